//! Sections whose plane does not cut the blank.

use super::finding::Finding;
use crate::section::line::cut;
use kanagata_scene::Plan;
use kanagata_solver::SimulationSetup;

/// An error for every section that the blank does not have.
pub(super) fn findings(plan: &Plan, setup: &SimulationSetup, out: &mut Vec<Finding>) {
    let mesh = setup.body.mesh();
    for (k, section) in plan.scene.output.sections.iter().enumerate() {
        let axis = section.normal.index();
        if cut(mesh, axis, section.at_mm).is_some() {
            continue;
        }
        let along = mesh.nodes.iter().map(|node| node[axis]);
        let [low, high] = along
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let name = ["x", "y"][axis];
        out.push(Finding::error(
            format!("output.sections[{k}]"),
            format!(
                "The plane {name} = {} mm does not cut the blank, which reaches from {low:.3} to {high:.3} mm.",
                section.at_mm
            ),
            "Give a coordinate on the blank.".into(),
        ));
    }
}
