//! Images of surfaces at symmetry planes.

use kanagata_contact::ToolSurface;
use kanagata_geometry::Vec3;

/// Largest number of patches whose image is computed.
const SAMPLED_PATCHES_MAX: usize = 2000;

/// Whether the images of points of a surface at a plane normal to `axis` lie within `near` [mm] of it. Points for which
/// `over` is false are not compared.
pub(crate) fn is_surface_symmetric(
    surface: &ToolSurface,
    (axis, at): (usize, f64),
    near: f64,
    over: &dyn Fn(&Vec3) -> bool,
) -> bool {
    let patches = &surface.model().patches;
    let every = patches.len().div_ceil(SAMPLED_PATCHES_MAX).max(1);
    let places = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.6, 0.3)];
    patches.iter().step_by(every).all(|patch| {
        places.iter().all(|&(eta, zeta)| {
            let mut image = patch.derivs(eta, zeta).s;
            if !over(&image) {
                return true;
            }
            image[axis] = 2.0 * at - image[axis];
            let foot = surface.closest(&image, None);
            (foot.point - image).norm() <= near
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_tools::plane;

    #[test]
    fn points_that_are_left_out_need_no_image() {
        let flat = plane("t", -Vec3::x(), Vec3::x() * 4.0, Vec3::y(), Vec3::z());
        let surface = ToolSurface::new(flat);
        let of =
            |over: &dyn Fn(&Vec3) -> bool| is_surface_symmetric(&surface, (0, 0.0), 1e-6, over);
        assert!(!of(&|_| true));
        assert!(of(&|p| p.x < 1.0 + 1e-9));
    }
}
