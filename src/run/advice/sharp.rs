//! Sharp edges that a tool opposite draws the sheet over. A sheet is held off tools at its nodes: over an edge it lies on
//! the two nodes beside it, and its force falls each time that one of them passes.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use super::curvature::corners;
use super::finding::Finding;
use super::size::Sizes;
use super::travel::end_of;
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::solver::{Motion, SimulationSetup, ToolSetup};
use crate::tool::side::SideCurve;

/// Angle between the faces' normals [rad] from which an edge is sharp.
pub(super) const SHARP: f64 = 0.5;
/// Share of a tool's direction in the normal of a face that looks towards the sheet.
const TOWARDS: f64 = 0.1;
/// Places along an edge at which the sheet is looked for.
pub(super) const PLACES: [f64; 5] = [0.5, 0.25, 0.75, 0.1, 0.9];
/// Elements over a radius that lets nodes pass one after the other.
const OVER_A_RADIUS: f64 = 2.0;

/// A remark on a tool whose sharp edges the sheet is drawn over; `kept`: patches the sheet may come near.
pub(super) fn remark(
    setup: &SimulationSetup,
    tool: usize,
    kept: &[bool],
    sizes: &Sizes,
) -> Option<Finding> {
    let opposite = Opposite::new(setup, tool, kept, sizes);
    if opposite.is_idle() {
        return None;
    }
    let own = &setup.tools[tool];
    let edges = edges(own, kept);
    let met = edges.iter().filter_map(|edge| Some((edge, opposite.meets(edge)?)));
    let (edge, at) = met.max_by(|(a, _), (b, _)| a.turn.total_cmp(&b.turn))?;
    Some(told(own, edge, at + own.offset, sizes))
}

/// A tool, and those on the sheet's other side that take the sheet past it.
pub(super) struct Opposite<'a> {
    own: &'a ToolSetup,
    passing: Vec<Passing>,
    /// Farthest place of its patches near the sheet along its direction, in its file [mm].
    front: f64,
    sizes: &'a Sizes,
    thickness: f64,
}

impl<'a> Opposite<'a> {
    /// `kept`: patches the sheet may come near.
    pub(super) fn new(
        setup: &'a SimulationSetup,
        tool: usize,
        kept: &[bool],
        sizes: &'a Sizes,
    ) -> Self {
        let own = &setup.tools[tool];
        let near = own.surface.model().patches.iter().zip(kept).filter(|(_, kept)| **kept);
        let front = near
            .flat_map(|(patch, _)| corners(patch))
            .map(|(x, _)| x.dot(&own.direction))
            .fold(f64::NEG_INFINITY, f64::max);
        let thickness = setup.body.mesh().mean_thickness();
        Self { own, passing: passing(setup, tool), front, sizes, thickness }
    }

    /// With these tools too, which go as far as they are pushed.
    pub(super) fn and_pushed(mut self, setup: &SimulationSetup, tools: &[usize]) -> Self {
        let pushed = tools.iter().map(|&tool| Passing::new(&setup.tools[tool], f64::INFINITY));
        self.passing.extend(pushed);
        self
    }

    /// Whether none of them goes past it by more than the sheet's thickness.
    pub(super) fn is_idle(&self) -> bool {
        self.passing.iter().all(|other| other.far <= self.thickness)
    }

    /// The first place of an edge that the sheet covers and may be taken back over, in the tool's file [mm].
    pub(super) fn meets(&self, edge: &Edge) -> Option<Vec3> {
        let own = self.own;
        let met = |at: &&Vec3| {
            let back = self.front - at.dot(&own.direction);
            let at = *at + own.offset;
            // The sheet reaches back over an edge no farther than the tool opposite goes there.
            let passed =
                |other: &Passing| back < other.far && other.reaches_past(&at, &edge.across);
            self.sizes.covers(&at, &own.direction) && self.passing.iter().any(passed)
        };
        edge.places.iter().find(met).copied()
    }
}

/// That a tool has this edge there, and the radius that would do.
fn told(tool: &ToolSetup, edge: &Edge, at: Vec3, sizes: &Sizes) -> Finding {
    let Edge { turn, along, across, .. } = edge;
    let element = sizes.along(&at, across, along).map_or(sizes.mean, |size| size.length);
    let radius = OVER_A_RADIUS * element / FRAC_PI_2;
    Finding::note(
        format!(
            "{} has a sharp edge at ({:.1}, {:.1}, {:.1}) mm, of {:.0} degrees, over which the sheet may be drawn",
            tool.name,
            at.x,
            at.y,
            at.z,
            turn.to_degrees()
        ),
        format!(
            "contact conditions are at nodes, so forces oscillate as nodes pass the edge; a radius of {radius:.2} mm has two elements over 90 degrees"
        ),
    )
}

