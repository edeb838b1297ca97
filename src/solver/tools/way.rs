//! Distance of a tool from a point of the sheet along its direction.

use crate::contact::ToolSurface;
use crate::geometry::Vec3;

/// Minimum cosine between the direction of a tool and a contact normal; below, the surface is a wall along the
/// direction and makes no contact.
pub(in crate::solver) const FACING_COS_MIN: f64 = 0.05;
/// Gap over the search radius `reach` below which a point lies on the surface.
const TOUCHING_GAP_REL: f64 = 1e-6;
/// Minimum step along the direction over the search radius.
pub(in crate::solver) const STEP_MIN_REL: f64 = 0.01;

/// Distance along the unit vector `along` [mm] that a surface travels until it meets `place` (in the frame of the
/// surface) with a normal that satisfies `pushes`; `None` beyond `distance_max` [mm]. Sphere tracing: each step is the
/// current distance, at least [`STEP_MIN_REL`] times `reach`.
pub(in crate::solver) fn distance_along(
    surface: &ToolSurface,
    place: &Vec3,
    along: &Vec3,
    [distance_max, reach]: [f64; 2],
    pushes: impl Fn(&Vec3) -> bool,
) -> Option<f64> {
    let mut distance = 0.0;
    while distance <= distance_max {
        let at = place - along * distance;
        let foot = surface.within(&at, None, distance_max - distance + reach);
        if !foot.gap.is_finite() {
            return None;
        }
        let (on_it, facing) = (foot.gap <= TOUCHING_GAP_REL * reach, foot.normal.dot(along));
        if on_it && !foot.past_border && facing > FACING_COS_MIN && pushes(&foot.normal) {
            return Some(distance + foot.gap / facing);
        }
        distance += (at - foot.point).norm().max(STEP_MIN_REL * reach);
    }
    None
}
