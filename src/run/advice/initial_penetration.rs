//! Tools that penetrate the undeformed sheet.

use super::element_size::Sizes;
use super::finding::Finding;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::penetration::inside;
use kanagata_solver::{Motion, SimulationSetup};

/// Penetration over the thickness above which a doubt is raised ([`DoubtCode::InsideTool`]); below it is a note.
const DEPTH_MAX_REL: f64 = 0.1;

/// The finding about a tool of the first stage that penetrates the undeformed sheet.
pub(super) fn finding(setup: &SimulationSetup, tool: usize, sizes: &Sizes) -> Option<Finding> {
    let own = &setup.tools[tool];
    let first = &setup.stages.first()?.motions[tool];
    if matches!(first, Motion::Absent | Motion::Release) {
        return None;
    }
    let mesh = setup.body.mesh();
    let found = inside(own, own.offset, mesh, |node| mesh.nodes[node], sizes.mean)?;
    let what = if found.wrong_face {
        "its `direction` or `side` selects the other face of the sheet: one of them is reversed"
    } else {
        "the first increment must remove the penetration at once and may not converge; start clear of the sheet: \"place\": \"touch\", or a larger `shift`"
    };
    let limit = DEPTH_MAX_REL * mesh.mean_thickness();
    if found.depth <= limit {
        return Some(Finding::note(found.to_string(), what.into()));
    }
    let place = own.name.clone();
    let doubt = Finding::doubt(DoubtCode::InsideTool, place, found.to_string(), what.into());
    Some(doubt.exceeds([found.depth, limit]))
}
