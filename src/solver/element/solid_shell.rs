//! The solid-shell: eight nodes, assumed natural shear and thickness strain, enhanced strain modes.
//!
//! Position `x = Σ_I M_I(ξ, η) (a_I + ζ d_I)` over four node pairs; `a` is the mean, `d` half the difference of
//! top and bottom node. Covariant strains `E_ij = ½ (g_i·g_j - G_i·G_j)`:
//!
//! | strain | taken |
//! |---|---|
//! | `E_11, E_22, E_12` | as they are: `m + ζ k + ζ² q` |
//! | `E_13` | at `(0, ∓1, 0)`, linear in `η` (Dvorkin & Bathe 1984) |
//! | `E_23` | at `(∓1, 0, 0)`, linear in `ξ` |
//! | `E_33` | at the four node pairs, bilinear (Betsch & Stein 1995) |
//!
//! and enhanced by modes `(j0/j) T0 M(ξ, η, ζ)`: `ζ, ζξ, ζη, ζξη` in `E_33` (no Poisson locking through the
//! thickness). With `membrane`, modes `ξ` in `E_11` and `η` in `E_22` follow what the other strain asks for, and the shear
//! `E_12` of the mid surface is that at the centre (`in_plane`). Per point of the mid
//! surface the stress is gathered into twelve generalised stresses of `[m, k, q, E_33, E_23, E_31]`, so
//! more points through the thickness cost material updates and little else.

mod column;
mod in_plane;

use self::column::Column;
use self::in_plane::InPlane;
use super::modes::{Mode, ModeSums};
use super::{DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want, compatible};
use crate::geometry::{Mat3, Vec3};
use crate::solver::tensor::{self, Mandel, Mandel66};
use std::f64::consts::FRAC_1_SQRT_2;

/// Generalised strains at a point of the mid surface.
const GENERALISED: usize = 12;

const fn mode(column: usize, powers: [u8; 3]) -> Mode {
    Mode { column, powers }
}

/// Modes through the thickness, and with those of the membrane.
pub(crate) const THICKNESS_MODES: usize = 4;
pub(crate) const MEMBRANE_MODES: usize = 6;

/// Thickness modes, then membrane modes.
const MODES: [Mode; MEMBRANE_MODES] = [
    mode(2, [0, 0, 1]),
    mode(2, [1, 0, 1]),
    mode(2, [0, 1, 1]),
    mode(2, [1, 1, 1]),
    mode(0, [1, 0, 0]),
    mode(1, [0, 1, 0]),
];

/// Node pairs of one configuration.
#[derive(Clone, Copy)]
struct Pairs {
    /// `a_I`.
    mean: [Vec3; 4],
    /// `d_I`.
    half: [Vec3; 4],
}

impl Pairs {
    fn new(x: &[Vec3; 8]) -> Self {
        Self {
            mean: std::array::from_fn(|i| 0.5 * (x[i + 4] + x[i])),
            half: std::array::from_fn(|i| 0.5 * (x[i + 4] - x[i])),
        }
    }
}

/// Bilinear functions and their derivatives at a point of the mid surface.
#[derive(Clone, Copy)]
struct Plane {
    value: [f64; 4],
    by_xi: [f64; 4],
    by_eta: [f64; 4],
}

impl Plane {
    fn at(xi: f64, eta: f64) -> Self {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        Self {
            value: corners.map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta)),
            by_xi: corners.map(|(a, b)| 0.25 * a * (1.0 + b * eta)),
            by_eta: corners.map(|(a, b)| 0.25 * b * (1.0 + a * xi)),
        }
    }
}

fn blend(weights: &[f64; 4], vectors: &[Vec3; 4]) -> Vec3 {
    vectors[0] * weights[0]
        + vectors[1] * weights[1]
        + vectors[2] * weights[2]
        + vectors[3] * weights[3]
}

/// Sampling points of `E_31` (by ξ at η = ∓1) and `E_23` (by η at ξ = ∓1) with their weights at `(ξ, η)`.
fn shear_samples(xi: f64, eta: f64) -> [(Plane, bool, f64); 4] {
    [
        (Plane::at(0.0, -1.0), true, 0.5 * (1.0 - eta)),
        (Plane::at(0.0, 1.0), true, 0.5 * (1.0 + eta)),
        (Plane::at(-1.0, 0.0), false, 0.5 * (1.0 - xi)),
        (Plane::at(1.0, 0.0), false, 0.5 * (1.0 + xi)),
    ]
}

