//! Compatible strains of trilinear hexahedra, point by point.

use super::DOFS;
use super::kernels::{self, Row};
use super::shape::PointGeometry;
use crate::numbers::tensor::{self, Mandel, PAIRS};

/// Deformation gradient `F = 1 + u_a ⊗ ∇N_a`, by rows. `Err(det F)` unless the determinant is positive and finite.
#[inline(always)]
pub(crate) fn deform(geometry: &PointGeometry, u: &[f64; DOFS]) -> Result<[[f64; 3]; 3], f64> {
    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for a in 0..8 {
        for (i, row) in f.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value += u[3 * a + i] * geometry.gradient[j][a];
            }
        }
    }
    let minor = |j: usize, k: usize| f[1][j] * f[2][k] - f[1][k] * f[2][j];
    let jacobian = f[0][0] * minor(1, 2) + f[0][1] * minor(2, 0) + f[0][2] * minor(0, 1);
    if jacobian > 0.0 && jacobian.is_finite() { Ok(f) } else { Err(jacobian) }
}

/// Right Cauchy-Green tensor `C = FᵀF` as a Mandel vector.
#[inline(always)]
pub(crate) fn cauchy_green(f: &[[f64; 3]; 3]) -> Mandel {
    std::array::from_fn(|pair| {
        let (a, b) = PAIRS[pair];
        tensor::factor(pair) * (f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b])
    })
}

/// `B = ∂E/∂u` of the compatible Green-Lagrange strain, one row for each Mandel component.
#[inline(always)]
pub(crate) fn strain_derivative(f: &[[f64; 3]; 3], geometry: &PointGeometry) -> [[f64; DOFS]; 6] {
    let mut b = [[0.0; DOFS]; 6];
    for (pair, row) in b.iter_mut().enumerate() {
        let (p, q) = PAIRS[pair];
        let half = 0.5 * tensor::factor(pair);
        for a in 0..8 {
            let (np, nq) = (geometry.gradient[p][a], geometry.gradient[q][a]);
            for i in 0..3 {
                row[3 * a + i] = half * (f[i][p] * nq + f[i][q] * np);
            }
        }
    }
    b
}

/// Adds `Bᵀ D B` for `N` generalised strains to the tangent.
pub(crate) fn add_congruence<const N: usize>(
    strains: &[Row; N],
    stiffness: &[[f64; N]; N],
    tangent: &mut [Row; DOFS],
) {
    let mut product = [[0.0; DOFS]; N];
    kernels::combine(stiffness, strains, &mut product);
    kernels::add_gram(strains, &product, tangent);
}

/// Adds the initial-stress terms `∇N_a · S ∇N_b` for each pair of nodes; `stress` includes the integration weight.
#[inline(always)]
pub(crate) fn add_nodal_stress(
    geometry: &PointGeometry,
    stress: &Mandel,
    sums: &mut [[f64; 8]; 8],
) {
    let s = tensor::to_matrix(stress);
    let g = &geometry.gradient;
    for j in 0..3 {
        let sg: [f64; 8] = std::array::from_fn(|b| {
            s[(j, 0)] * g[0][b] + s[(j, 1)] * g[1][b] + s[(j, 2)] * g[2][b]
        });
        for (row, factor) in sums.iter_mut().zip(g[j]) {
            for (sum, value) in row.iter_mut().zip(sg) {
                *sum += factor * value;
            }
        }
    }
}

/// Adds the scalars of [`add_nodal_stress`] to the tangent as `value · 1` for each pair of nodes (geometric
/// stiffness).
pub(crate) fn spread_nodal_stress(sums: &[[f64; 8]; 8], tangent: &mut [Row; DOFS]) {
    for (a, row) in sums.iter().enumerate() {
        for (b, value) in row.iter().enumerate() {
            for i in 0..3 {
                tangent[3 * a + i][3 * b + i] += value;
            }
        }
    }
}
