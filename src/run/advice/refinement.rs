//! Levels of refinement that differ from those of the scene.

use super::finding::Finding;
use kanagata_scene::Plan;
use kanagata_scene::blank::raised_elements;

/// Note: elements whose level of refinement was raised, since levels of neighbours differ by at most 1.
pub(super) fn raised(plan: &Plan) -> Option<Finding> {
    let raised = raised_elements(plan).filter(|raised| *raised > 0)?;
    Some(Finding::note(
        format!(
            "blank.refine: {raised} elements of the base mesh are refined more than requested, since levels of elements with a common side differ by at most 1"
        ),
        "smaller levels, or regions further apart, need fewer elements".into(),
    ))
}
