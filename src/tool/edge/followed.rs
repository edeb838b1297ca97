//! Edges that follow a wanted curve, as one through the CAD, and keep their normals.

use super::{
    EdgeCurve, EdgeFault, Kept, OPPOSITE_MEAN_MAX, SINGULAR_VALUE_MIN_REL, check, conditions,
    smallest_solution, uses_difference,
};
use kanagata_geometry::Vec3;

/// The coefficient closest to `wanted` with end tangents perpendicular to the normals. The part of `c` not determined
/// by Eq. 8, along `n0 x n1` (the whole tangent plane for equal normals), is that of `wanted`. Where the normals need too
/// large a change (an inflected edge) only their mean is satisfied; the curve then follows `wanted`, and the fault is
/// reported if its end tangents leave the tangent planes by more than [`OFF_NORMAL_SINE_MAX`].
///
/// The difference of the normals changes `c` along the edge only. Near an inflection it points across the edge (twist),
/// and Eq. 8 would shift the curve sideways by the ratio of two small numbers, which decreases only as the square of
/// the length: as slowly as the sagitta of a chord.
#[must_use]
pub fn nearest_coefficient(d: &Vec3, ends: &[[Vec3; 2]], wanted: &Vec3) -> EdgeCurve {
    let length = d.norm();
    if length == 0.0 {
        return EdgeCurve { c: Vec3::zeros(), fault: Some(EdgeFault::Degenerate) };
    }
    let bent = |kept: Kept| match ends {
        [one] => bent_along(d, one, wanted, kept),
        several => {
            // The rows of the means move the curve across the edge, on which those of the differences depend.
            let first = wanted + smallest_along(d, several, kept, wanted, wanted);
            wanted + smallest_along(d, several, kept, wanted, &first)
        }
    };
    let full = bent(Kept::All);
    // Normals that vary along the edge as those of a parabola need a correction of higher order only.
    let kept = (full - wanted).norm() <= CORRECTION_MAX_REL * length;
    match check(d, &full, ends) {
        None if kept => EdgeCurve { c: bent(Kept::Sound), fault: None },
        fault => {
            let c = bent(Kept::Means);
            match check(d, &c, ends) {
                None if is_off_normals(d, &c, ends) => {
                    EdgeCurve { c, fault: fault.or(Some(EdgeFault::TurnsBack)) }
                }
                None => EdgeCurve { c, fault: None },
                worse => EdgeCurve { c: Vec3::zeros(), fault: fault.or(worse) },
            }
        }
    }
}

/// [`nearest_coefficient`] of a pair of normals: `wanted + alpha nu + beta d`, whose two rows have a closed solution.
fn bent_along(d: &Vec3, [n0, n1]: &[Vec3; 2], wanted: &Vec3, kept: Kept) -> Vec3 {
    let (nu, dl, along) = ((n0 + n1) * 0.5, (n0 - n1) * 0.5, d / d.norm());
    if nu.norm_squared() <= OPPOSITE_MEAN_MAX * OPPOSITE_MEAN_MAX {
        return *wanted;
    }
    let (share, is_used) = (dl.dot(&along), uses_difference(d, [n0, n1], kept));
    let beta = if is_used && share.abs() > SINGULAR_VALUE_MIN_REL * dl.norm() {
        (nu.dot(d) - dl.dot(wanted)) / share
    } else {
        0.0
    };
    let alpha = (dl.dot(d) - nu.dot(wanted) - beta * nu.dot(&along)) / nu.norm_squared();
    wanted + nu * alpha + along * beta
}

/// The smallest change of `wanted` for several pairs of normals. The rows of the differences hold by a change along the
/// edge, with the part of `c` across it as in `like`.
fn smallest_along(d: &Vec3, ends: &[[Vec3; 2]], kept: Kept, wanted: &Vec3, like: &Vec3) -> Vec3 {
    let along = d / d.norm();
    let sideways = like - along * like.dot(&along);
    let by_length = |a: Vec3, b: f64| (along * a.dot(&along), b - a.dot(&sideways));
    smallest_solution(&conditions(d, ends, kept, by_length), wanted)
}

/// Sine of the angle between an end tangent and the tangent plane above which an edge is off its normals: 0.1 degrees, less
/// than the normals of patches differ from those of their faces.
const OFF_NORMAL_SINE_MAX: f64 = 2e-3;

/// Whether an end tangent of the curve leaves the tangent plane of a side.
fn is_off_normals(d: &Vec3, c: &Vec3, ends: &[[Vec3; 2]]) -> bool {
    let leaves =
        |tangent: Vec3, n: &Vec3| tangent.dot(n).abs() > OFF_NORMAL_SINE_MAX * tangent.norm();
    ends.iter().any(|[n0, n1]| leaves(d - c, n0) || leaves(d + c, n1))
}

/// Largest correction of a wanted coefficient relative to the edge length; inflected edges need more.
const CORRECTION_MAX_REL: f64 = 0.2;
