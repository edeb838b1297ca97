//! The trilinear hexahedron with mean dilatation, in a variational (symmetric) form.
//!
//! | symbol | meaning |
//! |---|---|
//! | `F`, `J`, `C` | deformation gradient, det F, FᵀF at a point |
//! | `J̄` | mean of `J` over the reference volume of the element |
//! | `g` | `(J̄/J)^(2/3) = exp φ` |
//! | `Ē` | assumed strain `½ (g C - 1)` |
//!
//! The stored energy is `∫ W(Ē) dV`; its first and second variations give force and tangent exactly:
//! `dĒ = g (B + ½ C ⊗ dφ)`, `dφ = ⅔ (d ln J̄ - d ln J)`,
//! `S : d²Ē = ½ g (S:C) (dφ ⊗ dφ + d²φ) + g (s ⊗ dφ + dφ ⊗ s) + g S : d²(½C)`, `s = Bᵀ S`.

use super::shape::PointGeometry;
use super::{DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want};
use crate::solver::material::log_strain;
use crate::solver::tensor::{self, Mandel, PAIRS};

/// Kinematics of one point.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    /// F by rows.
    pub f: [[f64; 3]; 3],
    jacobian: f64,
    /// d ln J by degree of freedom: spatial gradients of the shape functions.
    volume_rate: [f64; DOFS],
}

/// Evaluates the element; `new_state` receives the trial history of all points.
///
/// # Errors
/// [`PointFailure`] when the element is inverted or the material fails.
pub fn evaluate(
    input: &ElementInput<'_>,
    points: &[PointGeometry; 8],
    new_state: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    *out = ElementMatrices::zero();
    let state_len = input.material.state_len();
    let mut kinematics = [Point { f: [[0.0; 3]; 3], jacobian: 1.0, volume_rate: [0.0; DOFS] }; 8];
    let mut volume = 0.0;
    let mut current = 0.0;
    let mut mean_rate = [0.0; DOFS];
    for (index, (point, geometry)) in kinematics.iter_mut().zip(points).enumerate() {
        *point = deform(geometry, input.displacement).map_err(|ratio| PointFailure {
            point: index,
            reason: FailureReason::Inverted { ratio },
        })?;
        volume += geometry.weight;
        current += geometry.weight * point.jacobian;
        for (sum, rate) in mean_rate.iter_mut().zip(&point.volume_rate) {
            *sum += geometry.weight * point.jacobian * rate;
        }
    }
    mean_rate.iter_mut().for_each(|rate| *rate /= current);
    let mean_jacobian = current / volume;

    let mut pressure = [0.0; 8];
    for (index, (point, geometry)) in kinematics.iter().zip(points).enumerate() {
        let range = index * state_len..(index + 1) * state_len;
        let fail = |reason| PointFailure { point: index, reason };
        let c = cauchy_green(&point.f);
        let scale = (mean_jacobian / point.jacobian).cbrt().powi(2);
        let assumed: Mandel = c.map(|value| scale * value);
        let response = log_strain::update(
            input.material,
            &assumed,
            &input.old_state[range.clone()],
            &mut new_state[range],
            input.want == Want::ResidualAndTangent,
        )
        .map_err(|error| fail(error.into()))?;
        out.elastic_energy += geometry.weight * response.elastic_energy;
        out.plastic_work += geometry.weight * response.plastic_work;
        pressure[index] = 0.5 * geometry.weight * tensor::dot(&response.stress, &assumed);
        let dilatation: [f64; DOFS] =
            std::array::from_fn(|dof| 2.0 / 3.0 * (mean_rate[dof] - point.volume_rate[dof]));
        let b = strain_derivative(&point.f, geometry);
        let stress = response.stress.map(|value| value * geometry.weight * scale);
        add_force(&b, &dilatation, &stress, pressure[index], &mut out.force);
        if input.want == Want::ResidualAndTangent {
            let stiffness =
                response.tangent.map(|row| row.map(|v| v * geometry.weight * scale * scale));
            add_material_tangent(
                &b,
                &dilatation,
                &c,
                &stiffness,
                &stress,
                pressure[index],
                &mut out.tangent,
            );
            add_initial_stress(geometry, &stress, &mut out.tangent);
        }
    }
    if input.want == Want::ResidualAndTangent {
        add_volume_curvature(&kinematics, points, &mean_rate, &pressure, current, &mut out.tangent);
    }
    Ok(())
}

/// Deformation gradient, its determinant and the spatial gradients; `Err(det F)` unless it is above zero.
pub(crate) fn deform(geometry: &PointGeometry, u: &[f64; DOFS]) -> Result<Point, f64> {
    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for a in 0..8 {
        for (i, row) in f.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value += u[3 * a + i] * geometry.gradient[j][a];
            }
        }
    }
    let cofactor = |i: usize, j: usize| {
        let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        f[i1][j1] * f[i2][j2] - f[i1][j2] * f[i2][j1]
    };
    let cofactors: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| cofactor(i, j)));
    let jacobian =
        f[0][0] * cofactors[0][0] + f[0][1] * cofactors[0][1] + f[0][2] * cofactors[0][2];
    if !(jacobian > 0.0 && jacobian.is_finite()) {
        return Err(jacobian);
    }
    let mut volume_rate = [0.0; DOFS];
    for a in 0..8 {
        for i in 0..3 {
            let sum: f64 = (0..3).map(|j| cofactors[i][j] * geometry.gradient[j][a]).sum();
            volume_rate[3 * a + i] = sum / jacobian;
        }
    }
    Ok(Point { f, jacobian, volume_rate })
}

