//! Conservative advancement: points that move along a line towards the surface of a tool.

use crate::numbers::tolerances::ACCURACY_REL;
use kanagata_contact::{Projection, ToolSurface};
use kanagata_geometry::Vec3;

/// Minimum cosine between the direction of a tool and a contact normal; below, the surface is a wall along the
/// direction and makes no contact.
pub(crate) const FACING_COS_MIN: f64 = 0.05;
/// Minimum step along the line over the search radius: features of this size are resolved.
pub(crate) const RESOLUTION_REL: f64 = 0.01;

/// Points on a line from `from` (in the frame of the surface) along the unit vector `along`, up to `length` [mm], with
/// their closest points: distance along the line, closest point. Each step is the current distance from the surface,
/// which no feature can undercut, at least [`RESOLUTION_REL`] times `reach` [mm]. The last point is at `length`.
pub(crate) fn advance(
    surface: &ToolSurface,
    from: &Vec3,
    along: &Vec3,
    [length, reach]: [f64; 2],
) -> impl Iterator<Item = (f64, Projection)> {
    let mut next = Some(0.0);
    std::iter::from_fn(move || {
        let distance: f64 = next?;
        let at = from + along * distance;
        let foot = surface.within(&at, None, length - distance + reach);
        let clear = if foot.gap.is_finite() { (at - foot.point).norm() } else { f64::INFINITY };
        let step = clear.max(RESOLUTION_REL * reach);
        next = (distance < length).then(|| (distance + step).min(length));
        Some((distance, foot))
    })
}

/// Distance along the unit vector `along` [mm] that a surface travels until it meets `place` (in the frame of the
/// surface) with a normal that satisfies `pushes`; `None` beyond `distance_max` [mm].
pub(crate) fn distance_along(
    surface: &ToolSurface,
    place: &Vec3,
    along: &Vec3,
    [distance_max, reach]: [f64; 2],
    pushes: impl Fn(&Vec3) -> bool,
) -> Option<f64> {
    if distance_max < 0.0 {
        return None;
    }
    advance(surface, place, &-along, [distance_max, reach]).find_map(|(distance, foot)| {
        let (on_it, facing) = (foot.gap <= ACCURACY_REL * reach, foot.normal.dot(along));
        let meets = on_it && !foot.past_border && facing > FACING_COS_MIN && pushes(&foot.normal);
        meets.then(|| distance + foot.gap / facing)
    })
}