/// Generalised products `½ g_i·g_j` of one configuration; strains are differences of two of these.
fn products(pairs: &Pairs, in_plane: &InPlane, xi: f64, eta: f64) -> [f64; GENERALISED] {
    let plane = Plane::at(xi, eta);
    let (a1, a2) = (blend(&plane.by_xi, &pairs.mean), blend(&plane.by_eta, &pairs.mean));
    let (d1, d2) = (blend(&plane.by_xi, &pairs.half), blend(&plane.by_eta, &pairs.half));
    let r = FRAC_1_SQRT_2;
    let mut p = [0.0; GENERALISED];
    let (c1, c2) = in_plane::tangents(pairs);
    let own = [0.5 * a1.dot(&a1), 0.5 * a2.dot(&a2), r * a1.dot(&a2)];
    p[..3].copy_from_slice(&in_plane.assumed(&own, r * c1.dot(&c2)));
    p[3..6].copy_from_slice(&[a1.dot(&d1), a2.dot(&d2), r * (a1.dot(&d2) + a2.dot(&d1))]);
    p[6..9].copy_from_slice(&[0.5 * d1.dot(&d1), 0.5 * d2.dot(&d2), r * d1.dot(&d2)]);
    p[9] = (0..4).map(|i| 0.5 * plane.value[i] * pairs.half[i].norm_squared()).sum();
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (row, by) = if along_xi { (11, &sample.by_xi) } else { (10, &sample.by_eta) };
        p[row] += weight * r * blend(by, &pairs.mean).dot(&blend(&sample.value, &pairs.half));
    }
    p
}

/// Derivatives of [`products`] by the nodal displacements.
fn derivatives(pairs: &Pairs, in_plane: &InPlane, xi: f64, eta: f64) -> [[f64; DOFS]; GENERALISED] {
    let plane = Plane::at(xi, eta);
    let (n1, n2) = (&plane.by_xi, &plane.by_eta);
    let (a1, a2) = (blend(n1, &pairs.mean), blend(n2, &pairs.mean));
    let (d1, d2) = (blend(n1, &pairs.half), blend(n2, &pairs.half));
    let r = FRAC_1_SQRT_2;
    let mut b = [[0.0; DOFS]; GENERALISED];
    let mut put = |row: usize, pair: usize, by_mean: Vec3, by_half: Vec3| {
        for i in 0..3 {
            b[row][3 * pair + i] += 0.5 * (by_mean[i] - by_half[i]);
            b[row][3 * (pair + 4) + i] += 0.5 * (by_mean[i] + by_half[i]);
        }
    };
    let none = Vec3::zeros();
    let ((c1, c2), middle) = (in_plane::tangents(pairs), Plane::at(0.0, 0.0));
    for k in 0..4 {
        let own = [a1 * n1[k], a2 * n2[k], (a2 * n1[k] + a1 * n2[k]) * r];
        let centre = (c2 * middle.by_xi[k] + c1 * middle.by_eta[k]) * r;
        for (row, by) in in_plane.assumed(&own, centre).into_iter().enumerate() {
            put(row, k, by, none);
        }
        put(3, k, d1 * n1[k], a1 * n1[k]);
        put(4, k, d2 * n2[k], a2 * n2[k]);
        put(5, k, (d2 * n1[k] + d1 * n2[k]) * r, (a2 * n1[k] + a1 * n2[k]) * r);
        put(6, k, none, d1 * n1[k]);
        put(7, k, none, d2 * n2[k]);
        put(8, k, none, (d2 * n1[k] + d1 * n2[k]) * r);
        put(9, k, none, pairs.half[k] * plane.value[k]);
    }
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (row, by) = if along_xi { (11, &sample.by_xi) } else { (10, &sample.by_eta) };
        let (tangent, director) = (blend(by, &pairs.mean), blend(&sample.value, &pairs.half));
        for k in 0..4 {
            put(row, k, director * (weight * r * by[k]), tangent * (weight * r * sample.value[k]));
        }
    }
    b
}

