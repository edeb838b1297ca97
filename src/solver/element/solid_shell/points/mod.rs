//! Integration of a solid-shell over its points, one in each SIMD lane.
//!
//! The points are numbered column by column in one array, so that the material is evaluated for eight at a time
//! across columns. A column is processed from its first point in SIMD groups. Lanes beyond its last point hold points
//! of the next column or padding; their results are discarded.

mod modes;
pub(super) mod state;

use crate::element::solid_shell::points::state::PerPoint;
use crate::element::solid_shell::points::state::{COLUMNS, Points, vectors};
use pulp::{Arch, Simd, WithSimd};

use self::modes::Modes;
use super::column::{Frame, Totals};
use super::generalised::lanes::{Powers, add_generalised, add_generalised_stiffness, natural};
use crate::element::{ElementInput, FailureReason, PointFailure, Want};
use crate::material::log_strain::{self, Responses};
use crate::numbers::algebra::{apply, congruence, cross, multiply, splat};
use crate::numbers::lanes::{Eight, Lane, POINTS};

/// Capacity of the thickness rule, in whole SIMD vectors.
const RULE_CAPACITY: usize = 2 * POINTS;

/// Linear maps of symmetric tensors, in SIMD lanes.
type Map<S> = [[Lane<S>; 6]; 6];

/// Positions and weights through the thickness, zero beyond the last.
struct Rule {
    count: usize,
    zeta: [f64; RULE_CAPACITY],
    weight: [f64; RULE_CAPACITY],
}

impl Rule {
    fn new(rule: &[(f64, f64)]) -> Self {
        let mut out =
            Self { count: rule.len(), zeta: [0.0; RULE_CAPACITY], weight: [0.0; RULE_CAPACITY] };
        for (k, &(zeta, weight)) in rule.iter().enumerate() {
            (out.zeta[k], out.weight[k]) = (zeta, weight);
        }
        out
    }

    /// First indices of the SIMD groups of a column.
    #[inline(always)]
    fn groups<S: Simd>(&self) -> std::iter::StepBy<std::ops::Range<usize>> {
        (0..self.count).step_by(S::F64_LANES)
    }
}

/// Generalised stress and stiffness of the columns of an element; `new_state` receives the new histories of its
/// points.
///
/// # Errors
/// [`PointFailure`] if the Jacobian determinant of a point is not positive or the constitutive update fails.
pub(super) fn integrate(
    input: &ElementInput<'_>,
    rule: &[(f64, f64)],
    frames: &[Frame<'_>; COLUMNS],
    new_state: &mut [f64],
) -> Result<[Totals; COLUMNS], PointFailure> {
    let rule = Rule::new(rule);
    Arch::new().dispatch(Integrate { input, rule, frames, new_state })
}

struct Integrate<'a> {
    input: &'a ElementInput<'a>,
    rule: Rule,
    frames: &'a [Frame<'a>; COLUMNS],
    new_state: &'a mut [f64],
}

impl WithSimd for Integrate<'_> {
    type Output = Result<[Totals; COLUMNS], PointFailure>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { input, rule, frames, new_state } = self;
        let mut points = Points::zero();
        for (index, frame) in frames.iter().enumerate() {
            set_kinematics(simd, frame, &rule, index * rule.count, &mut points);
        }
        let count = COLUMNS * rule.count;
        let flat = |det: &&f64| !(**det > 0.0 && det.is_finite());
        if let Some(point) = points.det[..count].iter().position(|det| flat(&det)) {
            return Err(PointFailure { point, reason: FailureReason::Inverted { ratio: 0.0 } });
        }
        update_material(simd, input, count, new_state, &mut points)?;
        let mut totals = [const { Totals::ZERO }; COLUMNS];
        let wants_tangent = input.want == Want::ResidualAndTangent;
        for (index, (frame, totals)) in frames.iter().zip(&mut totals).enumerate() {
            integrate_column(
                simd,
                frame,
                &rule,
                index * rule.count,
                (&points, wants_tangent),
                totals,
            );
        }
        Ok(totals)
    }
}

