//! Faces of a tool where it is cut off at a symmetry plane: they touch nothing, as the tool goes on beyond it. To a node on the plane
//! that has come into the tool by rounding they are the nearest of all, and would let it pass.

use std::sync::Arc;

use super::types::{Scene, SymmetryPlane};
use crate::contact::ToolSurface;
use crate::geometry::{Aabb, Vec3};
use crate::solver::blank::HexMesh;

/// A face that is farther from the plane than this share of the sheet's thickness, or less flat, is none of a cut in it.
const FLAT: f64 = 0.01;
/// Cosine of the angle between a face beyond the plane and the plane from which on it is a cut.
const ALONG: f64 = 0.999;

/// Symmetry planes, as a tool meets them.
pub(super) struct Planes {
    /// Axis of each, its place there [mm], and on which side of it the sheet is.
    planes: Vec<(usize, f64, f64)>,
    near: f64,
}

impl Planes {
    pub(super) fn of(scene: &Scene, mesh: &HexMesh) -> Self {
        let middle = Aabb::of_points(&mesh.nodes).center();
        let plane = |p: &SymmetryPlane| {
            let axis = p.normal.index();
            (axis, p.at_mm, (middle[axis] - p.at_mm).signum())
        };
        let planes = scene.symmetry.iter().map(plane).collect();
        Self { planes, near: FLAT * mesh.mean_thickness() }
    }

    /// The surface of a tool at `offset` [mm] without its faces in these planes, or flat ones beyond them that look away from the
    /// sheet; as it is where it has none or nothing else.
    pub(super) fn without_cuts(
        &self,
        surface: &Arc<ToolSurface>,
        offset: &Vec3,
    ) -> Arc<ToolSurface> {
        let bounds = surface.patch_bounds();
        let patches = surface.model().patches.iter().zip(&bounds);
        let kept: Vec<bool> = patches
            .map(|(patch, bounds)| {
                let normal = patch.normal(0.5, 0.25).unwrap_or_default();
                !self.planes.iter().any(|plane| self.cuts(*plane, bounds, &normal, offset))
            })
            .collect();
        if kept.iter().all(|kept| *kept) || !kept.contains(&true) {
            return surface.clone();
        }
        Arc::new(surface.keeping(&kept))
    }

    fn cuts(
        &self,
        (axis, at, side): (usize, f64, f64),
        patch: &Aabb,
        normal: &Vec3,
        offset: &Vec3,
    ) -> bool {
        let inwards = [patch.min, patch.max].map(|x| side * (x[axis] + offset[axis] - at));
        let [far, least] = [inwards[0].max(inwards[1]), inwards[0].min(inwards[1])];
        let flat = far - least <= self.near;
        let in_plane = far <= self.near && least >= -self.near;
        flat && (in_plane || far <= self.near && side * normal[axis] <= -ALONG)
    }
}
