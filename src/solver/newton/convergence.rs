//! Convergence criterion of the Newton iteration, and the record of an iteration.

use super::record::IterationRecord;
use crate::limits::Limits;
use crate::numbers::tolerances::NEGLIGIBLE_REL;
use crate::system::correction::Correction;
use crate::system::system::{Residual, System};
use kanagata_geometry::Vec3;

/// Whether residual forces and gaps are within their tolerances. `stagnates`: the norms of the last corrections did
/// not halve.
pub(crate) fn is_settled(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    stagnates: bool,
    limits: &Limits,
) -> bool {
    let rounding = 1e-13 * sys.scales.normal * sys.lengths.shortest_edge;
    let force = limits.force_tolerance * residual.reference + rounding;
    let gap = limits.gap_tolerance * sys.lengths.shortest_edge;
    let residual_force = residual.force.max(sys.eval.internal_residual);
    residual.length <= gap
        && (residual_force <= force || is_rounding(sys, residual_force, last, stagnates))
}

/// Whether the residual is due to the rounding of nodal positions: residual and last correction are both within it.
/// An unconstrained sheet has no reference force, and its supports carry almost nothing. A thin sheet bends under the
/// rounding of its forces, so its corrections stop decreasing well above rounding. If they stagnate, they may be as
/// large as a small fraction of the thickness ([`NEGLIGIBLE_REL`]).
fn is_rounding(
    sys: &System,
    residual_force: f64,
    last: Option<&Correction>,
    stagnates: bool,
) -> bool {
    let rounding_of_residual = sys.rounding_of_forces() * (sys.u.len() as f64).sqrt();
    let position_rounding = rounding_of_residual / sys.scales.normal;
    let is_small = |c: &Correction| {
        size(c) <= position_rounding
            || (stagnates && largest_move(c) <= NEGLIGIBLE_REL * sys.lengths.shortest_edge)
    };
    residual_force <= rounding_of_residual && last.is_some_and(is_small)
}

/// Largest nodal displacement of a correction [mm].
fn largest_move(correction: &Correction) -> f64 {
    let moves = correction.u.chunks_exact(3).map(|u| Vec3::from_column_slice(u).norm());
    moves.fold(0.0, f64::max)
}

/// Norm of the displacements of a correction [mm].
pub(crate) fn size(correction: &Correction) -> f64 {
    correction.u.iter().map(|v| v * v).sum::<f64>().sqrt()
}

pub(crate) fn record(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    changes: usize,
) -> IterationRecord {
    let floor = 1e-12 * sys.scales.normal * sys.lengths.shortest_edge;
    // A diverging iterate is recorded too; records must contain finite numbers.
    let number = |value: f64| if value.is_finite() { value } else { f64::MAX };
    IterationRecord {
        residual: number(residual.force / residual.reference.max(floor)),
        gap: number(residual.length),
        penetration: number(residual.penetration),
        correction: number(last.map_or(0.0, size)),
        contacts: sys.contact.active().count(),
        slipping: residual.slipping,
        stuck: residual.stuck,
        changes,
    }
}
