//! Loads on a sheet without support and without contact.

use super::finding::Finding;
use super::missed_sheet::starts_clear;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::{Motion, SimulationSetup};

/// Net force over the sum of all forces, above which the loads push the sheet.
const NET_FORCE_MIN_REL: f64 = 1e-6;

/// A doubt about the first stage at whose end loads push the sheet along an axis without constraints while no tool is at
/// the sheet.
pub(super) fn finding(setup: &SimulationSetup) -> Option<Finding> {
    let forces = || setup.loads.chunks_exact(3).map(Vec3::from_column_slice);
    let (net, sum): (Vec3, f64) = (forces().sum(), forces().map(|f| f.norm()).sum());
    let nodes = setup.body.mesh().nodes.len();
    let held = |axis: usize| (0..nodes).any(|node| setup.constraints.is_held(node, axis));
    let axis = (0..3).find(|&axis| net[axis].abs() > NET_FORCE_MIN_REL * sum && !held(axis))?;
    let mut moved = vec![false; setup.tools.len()];
    let clear: Vec<bool> = setup.tools.iter().map(|tool| starts_clear(setup, tool)).collect();
    let stage = setup.stages.iter().find(|stage| {
        for (moved, motion) in moved.iter_mut().zip(&stage.motions) {
            *moved |= !matches!(motion, Motion::Hold | Motion::Release | Motion::Absent);
        }
        let there = |(tool, motion): (usize, &Motion)| {
            !matches!(motion, Motion::Release | Motion::Absent) && (moved[tool] || !clear[tool])
        };
        stage.load.at(1.0) != 0.0 && !stage.motions.iter().enumerate().any(there)
    })?;
    let (force, name) = (net[axis] * stage.load.at(1.0), ["x", "y", "z"][axis]);
    Some(Finding::doubt(
        DoubtCode::SheetUnconstrained,
        format!("stage {}", stage.name),
        format!(
            "At the end of stage `{}` loads push the sheet along {name} with {force:.3} N (modelled part); no node is constrained along {name} and no tool is at the sheet: there is no equilibrium.",
            stage.name
        ),
        "Constrain the sheet (`holds`, `symmetry`), balance the load, or keep a tool at the sheet."
            .into(),
    ))
}