/// `C = FᵀF` as a Mandel vector.
pub(crate) fn cauchy_green(f: &[[f64; 3]; 3]) -> Mandel {
    std::array::from_fn(|pair| {
        let (a, b) = PAIRS[pair];
        tensor::factor(pair) * (f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b])
    })
}

/// `B = ∂E_GL/∂u` of the compatible strain, by Mandel component.
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

/// Adds `w dĒᵀ S`; `stress` is `w g S` and `pressure` is `½ w g S:C`.
fn add_force(
    b: &[[f64; DOFS]; 6],
    dilatation: &[f64; DOFS],
    stress: &Mandel,
    pressure: f64,
    force: &mut [f64; DOFS],
) {
    for (row, value) in b.iter().zip(stress) {
        for (sum, rate) in force.iter_mut().zip(row) {
            *sum += rate * value;
        }
    }
    for (sum, rate) in force.iter_mut().zip(dilatation) {
        *sum += rate * pressure;
    }
}

/// Adds the terms in `B` and `dφ`: seven generalised strains `[B; dφ]` with a 7 x 7 stiffness.
fn add_material_tangent(
    b: &[[f64; DOFS]; 6],
    dilatation: &[f64; DOFS],
    c: &Mandel,
    stiffness: &tensor::Mandel66,
    stress: &Mandel,
    pressure: f64,
    tangent: &mut [[f64; DOFS]; DOFS],
) {
    let half_c = c.map(|value| 0.5 * value);
    let right = tensor::apply(stiffness, &half_c);
    let left = tensor::apply(&tensor::transpose(stiffness), &half_c);
    let corner = tensor::dot(&half_c, &right) + pressure;
    let mut strains = [[0.0; DOFS]; 7];
    strains[..6].copy_from_slice(b);
    strains[6] = *dilatation;
    let mut generalised = [[0.0; 7]; 7];
    for i in 0..6 {
        generalised[i][..6].copy_from_slice(&stiffness[i]);
        generalised[i][6] = right[i] + stress[i];
        generalised[6][i] = left[i] + stress[i];
    }
    generalised[6][6] = corner;
    add_congruence(&strains, &generalised, tangent);
}

/// Adds `Bᵀ D B` for `N` generalised strains.
pub(crate) fn add_congruence<const N: usize>(
    strains: &[[f64; DOFS]; N],
    stiffness: &[[f64; N]; N],
    tangent: &mut [[f64; DOFS]; DOFS],
) {
    let mut product = [[0.0; DOFS]; N];
    for (row, coefficients) in product.iter_mut().zip(stiffness) {
        for (coefficient, strain) in coefficients.iter().zip(strains) {
            for (sum, value) in row.iter_mut().zip(strain) {
                *sum += coefficient * value;
            }
        }
    }
    for (a, row) in tangent.iter_mut().enumerate() {
        for (strain, stressed) in strains.iter().zip(&product) {
            let factor = strain[a];
            for (sum, value) in row.iter_mut().zip(stressed) {
                *sum += factor * value;
            }
        }
    }
}

/// Adds `∇N_a · S ∇N_b` on the diagonal of each node pair; `stress` carries the weight.
pub(crate) fn add_initial_stress(
    geometry: &PointGeometry,
    stress: &Mandel,
    tangent: &mut [[f64; DOFS]; DOFS],
) {
    let s = tensor::to_matrix(stress);
    for a in 0..8 {
        let g = |j: usize| geometry.gradient[j][a];
        let sg: [f64; 3] =
            std::array::from_fn(|j| s[(j, 0)] * g(0) + s[(j, 1)] * g(1) + s[(j, 2)] * g(2));
        for b in 0..8 {
            let value = sg[0] * geometry.gradient[0][b]
                + sg[1] * geometry.gradient[1][b]
                + sg[2] * geometry.gradient[2][b];
            for i in 0..3 {
                tangent[3 * a + i][3 * b + i] += value;
            }
        }
    }
}

/// Adds `Σ ½ w g (S:C) d²φ` with `d² ln J = -g_a[j] g_b[i]` and
/// `d² ln J̄ = Σ w J (b bᵀ - g_a[j] g_b[i]) / (V J̄) - b̄ b̄ᵀ`.
fn add_volume_curvature(
    kinematics: &[Point; 8],
    points: &[PointGeometry; 8],
    mean_rate: &[f64; DOFS],
    pressure: &[f64; 8],
    current: f64,
    tangent: &mut [[f64; DOFS]; DOFS],
) {
    let total: f64 = pressure.iter().sum();
    let two_thirds = 2.0 / 3.0;
    for (index, (point, geometry)) in kinematics.iter().zip(points).enumerate() {
        let share = two_thirds * total * geometry.weight * point.jacobian / current;
        let swap = two_thirds * pressure[index] - share;
        let rate = &point.volume_rate;
        for a in 0..8 {
            for i in 0..3 {
                let row = &mut tangent[3 * a + i];
                let same = share * rate[3 * a + i];
                for (sum, value) in row.iter_mut().zip(rate) {
                    *sum += same * value;
                }
                for b in 0..8 {
                    let crossed = swap * rate[3 * b + i];
                    for j in 0..3 {
                        row[3 * b + j] += crossed * rate[3 * a + j];
                    }
                }
            }
        }
    }
    for (a, row) in tangent.iter_mut().enumerate() {
        let factor = two_thirds * total * mean_rate[a];
        for (sum, value) in row.iter_mut().zip(mean_rate) {
            *sum -= factor * value;
        }
    }
}
