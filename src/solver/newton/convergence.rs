//! Whether an iterate is a balance, and what goes on record of it.

use super::record::IterationRecord;
use crate::geometry::Vec3;
use crate::solver::limits::Limits;
use crate::solver::system::correction::Correction;
use crate::solver::system::system::{Residual, System};

/// Whether forces and gaps are within the tolerances; `stagnates`: the last corrections were no smaller than half
/// the ones before.
pub(in crate::solver) fn is_settled(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    stagnates: bool,
    limits: &Limits,
) -> bool {
    let rounding = 1e-13 * sys.scales.normal * sys.lengths.shortest_edge;
    let force = limits.force_tolerance * residual.reference + rounding;
    let gap = limits.gap_tolerance * sys.lengths.shortest_edge;
    let unbalanced = residual.force.max(sys.eval.internal_residual);
    residual.length <= gap && (unbalanced <= force || is_rounding(sys, unbalanced, last, stagnates))
}

/// Whether an iterate is the balance but for the rounding of the nodes' places: what it leaves out of balance is no more than
/// that, and neither was the last correction. A sheet that nothing holds has no other force to go by, and its
/// supports, which carry next to nothing, none that is worth a tolerance. A thin one that little holds answers to the rounding
/// of its forces by bending, so corrections stop shrinking at far more than rounding: then they may be a small share of the
/// thickness.
fn is_rounding(sys: &System, unbalanced: f64, last: Option<&Correction>, stagnates: bool) -> bool {
    const ROUNDING_FACTOR: f64 = 4.0;
    const CORRECTION_REL: f64 = 1e-3;
    let places =
        ROUNDING_FACTOR * f64::EPSILON * sys.lengths.farthest * (sys.u.len() as f64).sqrt();
    let small = |c: &Correction| {
        size(c) <= places
            || (stagnates && largest_move(c) <= CORRECTION_REL * sys.lengths.shortest_edge)
    };
    unbalanced <= sys.scales.normal * places && last.is_some_and(small)
}

/// Largest displacement of a node in a correction [mm].
fn largest_move(correction: &Correction) -> f64 {
    let moves = correction.u.chunks_exact(3).map(|u| Vec3::from_column_slice(u).norm());
    moves.fold(0.0, f64::max)
}

/// Norm of the displacements of a correction [mm].
pub(in crate::solver) fn size(correction: &Correction) -> f64 {
    correction.u.iter().map(|v| v * v).sum::<f64>().sqrt()
}

pub(in crate::solver) fn record(
    sys: &System,
    residual: &Residual,
    last: Option<&Correction>,
    changes: usize,
) -> IterationRecord {
    let floor = 1e-12 * sys.scales.normal * sys.lengths.shortest_edge;
    // An iterate out of all proportion goes on record too, and records are read again.
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
