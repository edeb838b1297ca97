//! The way of a tool to a place of the sheet.

use crate::contact::ToolSurface;
use crate::geometry::Vec3;

/// Least cosine between a tool's way and the normal of what it meets a node with: a wall along the way meets nothing.
pub(in crate::solver) const FACING_COS: f64 = 0.05;
/// Gap at which a place lies on the surface, over the length `reach` of a search.
const TOUCHING_GAP_REL: f64 = 1e-6;
/// Shortest step along a way past a tool, over the reach of the search.
pub(in crate::solver) const LEAST_STEP_REL: f64 = 0.01;

/// How far `place`, in the surface's frame, is from where a surface moved along the unit vector `along` meets it [mm], if that is
/// within `most` [mm], with a normal that `pushes`. The way is gone by the distance that there is from the surface, at least a
/// small share of `reach` [mm].
pub(in crate::solver) fn way_to(
    surface: &ToolSurface,
    place: &Vec3,
    along: &Vec3,
    [most, reach]: [f64; 2],
    pushes: impl Fn(&Vec3) -> bool,
) -> Option<f64> {
    let mut done = 0.0;
    while done <= most {
        let at = place - along * done;
        let foot = surface.within(&at, None, most - done + reach);
        if !foot.gap.is_finite() {
            return None;
        }
        let (on_it, facing) = (foot.gap <= TOUCHING_GAP_REL * reach, foot.normal.dot(along));
        if on_it && !foot.past_border && facing > FACING_COS && pushes(&foot.normal) {
            return Some(done + foot.gap / facing);
        }
        done += (at - foot.point).norm().max(LEAST_STEP_REL * reach);
    }
    None
}
