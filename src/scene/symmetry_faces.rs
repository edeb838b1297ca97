//! Symmetry faces of a tool: faces where a solid is cut at a symmetry plane.
//!
//! The real tool continues beyond the plane. Symmetry faces touch nothing and must be excluded from the contact search:
//! for a node on the plane that is inside the tool by rounding they are closer than the working face.
//!
//! A patch is a symmetry face if its normal is parallel to the normal of the plane at every sample, and it lies in the
//! plane, or beyond the plane with its normal away from the sheet. Distance alone does not decide: a fine patch of the
//! working face beside the plane is equally close.

use std::sync::Arc;

use super::types::{Scene, SymmetryPlane};
use kanagata_contact::ToolSurface;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_tool::Patch;

/// Distance of a patch in a symmetry plane, over the size of the tool: the precision of mesh files with few digits. With
/// twice the value, slits of a tool beside the plane are closed up to twice that width.
const IN_PLANE_REL: f64 = 1e-5;
/// Smallest cosine between parallel normals (0.26 degrees: facet normals in single precision).
const PARALLEL_COS_MIN: f64 = 0.99999;

/// The symmetry planes of a scene.
pub(super) struct Planes(Vec<Plane>);

/// A symmetry plane: its axis, its coordinate [mm], and the sign of the sheet's side.
struct Plane {
    axis: usize,
    at: f64,
    side: f64,
}

impl Planes {
    pub(super) fn of(scene: &Scene, mesh: &HexMesh) -> Self {
        let middle = Aabb::of_points(&mesh.nodes).center();
        let plane = |p: &SymmetryPlane| {
            let (axis, at) = (p.normal.index(), p.at_mm);
            Plane { axis, at, side: (middle[axis] - at).signum() }
        };
        Self(scene.symmetry.iter().map(plane).collect())
    }

    /// The surface of a tool at `offset` [mm] without its symmetry faces. Unchanged if there are none, or nothing else.
    pub(super) fn without_symmetry_faces(
        &self,
        surface: &Arc<ToolSurface>,
        offset: &Vec3,
    ) -> Arc<ToolSurface> {
        let near = IN_PLANE_REL * surface.bounds().diagonal();
        let bounds = surface.patch_bounds();
        let patches = surface.model().patches.iter().zip(&bounds);
        let is_symmetry_face = |(patch, bounds): (&Patch, &Aabb)| {
            self.0.iter().any(|plane| plane.contains_face(patch, bounds, offset, near))
        };
        let kept: Vec<bool> = patches.map(|patch| !is_symmetry_face(patch)).collect();
        if kept.iter().all(|kept| *kept) || !kept.contains(&true) {
            return surface.clone();
        }
        Arc::new(surface.restricted_to(&kept))
    }
}

impl Plane {
    /// Whether a patch with these bounds is a symmetry face, with the tolerance `near` [mm].
    fn contains_face(&self, patch: &Patch, bounds: &Aabb, offset: &Vec3, near: f64) -> bool {
        let inwards = [bounds.min, bounds.max]
            .map(|x| self.side * (x[self.axis] + offset[self.axis] - self.at));
        let [low, high] = [inwards[0].min(inwards[1]), inwards[0].max(inwards[1])];
        if high > near {
            return false;
        }
        let mut cosines = normals(patch).map(|n| self.side * n[self.axis]).peekable();
        let in_plane = low >= -near;
        cosines.peek().is_some()
            && cosines
                .all(|cosine| if in_plane { cosine.abs() } else { -cosine } >= PARALLEL_COS_MIN)
    }
}

/// Unit normals on a 3 x 3 grid of parameters over a patch.
fn normals(patch: &Patch) -> impl Iterator<Item = Vec3> + '_ {
    let at = |k: usize| [0.0, 0.5, 1.0][k];
    let grid = (0..9).map(move |k| (at(k / 3), at(k % 3)));
    let triangle = patch.sides() == 3;
    grid.filter(move |(eta, zeta)| !triangle || zeta <= eta)
        .filter_map(|(eta, zeta)| patch.normal(eta, zeta))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, plane, revolved};

    fn planes() -> Planes {
        Planes([0, 1].map(|axis| Plane { axis, at: 0.0, side: 1.0 }).into())
    }

    /// Number of patches that remain of a tool.
    fn left(model: kanagata_tool::ToolModel, offset: Vec3) -> usize {
        let surface = Arc::new(ToolSurface::new(model));
        let kept = planes().without_symmetry_faces(&surface, &offset);
        kept.patch_bounds().iter().filter(|b| !b.is_empty()).count()
    }

    #[test]
    fn fine_patches_beside_a_plane_belong_to_the_working_face() {
        for n in [1, 8, 64] {
            let profile = [arc(n, [0.0, 50.0], 50.0, [-FRAC_PI_2, -FRAC_PI_2 + 0.06], 1.0)];
            let cap = revolved("cap", n, FRAC_PI_2, &profile);
            let all = cap.patches.len();
            assert_eq!(left(cap, Vec3::zeros()), all, "{n}");
        }
    }

    /// A wall beside a floor: in the plane, beside it, beyond it, oblique to it, towards the sheet or away from it.
    #[test]
    fn a_wall_is_a_symmetry_face_in_the_plane_or_away_from_the_sheet_beyond_it() {
        let with_wall = |along: Vec3, normal: f64| {
            let mut model = plane("t", Vec3::zeros(), Vec3::x() * 8.0, Vec3::y() * 8.0, Vec3::z());
            let wall = plane("t", Vec3::zeros(), Vec3::y() * 8.0, along, Vec3::x() * normal);
            model.patches.extend(wall.patches);
            model
        };
        let (up, askew) = (Vec3::z() * 6.0, Vec3::new(0.06, 0.0, 6.0));
        for (x, along, normal, expected) in [
            (0.0, up, -1.0, 1),
            (0.0, up, 1.0, 1),
            (1e-5, up, -1.0, 1),
            (2e-3, up, -1.0, 2),
            (-2e-3, up, -1.0, 1),
            (-3.0, up, -1.0, 1),
            (-3.0, up, 1.0, 2),
            (-3.0, askew, -1.0, 2),
        ] {
            let found = left(with_wall(along, normal), Vec3::x() * x);
            assert_eq!(found, expected, "{x} {along:?} {normal}");
        }
    }
}
