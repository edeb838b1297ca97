//! Travel of a tool over the stages.

use kanagata_solver::Motion;

/// Travel of a tool at the end of a stage that starts at the travel `before` [mm]; `None` if a force or a spring drives
/// the tool.
pub(super) fn end_of(motion: &Motion, before: f64) -> Option<f64> {
    match motion {
        Motion::Hold | Motion::Release | Motion::Absent => Some(before),
        Motion::Travel(curve) => Some(curve.at(1.0)),
        Motion::Advance(curve) => Some(before + curve.at(1.0)),
        Motion::Force(_) | Motion::Spring { .. } => None,
    }
}
