//! Signed sines of element corners.

use kanagata_geometry::Vec3;

/// Signed sine of the corner at `at` relative to `normal`.
pub(crate) fn corner_sine(before: &Vec3, at: &Vec3, after: &Vec3, normal: &Vec3) -> f64 {
    sine(&(after - at), &(before - at), normal)
}

/// Signed sine of the corner between the sides `out` and `back` relative to `normal`; -1 where one of them is zero.
pub(super) fn sine(out: &Vec3, back: &Vec3, normal: &Vec3) -> f64 {
    let scale = out.norm() * back.norm() * normal.norm();
    if scale > 0.0 { out.cross(back).dot(normal) / scale } else { -1.0 }
}
