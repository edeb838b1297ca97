//! Limits of quality that the run cannot judge, and forming limits beyond their range.

use super::finding::Finding;
use kanagata_scene::Plan;
use kanagata_scene::types::{Drive, Scene};
use kanagata_solver::material::forming_limit::{FormingLimit, KEELER_THICKNESS_MAX};

/// Errors for limits of quality without what they are judged by.
pub(super) fn findings(plan: &Plan, out: &mut Vec<Finding>) {
    let Some(quality) = &plan.scene.quality else { return };
    if quality.flc_margin.is_some() && plan.card.forming_limit.is_none() {
        out.push(Finding::error(
            "quality.flc_margin".into(),
            format!(
                "The margin to the forming limit cannot be judged: material '{}' has no `forming_limit`.",
                plan.card.name
            ),
            "Give the card a `forming_limit` (points of a measured curve, or a law), or remove `quality.flc_margin`."
                .into(),
        ));
    }
    if quality.max_springback_mm.is_some() && !has_free_stage(&plan.scene) {
        out.push(Finding::error(
            "quality.max_springback_mm".into(),
            "Springback cannot be judged: no stage releases all tools.".into(),
            "Add a last stage in which every tool has `\"release\": true`, or remove `quality.max_springback_mm`."
                .into(),
        ));
    }
}

/// A note on a blank thicker than the correlation of its forming limit.
pub(super) fn thick_blank(plan: &Plan) -> Option<Finding> {
    let thickness = plan.scene.blank.thickness_mm;
    let law = matches!(plan.card.forming_limit, Some(FormingLimit::KeelerBrazier { .. }));
    (law && thickness > KEELER_THICKNESS_MAX).then(|| {
        Finding::note(
            format!(
                "the forming limit of material '{}' is that of a sheet of {KEELER_THICKNESS_MAX} mm, where the correlation of Keeler and Brazier ends; the blank has {thickness} mm",
                plan.card.name
            ),
            "give `forming_limit` points of a measured curve".into(),
        )
    })
}

/// Whether all tools are released or absent in a stage.
pub(super) fn has_free_stage(scene: &Scene) -> bool {
    let mut away = vec![false; scene.tools.len()];
    scene.stages.iter().any(|stage| {
        for (tool, away) in scene.tools.iter().zip(&mut away) {
            if let Some(drive) = stage.drive.get(&tool.name) {
                *away = matches!(drive, Drive::Release(true) | Drive::Absent(true));
            }
        }
        away.iter().all(|away| *away)
    })
}