/// A tool on the sheet's other side that goes past another.
struct Passing {
    /// How far, along the other's direction [mm].
    far: f64,
    /// Corners of its patches where it begins [mm].
    corners: Vec<Vec3>,
}

impl Passing {
    fn new(tool: &ToolSetup, far: f64) -> Self {
        let corners = tool.surface.model().patches.iter().flat_map(corners);
        Self { far, corners: corners.map(|(x, _)| x + tool.offset).collect() }
    }

    /// Whether some of it lies beyond a place, along a direction across the way it goes.
    fn reaches_past(&self, at: &Vec3, across: &Vec3) -> bool {
        self.corners.iter().any(|x| (x - at).dot(across) > 0.0)
    }
}

/// The tools on the sheet's other side that go past this one while both are there.
fn passing(setup: &SimulationSetup, tool: usize) -> Vec<Passing> {
    let own = &setup.tools[tool];
    let opposite = setup.tools.iter().enumerate();
    let opposite = opposite.filter(|&(other, opposite)| other != tool && opposite.side != own.side);
    opposite
        .map(|(other, opposite)| Passing::new(opposite, farthest_past(setup, tool, other)))
        .filter(|passing| passing.far > 0.0)
        .collect()
}

/// How far another tool goes past this one while both are there, along this one's direction [mm].
fn farthest_past(setup: &SimulationSetup, tool: usize, other: usize) -> f64 {
    let along = setup.tools[tool].direction.dot(&setup.tools[other].direction);
    let mut farthest = 0.0_f64;
    let mut ends = [(0.0, true); 2];
    for stage in &setup.stages {
        for ((at, there), which) in ends.iter_mut().zip([tool, other]) {
            let motion = &stage.motions[which];
            *at = end_of(motion, *at).unwrap_or(*at);
            *there = match motion {
                Motion::Release | Motion::Absent => false,
                Motion::Hold => *there,
                _ => true,
            };
        }
        let [(here, _), (there, _)] = ends;
        if ends.iter().all(|end| end.1) {
            farthest = farthest.max(there - along * here);
        }
    }
    farthest
}

/// A sharp edge.
pub(super) struct Edge {
    /// Places on it, its middle first [mm].
    pub places: [Vec3; 5],
    /// Angle by which the sheet may be bent over it: between the normals of its faces [rad].
    pub turn: f64,
    /// Along it.
    pub along: Vec3,
    /// Square to it and to the tool's direction, from the face that looks towards the sheet to what falls off.
    pub across: Vec3,
}

/// Sharp convex edges between patches near the sheet.
fn edges(tool: &ToolSetup, kept: &[bool]) -> Vec<Edge> {
    let model = tool.surface.model();
    let mut first: HashMap<[u32; 2], (Vec3, Vec3)> = HashMap::new();
    let mut out = Vec::new();
    let near = model.patches.iter().zip(&model.corners).zip(kept).filter(|(_, kept)| **kept);
    for ((patch, ring), _) in near {
        let ids = &ring.vertices;
        let corners = corners(patch);
        let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
        for k in 0..ids.len() {
            let side = SideCurve::new(patch, k);
            let (eta, zeta) = side.parameters(0.5);
            let Some(normal) = patch.normal(eta, zeta) else { continue };
            let (a, b) = (ids[k], ids[(k + 1) % ids.len()]);
            let Some((other, beyond)) = first.insert([a.min(b), a.max(b)], (normal, middle)) else {
                continue;
            };
            let (at, turn) = (side.point(0.5), normal.angle(&other));
            let convex = (middle - at).dot(&other) < 0.0 && (beyond - at).dot(&normal) < 0.0;
            let towards = [normal, other].map(|n| n.dot(&tool.direction));
            if turn > SHARP && convex && towards[0].max(towards[1]) > TOWARDS {
                let Some(along) = unit(side.point(1.0) - side.point(0.0)) else { continue };
                let land = if towards[0] > towards[1] { middle } else { beyond };
                let Some(across) = unit(along.cross(&tool.direction)) else { continue };
                let across = if (land - at).dot(&across) > 0.0 { -across } else { across };
                let places = PLACES.map(|t| side.point(t));
                out.push(Edge { places, turn, along, across });
            }
        }
    }
    out
}
