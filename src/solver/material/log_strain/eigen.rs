//! Eigenvalues and eigenvectors of symmetric tensors, several side by side.

use pulp::Simd;

use crate::solver::lanes::Lane;
use crate::solver::tensor::PAIRS;

/// Eigenvalues and orthonormal eigenvectors of symmetric tensors (Mandel components) by cyclic Jacobi rotations:
/// accurate to rounding also for equal eigenvalues. Returns `(values, q)` with the eigenvectors in the columns of `q`.
#[inline(always)]
pub(super) fn eigen<S: Simd>(simd: S, v: [Lane<S>; 6]) -> ([Lane<S>; 3], [[Lane<S>; 3]; 3]) {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut diagonal = [v[0], v[1], v[2]];
    // Off the diagonal, by the index that is in neither: 12, 20, 01.
    let mut off = [v[4] * half, v[5] * half, v[3] * half];
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let mut q = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let scale = Lane::dot(&v, &v) * 1e-34;
    for _ in 0..30 {
        if (Lane::dot(&off, &off) - scale).largest() <= 0.0 {
            break;
        }
        for k in [2, 0, 1] {
            rotate(simd, &mut diagonal, &mut off, &mut q, k);
        }
    }
    (diagonal, q)
}

/// The rotation about axis `k` that annihilates the entry off the diagonal of the two others.
#[inline(always)]
fn rotate<S: Simd>(
    simd: S,
    diagonal: &mut [Lane<S>; 3],
    off: &mut [Lane<S>; 3],
    q: &mut [[Lane<S>; 3]; 3],
    k: usize,
) {
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let apart = diagonal[j] - diagonal[i];
    let double = off[k] + off[k];
    // t = tan of the angle, the smaller of both that annihilate: |t| <= 1; 0 where nothing is to be done.
    let root = apart.mul_add(apart, double * double).sqrt() + apart.abs();
    let t = double / root.max(Lane::splat(simd, f64::MIN_POSITIVE));
    let t = apart.if_less(zero, -t, t);
    let c = one / t.mul_add(t, one).sqrt();
    let s = t * c;
    diagonal[i] = diagonal[i] - t * off[k];
    diagonal[j] = diagonal[j] + t * off[k];
    // The entries ki and kj stand where j and i are missing.
    let (ki, kj) = (off[j], off[i]);
    off[k] = zero;
    off[j] = c * ki - s * kj;
    off[i] = s * ki + c * kj;
    for row in q.iter_mut() {
        let (x, y) = (row[i], row[j]);
        row[i] = c * x - s * y;
        row[j] = s * x + c * y;
    }
}

/// The 6 x 6 matrices of the congruences `A ↦ q A qᵀ`, as `tensor::congruence`.
#[inline(always)]
pub(super) fn congruence<S: Simd>(simd: S, q: &[[Lane<S>; 3]; 3]) -> [[Lane<S>; 6]; 6] {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::tensor::{self, Mandel};

    #[test]
    fn they_are_those_of_one_tensor_at_a_time() {
        let simd = pulp::Scalar::new();
        let tensors: [Mandel; 6] = [
            [1.0, 2.0, 3.0, 0.5, -0.7, 0.2],
            [1.0; 6].map(|x| x * 1.5),
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1e-9, -2e-9, 1e-12],
            [1.0, 1.0, 2.0, 0.0, 1e-200, 0.0],
            [0.0; 6],
        ];
        for v in tensors {
            let (values, q) = eigen(simd, v.map(|x| Lane::splat(simd, x)));
            let map = congruence(simd, &q).map(|row| row.map(Lane::largest));
            let q = q.map(|row| row.map(Lane::largest));
            assert_eq!(map.as_flattened().len(), 36);
            for (found, expected) in map.iter().zip(tensor::congruence(&q)) {
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-15, "{v:?}");
                }
            }
            let [x, y, z] = values.map(Lane::largest);
            let rebuilt = tensor::apply(&map, &[x, y, z, 0.0, 0.0, 0.0]);
            for (a, b) in v.iter().zip(rebuilt) {
                assert!((a - b).abs() < 1e-14, "{v:?} {rebuilt:?}");
            }
        }
    }
}
