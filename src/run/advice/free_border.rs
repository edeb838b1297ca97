//! Free borders of tools over which the sheet may bend.
//!
//! Contact conditions are at nodes: the force of the border between nodes is missing, and a node drawn back over the
//! border re-enters from inside the tool.

use super::clamping::{is_force_driven, opposes, opposite_tools};
use super::curvature::corners;
use super::element_size::Sizes;
use super::finding::Finding;
use super::sharp_edge::{EDGE_PARAMETERS, Edge, Opposite, SHARP_ANGLE};
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;
use kanagata_solver::{SimulationSetup, ToolSetup};
use kanagata_tool::side::SideCurve;

/// Offset beyond a border at which the tool is searched, over the mean element size.
const PROBE_OFFSET_REL: f64 = 1e-3;

/// A note on a tool with a free border beyond which the sheet is bent. This happens if an opposite tool travels past the
/// border, is pushed there unopposed, or if a load acts beyond it. `kept`: reachable patches of all tools.
pub(super) fn finding(
    setup: &SimulationSetup,
    tool: usize,
    kept: &[Vec<bool>],
    sizes: &Sizes,
) -> Option<Finding> {
    let own = &setup.tools[tool];
    let pushed = unopposed(setup, tool);
    let opposite = Opposite::new(setup, tool, &kept[tool], sizes).and_pushed(setup, &pushed);
    let loads = pushing(setup, own);
    if opposite.is_idle() && loads.is_empty() {
        return None;
    }
    let met = |edge: &Edge| {
        opposite.meets(edge).or_else(|| {
            let bent = |at: &&Vec3| {
                let at = *at + own.offset;
                let beyond = |x: &Vec3| (x - at).dot(&edge.across) > sizes.mean;
                sizes.covers(&at, &own.direction) && loads.iter().any(beyond)
            };
            edge.places.iter().find(bent).copied()
        })
    };
    let met =
        borders(own, &kept[tool], sizes).into_iter().filter_map(|edge| Some((met(&edge)?, edge)));
    let (at, edge) = met.max_by(|(_, a), (_, b)| a.turn.total_cmp(&b.turn))?;
    Some(note(own, at + own.offset, edge.turn))
}

/// Force-driven opposite tools that no tool opposes.
fn unopposed(setup: &SimulationSetup, tool: usize) -> Vec<usize> {
    let pushed = |&other: &usize| {
        let mut against = opposite_tools(setup, other);
        is_force_driven(setup, other) && !against.any(|k| opposes(setup, k, other))
    };
    opposite_tools(setup, tool).filter(pushed).collect()
}

/// The note on a border at `at` [mm] over which the sheet principal_curvatures by up to `turn` [rad].
fn note(own: &ToolSetup, at: Vec3, turn: f64) -> Finding {
    Finding::note(
        format!(
            "the faces of {} end in a free border at ({:.1}, {:.1}, {:.1}) mm, over which the sheet may be bent by up to {:.0} degrees",
            own.name,
            at.x,
            at.y,
            at.z,
            turn.to_degrees()
        ),
        "contact conditions are at nodes: forces there depend on the mesh, and a node drawn back over the border may catch; model the edge radius of the tool and the wall behind it, or extend the tool beyond the sheet".into(),
    )
}

/// Positions of the nodes that a load pushes against the tool's direction [mm].
fn pushing(setup: &SimulationSetup, own: &ToolSetup) -> Vec<Vec3> {
    let loads = setup.loads.chunks_exact(3).zip(&setup.body.mesh().nodes);
    let down = loads.filter(|(f, _)| own.direction.dot(&Vec3::from_column_slice(f)) < 0.0);
    down.map(|(_, x)| *x).collect()
}

/// Free sides of reachable patches whose normal points towards the sheet.
fn borders(tool: &ToolSetup, kept: &[bool], sizes: &Sizes) -> Vec<Edge> {
    let near = tool.surface.model().patches.iter().zip(kept).filter(|(_, kept)| **kept);
    let mut edges = Vec::new();
    for (patch, _) in near {
        let corners = corners(patch);
        let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
        for k in 0..patch.sides() {
            let side = SideCurve::new(patch, k);
            let (eta, zeta) = side.parameters(0.5);
            let (Some(normal), Some(along)) =
                (patch.normal(eta, zeta), unit(side.point(1.0) - side.point(0.0)))
            else {
                continue;
            };
            // Beyond the border the sheet bends at most until it is parallel to the tool's direction.
            let turn = normal.dot(&tool.direction).clamp(-1.0, 1.0).asin();
            let (Some(out), Some(across)) =
                (unit(along.cross(&normal)), unit(along.cross(&tool.direction)))
            else {
                continue;
            };
            let away = |v: Vec3| if v.dot(&(side.point(0.5) - middle)) < 0.0 { -v } else { v };
            if turn > SHARP_ANGLE {
                let places = EDGE_PARAMETERS.map(|t| side.point(t));
                edges.push((away(out), Edge { places, turn, along, across: away(across) }));
            }
        }
    }
    let far = (PROBE_OFFSET_REL * sizes.mean).max(1e-5 * tool.surface.bounds().diagonal());
    let beside: Vec<Vec3> = edges.iter().map(|(out, edge)| edge.places[0] + out * far).collect();
    let feet = tool.surface.closest_of_all(&beside, &[]);
    edges.into_iter().zip(feet).filter(|(_, foot)| foot.past_border).map(|((_, e), _)| e).collect()
}
