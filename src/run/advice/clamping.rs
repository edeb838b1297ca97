//! Clamping tools. A tool clamps if another one opposes it with a clearance of about the thickness and no tool draws the
//! sheet past both.
//!
//! The sheet does not bend over surfaces behind the clamping faces that no tool opposes, for example radii and walls of
//! a holder's opening. Surfaces opposed by an anvil are kept: a sheet is coined into them.

use super::curvature::corners;
use super::sharp_edge::Opposite;
use crate::holding::lower_faces;
use kanagata_contact::Projection;
use kanagata_geometry::frame::unit;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_solver::{Motion, SimulationSetup, ToolSetup};
use kanagata_tool::Patch;

/// Largest clearance between the front of a tool and the opposing tool, over the thickness of the sheet.
const CLEARANCE_MAX_REL: f64 = 1.5;
/// Smallest cosine between a tool's direction and the normal of a face of its front.
const FRONT_COS_MIN: f64 = 0.9;
/// Largest number of columns of the blank at which a front is examined; more are thinned out evenly.
const COLUMNS_MAX: usize = 4096;
/// Smallest cosine between the direction and the normal of a face that presses the sheet into a recess.
const ANVIL_COS_MIN: f64 = 0.95;
/// Tolerance of positions over the thickness of the sheet.
const POSITION_TOLERANCE_REL: f64 = 1e-3;
/// Patch parameters at which fronts are sampled.
const SAMPLE_PARAMETERS: [f64; 3] = [0.2, 0.5, 0.8];

/// Whether a force or a spring drives a tool in some stage.
pub(super) fn is_force_driven(setup: &SimulationSetup, tool: usize) -> bool {
    let by_force = |m: &Motion| matches!(m, Motion::Force(_) | Motion::Spring { .. });
    setup.stages.iter().any(|stage| by_force(&stage.motions[tool]))
}

/// The tools on the opposite side of the sheet.
pub(super) fn opposite_tools(
    setup: &SimulationSetup,
    tool: usize,
) -> impl Iterator<Item = usize> + '_ {
    let side = setup.tools[tool].side;
    (0..setup.tools.len()).filter(move |&other| other != tool && setup.tools[other].side != side)
}

/// Whether tool `other` opposes more than half of the front of `tool`, at a clearance of about the thickness: the tool
/// cannot advance at any force. The front over the blank counts; without any, that over the other tool.
pub(super) fn opposes(setup: &SimulationSetup, other: usize, tool: usize) -> bool {
    let (own, other) = (&setup.tools[tool], &setup.tools[other]);
    let thickness = setup.body.mesh().mean_thickness();
    let over_blank = front_over_blank(setup, own);
    let places = if over_blank.is_empty() { front_over_tool(own, other) } else { over_blank };
    let along = |place: &(Vec3, f64)| place.0.dot(&own.direction);
    let front = places.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    let (points, areas): (Vec<Vec3>, Vec<f64>) = places
        .iter()
        .filter(|place| front - along(place) < 0.5 * thickness)
        .map(|(x, area)| (x - other.offset, *area))
        .unzip();
    let feet = other.surface.closest_of_all(&points, &[]);
    let meets = |foot: &Projection| {
        let turned = foot.normal.dot(&own.direction) < -FRONT_COS_MIN;
        turned && !foot.past_border && foot.gap.abs() <= CLEARANCE_MAX_REL * thickness
    };
    let met: f64 = feet.iter().zip(&areas).filter(|(f, _)| meets(f)).map(|(_, area)| area).sum();
    met > 0.5 * areas.iter().sum::<f64>()
}

/// Points of the front of a tool over the columns of the blank, at most [`COLUMNS_MAX`] of them, each with the area of the
/// blank that belongs to it [mm, mm²].
fn front_over_blank(setup: &SimulationSetup, own: &ToolSetup) -> Vec<(Vec3, f64)> {
    let mesh = setup.body.mesh();
    let faces = lower_faces(mesh, &mesh.nodes, &own.direction);
    let step = faces.len().div_ceil(COLUMNS_MAX).max(1);
    let faces: Vec<(Vec3, f64)> = faces.into_iter().step_by(step).collect();
    let points: Vec<Vec3> = faces.iter().map(|(x, _)| x - own.offset).collect();
    let feet = own.surface.closest_of_all(&points, &[]);
    let over = feet.iter().zip(&faces).filter_map(|(foot, (_, area))| {
        let looks = foot.normal.dot(&own.direction) > FRONT_COS_MIN;
        (looks && !foot.past_border).then_some((foot.point + own.offset, *area))
    });
    over.collect()
}

