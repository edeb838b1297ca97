//! Sides of patches at edges, and points along them.

use super::sample::patch_normal;
use kanagata_geometry::Vec3;
use kanagata_tool::Patch;
use kanagata_tool::side::corners;

/// A side of a patch at an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub patch: usize,
    pub side: usize,
    /// The side runs from the higher corner of the edge to the lower one.
    pub reversed: bool,
}

/// Point and normal of a patch at the fraction `t` of an edge.
pub(super) fn on_side(patch: &Patch, side: Side, t: f64) -> (Vec3, Option<Vec3>) {
    let c = corners(patch.sides());
    let (a, b) = (c[side.side], c[(side.side + 1) % c.len()]);
    let t = if side.reversed { 1.0 - t } else { t };
    let (eta, zeta) = (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
    let d = patch.derivs(eta, zeta);
    (d.s, patch_normal(&d))
}
