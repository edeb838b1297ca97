//! Tools that clamp: another stands before them with room for the sheet alone, and nothing takes the sheet past them. It does not
//! bend over what lies behind their faces with nothing before it, the radii and walls of a holder's opening; what an anvil stands
//! before is another matter, as a coin is pressed into it.

use super::curvature::corners;
use super::sharp::Opposite;
use crate::contact::Projection;
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::solver::{Motion, SimulationSetup, ToolSetup};
use crate::tool::Patch;

/// Room between the front of a tool and one that stands opposite, over the sheet's thickness, at most.
const ROOM: f64 = 1.5;
/// Share of a tool's direction in the normal of a face of its front.
const FRONT: f64 = 0.9;
/// Share of the direction in the normal of a face that a sheet is pressed into a recess by.
const ANVIL: f64 = 0.95;
/// What counts as the same place, over the sheet's thickness.
const SAME: f64 = 1e-3;
/// Parameters of the places on a patch that are looked at.
const PLACES: [f64; 3] = [0.2, 0.5, 0.8];

/// Whether a force or a spring drives a tool in some stage.
pub(super) fn is_forced(setup: &SimulationSetup, tool: usize) -> bool {
    let by_force = |m: &Motion| matches!(m, Motion::Force(_) | Motion::Spring { .. });
    setup.stages.iter().any(|stage| by_force(&stage.motions[tool]))
}

/// The tools on the sheet's other side.
pub(super) fn others(setup: &SimulationSetup, tool: usize) -> impl Iterator<Item = usize> + '_ {
    let side = setup.tools[tool].side;
    (0..setup.tools.len()).filter(move |&other| other != tool && setup.tools[other].side != side)
}

/// Whether most of a tool's front has another tool before it, with no more room than the sheet takes: it cannot go on, however
/// hard it pushes. `kept`: its patches that the sheet may come near.
pub(super) fn stands_before(
    setup: &SimulationSetup,
    other: usize,
    tool: usize,
    kept: &[bool],
) -> bool {
    let (own, other) = (&setup.tools[tool], &setup.tools[other]);
    let near = own.surface.model().patches.iter().zip(kept).filter(|(_, kept)| **kept);
    let places: Vec<(Vec3, f64)> = near
        .flat_map(|(patch, _)| front_of(patch, &own.direction))
        .map(|(x, area)| (x + own.offset, area))
        .collect();
    let along = |place: &(Vec3, f64)| place.0.dot(&own.direction);
    let front = places.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    let thickness = setup.body.mesh().mean_thickness();
    let (points, areas): (Vec<Vec3>, Vec<f64>) = places
        .iter()
        .filter(|place| front - along(place) < 0.5 * thickness)
        .map(|(x, area)| (x - other.offset, *area))
        .unzip();
    let feet = other.surface.closest_of_all(&points, &[]);
    let meets = |foot: &Projection| {
        let turned = foot.normal.dot(&own.direction) < -FRONT;
        turned && !foot.past_border && foot.gap.abs() <= ROOM * thickness
    };
    let met: f64 = feet.iter().zip(&areas).filter(|(f, _)| meets(f)).map(|(_, area)| area).sum();
    met > 0.5 * areas.iter().sum::<f64>()
}

/// Places on a patch where it looks along a direction, each with its share of the area [mm²].
fn front_of(patch: &Patch, direction: &Vec3) -> Vec<(Vec3, f64)> {
    let area = patch.area_vector().norm() / (PLACES.len() * PLACES.len()) as f64;
    let pairs = PLACES.into_iter().flat_map(|a| PLACES.map(|b| (a, b)));
    let inside = pairs.filter(|(eta, zeta)| patch.sides() == 4 || zeta < eta);
    let looks = |&(eta, zeta): &(f64, f64)| {
        patch.normal(eta, zeta).is_some_and(|normal| normal.dot(direction) > FRONT)
    };
    inside.filter(looks).map(|(eta, zeta)| (patch.derivs(eta, zeta).s, area)).collect()
}

/// Tells the patches of a tool that the sheet does not bend over.
pub(super) struct Clamping<'a> {
    tool: &'a ToolSetup,
    /// Those on the sheet's other side.
    others: Vec<&'a ToolSetup>,
    /// The sheet's least place along the direction of a tool that clamps [mm]; `None` of one that does not.
    sheet: Option<f64>,
    /// Of the sheet [mm].
    thickness: f64,
}

impl<'a> Clamping<'a> {
    /// `kept`: the tool's patches that the sheet may come near.
    pub(super) fn new(
        setup: &'a SimulationSetup,
        tool: usize,
        kept: &[bool],
        opposite: &Opposite<'_>,
    ) -> Self {
        let own = &setup.tools[tool];
        let clamps = opposite.is_idle()
            && setup.loads.iter().all(|&force| force == 0.0)
            && !others(setup, tool).any(|other| is_forced(setup, other))
            && others(setup, tool).any(|other| stands_before(setup, other, tool, kept));
        let along = setup.body.mesh().nodes.iter().map(|x| x.dot(&own.direction));
        let sheet = clamps.then(|| along.fold(f64::INFINITY, f64::min));
        let others = others(setup, tool).map(|other| &setup.tools[other]).collect();
        Self { tool: own, others, sheet, thickness: setup.body.mesh().mean_thickness() }
    }

    /// Whether a patch lies behind the sheet that the tool clamps, and no other stands before it.
    pub(super) fn is_behind(&self, patch: &Patch) -> bool {
        let behind = |(x, _): &(Vec3, Vec3)| {
            let along = (x + self.tool.offset).dot(&self.tool.direction);
            self.sheet.is_some_and(|sheet| along <= sheet + SAME * self.thickness)
        };
        let corners = corners(patch);
        corners.iter().all(behind) && !self.others.iter().any(|other| self.faces(other, &corners))
    }

    /// Whether a tool stands before the place of the sheet on the middle of a patch.
    fn faces(&self, other: &ToolSetup, corners: &[(Vec3, Vec3)]) -> bool {
        let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
        let out = unit(corners.iter().map(|c| c.1).sum::<Vec3>()).unwrap_or_default();
        let at = middle + out * self.thickness + self.tool.offset - other.offset;
        let foot = other.surface.closest(&at, None);
        // What lies beside an edge is not before a face.
        let beside = (at - foot.point - foot.normal * foot.gap).norm();
        beside < 0.1 * self.thickness && foot.normal.dot(&self.tool.direction) < -ANVIL
    }
}