/// Adds the second derivatives of [`products`] times the generalised stress, as scalars between the eight
/// vectors `a_0..a_3, d_0..d_3`.
fn add_curvature(
    stress: &[f64; GENERALISED],
    in_plane: &InPlane,
    (xi, eta): (f64, f64),
    sum: &mut [[f64; 8]; 8],
) {
    let (plane, middle) = (Plane::at(xi, eta), Plane::at(0.0, 0.0));
    let r = FRAC_1_SQRT_2;
    let form = |at: &Plane, s: &[f64], i: usize, j: usize| {
        let (n1, n2) = (&at.by_xi, &at.by_eta);
        s[0] * n1[i] * n1[j] + s[1] * n2[i] * n2[j] + s[2] * r * (n1[i] * n2[j] + n2[i] * n1[j])
    };
    let (own, centre) = in_plane.work([stress[0], stress[1], stress[2]]);
    for i in 0..4 {
        for j in 0..4 {
            sum[i][j] += form(&plane, &own, i, j) + form(&middle, &[0.0, 0.0, centre], i, j);
            let mixed = form(&plane, &stress[3..6], i, j);
            sum[i][j + 4] += mixed;
            sum[i + 4][j] += mixed;
            sum[i + 4][j + 4] += form(&plane, &stress[6..9], i, j);
        }
        sum[i + 4][i + 4] += stress[9] * plane.value[i];
    }
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (value, by) =
            if along_xi { (stress[11], &sample.by_xi) } else { (stress[10], &sample.by_eta) };
        for i in 0..4 {
            for j in 0..4 {
                let mixed = value * weight * r * by[i] * sample.value[j];
                sum[i][j + 4] += mixed;
                sum[j + 4][i] += mixed;
            }
        }
    }
}

/// Natural strain at height `zeta` from the generalised one, Mandel order.
fn natural(e: &[f64; GENERALISED], zeta: f64) -> Mandel {
    let along = |i: usize| e[i] + zeta * (e[i + 3] + zeta * e[i + 6]);
    [along(0), along(1), e[9], along(2), e[10], e[11]]
}

/// The transpose of [`natural`]: adds a natural stress to the generalised one.
fn add_generalised(s: &Mandel, zeta: f64, sum: &mut [f64; GENERALISED]) {
    for (i, value) in [s[0], s[1], s[3]].into_iter().enumerate() {
        sum[i] += value;
        sum[i + 3] += zeta * value;
        sum[i + 6] += zeta * zeta * value;
    }
    sum[9] += s[2];
    sum[10] += s[4];
    sum[11] += s[5];
}

/// Adds `Φᵀ D Φ` of one point, `Φ` being [`natural`].
fn add_generalised_stiffness(d: &Mandel66, zeta: f64, sum: &mut [[f64; GENERALISED]; GENERALISED]) {
    let mut half = [[0.0; GENERALISED]; 6];
    for (row, values) in half.iter_mut().zip(d) {
        add_generalised(values, zeta, row);
    }
    let powers = [1.0, zeta, zeta * zeta];
    for (group, source) in [(0, 0), (1, 1), (2, 3)] {
        for (k, power) in powers.iter().enumerate() {
            let target = &mut sum[group + 3 * k];
            target.iter_mut().zip(&half[source]).for_each(|(x, y)| *x += power * y);
        }
    }
    for (target, source) in [(9, 2), (10, 4), (11, 5)] {
        sum[target].iter_mut().zip(&half[source]).for_each(|(x, y)| *x += y);
    }
}

/// Map from natural to Cartesian strain, `E = J⁻ᵀ Ē J⁻¹`, and det J.
fn to_cartesian(pairs: &Pairs, plane: &Plane, zeta: f64) -> Option<(Mandel66, f64)> {
    let base = |by: &[f64; 4]| blend(by, &pairs.mean) + blend(by, &pairs.half) * zeta;
    let jacobian = Mat3::from_columns(&[
        base(&plane.by_xi),
        base(&plane.by_eta),
        blend(&plane.value, &pairs.half),
    ]);
    let det = jacobian.determinant();
    let inverse = jacobian.try_inverse().filter(|_| det > 0.0)?;
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| inverse[(j, i)]));
    Some((tensor::congruence(&rows), det))
}

