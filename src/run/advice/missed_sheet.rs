//! Travel-driven tools that move away from the sheet or stop short of it: `direction` or the sign of the travel is
//! probably reversed.

use super::finding::Finding;
use kanagata_contact::Projection;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_solver::reach::travel_range;
use kanagata_solver::{Motion, Placement, SimulationSetup, ToolSetup};

/// Largest number of sheet nodes whose distance is computed.
const SAMPLED_NODES_MAX: usize = 2000;
/// Smallest step between sampled travels, over [`approach_distance`].
const TRAVEL_STEP_REL: f64 = 0.25;
/// Largest number of sampled travels.
const TRAVEL_STEPS_MAX: f64 = 200.0;
/// Distance over the size of the sheet by which its rim may approach a tool without contact.
const APPROACH_REL: f64 = 0.05;

/// A note on a tool that travels and never touches the undeformed sheet, if no other tool and no load can bring the
/// sheet to it.
pub(super) fn finding(setup: &SimulationSetup, tool: usize) -> Option<Finding> {
    let own = &setup.tools[tool];
    let [low, high] = travel_range(setup, tool)?;
    if high <= low || is_loaded_along(setup, &own.direction) {
        return None;
    }
    let ends = [low, high].map(|travel| (travel, distance(setup, own, travel)));
    let start = distance(setup, own, 0.0);
    let (thickness, size) =
        (setup.body.mesh().mean_thickness(), Aabb::of_points(&setup.body.mesh().nodes).diagonal());
    let near = approach_distance(setup);
    let minimum = min_distance_over(setup, own, [low, high], near).min(start).min(ends[1].1);
    let (far, farthest) = if ends[0].1 > ends[1].1 { ends[0] } else { ends[1] };
    let leaves = minimum >= start - 1e-6 * size && farthest > start + thickness;
    // Other tools may bend the sheet towards this one.
    let short = minimum > near && minimum > travel_of_others(setup, tool);
    if !(leaves || short)
        || (leaves && !travels_first(setup, tool))
        || may_be_carried(setup, tool, far)
    {
        return None;
    }
    let name = &own.name;
    Some(if leaves {
        Finding::note(
            format!(
                "{name} moves away from the sheet: it starts {start:.2} mm from it and is {farthest:.2} mm away at a travel of {far:.2} mm"
            ),
            "positive travel is along `direction`: one of the two is reversed".into(),
        )
    } else {
        Finding::note(
            format!(
                "{name} travels from {low:.2} to {high:.2} mm and stays at least {minimum:.2} mm from the undeformed sheet"
            ),
            "check its place, direction and travel".into(),
        )
    })
}

/// Whether nodal loads have a component along `direction`.
fn is_loaded_along(setup: &SimulationSetup, direction: &Vec3) -> bool {
    let mut along = setup.loads.chunks_exact(3).map(|f| direction.dot(&Vec3::from_column_slice(f)));
    along.any(|force| force.abs() > 1e-9)
}

/// Total travel of all other tools that are driven by travel [mm].
fn travel_of_others(setup: &SimulationSetup, tool: usize) -> f64 {
    let others = (0..setup.tools.len()).filter(|&other| other != tool);
    let far = |other| travel_range(setup, other).map_or(0.0, |[low, high]| high - low);
    others.map(far).sum()
}

/// Smallest distance between tool and sheet at sampled travels of a range [mm]. It serves to decide whether the tool comes
/// closer than `near`.
///
/// A travel step reduces the distance by at most its length. Steps are as long as the distance exceeds `near`, and a quarter of
/// `near` or more: the true minimum below `near` is missed by at most a quarter of it, unless [`TRAVEL_STEPS_MAX`] limits them.
fn min_distance_over(
    setup: &SimulationSetup,
    tool: &ToolSetup,
    [low, high]: [f64; 2],
    near: f64,
) -> f64 {
    let shortest = (TRAVEL_STEP_REL * near).max((high - low) / TRAVEL_STEPS_MAX);
    let (mut travel, mut minimum) = (low, f64::INFINITY);
    while travel < high {
        let now = distance(setup, tool, travel);
        minimum = minimum.min(now);
        travel += (now - near).max(shortest);
    }
    minimum
}

/// Whether a tool that is not placed by contact with the sheet starts clear of it.
pub(super) fn starts_clear(setup: &SimulationSetup, tool: &ToolSetup) -> bool {
    tool.placement == Placement::AsGiven && distance(setup, tool, 0.0) > approach_distance(setup)
}

/// Distance below which a tool may touch the sheet, whose rim can move towards it [mm].
fn approach_distance(setup: &SimulationSetup) -> f64 {
    let mesh = setup.body.mesh();
    f64::max(2.0 * mesh.mean_thickness(), APPROACH_REL * Aabb::of_points(&mesh.nodes).diagonal())
}

/// Smallest signed distance between the tool and the nodes that it may touch, in the undeformed sheet [mm]. Negative:
/// penetration.
fn distance(setup: &SimulationSetup, tool: &ToolSetup, travel: f64) -> f64 {
    let mesh = setup.body.mesh();
    let ids = tool.side.nodes(mesh);
    let shift = tool.offset + tool.direction * travel;
    let every = ids.len().div_ceil(SAMPLED_NODES_MAX).max(1);
    let points: Vec<Vec3> =
        ids.into_iter().step_by(every).map(|n| mesh.nodes[n as usize] - shift).collect();
    let feet = tool.surface.closest_of_all(&points, &[]);
    let signed = |(x, foot): (&Vec3, &Projection)| {
        let distance = (foot.point - x).norm();
        if foot.gap < 0.0 && !foot.past_border { -distance } else { distance }
    };
    points.iter().zip(&feet).map(signed).fold(f64::INFINITY, f64::min)
}

/// Whether no other tool travels in an earlier stage. A tool that travels later may have formed the sheet and be
/// retracting.
fn travels_first(setup: &SimulationSetup, tool: usize) -> bool {
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

/// Whether another tool travels or pushes in the direction in which this tool reaches the travel `far`: it may carry the
/// sheet along.
fn may_be_carried(setup: &SimulationSetup, tool: usize, far: f64) -> bool {
    let path = setup.tools[tool].direction * far;
    (0..setup.tools.len()).filter(|&other| other != tool).any(|other| {
        let along = setup.tools[other].direction.dot(&path);
        match travel_range(setup, other) {
            Some([low, high]) => along * low > 0.0 || along * high > 0.0,
            None => along > 0.0,
        }
    })
}
