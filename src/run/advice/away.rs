//! Tools moved by their travel that go away from the sheet, or end short of it: a direction or a sign turned round.

use super::finding::Finding;
use crate::contact::Projection;
use crate::geometry::{Aabb, Vec3};
use crate::solver::reach::travel_range;
use crate::solver::{Motion, Placement, SimulationSetup, ToolSetup};

/// Nodes whose distance is looked at, at most.
const SAMPLES: usize = 2000;
/// Least step between two places on the way at which it is, over the distance at which a tool comes near.
const STEP: f64 = 0.25;
/// Steps at most.
const STEPS: f64 = 200.0;
/// Share of the sheet's size that its rim may come towards a tool by itself.
const RIM: f64 = 0.05;

/// A remark on a tool that travels and never meets the sheet where that lies, with no other tool and no load that could bring
/// the sheet along.
pub(super) fn remark(setup: &SimulationSetup, tool: usize) -> Option<Finding> {
    let own = &setup.tools[tool];
    let [low, high] = travel_range(setup, tool)?;
    let pulled =
        setup.loads.chunks_exact(3).map(|f| own.direction.dot(&Vec3::from_column_slice(f)));
    if high <= low || pulled.into_iter().any(|force| force.abs() > 1e-9) {
        return None;
    }
    let ends = [low, high].map(|travel| (travel, distance(setup, own, travel)));
    let start = distance(setup, own, 0.0);
    let (thickness, size) =
        (setup.body.mesh().mean_thickness(), Aabb::of_points(&setup.body.mesh().nodes).diagonal());
    let near = near(setup);
    let least = on_the_way(setup, own, [low, high], near).min(start).min(ends[1].1);
    let (far, most) = if ends[0].1 > ends[1].1 { ends[0] } else { ends[1] };
    let leaves = least >= start - 1e-6 * size && most > start + thickness;
    // Others may bend the sheet towards it.
    let short = least > near && least > others_travel(setup, tool);
    if !(leaves || short) || (leaves && !begins_it(setup, tool)) || brought(setup, tool, far) {
        return None;
    }
    let name = &own.name;
    Some(if leaves {
        Finding::note(
            format!(
                "{name} moves away from the sheet all the time: it begins {start:.2} mm from it, and at a travel of {far:.2} mm is {most:.2} mm away"
            ),
            "positive travel goes along `direction`: one of the two is turned round".into(),
        )
    } else {
        Finding::note(
            format!(
                "{name} travels from {low:.2} to {high:.2} mm and stays at least {least:.2} mm from the undeformed sheet"
            ),
            "check its place, its direction and how far it travels".into(),
        )
    })
}

/// How far tools but one travel in all, those that forces move aside [mm].
fn others_travel(setup: &SimulationSetup, tool: usize) -> f64 {
    let others = (0..setup.tools.len()).filter(|&other| other != tool);
    let far = |other| travel_range(setup, other).map_or(0.0, |[low, high]| high - low);
    others.map(far).sum()
}

/// Least distance from a tool between two travels [mm], of which no more than that it is below `near` is of interest. A step of
/// the tool brings it no nearer than by its length, so none goes over a place where it is nearer by more than a quarter of that.
fn on_the_way(setup: &SimulationSetup, tool: &ToolSetup, [low, high]: [f64; 2], near: f64) -> f64 {
    let shortest = (STEP * near).max((high - low) / STEPS);
    let (mut travel, mut least) = (low, f64::INFINITY);
    while travel < high {
        let now = distance(setup, tool, travel);
        least = least.min(now);
        travel += (now - near).max(shortest);
    }
    least
}

/// Whether a tool that is not placed on the sheet begins well clear of it.
pub(super) fn stands_off(setup: &SimulationSetup, tool: &ToolSetup) -> bool {
    tool.placement == Placement::AsGiven && distance(setup, tool, 0.0) > near(setup)
}

/// Distance at which a tool comes near the sheet [mm]: what its rim may come towards a tool by itself.
fn near(setup: &SimulationSetup) -> f64 {
    let mesh = setup.body.mesh();
    f64::max(2.0 * mesh.mean_thickness(), RIM * Aabb::of_points(&mesh.nodes).diagonal())
}

/// Least distance of the sheet's nodes that a tool may touch from it, where they lie before forming [mm]; below zero where it
/// would be past them.
fn distance(setup: &SimulationSetup, tool: &ToolSetup, travel: f64) -> f64 {
    let mesh = setup.body.mesh();
    let ids = tool.side.nodes(mesh);
    let shift = tool.offset + tool.direction * travel;
    let every = ids.len().div_ceil(SAMPLES).max(1);
    let points: Vec<Vec3> =
        ids.into_iter().step_by(every).map(|n| mesh.nodes[n as usize] - shift).collect();
    let feet = tool.surface.closest_of_all(&points, &[]);
    let signed = |(x, foot): (&Vec3, &Projection)| {
        let distance = (foot.point - x).norm();
        if foot.gap < 0.0 && !foot.past_border { -distance } else { distance }
    };
    points.iter().zip(&feet).map(signed).fold(f64::INFINITY, f64::min)
}

/// Whether no other tool has travelled before the stage in which this one does: it is not one that has done its work and is
/// taken away.
fn begins_it(setup: &SimulationSetup, tool: usize) -> bool {
    let travels = |motion: &Motion| {
        let extent = match motion {
            Motion::Travel(curve) | Motion::Advance(curve) => curve.extent(),
            _ => [0.0; 2],
        };
        extent != [0.0; 2]
    };
    let first = setup.stages.iter().find(|stage| stage.motions.iter().any(travels));
    first.is_some_and(|stage| travels(&stage.motions[tool]))
}

/// Whether another tool goes, or is pushed, the way that this one does to the travel `far`: the sheet may be between them.
fn brought(setup: &SimulationSetup, tool: usize, far: f64) -> bool {
    let way = setup.tools[tool].direction * far;
    (0..setup.tools.len()).filter(|&other| other != tool).any(|other| {
        let along = setup.tools[other].direction.dot(&way);
        match travel_range(setup, other) {
            Some([low, high]) => along * low > 0.0 || along * high > 0.0,
            None => along > 0.0,
        }
    })
}