/// Sampled points of the front of a tool within the box of another one, seen along the direction of the first; all of them
/// where there are none.
fn front_over_tool(own: &ToolSetup, other: &ToolSetup) -> Vec<(Vec3, f64)> {
    let patches = own.surface.model().patches.iter();
    let all: Vec<(Vec3, f64)> = patches
        .flat_map(|patch| front_samples(patch, &own.direction))
        .map(|(x, area)| (x + own.offset, area))
        .collect();
    let flat = |x: &Vec3| x - own.direction * x.dot(&own.direction);
    let corners = other.surface.bounds().corners().map(|x| flat(&(x + other.offset)));
    let bounds = Aabb::of_points(&corners);
    let is_over = |place: &&(Vec3, f64)| bounds.distance_squared(&flat(&place.0)) == 0.0;
    let over: Vec<(Vec3, f64)> = all.iter().filter(is_over).copied().collect();
    if over.is_empty() { all } else { over }
}

/// Sampled points of a patch whose normal is along `direction`, each with its part of the area [mm²].
fn front_samples(patch: &Patch, direction: &Vec3) -> Vec<(Vec3, f64)> {
    let area =
        patch.area_vector().norm() / (SAMPLE_PARAMETERS.len() * SAMPLE_PARAMETERS.len()) as f64;
    let pairs = SAMPLE_PARAMETERS.into_iter().flat_map(|a| SAMPLE_PARAMETERS.map(|b| (a, b)));
    let inside = pairs.filter(|(eta, zeta)| patch.sides() == 4 || zeta < eta);
    let looks = |&(eta, zeta): &(f64, f64)| {
        patch.normal(eta, zeta).is_some_and(|normal| normal.dot(direction) > FRONT_COS_MIN)
    };
    inside.filter(looks).map(|(eta, zeta)| (patch.derivs(eta, zeta).s, area)).collect()
}

/// Finds the patches of a tool over which the sheet does not bend.
pub(super) struct Clamping<'a> {
    tool: &'a ToolSetup,
    /// Tools on the opposite side of the sheet.
    opposite_tools: Vec<&'a ToolSetup>,
    /// Smallest coordinate of the sheet along the direction of a clamping tool [mm]; `None` for other tools.
    sheet: Option<f64>,
    /// Mean thickness of the sheet [mm].
    thickness: f64,
}

impl<'a> Clamping<'a> {
    pub(super) fn new(setup: &'a SimulationSetup, tool: usize, opposite: &Opposite<'_>) -> Self {
        let own = &setup.tools[tool];
        let clamps = opposite.is_idle()
            && setup.loads.iter().all(|&force| force == 0.0)
            && !opposite_tools(setup, tool).any(|other| is_force_driven(setup, other))
            && opposite_tools(setup, tool).any(|other| opposes(setup, other, tool));
        let along = setup.body.mesh().nodes.iter().map(|x| x.dot(&own.direction));
        let sheet = clamps.then(|| along.fold(f64::INFINITY, f64::min));
        let opposite_tools = opposite_tools(setup, tool).map(|other| &setup.tools[other]).collect();
        Self { tool: own, opposite_tools, sheet, thickness: setup.body.mesh().mean_thickness() }
    }

    /// Whether a patch lies behind the clamped sheet and no tool opposes it.
    pub(super) fn is_behind(&self, patch: &Patch) -> bool {
        let behind = |(x, _): &(Vec3, Vec3)| {
            let along = (x + self.tool.offset).dot(&self.tool.direction);
            self.sheet.is_some_and(|sheet| along <= sheet + POSITION_TOLERANCE_REL * self.thickness)
        };
        let corners = corners(patch);
        corners.iter().all(behind)
            && !self.opposite_tools.iter().any(|other| self.faces(other, &corners))
    }

    /// Whether a tool opposes the sheet at the middle of a patch.
    fn faces(&self, other: &ToolSetup, corners: &[(Vec3, Vec3)]) -> bool {
        let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
        let out = unit(corners.iter().map(|c| c.1).sum::<Vec3>()).unwrap_or_default();
        let at = middle + out * self.thickness + self.tool.offset - other.offset;
        let foot = other.surface.closest(&at, None);
        // A foot point beside an edge does not oppose a face.
        let beside = (at - foot.point - foot.normal * foot.gap).norm();
        beside < 0.1 * self.thickness && foot.normal.dot(&self.tool.direction) < -ANVIL_COS_MIN
    }
}
