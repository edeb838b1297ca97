//! Tools driven by a force or a spring that may lose the sheet. If the sheet is drawn out from under a holder, the
//! holder pinches the rim and then closes further.

use rayon::prelude::*;

use super::finding::Finding;
use super::travel::end_of;
use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{SimulationSetup, ToolSetup};

/// Notes on tools without a stop that cover less of the sheet than the other tools draw.
pub(super) fn findings(setup: &SimulationSetup, out: &mut Vec<Finding>) {
    for (tool, own) in setup.tools.iter().enumerate().filter(|(_, own)| own.stop.is_none()) {
        if let Some((drawing, drawn)) = drawn(setup, tool)
            && let Some(width) = width_under(setup.body.mesh(), own, &setup.tools[drawing])
            && drawn > width
        {
            out.push(Finding::note(
                format!(
                    "{} is driven by a force and has no stop: {width:.1} mm of the sheet may be drawn before its rim leaves it, and {} travels {drawn:.1} mm",
                    own.name, setup.tools[drawing].name
                ),
                "if the sheet is drawn out from under it, it pinches the rim and closes further; set `stop_mm`, its largest travel".into(),
            ));
        }
    }
}

/// The other tool with the largest travel while a force drives this one, and that travel [mm].
fn drawn(setup: &SimulationSetup, tool: usize) -> Option<(usize, f64)> {
    let travelled = |other: usize| {
        let (mut at, mut travelled) = (0.0, 0.0);
        for stage in &setup.stages {
            let before = at;
            at = end_of(&stage.motions[other], before).unwrap_or(before);
            if end_of(&stage.motions[tool], 0.0).is_none() {
                travelled += f64::max(at - before, 0.0);
            }
        }
        (other, travelled)
    };
    let others = (0..setup.tools.len()).filter(|&other| other != tool).map(travelled);
    others.filter(|(_, travelled)| *travelled > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Width of the sheet that may be drawn from under a tool [mm].
///
/// It is the largest distance, projected along the tool's direction in the undeformed sheet, from a node under the tool
/// or outside it to the nodes inside it that are drawn already. `None` if there are no such nodes, and for a pad, which
/// opposes the drawing tool.
fn width_under(mesh: &HexMesh, tool: &ToolSetup, drawing: &ToolSetup) -> Option<f64> {
    let seen = |x: &Vec3| x - tool.direction * x.dot(&tool.direction);
    let (under, beside) = faced(mesh, tool, seen);
    let (core, _) = faced(mesh, drawing, seen);
    let to =
        |from: &[Vec3], x: &Vec3| from.iter().map(|b| (b - x).norm()).fold(f64::INFINITY, f64::min);
    let depth: Vec<f64> = under.par_iter().map(|x| to(&core, x)).collect();
    let opposite = depth.iter().filter(|depth| **depth < mesh.mean_thickness()).count();
    if 2 * opposite > under.len() {
        return None;
    }
    let nearest = depth.into_iter().fold(f64::INFINITY, f64::min);
    let (inside, outside): (Vec<Vec3>, Vec<Vec3>) =
        beside.into_iter().partition(|x| core.is_empty() || to(&core, x) <= nearest);
    let all = under.par_iter().chain(&outside);
    let width = all.map(|x| to(&inside, x)).reduce(|| 0.0, f64::max);
    (!under.is_empty() && width.is_finite()).then_some(width)
}

/// Projected nodes that a tool faces, and the other nodes that it may touch.
fn faced(mesh: &HexMesh, tool: &ToolSetup, seen: impl Fn(&Vec3) -> Vec3) -> (Vec<Vec3>, Vec<Vec3>) {
    let ids = tool.side.nodes(mesh);
    let nodes: Vec<Vec3> = ids.into_iter().map(|n| mesh.nodes[n as usize]).collect();
    let points: Vec<Vec3> = nodes.iter().map(|x| x - tool.offset).collect();
    let feet = tool.surface.closest_of_all(&points, &[]);
    let (mut under, mut beside): (Vec<Vec3>, Vec<Vec3>) = (Vec::new(), Vec::new());
    for (x, foot) in nodes.iter().zip(&feet) {
        // Nodes beside the tool have a foot point with a normal across the direction.
        let faces = foot.normal.dot(&tool.direction) > 0.5 && !foot.past_border;
        if faces { &mut under } else { &mut beside }.push(seen(x));
    }
    (under, beside)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::test_tools::plane;
    use kanagata_contact::ToolSurface;
    use kanagata_geometry::Mat3;
    use kanagata_solver::sheet::hex_mesh::rectangle;
    use kanagata_solver::{Placement, SheetSide};

    /// The width of a strip of 10 mm that may be drawn from under a holder over one part of it by a punch over another.
    fn width(turn: Mat3, held: [f64; 2], drawn: [f64; 2]) -> Option<f64> {
        let mut mesh = rectangle(10.0, 10.0, 1.0, 10, 10, 1);
        mesh.nodes.iter_mut().for_each(|x| *x = turn * *x);
        let over = |[from, to]: [f64; 2]| {
            let [origin, a, b, up] =
                [Vec3::new(from, 0.0, 1.0), Vec3::x() * (to - from), Vec3::y() * 10.0, Vec3::z()];
            let model = plane("tool", turn * origin, turn * a, turn * b, turn * -up);
            ToolSetup {
                name: "tool".into(),
                surface: Arc::new(ToolSurface::new(model)),
                offset: Vec3::zeros(),
                direction: turn * -up,
                placement: Placement::AsGiven,
                friction: 0.0,
                side: SheetSide::Top,
                stop: None,
            }
        };
        width_under(&mesh, &over(held), &over(drawn))
    }

    #[test]
    fn what_lies_under_a_tool_is_the_same_whatever_way_it_pushes() {
        let turned = Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        for turn in [Mat3::identity(), turned] {
            // From the last node that is not under the tool, at 5 mm, to the end.
            assert_eq!(width(turn, [5.5, 10.0], [0.0, 2.5]), Some(5.0));
            // The rim beyond the holder also passes under it.
            assert_eq!(width(turn, [4.5, 7.5], [0.0, 2.5]), Some(6.0));
            // A pad that moves with the punch.
            assert_eq!(width(turn, [0.0, 3.5], [0.0, 2.5]), None);
        }
    }
}
