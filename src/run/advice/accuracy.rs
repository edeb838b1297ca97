//! An accuracy that a single run cannot judge, or that this blank does not allow.

use super::finding::Finding;
use super::quality::has_free_stage;
use kanagata_report::doubt::{Doubt, DoubtCode};
use kanagata_scene::Plan;
use kanagata_scene::types::BlankShape;

/// Errors for an accuracy that no sequence of runs can reach.
pub(super) fn findings(plan: &Plan, out: &mut Vec<Finding>) {
    let Some(accuracy) = &plan.scene.accuracy else { return };
    if matches!(plan.scene.blank.shape, BlankShape::Mesh { .. }) {
        out.push(Finding::error(
            "accuracy".into(),
            "The elements of a mesh file cannot be changed from run to run.".into(),
            "Give the blank as `rectangle`, `quarter_disc` or `disc`, or remove `accuracy`.".into(),
        ));
    }
    if !plan.scene.blank.refine.is_empty() {
        out.push(Finding::error(
            "blank.refine".into(),
            "With `accuracy` the runs choose where elements are refined.".into(),
            "Remove `blank.refine`, or remove `accuracy`.".into(),
        ));
    }
    let springback = accuracy.springback.or(accuracy.springback_mm);
    if springback.is_some() && !has_free_stage(&plan.scene) {
        out.push(Finding::error(
            "accuracy.springback".into(),
            "Springback cannot be judged: no stage releases all tools.".into(),
            "Add a last stage in which every tool has `\"release\": true`, or remove this key."
                .into(),
        ));
    }
}

/// A note on what the sequence of runs chooses.
pub(super) fn note(plan: &Plan) -> Option<Finding> {
    plan.scene.accuracy.as_ref().map(|_| {
        Finding::note(
            "the runs choose elements, layers, points and increments from run to run; the scene's elements are an upper limit of the first run, and cost and notes on elements are those of a single run".into(),
            "give the elements that you would use without `accuracy`".into(),
        )
    })
}

/// The doubt about a single run of a scene that asks for an accuracy.
pub(crate) fn unjudged(plan: &Plan) -> Option<Doubt> {
    plan.scene.accuracy.as_ref().map(|_| {
        Doubt::new(
            DoubtCode::AccuracyNotReached,
            "accuracy".into(),
            "A single run does not estimate its error: the accuracy that the scene asks for is not judged. Run the scene as a \
             sequence, or remove `accuracy`."
                .into(),
        )
    })
}
