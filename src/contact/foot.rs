//! Local geometry at a foot point: unit normal, side or corner, curvature.

use super::projection::Location;
use kanagata_geometry::{Mat3, Vec2, Vec3};
use kanagata_tool::PatchDerivs;

#[inline(always)]
pub(super) fn unit_normal(d: &PatchDerivs) -> Option<Vec3> {
    let n = d.d1.cross(&d.d2);
    let size = n.norm();
    (size > 1e-12 * d.d1.norm() * d.d2.norm() && size > 0.0).then(|| n / size)
}

/// Side or corner of the domain that contains `at` to within rounding, and `at` moved onto it.
#[inline(always)]
pub(super) fn locate(sides: usize, at: Vec2) -> (Location, Vec2) {
    const ON_SIDE_TOLERANCE: f64 = 1e-12;
    let corners: &[(f64, f64)] = &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][..sides];
    for (k, &(eta, zeta)) in corners.iter().enumerate() {
        if (at.x - eta).abs() < ON_SIDE_TOLERANCE && (at.y - zeta).abs() < ON_SIDE_TOLERANCE {
            return (Location::Vertex(k as u8), Vec2::new(eta, zeta));
        }
    }
    if at.y < ON_SIDE_TOLERANCE {
        return (Location::Edge(0), Vec2::new(at.x, 0.0));
    }
    if at.x > 1.0 - ON_SIDE_TOLERANCE {
        return (Location::Edge(1), Vec2::new(1.0, at.y));
    }
    if sides == 3 {
        let mean = 0.5 * (at.x + at.y);
        return if at.x - at.y < ON_SIDE_TOLERANCE {
            (Location::Edge(2), Vec2::new(mean, mean))
        } else {
            (Location::Inside, at)
        };
    }
    if at.y > 1.0 - ON_SIDE_TOLERANCE {
        return (Location::Edge(2), Vec2::new(at.x, 1.0));
    }
    if at.x < ON_SIDE_TOLERANCE {
        (Location::Edge(3), Vec2::new(0.0, at.y))
    } else {
        (Location::Inside, at)
    }
}

/// Curvature tensor `b_ij S^i (x) S^j` from the first and second fundamental forms; zero where the patch is degenerate.
#[inline(always)]
pub(super) fn weingarten(d: &PatchDerivs, n: &Vec3) -> Mat3 {
    let (e, f, g) = (d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared());
    let det = e * g - f * f;
    if det.is_nan() || det <= 1e-20 * e * g {
        return Mat3::zeros();
    }
    let s1 = (d.d1 * g - d.d2 * f) / det;
    let s2 = (d.d2 * e - d.d1 * f) / det;
    let (b11, b12, b22) = (n.dot(&d.d11), n.dot(&d.d12), n.dot(&d.d22));
    let cross = s1 * s2.transpose();
    s1 * s1.transpose() * b11 + (cross + cross.transpose()) * b12 + s2 * s2.transpose() * b22
}
