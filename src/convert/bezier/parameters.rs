//! Surface parameters along the sides of an element, continuous across seams and defined at poles.

use crate::searches::SearchedFace;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

/// Parameters of the foot points of consecutive points on `face`. Each search starts at the preceding foot point.
pub fn foot_parameters(face: SearchedFace<'_>, points: &[Vec3]) -> Vec<Vec2> {
    // Squared distance up to which a point lies on the face [mm^2].
    const ON_FACE_MAX_MM2: f64 = 1e-8;
    let mut last: Option<Vec2> = None;
    let mut feet = Vec::with_capacity(points.len());
    for p in points {
        let near = last.map(|uv| face.closest_near(p, uv, ON_FACE_MAX_MM2));
        let found = near.filter(|n| n.1 <= ON_FACE_MAX_MM2);
        let uv = found.map_or_else(|| face.closest(p).0, |n| n.0);
        feet.push(uv);
        last = Some(uv);
    }
    feet
}

/// Index of the parameter (0 or 1) whose derivative vanishes at `uv` (pole): its tangent, times the width of the
/// parameter range, is at most 1e-6 of the other one.
pub fn collapsed_parameter(face: &Face, uv: Vec2) -> Option<usize> {
    let d = face.surface.derivs(uv);
    let [u, v] = face.surface.domain();
    let extent = [d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0])];
    (0..2).find(|&k| extent[k] <= 1e-6 * extent[1 - k])
}

/// Shifts the parameters of a side by whole periods to within half a period of `near`. At an end that is a pole, the
/// arbitrary parameter is set to that of the adjacent point.
pub fn unwrap_periods(face: &Face, feet: &mut [Vec2], near: Vec2) {
    let domain = face.surface.domain();
    for k in 0..2 {
        let [low, high] = domain[k];
        let at = |t: f64| {
            let mut uv = near;
            uv[k] = t;
            face.surface.point(uv)
        };
        let mut middle = near;
        middle[k] = 0.5 * (low + high);
        let size = (face.surface.point(middle) - at(low)).norm();
        if (at(low) - at(high)).norm() > 1e-6 * size {
            continue;
        }
        for uv in feet.iter_mut() {
            let distance = uv[k] - near[k];
            if distance.abs() > 0.5 * (high - low) {
                uv[k] -= distance.signum() * (high - low);
            }
            uv[k] = uv[k].clamp(low, high);
        }
    }
    let last = feet.len() - 1;
    for (end, beside) in [(0, 1), (last, last.saturating_sub(1))] {
        if let Some(k) = collapsed_parameter(face, feet[end]) {
            feet[end][k] = feet[beside][k];
        }
    }
}
