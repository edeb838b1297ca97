//! Constrained nodes in the path of travelling tools: contact there has no solution.

use super::finding::Finding;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::{DoubtCode, place_mm};
use kanagata_solver::reach::travel_range;
use kanagata_solver::{SimulationSetup, ToolSetup};

/// Component of the tool's direction along an axis above which a node constrained along that axis obstructs the tool.
const PATH_COS_MIN: f64 = 0.1;
/// Penetration over the thickness above which a doubt is raised.
const DEPTH_MAX_REL: f64 = 0.05;
/// Number of sampled intervals of the travel.
const TRAVEL_INTERVALS: usize = 16;

/// Findings on constrained nodes.
pub(super) fn findings(setup: &SimulationSetup, out: &mut Vec<Finding>) {
    let nodes = setup.body.mesh().nodes.len();
    let held = |node: usize| (0..3).all(|axis| setup.constraints.is_held(node, axis));
    let fixed = |node: usize| held(node) || setup.constraints.is_hanging(node);
    let moves = |tool: &usize| travel_range(setup, *tool).is_none_or(|[low, high]| high > low);
    if nodes > 0 && (0..nodes).all(fixed) && (0..setup.tools.len()).any(|tool| moves(&tool)) {
        out.push(Finding::error(
            "holds".into(),
            format!("All {nodes} nodes of the blank are constrained in x, y and z, and a tool is driven against it: nothing can deform."),
            "Constrain the nodes that a fixture holds, not all of the blank.".into(),
        ));
        return;
    }
    out.extend((0..setup.tools.len()).filter_map(|tool| driven_through(setup, tool)));
}

/// The doubt about a tool that travels through constrained nodes.
fn driven_through(setup: &SimulationSetup, tool: usize) -> Option<Finding> {
    let own = &setup.tools[tool];
    let [low, high] = travel_range(setup, tool)?;
    let mesh = setup.body.mesh();
    let in_way = |node: &usize| {
        let axes = (0..3).filter(|&axis| own.direction[axis].abs() > PATH_COS_MIN);
        axes.into_iter().all(|axis| setup.constraints.is_held(*node, axis))
    };
    let nodes: Vec<usize> = own.side.nodes(mesh).into_iter().map(|n| n as usize).collect();
    let nodes: Vec<usize> = nodes.into_iter().filter(in_way).collect();
    if nodes.is_empty() || high <= low {
        return None;
    }
    let positions =
        (0..=TRAVEL_INTERVALS).map(|k| low + (high - low) * k as f64 / TRAVEL_INTERVALS as f64);
    let deepest = positions.flat_map(|travel| depths(setup, own, &nodes, travel));
    let (node, depth) = deepest.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let limit = DEPTH_MAX_REL * mesh.mean_thickness();
    (depth > limit).then(|| {
        let at: [f64; 3] = mesh.nodes[node].into();
        Finding::doubt(
            DoubtCode::ConstrainedNodeDriven,
            format!("{}, node {node}", own.name),
            format!(
                "{} is driven through constrained nodes, by up to {depth:.2} mm, at {}: no contact force can keep them out.",
                own.name,
                place_mm(&at)
            ),
            "Constrain nodes outside the tool's path, or leave its direction free (`axes`).".into(),
        )
        .exceeds([depth, limit])
    })
}

/// Penetrations of the nodes, which do not move, at a travel of the tool [mm].
fn depths(
    setup: &SimulationSetup,
    tool: &ToolSetup,
    nodes: &[usize],
    travel: f64,
) -> Vec<(usize, f64)> {
    let shift = tool.offset + tool.direction * travel;
    let points: Vec<Vec3> = nodes.iter().map(|&n| setup.body.mesh().nodes[n] - shift).collect();
    let feet = tool.surface.closest_of_all(&points, &[]);
    let inside = nodes.iter().zip(feet).filter(|(_, foot)| !foot.past_border);
    inside.map(|(&node, foot)| (node, -foot.gap)).collect()
}
