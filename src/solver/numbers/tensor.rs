//! Symmetric second-order tensors as Mandel (Kelvin) six-vectors.
//!
//! The component order is `[11, 22, 33, √2·12, √2·23, √2·31]` throughout the solver. In this basis the inner product
//! of two tensors is the dot product of their vectors, a fourth-order tensor with minor symmetries is a 6 x 6 matrix,
//! and a rotation is an orthogonal 6 x 6 matrix. Stresses and strains need no different factors. Engineering shear
//! strain is √2 times the Mandel component.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use kanagata_geometry::Mat3;

/// Symmetric tensor `[11, 22, 33, √2·12, √2·23, √2·31]`.
pub type Mandel = [f64; 6];
/// Linear map of symmetric tensors in the Mandel basis, row by row.
pub type Mandel66 = [[f64; 6]; 6];

/// Index pair of each Mandel component.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];
/// Second-order unit tensor.
pub const UNIT: Mandel = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// Weight of component `index`: 1 on the diagonal, √2 off it.
#[must_use]
pub fn factor(index: usize) -> f64 {
    if index < 3 { 1.0 } else { SQRT_2 }
}

/// Mandel vector of the symmetric part of `m`.
#[must_use]
pub fn from_matrix(m: &Mat3) -> Mandel {
    std::array::from_fn(|index| {
        let (a, b) = PAIRS[index];
        factor(index) * 0.5 * (m[(a, b)] + m[(b, a)])
    })
}

/// Symmetric matrix of a Mandel vector.
#[must_use]
pub fn to_matrix(v: &Mandel) -> Mat3 {
    let s = FRAC_1_SQRT_2;
    Mat3::new(v[0], v[3] * s, v[5] * s, v[3] * s, v[1], v[4] * s, v[5] * s, v[4] * s, v[2])
}

/// Inner product of two symmetric tensors.
#[must_use]
#[inline(always)]
pub fn dot(a: &Mandel, b: &Mandel) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}

/// Linear map applied to a symmetric tensor.
#[must_use]
#[inline(always)]
pub fn apply(m: &Mandel66, v: &Mandel) -> Mandel {
    std::array::from_fn(|row| dot(&m[row], v))
}

/// Product of two linear maps.
#[must_use]
#[inline(always)]
pub fn product(a: &Mandel66, b: &Mandel66) -> Mandel66 {
    let mut out = [[0.0; 6]; 6];
    for (out_row, a_row) in out.iter_mut().zip(a) {
        for (factor, b_row) in a_row.iter().zip(b) {
            for (sum, value) in out_row.iter_mut().zip(b_row) {
                *sum += factor * value;
            }
        }
    }
    out
}

/// Transpose of a linear map.
#[must_use]
#[inline(always)]
pub fn transpose(m: &Mandel66) -> Mandel66 {
    std::array::from_fn(|row| std::array::from_fn(|column| m[column][row]))
}

/// Determinant of a symmetric tensor.
#[must_use]
pub fn determinant(v: &Mandel) -> f64 {
    let [a, b, c] = [v[0], v[1], v[2]];
    let [p, q, r] = [v[3] * FRAC_1_SQRT_2, v[4] * FRAC_1_SQRT_2, v[5] * FRAC_1_SQRT_2];
    a * (b * c - q * q) - p * (p * c - q * r) + r * (p * q - b * r)
}

/// 6 x 6 matrix of the congruence `A ↦ q A qᵀ`; orthogonal if `q` is a rotation.
#[must_use]
#[inline(always)]
pub fn congruence(q: &[[f64; 3]; 3]) -> Mandel66 {
    let mut out = [[0.0; 6]; 6];
    for (row, &(a, b)) in PAIRS.iter().enumerate() {
        let left = if row < 3 { 0.5 } else { FRAC_1_SQRT_2 };
        for (column, &(c, d)) in PAIRS.iter().enumerate() {
            let right = if column < 3 { 1.0 } else { FRAC_1_SQRT_2 };
            out[row][column] = 2.0 * left * right * {
                if column < 3 { q[a][c] * q[b][c] } else { q[a][c] * q[b][d] + q[a][d] * q[b][c] }
            };
        }
    }
    // Factors of diagonal rows: 2 * 1/2 = 1; of off-diagonal rows: 2/√2 = √2.
    out
}

