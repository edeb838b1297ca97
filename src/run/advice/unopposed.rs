//! Tools that push with a force while no tool stands on the sheet's other side, and no support holds it: taken away too early,
//! or not there yet.

use super::Remark;
use crate::geometry::Vec3;
use crate::solver::{Motion, SheetSide, SimulationSetup, Stage};

/// Remarks on stages in which nothing stands against a tool that pushes.
pub(super) fn remarks(setup: &SimulationSetup, out: &mut Vec<Remark>) {
    for stage in &setup.stages {
        for (tool, own) in setup.tools.iter().enumerate() {
            let Some(force) = force_at_end(&stage.motions[tool]).filter(|force| *force > 0.0)
            else {
                continue;
            };
            let against = |(other, motion): (usize, &Motion)| {
                other != tool
                    && !matches!(motion, Motion::Release | Motion::Absent)
                    && (own.side == SheetSide::Both || setup.tools[other].side != own.side)
            };
            let alone = !stage.motions.iter().enumerate().any(against);
            if alone && !supported(setup, &own.direction) {
                out.push(Remark::new(
                    format!(
                        "at the end of stage `{}` {} pushes with {force:.0} N and no tool stands against it",
                        stage.name, own.name
                    ),
                    format!("there is no balance; {}", remedy(setup, stage)),
                ));
            }
        }
    }
}

/// Whether nodes are held against a push this way.
fn supported(setup: &SimulationSetup, direction: &Vec3) -> bool {
    /// Cosine of the angle between the two from which a node that is held along an axis holds.
    const HOLDS: f64 = 0.1;
    let axes = (0..3).filter(|&axis| direction[axis].abs() > HOLDS);
    let nodes = 0..setup.body.mesh().nodes.len();
    axes.into_iter().any(|axis| nodes.clone().any(|node| setup.constraints.is_held(node, axis)))
}

/// What to do: a tool let go in that very stage leaves forces behind, which go with the sheet and are guided by nothing.
fn remedy(setup: &SimulationSetup, stage: &Stage) -> String {
    let gone = setup.tools.iter().zip(&stage.motions).find(|(_, m)| **m == Motion::Release);
    gone.map_or_else(
        || "keep a tool on its other side, or release this one too".into(),
        |(tool, _)| {
            format!(
                "what {} leaves behind as it is let go are forces that move with the sheet and that nothing guides (they may bend it): let it go back by travel, or release this one too",
                tool.name
            )
        },
    )
}

/// Force of a tool at the end of a stage that drives it by one [N]. A spring goes on to where it has none.
fn force_at_end(motion: &Motion) -> Option<f64> {
    match motion {
        Motion::Force(curve) => Some(curve.at(1.0)),
        Motion::Hold
        | Motion::Spring { .. }
        | Motion::Travel(_)
        | Motion::Advance(_)
        | Motion::Release
        | Motion::Absent => None,
    }
}
