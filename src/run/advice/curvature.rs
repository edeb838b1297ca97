//! Principal curvatures of patches from the normals at their corners.

use nalgebra::Matrix2;

use kanagata_geometry::frame::unit;
use kanagata_geometry::{Mat3, Vec3};
use kanagata_tool::Patch;
use kanagata_tool::side::corners as parameters;

/// Angle between normals below which a patch counts as flat [rad].
pub(super) const FLAT_ANGLE: f64 = 1e-3;

/// One principal curvature of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PrincipalCurvature {
    /// Principal direction: unit vector in the mean tangent plane.
    pub direction: Vec3,
    /// Radius of curvature along it [mm]; infinite if flat.
    pub radius: f64,
    /// Extent of the corners along it [mm].
    pub length: f64,
}

impl PrincipalCurvature {
    /// Angle of the normal over the patch [rad].
    pub(super) fn turn(&self) -> f64 {
        2.0 * (0.5 * self.length / self.radius).min(1.0).asin()
    }
}

/// Corners of a patch and their normals; corners without normal are omitted.
pub(super) fn corners(patch: &Patch) -> Vec<(Vec3, Vec3)> {
    let at = |&(eta, zeta): &(f64, f64)| {
        // Slightly inside the patch, because a collapsed corner has no normal.
        let inside = |v: f64, to: f64| v + 1e-6 * (to - v);
        let normal = patch.normal(inside(eta, 0.6), inside(zeta, 0.4))?;
        Some((patch.derivs(eta, zeta).s, normal))
    };
    parameters(patch.sides()).iter().filter_map(at).collect()
}

/// Mean of the corners [mm] and the two principal curvatures, the larger first.
///
/// They are the eigenvalues of the symmetric 2x2 shape operator that fits, in the least-squares sense, the changes of
/// the normal along the sides. `None` if the corners are collinear.
pub(super) fn principal_curvatures(
    corners: &[(Vec3, Vec3)],
) -> Option<(Vec3, [PrincipalCurvature; 2])> {
    let middle = corners.iter().map(|c| c.0).sum::<Vec3>() / corners.len().max(1) as f64;
    let normal = unit(corners.iter().map(|c| c.1).sum::<Vec3>())?;
    let e1 = unit(normal.cross(&Vec3::ith(normal.iamin(), 1.0)))?;
    let e2 = normal.cross(&e1);
    let (mut map, mut right) = (Mat3::zeros(), Vec3::zeros());
    for (k, (a, na)) in corners.iter().enumerate() {
        let (b, nb) = corners[(k + 1) % corners.len()];
        let (chord, change) = (b - a, nb - na);
        let (x, y) = (chord.dot(&e1), chord.dot(&e2));
        for (row, wanted) in
            [(Vec3::new(x, y, 0.0), change.dot(&e1)), (Vec3::new(0.0, x, y), change.dot(&e2))]
        {
            map += row * row.transpose();
            right += row * wanted;
        }
    }
    // Collinear sides do not determine the curvature across them.
    if map.determinant() <= 1e-18 * (map.trace() / 3.0).powi(3) {
        return None;
    }
    let s = map.lu().solve(&right)?;
    let eigen = Matrix2::new(s.x, s.y, s.y, s.z).symmetric_eigen();
    let bend = |k: usize| {
        let v = eigen.eigenvectors.column(k);
        let direction = e1 * v[0] + e2 * v[1];
        let along = corners.iter().map(|c| c.0.dot(&direction));
        let (low, high) = along
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        PrincipalCurvature {
            direction,
            radius: 1.0 / eigen.eigenvalues[k].abs(),
            length: high - low,
        }
    };
    let (a, b) = (bend(0), bend(1));
    Some((middle, if a.radius <= b.radius { [a, b] } else { [b, a] }))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::test_tools::{arc, plane, revolved};

    #[test]
    fn balls_and_planes_have_their_curvatures() {
        let ball =
            revolved("ball", 4, FRAC_PI_2, &[arc(6, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)]);
        for patch in &ball.patches {
            let (_, found) = principal_curvatures(&corners(patch)).unwrap();
            for bend in found {
                assert!((bend.radius - 7.0).abs() < 0.1, "{bend:?}");
                assert!(bend.turn() > 0.02 && bend.turn() < 0.45, "{bend:?}");
            }
        }
        let flat = plane("p", Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let (at, found) = principal_curvatures(&corners(&flat.patches[0])).unwrap();
        assert_eq!(at, Vec3::new(0.5, 0.5, 0.0));
        assert!(found.iter().all(|b| b.turn() < FLAT_ANGLE && (b.length - 1.0).abs() < 0.5));
    }

    /// A cylinder of radius 3 about y; the sides of its patch are oblique to the axis.
    #[test]
    fn the_direction_of_a_cylinder_is_found_from_sides_askew() {
        let at = |angle: f64, y: f64| {
            let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
            (normal * 3.0 + Vec3::y() * y, normal)
        };
        let corners = [at(-0.3, 0.0), at(0.2, 1.0), at(0.5, 6.0), at(0.0, 5.0)];
        let (_, [larger, smaller]) = principal_curvatures(&corners).unwrap();
        assert!(
            (larger.radius - 3.0).abs() < 0.05 && smaller.radius > 100.0,
            "{larger:?} {smaller:?}"
        );
        assert!(larger.direction.y.abs() < 0.05, "{larger:?}");
        // 0.8 rad between corners.
        assert!((larger.turn() - 0.8).abs() < 0.03, "{}", larger.turn());
    }
}
