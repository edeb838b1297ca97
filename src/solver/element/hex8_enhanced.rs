//! Trilinear hexahedron with twelve enhanced strain modes, condensed in the element.
//!
//! The assumed strain is the Green-Lagrange strain plus `(j0/j) T0 M(ξ, η, ζ) α` (Simo & Rifai 1990, applied to the
//! Green-Lagrange strain). Nine modes linear in the natural coordinates remove shear locking in bending. Three
//! bilinear volume modes remove volumetric locking. 2 x 2 x 2 Gauss points.

use super::modes::{Mode, ModeResidual, ModeSums};
use super::shape::{PointGeometry, gauss_2x2x2, jacobian};
use super::{DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want, compatible};
use crate::material::log_strain::{self, Responses};
use crate::numbers::lanes::{Eight, POINTS};
use crate::numbers::tensor::{self, Mandel, Mandel66};

/// Number of enhanced modes.
pub(crate) const MODE_COUNT: usize = 12;
/// Maximum local Newton iterations of the modes at fixed displacements in one evaluation.
const MODE_ITERATIONS_MAX: usize = 10;
/// Value of [`Mode::column`] for the volume strain.
const VOLUME: usize = 6;

const fn mode(column: usize, powers: [u8; 3]) -> Mode {
    Mode { column, powers }
}

const MODES: [Mode; MODE_COUNT] = [
    mode(0, [1, 0, 0]),
    mode(1, [0, 1, 0]),
    mode(2, [0, 0, 1]),
    mode(3, [1, 0, 0]),
    mode(3, [0, 1, 0]),
    mode(4, [0, 1, 0]),
    mode(4, [0, 0, 1]),
    mode(5, [0, 0, 1]),
    mode(5, [1, 0, 0]),
    mode(VOLUME, [1, 1, 0]),
    mode(VOLUME, [0, 1, 1]),
    mode(VOLUME, [1, 0, 1]),
];

/// Evaluates the element. `new_state` receives the trial history; `record` is its mode record.
///
/// # Errors
/// [`PointFailure`] when the element is inverted, or the material or the condensation fails.
pub(crate) fn evaluate(
    input: &ElementInput<'_>,
    points: &[PointGeometry; 8],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    let jacobian = jacobian(input.nodes, [0.0; 3]);
    let det = jacobian.determinant();
    let centre = jacobian.try_inverse().map(|inverse| {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| inverse[(j, i)]));
        (tensor::congruence(&rows), det)
    });
    // A reference element that is flat at its centre has no volume that a ratio could refer to.
    let centre =
        centre.ok_or(PointFailure { point: 0, reason: FailureReason::Inverted { ratio: 0.0 } })?;
    let strain_norm = MODES.map(|mode| mode.strain_norm(&centre.0));
    let at = |alpha: &_, record: &mut _| {
        evaluate_at(input, points, &centre, alpha, new_state, record, out)
    };
    ModeSums::with_prediction(record, input.displacement, &strain_norm, MODE_ITERATIONS_MAX, at)
}

