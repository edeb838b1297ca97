//! Parameters along a side of an element, made to fit those of its other sides at seams and poles.

use crate::cad::model::Face;
use crate::convert::searches::SearchedFace;
use crate::geometry::{Vec2, Vec3};

/// Parameters on `face` of points in a row.
pub fn feet(face: SearchedFace<'_>, points: &[Vec3]) -> Vec<Vec2> {
    // Squared distance of points that are on the face [mm^2].
    const ON: f64 = 1e-8;
    let mut last: Option<Vec2> = None;
    let mut feet = Vec::with_capacity(points.len());
    for p in points {
        let near = last.map(|uv| face.closest_near(p, uv, ON));
        let found = near.filter(|n| n.1 <= ON);
        let uv = found.map_or_else(|| face.closest(p).0, |n| n.0);
        feet.push(uv);
        last = Some(uv);
    }
    feet
}

/// Parameter (0 or 1) along which the surface does not move at `uv` (pole).
pub fn collapsed(face: &Face, uv: Vec2) -> Option<usize> {
    let d = face.surface.derivs(uv);
    let [u, v] = face.surface.domain();
    let reach = [d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0])];
    (0..2).find(|&k| reach[k] <= 1e-6 * reach[1 - k])
}

/// Puts the parameters of a side on the same side of a seam as `near`, and gives a pole at one of its ends the
/// parameter that the side has beside it.
pub fn unwrap(face: &Face, feet: &mut [Vec2], near: Vec2) {
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
            let off = uv[k] - near[k];
            if off.abs() > 0.5 * (high - low) {
                uv[k] -= off.signum() * (high - low);
            }
            uv[k] = uv[k].clamp(low, high);
        }
    }
    let last = feet.len() - 1;
    for (end, beside) in [(0, 1), (last, last.saturating_sub(1))] {
        if let Some(k) = collapsed(face, feet[end]) {
            feet[end][k] = feet[beside][k];
        }
    }
}
