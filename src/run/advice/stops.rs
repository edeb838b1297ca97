//! Tools driven by a force or a spring that lose the sheet: drawn out from under a holder it leaves nothing to push against,
//! and the holder pinches the rim, then follows the sheet down.

use rayon::prelude::*;

use super::{Remark, end_of};
use crate::geometry::Vec3;
use crate::solver::blank::HexMesh;
use crate::solver::{SimulationSetup, ToolSetup};

/// Remarks on tools without a stop under which less sheet lies than the others draw.
pub(super) fn remarks(setup: &SimulationSetup, out: &mut Vec<Remark>) {
    for (tool, own) in setup.tools.iter().enumerate().filter(|(_, own)| own.stop.is_none()) {
        let drawn = drawn(setup, tool);
        if drawn > 0.0
            && let Some(width) = width_under(setup.body.mesh(), own)
            && drawn > width
        {
            out.push(Remark::new(
                format!(
                    "{} is driven by a force and has no stop: {width:.1} mm of the sheet lie under it at most, and {drawn:.1} mm may be drawn",
                    own.name
                ),
                "where the sheet is drawn out from under it, it pinches the rim and goes on; `stop_mm` is the travel past which it does not go".into(),
            ));
        }
    }
}

/// How far another tool goes at most while a force drives this one [mm].
fn drawn(setup: &SimulationSetup, tool: usize) -> f64 {
    let gone = |other: usize| {
        let (mut at, mut gone) = (0.0, 0.0);
        for stage in &setup.stages {
            let before = at;
            at = end_of(&stage.motions[other], before).unwrap_or(before);
            if end_of(&stage.motions[tool], 0.0).is_none() {
                gone += f64::max(at - before, 0.0);
            }
        }
        gone
    };
    (0..setup.tools.len()).filter(|&other| other != tool).map(gone).fold(0.0, f64::max)
}

/// The farthest that a node under a tool lies from those that are not, seen along the tool's way, before forming [mm]; `None`
/// where there are only nodes of one kind.
fn width_under(mesh: &HexMesh, tool: &ToolSetup) -> Option<f64> {
    let ids = tool.side.nodes(mesh);
    let nodes: Vec<Vec3> = ids.into_iter().map(|n| mesh.nodes[n as usize]).collect();
    let points: Vec<Vec3> = nodes.iter().map(|x| x - tool.offset).collect();
    let feet = tool.surface.closest_of_all(&points, &[]);
    let seen = |x: &Vec3| x - tool.direction * x.dot(&tool.direction);
    let (mut under, mut beside): (Vec<Vec3>, Vec<Vec3>) = (Vec::new(), Vec::new());
    for (x, foot) in nodes.iter().zip(&feet) {
        // A foot across the direction is one of a node beside the tool.
        let faces = foot.normal.dot(&tool.direction) > 0.5 && !foot.past_border;
        if faces { &mut under } else { &mut beside }.push(seen(x));
    }
    let nearest = |x: &Vec3| beside.iter().map(|b| (b - x).norm()).fold(f64::INFINITY, f64::min);
    let width = under.par_iter().map(nearest).reduce(|| 0.0, f64::max);
    (!under.is_empty() && width.is_finite()).then_some(width)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::contact::ToolSurface;
    use crate::contact::test_tools::plane;
    use crate::geometry::Mat3;
    use crate::solver::blank::rectangle;
    use crate::solver::{Placement, SheetSide};

    #[test]
    fn what_lies_under_a_tool_is_the_same_whatever_way_it_pushes() {
        let width = |turn: Mat3| {
            let mut mesh = rectangle(10.0, 10.0, 1.0, 10, 10, 1);
            mesh.nodes.iter_mut().for_each(|x| *x = turn * *x);
            let [origin, a, b, up] =
                [Vec3::new(5.5, 0.0, 1.0), Vec3::x() * 4.5, Vec3::y() * 10.0, Vec3::z()];
            let model = plane("holder", turn * origin, turn * a, turn * b, turn * -up);
            let holder = ToolSetup {
                name: "holder".into(),
                surface: Arc::new(ToolSurface::new(model)),
                offset: Vec3::zeros(),
                direction: turn * -up,
                placement: Placement::AsGiven,
                friction: 0.0,
                side: SheetSide::Top,
                stop: None,
            };
            width_under(&mesh, &holder)
        };
        // From the last node that is not under it, at 5 mm, to the end.
        assert_eq!(width(Mat3::identity()), Some(5.0));
        assert_eq!(width(Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)), Some(5.0));
    }
}
