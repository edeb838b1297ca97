//! Sharp edges over which an opposite tool draws the sheet.
//!
//! Contact conditions are at nodes: over an edge the sheet is supported by the two adjacent nodes, and the force drops
//! whenever one of them passes.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use super::curvature::corners;
use super::element_size::Sizes;
use super::finding::Finding;
use super::travel::end_of;
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;
use kanagata_solver::{Motion, SimulationSetup, ToolSetup};
use kanagata_tool::side::SideCurve;

/// Angle between face normals above which an edge is sharp [rad].
pub(super) const SHARP_ANGLE: f64 = 0.5;
/// Smallest cosine between a tool's direction and the normal of a face that points towards the sheet.
const FACING_COS_MIN: f64 = 0.1;
/// Parameters of the points of an edge at which the sheet is searched.
pub(super) const EDGE_PARAMETERS: [f64; 5] = [0.5, 0.25, 0.75, 0.1, 0.9];
/// Elements over 90 degrees with which nodes pass a radius one after the other.
const ELEMENTS_PER_90_DEG: f64 = 2.0;

/// A note on a tool with sharp edges over which the sheet is drawn. `kept`: reachable patches.
pub(super) fn finding(
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
    Some(note(own, edge, at + own.offset, sizes))
}

/// A tool, and the opposite tools that draw the sheet past it.
pub(super) struct Opposite<'a> {
    own: &'a ToolSetup,
    passing: Vec<Passing>,
    /// Largest coordinate of its reachable patches along its direction, in the tool file [mm].
    front: f64,
    sizes: &'a Sizes,
    thickness: f64,
}

impl<'a> Opposite<'a> {
    /// `kept`: reachable patches of the tool.
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
        Self { own, passing: passing_tools(setup, tool), front, sizes, thickness }
    }

    /// Adds force-driven tools, whose travel is unlimited.
    pub(super) fn and_pushed(mut self, setup: &SimulationSetup, tools: &[usize]) -> Self {
        let pushed = tools.iter().map(|&tool| Passing::new(&setup.tools[tool], f64::INFINITY));
        self.passing.extend(pushed);
        self
    }

    /// Whether no opposite tool travels past this one by more than the thickness.
    pub(super) fn is_idle(&self) -> bool {
        self.passing.iter().all(|other| other.far <= self.thickness)
    }

    /// The first point of an edge that the sheet covers and may be drawn over, in the tool file [mm].
    pub(super) fn meets(&self, edge: &Edge) -> Option<Vec3> {
        let own = self.own;
        let met = |at: &&Vec3| {
            let back = self.front - at.dot(&own.direction);
            let at = *at + own.offset;
            // The sheet wraps an edge no farther than the opposite tool travels past it.
            let passed =
                |other: &Passing| back < other.far && other.reaches_past(&at, &edge.across);
            self.sizes.covers(&at, &own.direction) && self.passing.iter().any(passed)
        };
        edge.places.iter().find(met).copied()
    }
}

/// The note on an edge, with the radius that would suffice.
fn note(tool: &ToolSetup, edge: &Edge, at: Vec3, sizes: &Sizes) -> Finding {
    let Edge { turn, along, across, .. } = edge;
    let element = sizes.along(&at, across, along).map_or(sizes.mean, |size| size.length);
    let radius = ELEMENTS_PER_90_DEG * element / FRAC_PI_2;
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

/// An opposite tool that travels past another tool.
struct Passing {
    /// Travel past the other tool, along the other's direction [mm].
    far: f64,
    /// Corners of its patches at its initial position [mm].
    corners: Vec<Vec3>,
}

impl Passing {
    fn new(tool: &ToolSetup, far: f64) -> Self {
        let corners = tool.surface.model().patches.iter().flat_map(corners);
        Self { far, corners: corners.map(|(x, _)| x + tool.offset).collect() }
    }

    /// Whether some of its corners lie beyond a point in the direction `across`.
    fn reaches_past(&self, at: &Vec3, across: &Vec3) -> bool {
        self.corners.iter().any(|x| (x - at).dot(across) > 0.0)
    }
}

/// Opposite tools that travel past this one while both are present.
fn passing_tools(setup: &SimulationSetup, tool: usize) -> Vec<Passing> {
    let own = &setup.tools[tool];
    let opposite = setup.tools.iter().enumerate();
    let opposite = opposite.filter(|&(other, opposite)| other != tool && opposite.side != own.side);
    opposite
        .map(|(other, opposite)| Passing::new(opposite, farthest_past(setup, tool, other)))
        .filter(|passing_tools| passing_tools.far > 0.0)
        .collect()
}

/// Largest travel of another tool past this one while both are present, along this one's direction [mm].
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
    /// Points of the edge, its middle first [mm].
    pub places: [Vec3; 5],
    /// Largest bending angle of the sheet over it: between the normals of its faces [rad].
    pub turn: f64,
    /// Unit vector along the edge.
    pub along: Vec3,
    /// Unit vector normal to the edge and to the tool's direction, from the face towards the sheet to the falling face.
    pub across: Vec3,
}

/// Sharp convex edges between reachable patches.
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
            if turn > SHARP_ANGLE && convex && towards[0].max(towards[1]) > FACING_COS_MIN {
                let Some(along) = unit(side.point(1.0) - side.point(0.0)) else { continue };
                let land = if towards[0] > towards[1] { middle } else { beyond };
                let Some(across) = unit(along.cross(&tool.direction)) else { continue };
                let across = if (land - at).dot(&across) > 0.0 { -across } else { across };
                let places = EDGE_PARAMETERS.map(|t| side.point(t));
                out.push(Edge { places, turn, along, across });
            }
        }
    }
    out
}