/// Evaluates the element with `M` modes: [`THICKNESS_MODES`] or [`MEMBRANE_MODES`].
///
/// `thickness_rule` lists points and weights on [-1, 1]; `new_state` receives the trial history, point
/// `layers * plane + layer`; `record` is the element's mode record.
///
/// # Errors
/// [`PointFailure`] when the material or the condensation fails.
pub(crate) fn evaluate<const M: usize>(
    input: &ElementInput<'_>,
    thickness_rule: &[(f64, f64)],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    let reference = Pairs::new(input.nodes);
    let centre = to_cartesian(&reference, &Plane::at(0.0, 0.0), 0.0)
        .ok_or(PointFailure { point: 0, reason: FailureReason::Inverted { ratio: 0.0 } })?;
    let unit = std::array::from_fn(|k| MODES[k].unit(&centre.0));
    ModeSums::<M>::with_prediction(record, input.displacement, &unit, |alpha, record| {
        let shape = Shape { pairs: &reference, centre: &centre, rule: thickness_rule };
        evaluate_at(input, &shape, alpha, new_state, record, out)
    })
}

/// What does not change with the displacement.
#[derive(Clone, Copy)]
struct Shape<'a> {
    /// Node pairs before anything moved.
    pairs: &'a Pairs,
    /// Map from natural to Cartesian strain at the element's centre, and det J there.
    centre: &'a (Mandel66, f64),
    /// Points and weights through the thickness.
    rule: &'a [(f64, f64)],
}

/// [`evaluate`] with given values of the modes.
fn evaluate_at<const M: usize>(
    input: &ElementInput<'_>,
    shape: &Shape<'_>,
    alpha: &[f64; M],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    *out = ElementMatrices::zero();
    let u = input.displacement;
    let moved =
        std::array::from_fn(|a| input.nodes[a] + Vec3::new(u[3 * a], u[3 * a + 1], u[3 * a + 2]));
    let current = Pairs::new(&moved);
    let mut sums = ModeSums::<M>::zero();
    let mut curvature = [[0.0; 8]; 8];
    let gauss = 1.0 / 3.0_f64.sqrt();
    for (index, (xi, eta)) in
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate()
    {
        let (xi, eta) = (xi * gauss, eta * gauss);
        let in_plane = match M {
            MEMBRANE_MODES => InPlane::with_shear_of_centre(shape.pairs, xi, eta),
            _ => InPlane::AS_IT_IS,
        };
        let column =
            Column { input, shape, current: &current, in_plane: &in_plane, index, xi, eta };
        let totals = column.integrate::<M>(alpha, new_state, &mut sums, out)?;
        let b = derivatives(&current, &in_plane, xi, eta);
        for (row, value) in b.iter().zip(&totals.stress) {
            out.force.iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * value);
        }
        for k in 0..M {
            for (row, (left, right)) in b.iter().zip(totals.left[k].iter().zip(&totals.right[k])) {
                sums.left[k].iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * left);
                sums.right[k].iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * right);
            }
        }
        if input.want == Want::ResidualAndTangent {
            compatible::add_congruence(&b, &totals.stiffness, &mut out.tangent);
            add_curvature(&totals.stress, &in_plane, (xi, eta), &mut curvature);
        }
    }
    if input.want == Want::ResidualAndTangent {
        add_pair_form(&curvature, &mut out.tangent);
    }
    sums.condense(alpha, u, input.want, record, out)
        .map_err(|reason| PointFailure { point: 0, reason })
}

/// Adds a scalar form between `a_0..a_3, d_0..d_3` to the nodes' diagonal entries.
fn add_pair_form(form: &[[f64; 8]; 8], tangent: &mut [[f64; DOFS]; DOFS]) {
    for i in 0..8 {
        for j in 0..8 {
            let (p, q) = (i % 4, j % 4);
            let (si, sj) = (if i < 4 { -1.0 } else { 1.0 }, if j < 4 { -1.0 } else { 1.0 });
            let value = 0.25
                * (form[p][q]
                    + sj * form[p][q + 4]
                    + si * form[p + 4][q]
                    + si * sj * form[p + 4][q + 4]);
            for k in 0..3 {
                tangent[3 * i + k][3 * j + k] += value;
            }
        }
    }
}
