//! Solid-shell with eight nodes: assumed natural shear and thickness strains, enhanced strain modes.
//!
//! Position `x = Σ_I M_I(ξ, η) (a_I + ζ d_I)` over four node pairs; `a_I` is the mean and `d_I` half the difference
//! of top and bottom node. Covariant strains `E_ij = ½ (g_i·g_j - G_i·G_j)`:
//!
//! | strain | sampled |
//! |---|---|
//! | `E_11, E_22, E_12` | at the point: `m + ζ k + ζ² q` |
//! | `E_13` | at `(0, ∓1, 0)`, linear in `η` (Dvorkin & Bathe 1984) |
//! | `E_23` | at `(∓1, 0, 0)`, linear in `ξ` |
//! | `E_33` | at the four node pairs, bilinear (Betsch & Stein 1995) |
//!
//! `E_33` is enhanced by modes `(j0/j) T0 M(ξ, η, ζ)`: `ζ` and `ζ² - 1/3`, each times `1, ξ, η, ξη`. The first shape
//! removes Poisson thickness locking in bending, the second volumetric locking in sharp bending.
//!
//! With `membrane`, modes `ξ` in `E_11` and `η` in `E_22` are added (`stretch`), and the shear `E_12` of the
//! mid-surface is that of the centre (`in_plane`).
//!
//! At each point of the mid-surface the stresses are integrated to twelve generalised stresses of
//! `[m, k, q, E_33, E_23, E_31]`. More points through the thickness therefore cost constitutive updates and little
//! else.

mod column;
mod fibres;
mod generalised;
mod in_plane;
pub(crate) mod pairs;
mod points;
mod shape;
mod stretch;

use self::column::Column;
use self::in_plane::InPlane;
pub(super) use self::points::state::COLUMN_POINTS_MAX;
use self::stretch::Axes;
use super::modes::{ModeResidual, ModeSums};
use super::{DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want};
use crate::element::solid_shell::pairs::MEMBRANE_MODES;
use crate::element::solid_shell::pairs::{PLANE, Pairs, Plane, THICKNESS_MODES, blend};
use crate::element::solid_shell::shape::{Moved, Shape, Sums};
use crate::numbers::tensor::{self, Mandel66};
use kanagata_geometry::Mat3;

/// Maximum local Newton iterations of the modes in one evaluation: none are needed.
const MODE_ITERATIONS_MAX: usize = 0;

/// Base vectors at a point, as columns.
fn base_vectors(pairs: &Pairs, plane: &Plane, zeta: f64) -> Mat3 {
    let along = |by: &[f64; 4]| blend(by, &pairs.mean) + blend(by, &pairs.half) * zeta;
    let across = blend(&plane.value, &pairs.half);
    Mat3::from_columns(&[along(&plane.by_xi), along(&plane.by_eta), across])
}

/// Inverse and determinant of right-handed base vectors; `None` if they are not right-handed.
fn inverse(base: &Mat3) -> Option<(Mat3, f64)> {
    let det = base.determinant();
    Some((base.try_inverse().filter(|_| det > 0.0)?, det))
}

/// Map from natural to Cartesian strain, `E = J⁻ᵀ Ē J⁻¹`.
fn to_cartesian(inverse: &Mat3) -> Mandel66 {
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| inverse[(j, i)]));
    tensor::congruence(&rows)
}

/// Evaluates the element with `M` modes: [`THICKNESS_MODES`] or [`MEMBRANE_MODES`].
///
/// `thickness_rule` lists points and weights on [-1, 1]; `new_state` receives the trial history, point
/// `layers * plane + layer`; `record` is the element's mode record.
///
/// # Errors
/// [`PointFailure`] if the element is inverted, or the constitutive update or the condensation fails.
pub(crate) fn evaluate<const M: usize>(
    input: &ElementInput<'_>,
    thickness_rule: &[(f64, f64)],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    let reference = Pairs::new(input.nodes);
    let base = base_vectors(&reference, &Plane::at(0.0, 0.0), 0.0);
    let (inverse, det) = inverse(&base)
        .ok_or(PointFailure { point: 0, reason: FailureReason::Inverted { ratio: 0.0 } })?;
    let (centre, axes) = ((to_cartesian(&inverse), det), Axes::new(&base, &inverse));
    // A unit stretch has a strain norm of one.
    let strain_norm = std::array::from_fn(|k| {
        if k < THICKNESS_MODES { PLANE[0].strain_norm(&centre.0) } else { 1.0 }
    });
    let at = |alpha: &_, record: &mut _| {
        let shape = Shape { pairs: &reference, centre: &centre, axes: &axes, rule: thickness_rule };
        evaluate_at(input, &shape, alpha, new_state, record, out)
    };
    ModeSums::<M>::with_prediction(
        record,
        input.displacement,
        &strain_norm,
        MODE_ITERATIONS_MAX,
        at,
    )
}

/// [`evaluate`] for given values of the modes.
fn evaluate_at<const M: usize>(
    input: &ElementInput<'_>,
    shape: &Shape<'_>,
    alpha: &[f64; M],
    new_state: &mut [f64],
    record: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<ModeResidual<M>, PointFailure> {
    *out = ElementMatrices::zero();
    let moved = Moved::new::<M>(input, shape.pairs);
    let mut sums =
        Sums::<M> { modes: ModeSums::zero(), curvature: [[0.0; 8]; 8], turning: [0.0; 2] };
    let columns = columns::<M>(input, shape, &moved);
    let [a, b, c, d] = &columns;
    let frames = [a.frame(alpha)?, b.frame(alpha)?, c.frame(alpha)?, d.frame(alpha)?];
    let totals = points::integrate(input, shape.rule, &frames, new_state)?;
    for (column, totals) in columns.iter().zip(&totals) {
        column.add(totals, &mut sums, out);
    }
    if input.want == Want::ResidualAndTangent {
        if M == MEMBRANE_MODES {
            moved.fibres.add_curvature(sums.turning, &mut sums.curvature, &mut out.tangent);
        }
        add_pair_form(&sums.curvature, &mut out.tangent);
    }
    sums.modes
        .condense(alpha, input.displacement, input.want, record, out)
        .map_err(|reason| PointFailure { point: 0, reason })
}

/// Columns at the four points of the mid-surface.
fn columns<'a, const M: usize>(
    input: &'a ElementInput<'a>,
    shape: &'a Shape<'a>,
    moved: &'a Moved,
) -> [Column<'a>; points::state::COLUMNS] {
    let gauss = 1.0 / 3.0_f64.sqrt();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    std::array::from_fn(|index| {
        let (xi, eta) = (corners[index].0 * gauss, corners[index].1 * gauss);
        let in_plane = match M {
            MEMBRANE_MODES => InPlane::assumed_at(shape.pairs, xi, eta),
            _ => InPlane::IDENTITY,
        };
        Column { input, shape, moved, in_plane, index, xi, eta }
    })
}

/// Adds a scalar form between `a_0..a_3, d_0..d_3` to the tangent as `value · 1` for each pair of nodes.
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
