//! Tools that push the sheet while no tool and no support is on its other side, for example because they are removed too
//! early.

use super::finding::Finding;
use super::travel::end_of;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::{Motion, SheetSide, SimulationSetup, Stage};

/// Doubts about stages in which nothing opposes a pushing tool.
pub(super) fn findings(setup: &SimulationSetup, out: &mut Vec<Finding>) {
    let mut travels = vec![0.0; setup.tools.len()];
    for stage in &setup.stages {
        for (tool, own) in setup.tools.iter().enumerate() {
            let motion = &stage.motions[tool];
            let before = travels[tool];
            travels[tool] = end_of(motion, before).unwrap_or(before);
            let Some(push) = push(motion, before) else { continue };
            let against = |(other, motion): (usize, &Motion)| {
                other != tool
                    && !matches!(motion, Motion::Release | Motion::Absent)
                    && (own.side == SheetSide::Both || setup.tools[other].side != own.side)
            };
            let alone = !stage.motions.iter().enumerate().any(against);
            if alone && !supported(setup, &own.direction) {
                out.push(Finding::doubt(
                    DoubtCode::ToolUnopposed,
                    format!("{}, stage {}", own.name, stage.name),
                    format!(
                        "At the end of stage `{}` {} {push}, and no tool or support is on the other side of the sheet: there is no equilibrium, or the sheet moves as a rigid body.",
                        stage.name, own.name
                    ),
                    remedy(setup, stage),
                ));
            }
        }
    }
}

/// Whether nodes are constrained against a push along `direction`.
fn supported(setup: &SimulationSetup, direction: &Vec3) -> bool {
    /// Smallest component of the direction along an axis whose constraints support the push.
    const SUPPORT_COS_MIN: f64 = 0.1;
    let axes = (0..3).filter(|&axis| direction[axis].abs() > SUPPORT_COS_MIN);
    let nodes = 0..setup.body.mesh().nodes.len();
    axes.into_iter().any(|axis| nodes.clone().any(|node| setup.constraints.is_held(node, axis)))
}

/// The remedy. The remaining forces of a tool released in the same stage follow the sheet without guidance.
fn remedy(setup: &SimulationSetup, stage: &Stage) -> String {
    let released = setup.tools.iter().zip(&stage.motions).find(|(_, m)| **m == Motion::Release);
    released.map_or_else(
        || "Keep a tool on the other side of the sheet, or release this one too.".into(),
        |(tool, _)| {
            format!(
                "{} is released in this stage: its forces then follow the sheet without guidance and may bend it. Move it back by `travel_mm`, or release this tool too.",
                tool.name
            )
        },
    )
}

/// How a tool with the travel `before` [mm] at the start of a stage pushes at its end, in words; `None` if it does not.
/// A spring moves to its force-free position.
fn push(motion: &Motion, before: f64) -> Option<String> {
    match motion {
        Motion::Force(curve) => {
            let force = curve.at(1.0);
            (force > 0.0).then(|| format!("pushes with {force:.0} N"))
        }
        Motion::Travel(_) | Motion::Advance(_) => end_of(motion, before)
            .filter(|end| *end > before)
            .map(|end| format!("has travelled to {end:.2} mm")),
        Motion::Hold | Motion::Spring { .. } | Motion::Release | Motion::Absent => None,
    }
}
