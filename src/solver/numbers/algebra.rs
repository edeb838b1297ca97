//! Vectors and symmetric tensors of several points in SIMD lanes; tensors as in [`super::tensor`].

use pulp::Simd;

use super::lanes::Lane;
use super::tensor::{Mandel66, PAIRS};

/// Broadcasts a vector to all lanes.
#[inline(always)]
pub(crate) fn splat<S: Simd, const N: usize>(simd: S, vector: &[f64; N]) -> [Lane<S>; N] {
    let mut out = [Lane::splat(simd, 0.0); N];
    for (out, value) in out.iter_mut().zip(vector) {
        *out = Lane::splat(simd, *value);
    }
    out
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: &[Lane<S>; 3], b: &[Lane<S>; 3]) -> [Lane<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Matrix times vector.
#[inline(always)]
pub(crate) fn apply<S: Simd>(matrix: &[[Lane<S>; 6]; 6], vector: &[Lane<S>; 6]) -> [Lane<S>; 6] {
    let mut out = *vector;
    for (out, row) in out.iter_mut().zip(matrix) {
        *out = Lane::dot(row, vector);
    }
    out
}

/// Row vector times matrix.
#[inline(always)]
pub(crate) fn multiply<S: Simd>(row: &[Lane<S>; 6], matrix: &[[Lane<S>; 6]; 6]) -> [Lane<S>; 6] {
    let mut sums = matrix[0];
    for sum in &mut sums {
        *sum = row[0] * *sum;
    }
    for (factor, row) in row[1..].iter().zip(&matrix[1..]) {
        for (sum, value) in sums.iter_mut().zip(row) {
            *sum = factor.mul_add(*value, *sum);
        }
    }
    sums
}

/// Symmetric matrix of a Mandel vector.
#[inline(always)]
pub(crate) fn symmetric_matrix<S: Simd>(v: &[Lane<S>; 6]) -> [[Lane<S>; 3]; 3] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let [xy, yz, zx] = [v[3] * half, v[4] * half, v[5] * half];
    [[v[0], xy, zx], [xy, v[1], yz], [zx, yz, v[2]]]
}

/// `½ (x ⊗ y + y ⊗ x)`.
#[inline(always)]
pub(crate) fn symmetric<S: Simd>(x: &[Lane<S>; 3], y: &[Lane<S>; 3]) -> [Lane<S>; 6] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut out = [x[0] * y[0], x[1] * y[1], x[2] * y[2], x[0], x[0], x[0]];
    for (out, (i, j)) in out[3..].iter_mut().zip([(0, 1), (1, 2), (2, 0)]) {
        *out = x[i].mul_add(y[j], x[j] * y[i]) * half;
    }
    out
}

/// 6 x 6 matrices of the congruences `A ↦ q A qᵀ`, as `tensor::congruence`.
#[inline(always)]
pub(crate) fn congruence<S: Simd>(simd: S, q: &[[Lane<S>; 3]; 3]) -> [[Lane<S>; 6]; 6] {
    let root = std::f64::consts::SQRT_2;
    let zero = Lane::splat(simd, 0.0);
    let mut out = [[zero; 6]; 6];
    for (row, &(a, b)) in PAIRS.iter().enumerate() {
        for (column, &(c, d)) in PAIRS.iter().enumerate() {
            out[row][column] = match (row < 3, column < 3) {
                (true, true) => q[a][c] * q[a][c],
                (false, true) => q[a][c] * q[b][c] * root,
                (true, false) => q[a][c] * q[a][d] * root,
                (false, false) => q[a][c].mul_add(q[b][d], q[a][d] * q[b][c]),
            };
        }
    }
    out
}

/// `map t`, or `mapᵀ t` with `transposed`.
#[inline(always)]
pub(crate) fn rotate<S: Simd>(map: &Mandel66, transposed: bool, t: &[Lane<S>; 6]) -> [Lane<S>; 6] {
    let mut out = *t;
    for (i, out) in out.iter_mut().enumerate() {
        let entry = |k: usize| if transposed { map[k][i] } else { map[i][k] };
        *out = t[0] * entry(0);
        for (k, value) in t.iter().enumerate().skip(1) {
            *out = *out + *value * entry(k);
        }
    }
    out
}

/// Rotates a tangent from the axes of `rotation` back to the original axes.
#[inline(always)]
pub(crate) fn rotate_back<S: Simd>(rotation: &Mandel66, tangent: &mut [[Lane<S>; 6]; 6]) {
    // Rows, then columns, with the transpose of `rotation`.
    for row in tangent.iter_mut() {
        *row = rotate(rotation, true, row);
    }
    for column in 0..6 {
        let mut one = tangent[0];
        for (one, row) in one.iter_mut().zip(tangent.iter()) {
            *one = row[column];
        }
        let one = rotate(rotation, true, &one);
        for (one, row) in one.iter().zip(tangent.iter_mut()) {
            row[column] = *one;
        }
    }
}
