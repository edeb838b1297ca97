//! Free borders of a tool's faces that the sheet may be bent over. Tools hold nodes and see nothing between them: what the border
//! presses into the sheet there is missing, and a node drawn back over it comes from within the tool.

use super::clamping::{is_forced, others, stands_before};
use super::curvature::corners;
use super::finding::Finding;
use super::sharp::{Edge, Opposite, PLACES, SHARP};
use super::size::Sizes;
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::solver::{SimulationSetup, ToolSetup};
use crate::tool::side::SideCurve;

/// How far beside a border is looked from, over the mean size of elements.
const BESIDE: f64 = 1e-3;

/// A remark on a tool with a free border where a tool on the sheet's other side goes past it or is pushed there with nothing
/// before it, or a load pushes the sheet down beyond it; `kept`: patches of all tools that the sheet may come near.
pub(super) fn remark(
    setup: &SimulationSetup,
    tool: usize,
    kept: &[Vec<bool>],
    sizes: &Sizes,
) -> Option<Finding> {
    let own = &setup.tools[tool];
    let pushed = unopposed(setup, tool, kept);
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

/// Tools on the sheet's other side that forces push with nothing before them.
fn unopposed(setup: &SimulationSetup, tool: usize, kept: &[Vec<bool>]) -> Vec<usize> {
    let pushed = |&other: &usize| {
        let mut against = others(setup, other);
        is_forced(setup, other) && !against.any(|k| stands_before(setup, k, other, &kept[other]))
    };
    others(setup, tool).filter(pushed).collect()
}

/// The remark on a border at `at` [mm] over which the sheet is bent by up to `turn` [rad].
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
        "tools hold nodes and see nothing between them, so forces there go by the mesh, and a node drawn back over the border may lock the sheet; give the tool the radius of its edge and the wall behind it, or let it end beyond the sheet".into(),
    )
}

/// Nodes that a load pushes towards a tool's back [mm].
fn pushing(setup: &SimulationSetup, own: &ToolSetup) -> Vec<Vec3> {
    let loads = setup.loads.chunks_exact(3).zip(&setup.body.mesh().nodes);
    let down = loads.filter(|(f, _)| own.direction.dot(&Vec3::from_column_slice(f)) < 0.0);
    down.map(|(_, x)| *x).collect()
}

/// Sides of patches near the sheet, of faces that look towards it, beyond which the tool has nothing.
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
            // Beyond the border the sheet goes along the tool's direction at the most.
            let turn = normal.dot(&tool.direction).clamp(-1.0, 1.0).asin();
            let (Some(out), Some(across)) =
                (unit(along.cross(&normal)), unit(along.cross(&tool.direction)))
            else {
                continue;
            };
            let away = |v: Vec3| if v.dot(&(side.point(0.5) - middle)) < 0.0 { -v } else { v };
            if turn > SHARP {
                let places = PLACES.map(|t| side.point(t));
                edges.push((away(out), Edge { places, turn, along, across: away(across) }));
            }
        }
    }
    let far = (BESIDE * sizes.mean).max(1e-5 * tool.surface.bounds().diagonal());
    let beside: Vec<Vec3> = edges.iter().map(|(out, edge)| edge.places[0] + out * far).collect();
    let feet = tool.surface.closest_of_all(&beside, &[]);
    edges.into_iter().zip(feet).filter(|(_, foot)| foot.past_border).map(|((_, e), _)| e).collect()
}
