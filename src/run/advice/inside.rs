//! Tools that stand in the sheet before it is formed.

use super::finding::Finding;
use super::size::Sizes;
use crate::report::doubt::DoubtCode;
use crate::solver::penetration::inside;
use crate::solver::{Motion, SimulationSetup};

/// Depth over the thickness above which a doubt is raised ([`DoubtCode::InsideTool`]).
const DEEP: f64 = 0.1;

/// A remark on a tool of the first stage in which the undeformed sheet begins.
pub(super) fn remark(setup: &SimulationSetup, tool: usize, sizes: &Sizes) -> Option<Finding> {
    let own = &setup.tools[tool];
    let first = &setup.stages.first()?.motions[tool];
    if matches!(first, Motion::Absent | Motion::Release) {
        return None;
    }
    let mesh = setup.body.mesh();
    let found = inside(own, own.offset, mesh, |node| mesh.nodes[node], sizes.mean)?;
    let what = if found.wrong_face {
        "it is to touch the other face of the sheet, as its `direction` or its `side` has it: one of them is turned round"
    } else {
        "the first increment has to push them out at once and may not converge; begin clear of the sheet: \"place\": \"touch\", or a `shift` farther back"
    };
    let limit = DEEP * mesh.mean_thickness();
    if found.depth <= limit {
        return Some(Finding::note(found.to_string(), what.into()));
    }
    let place = own.name.clone();
    let doubt = Finding::doubt(DoubtCode::InsideTool, place, found.to_string(), what.into());
    Some(doubt.exceeds([found.depth, limit]))
}
