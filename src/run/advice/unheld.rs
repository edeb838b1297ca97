//! Loads on a sheet that nothing holds: no support, and no tool at it.

use super::away::stands_off;
use super::finding::Finding;
use crate::geometry::Vec3;
use crate::report::doubt::DoubtCode;
use crate::solver::{Motion, SimulationSetup};

/// Share of the sum of all forces from which what they leave pushes the sheet along.
const LEFT: f64 = 1e-6;

/// A remark on the first stage at whose end loads push the sheet along an axis along which nothing holds it.
pub(super) fn remark(setup: &SimulationSetup) -> Option<Finding> {
    let forces = || setup.loads.chunks_exact(3).map(Vec3::from_column_slice);
    let (net, sum): (Vec3, f64) = (forces().sum(), forces().map(|f| f.norm()).sum());
    let nodes = setup.body.mesh().nodes.len();
    let held = |axis: usize| (0..nodes).any(|node| setup.constraints.is_held(node, axis));
    let axis = (0..3).find(|&axis| net[axis].abs() > LEFT * sum && !held(axis))?;
    let mut moved = vec![false; setup.tools.len()];
    let off: Vec<bool> = setup.tools.iter().map(|tool| stands_off(setup, tool)).collect();
    let stage = setup.stages.iter().find(|stage| {
        for (moved, motion) in moved.iter_mut().zip(&stage.motions) {
            *moved |= !matches!(motion, Motion::Hold | Motion::Release | Motion::Absent);
        }
        let there = |(tool, motion): (usize, &Motion)| {
            !matches!(motion, Motion::Release | Motion::Absent) && (moved[tool] || !off[tool])
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