/// Eigenvalues and orthonormal eigenvectors of a symmetric tensor by cyclic Jacobi rotations, accurate to rounding
/// for equal eigenvalues too. Returns `(values, q)` with the eigenvectors in the columns of `q`. Reference for tests.
#[cfg(test)]
pub(crate) fn eigen(v: &Mandel) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut a = [[0.0; 3]; 3];
    for (index, &(i, j)) in PAIRS.iter().enumerate() {
        let value = if index < 3 { v[index] } else { v[index] * FRAC_1_SQRT_2 };
        a[i][j] = value;
        a[j][i] = value;
    }
    let mut q = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let scale = dot(v, v);
    for _ in 0..30 {
        let off_diagonal = a[0][1] * a[0][1] + a[1][2] * a[1][2] + a[0][2] * a[0][2];
        if off_diagonal <= 1e-34 * scale {
            break;
        }
        for (i, j) in [(0, 1), (1, 2), (0, 2)] {
            jacobi_rotation(&mut a, &mut q, i, j);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], q)
}

/// Jacobi rotation that annihilates `a[i][j]`.
#[cfg(test)]
fn jacobi_rotation(a: &mut [[f64; 3]; 3], q: &mut [[f64; 3]; 3], i: usize, j: usize) {
    let off_diagonal = a[i][j];
    if off_diagonal == 0.0 {
        return;
    }
    let theta = (a[j][j] - a[i][i]) / (2.0 * off_diagonal);
    let t = if theta.abs() > 1e150 {
        0.5 / theta
    } else {
        theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt())
    };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    let k = 3 - i - j;
    let (aki, akj) = (a[k][i], a[k][j]);
    a[i][i] -= t * off_diagonal;
    a[j][j] += t * off_diagonal;
    a[i][j] = 0.0;
    a[j][i] = 0.0;
    a[k][i] = c * aki - s * akj;
    a[i][k] = a[k][i];
    a[k][j] = s * aki + c * akj;
    a[j][k] = a[k][j];
    for row in q.iter_mut() {
        let (ri, rj) = (row[i], row[j]);
        row[i] = c * ri - s * rj;
        row[j] = s * ri + c * rj;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn congruence_is_the_matrix_congruence() {
        let q = [[0.3, -1.2, 0.7], [0.9, 0.1, -0.4], [0.2, 0.5, 1.1]];
        let m = Mat3::new(2.0, -0.3, 0.4, -0.3, 1.1, 0.8, 0.4, 0.8, -0.5);
        let matrix = Mat3::from_fn(|r, c| q[r][c]);
        let expected = from_matrix(&(matrix * m * matrix.transpose()));
        let found = apply(&congruence(&q), &from_matrix(&m));
        for (e, f) in expected.iter().zip(found) {
            assert!((e - f).abs() < 1e-14, "{e} {f}");
        }
    }

    #[test]
    fn eigenvectors_rebuild_the_tensor() {
        for v in [
            [1.0, 2.0, 3.0, 0.5, -0.7, 0.2],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1e-9, -2e-9, 1e-12],
            [0.0, 0.0, 0.0, SQRT_2, SQRT_2, SQRT_2],
        ] {
            let (values, q) = eigen(&v);
            let diagonal = [values[0], values[1], values[2], 0.0, 0.0, 0.0];
            let rebuilt = apply(&congruence(&q), &diagonal);
            for (a, b) in v.iter().zip(rebuilt) {
                assert!((a - b).abs() < 1e-14, "{v:?} {rebuilt:?}");
            }
            assert!((determinant(&v) - values[0] * values[1] * values[2]).abs() < 1e-13);
        }
    }
}
