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

use super::kernels::{self, Row};
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
    kernels::vectorised(|| evaluate_inlined(input, points, new_state, out))
}

#[inline(always)]
fn evaluate_inlined(
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

    let mut sums = TangentSums::new();
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
        let pressure = 0.5 * geometry.weight * tensor::dot(&response.stress, &assumed);
        let strains = generalised_strains(point, geometry, &mean_rate);
        let stress = response.stress.map(|value| value * geometry.weight * scale);
        add_force(&strains, &stress, pressure, &mut out.force);
        if input.want == Want::ResidualAndTangent {
            let stiffness =
                response.tangent.map(|row| row.map(|v| v * geometry.weight * scale * scale));
            let generalised = generalised_stiffness(&c, &stiffness, &stress, pressure);
            sums.add_point(index, &strains, &generalised, pressure);
            add_nodal_stress(geometry, &stress, &mut sums.initial_stress);
        }
    }
    if input.want == Want::ResidualAndTangent {
        sums.finish(&kinematics, points, &mean_rate, current, &mut out.tangent);
    }
    Ok(())
}

/// What the tangent is summed from, so that one product of tall matrices makes it.
struct TangentSums {
    /// Generalised strains of all points, then the volume rates of the points, then the mean one.
    left: [Row; ROWS],
    /// Their stiffness times them.
    right: [Row; ROWS],
    /// `Σ w ∇N_a · S ∇N_b` by node pair.
    initial_stress: [[f64; 8]; 8],
    pressure: [f64; 8],
}

/// Six strains and the dilatation.
const STRAINS: usize = 7;
const ROWS: usize = 8 * STRAINS + 9;

impl TangentSums {
    fn new() -> Self {
        Self {
            left: [[0.0; DOFS]; ROWS],
            right: [[0.0; DOFS]; ROWS],
            initial_stress: [[0.0; 8]; 8],
            pressure: [0.0; 8],
        }
    }

    /// Adds the terms in `B` and `dφ` of one point.
    #[inline(always)]
    fn add_point(
        &mut self,
        index: usize,
        strains: &[Row; STRAINS],
        stiffness: &[[f64; STRAINS]; STRAINS],
        pressure: f64,
    ) {
        let range = index * STRAINS..(index + 1) * STRAINS;
        self.left[range.clone()].copy_from_slice(strains);
        kernels::combine(stiffness, strains, &mut self.right[range]);
        self.pressure[index] = pressure;
    }

    /// Adds `Σ ½ w g (S:C) d²φ` with `d² ln J = -g_a[j] g_b[i]` and
    /// `d² ln J̄ = Σ w J (b bᵀ - g_a[j] g_b[i]) / (V J̄) - b̄ b̄ᵀ`, and multiplies everything out.
    fn finish(
        mut self,
        kinematics: &[Point; 8],
        points: &[PointGeometry; 8],
        mean_rate: &Row,
        current: f64,
        tangent: &mut [Row; DOFS],
    ) {
        let total = 2.0 / 3.0 * self.pressure.iter().sum::<f64>();
        let mut crossed_left = [[0.0; DOFS]; 8];
        let mut crossed_right = [[0.0; DOFS]; 8];
        for (index, (point, geometry)) in kinematics.iter().zip(points).enumerate() {
            let share = total * geometry.weight * point.jacobian / current;
            let swap = 2.0 / 3.0 * self.pressure[index] - share;
            let row = 8 * STRAINS + index;
            self.left[row] = point.volume_rate;
            self.right[row] = point.volume_rate.map(|rate| share * rate);
            crossed_left[index] = point.volume_rate;
            crossed_right[index] = point.volume_rate.map(|rate| swap * rate);
        }
        self.left[ROWS - 1] = *mean_rate;
        self.right[ROWS - 1] = mean_rate.map(|rate| -total * rate);
        kernels::add_gram(&self.left, &self.right, tangent);
        let mut crossed = [[0.0; DOFS]; DOFS];
        kernels::add_gram(&crossed_left, &crossed_right, &mut crossed);
        for a in 0..8 {
            for b in 0..8 {
                for i in 0..3 {
                    for j in 0..3 {
                        tangent[3 * a + i][3 * b + j] += crossed[3 * a + j][3 * b + i];
                    }
                }
            }
        }
        spread_nodal_stress(&self.initial_stress, tangent);
    }
}

/// `[B; dφ]` at a point.
#[inline(always)]
fn generalised_strains(point: &Point, geometry: &PointGeometry, mean_rate: &Row) -> [Row; STRAINS] {
    let mut strains = [[0.0; DOFS]; STRAINS];
    strains[..6].copy_from_slice(&strain_derivative(&point.f, geometry));
    strains[6] = std::array::from_fn(|dof| 2.0 / 3.0 * (mean_rate[dof] - point.volume_rate[dof]));
    strains
}

/// Deformation gradient, its determinant and the spatial gradients; `Err(det F)` unless it is above zero.
#[inline(always)]
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
#[inline(always)]
pub(crate) fn cauchy_green(f: &[[f64; 3]; 3]) -> Mandel {
    std::array::from_fn(|pair| {
        let (a, b) = PAIRS[pair];
        tensor::factor(pair) * (f[0][a] * f[0][b] + f[1][a] * f[1][b] + f[2][a] * f[2][b])
    })
}

/// `B = ∂E_GL/∂u` of the compatible strain, by Mandel component.
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

/// Adds `w dĒᵀ S`; `stress` is `w g S` and `pressure` is `½ w g S:C`.
#[inline(always)]
fn add_force(strains: &[Row; STRAINS], stress: &Mandel, pressure: f64, force: &mut Row) {
    for (row, value) in strains.iter().zip(stress.iter().chain([&pressure])) {
        for (sum, rate) in force.iter_mut().zip(row) {
            *sum += rate * value;
        }
    }
}

/// Stiffness of the generalised strains `[B; dφ]`.
#[inline(always)]
fn generalised_stiffness(
    c: &Mandel,
    stiffness: &tensor::Mandel66,
    stress: &Mandel,
    pressure: f64,
) -> [[f64; STRAINS]; STRAINS] {
    let half_c = c.map(|value| 0.5 * value);
    let right = tensor::apply(stiffness, &half_c);
    let left = tensor::apply(&tensor::transpose(stiffness), &half_c);
    let mut generalised = [[0.0; STRAINS]; STRAINS];
    for i in 0..6 {
        generalised[i][..6].copy_from_slice(&stiffness[i]);
        generalised[i][6] = right[i] + stress[i];
        generalised[6][i] = left[i] + stress[i];
    }
    generalised[6][6] = tensor::dot(&half_c, &right) + pressure;
    generalised
}

/// Adds `Bᵀ D B` for `N` generalised strains.
pub(crate) fn add_congruence<const N: usize>(
    strains: &[Row; N],
    stiffness: &[[f64; N]; N],
    tangent: &mut [Row; DOFS],
) {
    let mut product = [[0.0; DOFS]; N];
    kernels::combine(stiffness, strains, &mut product);
    kernels::add_gram(strains, &product, tangent);
}

/// Adds `∇N_a · S ∇N_b` by node pair; `stress` carries the weight.
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

/// Puts the sums of [`add_nodal_stress`] on the diagonal of each node pair.
pub(crate) fn spread_nodal_stress(sums: &[[f64; 8]; 8], tangent: &mut [Row; DOFS]) {
    for (a, row) in sums.iter().enumerate() {
        for (b, value) in row.iter().enumerate() {
            for i in 0..3 {
                tangent[3 * a + i][3 * b + i] += value;
            }
        }
    }
}