/// Kinematics of the points of a column whose first point is `start`.
#[inline(always)]
fn set_kinematics<S: Simd>(
    simd: S,
    frame: &Frame<'_>,
    rule: &Rule,
    start: usize,
    points: &mut Points,
) {
    let [a, b] = vectors(simd, &frame.along);
    let [by_a, by_b] = vectors(simd, &frame.tilt);
    let across = splat(simd, &frame.across.into());
    let gradient: [[f64; 3]; 3] = frame.gradient.transpose().into();
    let (thickness_strain, unit) = (splat(simd, &frame.thickness_strain), splat(simd, &frame.unit));
    let two = Lane::splat(simd, 2.0);
    for first in rule.groups::<S>() {
        let zeta = Lane::load(simd, &rule.zeta, first);
        let [g, h] = base_vectors([&a, &b], [&by_a, &by_b], zeta);
        let dual = [cross(&h, &across), cross(&across, &g), cross(&g, &h)];
        let det = Lane::dot(&g, &dual[0]);
        let over = Lane::splat(simd, 1.0) / det;
        let map = congruence(simd, &stretched(simd, &dual, over, &gradient));
        let det_ratio = over * frame.centre_det;
        let shape_strain = strain_shapes(simd, zeta, det_ratio);
        let thickening =
            shape_strain[0] * frame.thickening[0] + shape_strain[1] * frame.thickening[1];
        let strain = natural(simd, &frame.strain, zeta);
        let at = start + first;
        for i in 0..6 {
            let thick = thickness_strain[i] * thickening;
            let half = thick + Lane::dot(&map[i], &strain);
            half.mul_add(two, unit[i]).store(&mut points.stretched[i], at);
            for j in 0..6 {
                map[i][j].store(&mut points.map[i][j], at);
            }
        }
        det.store(&mut points.det, at);
        for k in 0..2 {
            shape_strain[k].store(&mut points.shape_strain[k], at);
        }
    }
}

/// Linear and quadratic thickness strain at `zeta`, orthogonal to constant stress over the thickness.
#[inline(always)]
fn strain_shapes<S: Simd>(simd: S, zeta: Lane<S>, det_ratio: Lane<S>) -> [Lane<S>; 2] {
    [zeta * det_ratio, (zeta * zeta - Lane::splat(simd, 1.0 / 3.0)) * det_ratio]
}

/// Base vectors at the thickness coordinate `zeta`: `along + zeta tilt`, for both in-plane directions.
#[inline(always)]
fn base_vectors<S: Simd>(
    along: [&[Lane<S>; 3]; 2],
    tilt: [&[Lane<S>; 3]; 2],
    zeta: Lane<S>,
) -> [[Lane<S>; 3]; 2] {
    let mut bases = [*along[0], *along[1]];
    for k in 0..2 {
        for i in 0..3 {
            bases[k][i] = tilt[k][i].mul_add(zeta, along[k][i]);
        }
    }
    bases
}

/// Component `j` of the `i`-th dual base vector in `[j][i]`, transformed by `U`: `dual` times `over`, by the rows of
/// `U`.
#[inline(always)]
fn stretched<S: Simd>(
    simd: S,
    dual: &[[Lane<S>; 3]; 3],
    over: Lane<S>,
    gradient: &[[f64; 3]; 3],
) -> [[Lane<S>; 3]; 3] {
    let mut q = [[over; 3]; 3];
    for (i, dual) in dual.iter().enumerate() {
        for j in 0..3 {
            let column = splat(simd, &[gradient[0][j], gradient[1][j], gradient[2][j]]);
            q[j][i] = Lane::dot(dual, &column) * over;
        }
    }
    q
}

/// Constitutive update of the points, eight at a time.
#[inline(always)]
fn update_material<S: Simd>(
    simd: S,
    input: &ElementInput<'_>,
    count: usize,
    new_state: &mut [f64],
    points: &mut Points,
) -> Result<(), PointFailure> {
    let len = input.material.state_len();
    let mut responses = Responses::zero();
    for first in (0..count).step_by(POINTS) {
        let count_here = POINTS.min(count - first);
        let mut c = [[1.0; POINTS]; 6];
        for (c, from) in c.iter_mut().zip(&points.stretched) {
            c[..count_here].copy_from_slice(&from[first..first + count_here]);
        }
        let range = first * len..(first + count_here) * len;
        let histories = (&input.old_state[range.clone()], &mut new_state[range]);
        log_strain::update_lanes(
            simd,
            input.material,
            &c,
            count_here,
            histories,
            true,
            &mut responses,
        )
        .map_err(|(k, error)| PointFailure { point: first + k, reason: error.into() })?;
        let put = |from: &Eight, to: &mut PerPoint| to[first..first + POINTS].copy_from_slice(from);
        for i in 0..6 {
            put(&responses.stress[i], &mut points.stress[i]);
            for j in 0..6 {
                put(&responses.tangent[i][j], &mut points.tangent[i][j]);
            }
        }
        put(&responses.elastic_energy, &mut points.elastic_energy);
        put(&responses.plastic_work, &mut points.plastic_work);
    }
    Ok(())
}