fn evaluate_at(
    input: &ElementInput<'_>,
    points: &[PointGeometry; 8],
    centre: &(Mandel66, f64),
    alpha: &[f64; MODE_COUNT],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<ModeResidual<MODE_COUNT>, PointFailure> {
    *out = ElementMatrices::zero();
    let directions: [_; 8] = std::array::from_fn(|index| {
        mode_strains(centre, points[index].weight, gauss_2x2x2()[index])
    });
    let Deformed { gradients, c } = Deformed::new(input, points, &directions, alpha)?;
    let across: Mandel = centre.0.map(|row| row[2]);
    let mut responses = Responses::zero();
    let histories = (input.old_state, new_state);
    log_strain::update_points(input.material, &c, POINTS, histories, true, &mut responses)
        .map_err(|(point, error)| PointFailure { point, reason: error.into() })?;
    let mut sums = PointSums { modes: ModeSums::zero(), initial_stress: [[0.0; 8]; 8] };
    for (index, geometry) in points.iter().enumerate() {
        let response = responses.at(index);
        let weight = geometry.weight;
        out.elastic_energy += weight * response.elastic_energy;
        out.plastic_work += weight * response.plastic_work;
        let point = WeightedPoint {
            geometry,
            gradient: &gradients[index],
            directions: &directions[index],
            stress: response.stress.map(|value| weight * value),
            tangent: response.tangent.map(|row| row.map(|value| weight * value)),
        };
        out.thickness_force += tensor::dot(&across, &point.stress);
        sums.add(&point, input.want, out);
    }
    compatible::spread_nodal_stress(&sums.initial_stress, &mut out.tangent);
    sums.modes
        .condense(alpha, input.displacement, input.want, record, out)
        .map_err(|reason| PointFailure { point: 0, reason })
}

/// Deformation at the eight points.
struct Deformed {
    /// Compatible deformation gradients.
    gradients: [[[f64; 3]; 3]; 8],
    /// Right Cauchy-Green tensors of the assumed strain, enhanced modes included.
    c: [Eight; 6],
}

impl Deformed {
    /// # Errors
    /// [`FailureReason::Inverted`] at the first point where the compatible deformation inverts the element.
    #[inline]
    fn new(
        input: &ElementInput<'_>,
        points: &[PointGeometry; 8],
        directions: &[[Mandel; MODE_COUNT]; 8],
        alpha: &[f64; MODE_COUNT],
    ) -> Result<Self, PointFailure> {
        let mut gradients = [[[0.0; 3]; 3]; 8];
        let mut c = [[0.0; POINTS]; 6];
        for (index, geometry) in points.iter().enumerate() {
            let reason = |ratio| FailureReason::Inverted { ratio };
            let f = compatible::deform(geometry, input.displacement)
                .map_err(|ratio| PointFailure { point: index, reason: reason(ratio) })?;
            let mut stretch = compatible::cauchy_green(&f);
            for (direction, value) in directions[index].iter().zip(alpha) {
                (0..6).for_each(|i| stretch[i] += 2.0 * value * direction[i]);
            }
            (0..6).for_each(|i| c[i][index] = stretch[i]);
            gradients[index] = f;
        }
        Ok(Self { gradients, c })
    }
}

/// A point with stress and tangent multiplied by its integration weight.
struct WeightedPoint<'a> {
    geometry: &'a PointGeometry,
    /// Compatible deformation gradient.
    gradient: &'a [[f64; 3]; 3],
    /// Strain directions of the modes.
    directions: &'a [Mandel; MODE_COUNT],
    stress: Mandel,
    tangent: Mandel66,
}

/// Sums over the points, condensed or added to the tangent after the last point.
struct PointSums {
    modes: ModeSums<MODE_COUNT>,
    /// `Σ N_a,I S_IJ N_b,J` by pair of nodes.
    initial_stress: [[f64; 8]; 8],
}

impl PointSums {
    /// Adds one point to the force and, if requested, to the tangent.
    #[inline]
    fn add(&mut self, point: &WeightedPoint<'_>, want: Want, out: &mut ElementMatrices) {
        let WeightedPoint { geometry, gradient, stress, tangent, .. } = point;
        let b = compatible::strain_derivative(gradient, geometry);
        for (row, value) in b.iter().zip(stress) {
            out.force.iter_mut().zip(row).for_each(|(sum, rate)| *sum += rate * value);
        }
        if want == Want::ResidualAndTangent {
            compatible::add_congruence(&b, tangent, &mut out.tangent);
            compatible::add_nodal_stress(geometry, stress, &mut self.initial_stress);
        }
        add_modes(point, &b, &mut self.modes);
    }
}

/// Adds one point to the sums of the modes; `b` is `∂E/∂u` of its compatible strain.
fn add_modes(point: &WeightedPoint<'_>, b: &[[f64; DOFS]; 6], sums: &mut ModeSums<MODE_COUNT>) {
    let WeightedPoint { directions, stress, tangent, .. } = point;
    let transposed = tensor::transpose(tangent);
    for (k, direction) in directions.iter().enumerate() {
        sums.residual[k] += tensor::dot(direction, stress);
        let column = tensor::apply(tangent, direction);
        let row = tensor::apply(&transposed, direction);
        for (sum, other) in sums.stiffness[k].iter_mut().zip(*directions) {
            *sum += tensor::dot(&row, other);
        }
        for (rates, (left, right)) in b.iter().zip(column.iter().zip(&row)) {
            sums.left[k].iter_mut().zip(rates).for_each(|(sum, rate)| *sum += rate * left);
            sums.right[k].iter_mut().zip(rates).for_each(|(sum, rate)| *sum += rate * right);
        }
    }
}

/// Cartesian strains `(j0/j) T0 M` of the modes at a point. The quadrature weight is one, so `det` is the volume of
/// the point.
fn mode_strains(centre: &(Mandel66, f64), det: f64, xi: [f64; 3]) -> [Mandel; MODE_COUNT] {
    let (map, centre_det) = centre;
    std::array::from_fn(|k| {
        let mode = &MODES[k];
        let value = mode.value(xi) * centre_det / det;
        std::array::from_fn(|i| {
            value * if mode.column == VOLUME { tensor::UNIT[i] } else { map[i][mode.column] }
        })
    })
}
