//! Symmetry planes of tools, and tools of revolution about the z axis.

use super::GivenTool;
use super::roles::bounds;
use crate::advice::mirror::is_surface_symmetric;
use kanagata_geometry::{Aabb, Vec3};

/// Tolerance of a symmetry over the size of the tools: sides that are meshed apart differ by their shape error.
const TOLERANCE_REL: f64 = 1e-3;
/// Tolerance of a symmetry over the thickness of the sheet: a bead on one side of a large die is no shape error. Doubled,
/// beads of half the thickness are not seen.
const TOLERANCE_THICKNESS_REL: f64 = 0.25;
/// Patches above which not all are compared.
const COMPARED_MAX: usize = 500;
/// Angles from x to which points of a tool of revolution are turned [rad], within the first quadrant.
const TURNED: [f64; 3] = [0.3, 0.8, 1.3];

/// A plane normal to x (0) or y (1), and the side on which the sheet lies: 1 above the coordinate, -1 below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cut {
    pub(super) axis: usize,
    pub(super) at: f64,
    pub(super) side: f64,
}

/// At most one plane normal to x and one normal to y: where all tools end at 0, or about which all are symmetric.
pub(super) fn cuts(tools: &[GivenTool], thickness: f64) -> Vec<Cut> {
    let all = tools.iter().map(bounds).reduce(|a, b| a.union(&b)).unwrap_or(Aabb::EMPTY);
    let near = (TOLERANCE_REL * all.diagonal()).min(TOLERANCE_THICKNESS_REL * thickness);
    (0..2).filter_map(|axis| cut(tools, &all, axis, near)).collect()
}

fn cut(tools: &[GivenTool], all: &Aabb, axis: usize, near: f64) -> Option<Cut> {
    let end = |of: fn(&Aabb) -> Vec3| tools.iter().all(|tool| of(&bounds(tool))[axis].abs() < near);
    if end(|b| b.min) {
        return Some(Cut { axis, at: 0.0, side: 1.0 });
    }
    if end(|b| b.max) {
        return Some(Cut { axis, at: 0.0, side: -1.0 });
    }
    let middle = all.center()[axis];
    let at = if middle.abs() < near { 0.0 } else { middle };
    let symmetric =
        |tool: &GivenTool| is_surface_symmetric(&tool.surface, (axis, at), near, &|_: &Vec3| true);
    tools.iter().all(symmetric).then_some(Cut { axis, at, side: 1.0 })
}

/// Whether tools are surfaces of revolution about the z axis, as far as the quadrants beyond their cuts show.
pub(super) fn are_of_revolution(tools: &[&GivenTool], cuts: &[Cut]) -> bool {
    let in_quadrant = |p: &Vec3| (0..2).all(|k| p[k] * side(cuts, k) >= 0.0);
    tools.iter().all(|tool| {
        let near = TOLERANCE_REL * bounds(tool).diagonal();
        let patches = &tool.surface.model().patches;
        let every = patches.len().div_ceil(COMPARED_MAX).max(1);
        patches.iter().step_by(every).all(|patch| {
            let p = patch.derivs(0.6, 0.3).s;
            let r = p.x.hypot(p.y);
            let turned = |angle: f64| {
                Vec3::new(side(cuts, 0) * r * angle.cos(), side(cuts, 1) * r * angle.sin(), p.z)
            };
            !in_quadrant(&p)
                || TURNED.iter().all(|&angle| {
                    let image = turned(angle);
                    (tool.surface.closest(&image, None).point - image).norm() <= near
                })
        })
    })
}

/// Side of the z axis on which the sheet lies.
fn side(cuts: &[Cut], axis: usize) -> f64 {
    cuts.iter().find(|cut| cut.axis == axis).map_or(1.0, |cut| cut.side)
}
