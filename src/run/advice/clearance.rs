//! Clearance that tools leave the sheet at the end of their travels, against its thickness and the tools' shape error.

use super::Remark;
use crate::audit::clearance::{ClearanceOptions, clearance};
use crate::geometry::Vec3;
use crate::scene::Plan;
use crate::solver::{Motion, SimulationSetup};

/// Shares of the room beside the sheet, and of its thickness, that shape errors may take up.
const OF_ROOM: f64 = 0.5;
const OF_THICKNESS: f64 = 0.02;
/// Intervals along a side of a patch.
const SAMPLES: usize = 3;

/// Remarks on pairs of tools that face each other and whose travels are given.
pub(super) fn remarks(plan: &Plan, setup: &SimulationSetup, out: &mut Vec<Remark>) {
    let thickness = setup.body.mesh().mean_thickness();
    let tools = &setup.tools;
    for a in 0..tools.len() {
        for b in 0..a {
            let (Some(end_a), Some(end_b)) = (farthest(setup, a), farthest(setup, b)) else {
                continue;
            };
            if tools[a].direction.dot(&tools[b].direction) > -0.5 || (end_a == 0.0 && end_b == 0.0)
            {
                continue;
            }
            let shift = |k: usize, travel: f64| tools[k].offset + tools[k].direction * travel;
            let options = ClearanceOptions {
                travel: shift(a, end_a) - shift(b, end_b),
                thickness_mm: thickness,
                samples: SAMPLES,
                refine: 8,
                nearest: 1,
            };
            let found = clearance(tools[a].surface.model(), &tools[b].surface, &options);
            if let Some(least) = found.min_mm {
                let errors = [a, b].map(|k| plan.tools[k].shape_error_mm);
                let names = format!("{} and {}", tools[a].name, tools[b].name);
                out.extend(remark(&names, least, thickness, errors, found.at_mm.map(Vec3::from)));
            }
        }
    }
}

fn remark(
    names: &str,
    least: f64,
    thickness: f64,
    errors: [Option<f64>; 2],
    at: Option<Vec3>,
) -> Option<Remark> {
    let place =
        at.map_or_else(String::new, |p| format!(" at ({:.1}, {:.1}, {:.1}) mm", p.x, p.y, p.z));
    let room = least - thickness;
    if room < -OF_THICKNESS * thickness {
        return Some(Remark::new(
            format!(
                "{names} leave {least:.3} mm at the end of their travel{place}, the sheet has {thickness:.3} mm"
            ),
            "it is ironed there: forces and increments grow many times".into(),
        ));
    }
    let allowed = OF_ROOM * room.max(2.0 * OF_THICKNESS * thickness);
    let known: f64 = errors.iter().flatten().sum();
    if known > allowed {
        return Some(Remark::new(
            format!(
                "the shape errors of {names} are {known:.3} mm together, their clearance leaves {:.3} mm beside the sheet{place}: too coarse",
                room.max(0.0)
            ),
            format!("convert with --tol {:.4}; unknowns stay the same", 0.5 * allowed),
        ));
    }
    None
}

/// Travel of a tool farthest from its start [mm]; `None` when forces decide.
fn farthest(setup: &SimulationSetup, tool: usize) -> Option<f64> {
    let mut now = 0.0_f64;
    let mut most = 0.0_f64;
    for stage in &setup.stages {
        now = match &stage.motions[tool] {
            Motion::Hold | Motion::Release | Motion::Absent => now,
            Motion::Travel(curve) => curve.at(1.0),
            Motion::Advance(curve) => now + curve.at(1.0),
            Motion::Force(_) | Motion::Spring { .. } => return None,
        };
        most = if now.abs() > most.abs() { now } else { most };
    }
    Some(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_held_against_thickness_and_shape_error() {
        let told = |least: f64, errors: [Option<f64>; 2]| {
            remark("a and b", least, 1.0, errors, None).map(|r| r.to_string())
        };
        assert_eq!(told(1.2, [Some(0.01), None]), None);
        assert!(told(0.9, [None; 2]).unwrap().contains("ironed"));
        let coarse = told(1.1, [Some(0.04), Some(0.03)]).unwrap();
        assert!(coarse.contains("0.070 mm") && coarse.contains("--tol 0.0250"), "{coarse}");
    }
}
