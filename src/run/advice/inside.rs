//! Tools that stand in the sheet before it is formed.

use super::Remark;
use super::size::Sizes;
use crate::geometry::Vec3;
use crate::solver::{Motion, SimulationSetup};

/// Depth over the thickness that is told: shape errors of tools are less.
const DEEP: f64 = 0.02;
/// How far inside nodes are looked for, over the size of the elements or the thickness.
const REACH: f64 = 5.0;

/// A remark on a tool of the first stage in which the undeformed sheet begins.
pub(super) fn remark(setup: &SimulationSetup, tool: usize, sizes: &Sizes) -> Option<Remark> {
    let own = &setup.tools[tool];
    let first = &setup.stages.first()?.motions[tool];
    if matches!(first, Motion::Absent | Motion::Release) {
        return None;
    }
    let mesh = setup.body.mesh();
    let nodes = own.side.nodes(mesh).into_iter().map(|n| mesh.nodes[n as usize]);
    let thickness = mesh.mean_thickness();
    let reach = REACH * sizes.mean.max(thickness);
    let depth = |x: &Vec3| {
        let foot = own.surface.within(&(x - own.offset), None, reach);
        (!foot.past_border && foot.gap < -DEEP * thickness).then_some(-foot.gap)
    };
    let inside: Vec<(Vec3, f64)> = nodes.filter_map(|x| Some((x, depth(&x)?))).collect();
    let (at, deepest) = inside.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Remark::new(
        format!(
            "{} nodes of the undeformed sheet are inside {}, the deepest by {deepest:.3} mm at ({:.1}, {:.1}, {:.1}) mm",
            inside.len(),
            own.name,
            at.x,
            at.y,
            at.z
        ),
        "they would be pushed out at once in the first increment, which may have no balance; begin clear of the sheet: \"place\": \"touch\", or a `shift` farther back".into(),
    ))
}