/// Sums over the points of a column whose first point is `start`.
#[inline(always)]
fn integrate_column<S: Simd>(
    simd: S,
    frame: &Frame<'_>,
    rule: &Rule,
    start: usize,
    (points, wants_tangent): (&Points, bool),
    totals: &mut Totals,
) {
    let zero = Lane::splat(simd, 0.0);
    for first in rule.groups::<S>() {
        let at = start + first;
        let quadrature = Lane::load(simd, &rule.weight, first);
        let weight = quadrature * Lane::load(simd, &points.det, at);
        let weights = Weights { simd, at, quadrature, weight };
        totals.elastic_energy += weights.weighted(&points.elastic_energy).sum();
        totals.plastic_work += weights.weighted(&points.plastic_work).sum();
        let (stress, tangent, transposed) = weights.responses(points);
        let powers = Powers::new(Lane::load(simd, &rule.zeta, first));
        add_generalised(&apply(&transposed, &stress), &powers, &mut totals.stress);
        if wants_tangent {
            let mut own = [[zero; 6]; 6];
            for (row, column) in own.iter_mut().zip(&transposed) {
                *row = multiply(column, &tangent);
            }
            for row in &mut own {
                *row = apply(&transposed, row);
            }
            add_generalised_stiffness(&own, &powers, &mut totals.stiffness);
        }
        let modes = Modes::new(simd, frame, (points, at), &stress);
        modes.add_to(&transposed, (&stress, &tangent), &powers, totals);
    }
}

/// Weights of the points from index `at`; `quadrature` is zero in lanes beyond the column.
struct Weights<S: Simd> {
    simd: S,
    at: usize,
    quadrature: Lane<S>,
    weight: Lane<S>,
}

impl<S: Simd> Weights<S> {
    /// Values of the points times their weights; zero beyond the column regardless of the stored value.
    #[inline(always)]
    fn weighted(&self, from: &PerPoint) -> Lane<S> {
        let zero = Lane::splat(self.simd, 0.0);
        zero.if_less(self.quadrature, self.weight * Lane::load(self.simd, from, self.at), zero)
    }

    /// Weighted stresses and tangents, and the transposed maps from natural to Cartesian strain.
    #[inline(always)]
    fn responses(&self, points: &Points) -> ([Lane<S>; 6], Map<S>, Map<S>) {
        let zero = Lane::splat(self.simd, 0.0);
        let mut stress = [zero; 6];
        let (mut tangent, mut transposed) = ([[zero; 6]; 6], [[zero; 6]; 6]);
        for i in 0..6 {
            stress[i] = self.weighted(&points.stress[i]);
            for j in 0..6 {
                tangent[i][j] = self.weighted(&points.tangent[i][j]);
                transposed[j][i] = Lane::load(self.simd, &points.map[i][j], self.at);
            }
        }
        (stress, tangent, transposed)
    }
}

#[cfg(test)]
mod tests {
    use super::state::POINT_CAPACITY;
    use super::*;

    #[test]
    fn lanes_beyond_a_column_are_excluded() {
        let simd = pulp::Scalar::new();
        let one = Lane::splat(simd, 1.0);
        let weights = Weights { simd, at: 3, quadrature: one, weight: one + one };
        let mut each = [f64::NAN; POINT_CAPACITY];
        each[3] = 5.0;
        assert_eq!(weights.weighted(&each).sum(), 10.0);
        let beyond = Weights { quadrature: Lane::splat(simd, 0.0), at: 4, ..weights };
        assert_eq!(beyond.weighted(&each).sum(), 0.0);
    }
}
