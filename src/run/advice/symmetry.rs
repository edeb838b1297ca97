//! Symmetry planes: unused, missing, or declared where sheet, material or tools are not symmetric.

use rustc_hash::FxHashMap;

use super::element_size::EVERYWHERE;
use super::finding::Finding;
use super::mirror::is_surface_symmetric;
use crate::cost::{Cost, TIME_EXPONENT};
use kanagata_geometry::{Aabb, Vec3};
use kanagata_report::doubt::DoubtCode;
use kanagata_scene::Plan;
use kanagata_scene::types::BlankShape;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{SimulationSetup, ToolSetup};

/// Tolerance of symmetric positions over the size of the sheet: of nodes, and of tools.
const SHEET_TOLERANCE_REL: f64 = 1e-6;
const TOOL_TOLERANCE_REL: f64 = 1e-5;
/// Tolerance of a tool's symmetry about a declared plane: meshed sides may differ by their shape error.
const DECLARED_PLANE_TOLERANCE_REL: f64 = 1e-3;
/// A note for x and for y if the plane through the middle of the sheet is a symmetry plane of sheet, supports, loads and
/// tools.
pub(super) fn unused(plan: &Plan, setup: &SimulationSetup, cost: &Cost) -> Vec<Finding> {
    let sheet = Aabb::of_points(&setup.body.mesh().nodes);
    let found: Vec<usize> = (0..2)
        .filter(|&axis| {
            let used = plan.scene.symmetry.iter().any(|p| p.normal.index() == axis);
            !used && is_symmetric(plan, setup, axis, sheet.center()[axis])
        })
        .collect();
    let name = |axis: usize| ["x", "y"][axis];
    let finding = |&axis: &usize| {
        let at = sheet.center()[axis];
        let half = halved(setup.body.mesh(), axis, at, SHEET_TOLERANCE_REL * sheet.diagonal())?;
        let share = half as f64 / (3 * setup.body.mesh().nodes.len()).max(1) as f64;
        let half = share * cost.unknowns as f64;
        Some(Finding::note(
            format!(
                "sheet and tools are symmetric about {} = {at:.4} mm, and both halves are modelled",
                name(axis)
            ),
            format!(
                "half the sheet and a symmetry plane there have {half:.0} unknowns and take about {}",
                cost.times(share.powf(TIME_EXPONENT))
            ),
        ))
    };
    found.iter().filter_map(finding).collect()
}

/// Doubts about straight sides of the blank normal to x or y that look like symmetry cuts without a declared plane. A
/// side is such a cut if all tools end there or are symmetric about it, or if the blank is a quarter disc.
pub(super) fn missing(plan: &Plan, setup: &SimulationSetup) -> Vec<Finding> {
    let nodes = &setup.body.mesh().nodes;
    let sheet = Aabb::of_points(nodes);
    let size = sheet.diagonal();
    let quarter = matches!(plan.scene.blank.shape, BlankShape::QuarterDisc { .. });
    let mut out = Vec::new();
    for axis in 0..2 {
        let ends = [sheet.min[axis], sheet.max[axis]];
        let cut = ends.map(|at| is_cut(setup, axis, at, size));
        for (k, at) in ends.into_iter().enumerate() {
            // Tools as wide as the sheet end at both sides of a whole sheet.
            let seems = (cut[k] && !cut[1 - k]) || (quarter && k == 0);
            if !seems || !is_straight_and_free(setup, axis, at, SHEET_TOLERANCE_REL * size) {
                continue;
            }
            let name = ["x", "y"][axis];
            out.push(Finding::doubt(
                DoubtCode::SymmetryMissing,
                format!("{name} = {at} mm"),
                format!(
                    "The blank has a straight free side at {name} = {at:.4} mm where {}, and no symmetry plane is declared there: the cut side is free, and forces are those of the part.",
                    if quarter { "a quarter disc is cut" } else { "all tools end or are symmetric" }
                ),
                format!("Declare `symmetry`: {{\"normal\": \"{name}\", \"at_mm\": {at}}}, or model the whole sheet."),
            ));
        }
    }
    out
}

/// Whether all tools end at a plane or are symmetric about it.
fn is_cut(setup: &SimulationSetup, axis: usize, at: f64, size: f64) -> bool {
    let near = DECLARED_PLANE_TOLERANCE_REL * size;
    let cut = |tool: &ToolSetup| {
        let bounds = tool.surface.bounds();
        let ends = [bounds.min, bounds.max].map(|end| (end + tool.offset)[axis]);
        ends.iter().any(|end| (end - at).abs() < near)
            || (ends[0] < at - near
                && ends[1] > at + near
                && is_tool_symmetric(tool, axis, at, near, &EVERYWHERE))
    };
    !setup.tools.is_empty() && setup.tools.iter().all(cut)
}

/// Whether the side of the sheet at a plane is straight and mostly free. It must be longer than a corner, and less than
/// half of its nodes may be constrained across the plane (a clamped rim constrains some).
fn is_straight_and_free(setup: &SimulationSetup, axis: usize, at: f64, near: f64) -> bool {
    /// Smallest length of the side over the extent of the sheet along it.
    const SIDE_LENGTH_MIN_REL: f64 = 0.25;
    let nodes = &setup.body.mesh().nodes;
    let on: Vec<usize> = (0..nodes.len()).filter(|&n| (nodes[n][axis] - at).abs() < near).collect();
    let along = 1 - axis;
    let extent = |bounds: &Aabb| (bounds.max - bounds.min)[along];
    let side = Aabb::of_points(on.iter().map(|&n| &nodes[n]));
    !on.is_empty()
        && extent(&side) > SIDE_LENGTH_MIN_REL * extent(&Aabb::of_points(nodes))
        && 2 * on.iter().filter(|&&node| setup.constraints.is_held(node, axis)).count() < on.len()
}

/// Region of the model: unbounded except by symmetry planes, on the sheet's side of them.
pub(super) fn modelled_region(plan: &Plan, setup: &SimulationSetup) -> Aabb {
    let sheet = Aabb::of_points(&setup.body.mesh().nodes);
    let mut out = EVERYWHERE;
    for plane in &plan.scene.symmetry {
        let (axis, at) = (plane.normal.index(), plane.at_mm);
        let near = 1e-3 * sheet.diagonal();
        if sheet.center()[axis] > at {
            out.min[axis] = at - near;
        } else {
            out.max[axis] = at + near;
        }
    }
    out
}

/// Doubts about declared symmetry planes about which the material is not symmetric.
pub(super) fn oblique_rolling(plan: &Plan) -> Vec<Finding> {
    let planes = plan.scene.symmetry.iter().map(|plane| (plane.normal.index(), plane.at_mm));
    let oblique_rolling =
        planes.filter(|&(axis, _)| axis < 2 && !is_material_symmetric(plan, axis));
    let finding = |(axis, at)| {
        let name = ["x", "y", "z"][axis];
        Finding::doubt(
            DoubtCode::SymmetryWrong,
            format!("{name} = {at} mm"),
            format!(
                "The rolling direction is askew to the symmetry plane {name} = {at:.4} mm: results are those of a sheet whose rolling direction changes at the plane."
            ),
            "Model both halves, or turn the rolling direction along or across the plane.".into(),
        )
    };
    oblique_rolling.map(finding).collect()
}

/// The box of the sheet mirrored at a plane.
fn mirrored(sheet: &Aabb, axis: usize, at: f64) -> Aabb {
    let mut out = *sheet;
    out.min[axis] = 2.0 * at - sheet.max[axis];
    out.max[axis] = 2.0 * at - sheet.min[axis];
    out
}

/// Doubts about declared symmetry planes about which tools are not symmetric. A tool of the faces that the sheet can touch
/// ends anywhere on the far side: what is there of it must be an image of what is over the sheet.
pub(super) fn asymmetric_tools(plan: &Plan, setup: &SimulationSetup) -> Vec<Finding> {
    let sheet = Aabb::of_points(&setup.body.mesh().nodes);
    let size = sheet.diagonal();
    let mut out = Vec::new();
    for plane in &plan.scene.symmetry {
        let (axis, at) = (plane.normal.index(), plane.at_mm);
        let name = ["x", "y", "z"][axis];
        let far = mirrored(&sheet, axis, at);
        let both = sheet.union(&far);
        for (tool, planned) in setup.tools.iter().zip(&plan.tools) {
            let part = if planned.reachable_only { &far } else { &both };
            let bounds = tool.surface.bounds();
            let beyond =
                [at - (bounds.min + tool.offset)[axis], (bounds.max + tool.offset)[axis] - at];
            let whole = beyond.iter().all(|beyond| *beyond > 0.1 * size);
            if whole
                && !is_tool_symmetric(tool, axis, at, DECLARED_PLANE_TOLERANCE_REL * size, part)
            {
                out.push(Finding::doubt(
                    DoubtCode::SymmetryWrong,
                    format!("{}, {name} = {at} mm", tool.name),
                    format!(
                        "{} extends beyond the symmetry plane {name} = {at:.4} mm and is not symmetric about it.",
                        tool.name
                    ),
                    "The far side is taken to be the image of the modelled side. Model both halves, or centre the tool on the plane.".into(),
                ));
            }
        }
    }
    out
}

/// Unknowns of the half of the sheet below the plane, including nodes on it. `None` if an element crosses the plane (an
/// odd number of elements).
fn halved(mesh: &HexMesh, axis: usize, at: f64, near: f64) -> Option<usize> {
    let beside = |n: &u32| mesh.nodes[*n as usize][axis] - at;
    let across =
        |e: &[u32; 8]| e.iter().any(|n| beside(n) > near) && e.iter().any(|n| beside(n) < -near);
    let whole = !mesh.elements.iter().any(across);
    whole.then(|| 3 * mesh.nodes.iter().filter(|x| x[axis] - at <= near).count())
}

fn is_symmetric(plan: &Plan, setup: &SimulationSetup, axis: usize, at: f64) -> bool {
    let size = Aabb::of_points(&setup.body.mesh().nodes).diagonal();
    let moves_across = |t: &ToolSetup| t.direction[axis].abs() > 1e-9;
    if !is_material_symmetric(plan, axis) || setup.tools.iter().any(moves_across) {
        return false;
    }
    is_sheet_symmetric(setup, axis, at, SHEET_TOLERANCE_REL * size)
        && setup
            .tools
            .iter()
            .all(|t| is_tool_symmetric(t, axis, at, TOOL_TOLERANCE_REL * size, &EVERYWHERE))
}

/// Whether the material is symmetric: the rolling direction is along or across the axis, or the material is isotropic.
fn is_material_symmetric(plan: &Plan, axis: usize) -> bool {
    const ROLLING_TOLERANCE: f64 = 1e-9;
    if plan.card.is_isotropic().unwrap_or(false) {
        return true;
    }
    let blank = &plan.scene.blank;
    match blank.rolling_direction.map(Vec3::from) {
        Some(vector) => {
            let across = Vec3::ith(axis, vector[axis]);
            [across, vector - across]
                .iter()
                .any(|part| part.norm() < ROLLING_TOLERANCE * vector.norm())
        }
        None => {
            let angle = blank.rolling_direction_deg / 90.0;
            (angle - angle.round()).abs() < ROLLING_TOLERANCE
        }
    }
}

/// Whether every node has an image with the same constraints and the mirrored load.
fn is_sheet_symmetric(setup: &SimulationSetup, axis: usize, at: f64, near: f64) -> bool {
    let nodes = &setup.body.mesh().nodes;
    // Cells are twice the tolerance wide: an image lies in its own cell or a neighbour.
    let cell = |x: &Vec3| [0, 1, 2].map(|k| (x[k] / (2.0 * near)).floor() as i64);
    let mut by_cell: FxHashMap<[i64; 3], usize> = FxHashMap::default();
    by_cell.reserve(nodes.len());
    for (n, x) in nodes.iter().enumerate() {
        by_cell.insert(cell(x), n);
    }
    let image_of = |x: &Vec3| -> Option<usize> {
        let mut image = *x;
        image[axis] = 2.0 * at - x[axis];
        let key = cell(&image);
        // Its own cell first, which contains most images.
        const OWN_CELL: i64 = 13;
        std::iter::once(OWN_CELL).chain((0..27).filter(|k| *k != OWN_CELL)).find_map(|k| {
            let shift = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            let beside = [0, 1, 2].map(|i| key[i].saturating_add(shift[i]));
            by_cell.get(&beside).copied().filter(|&n| (nodes[n] - image).norm() <= near)
        })
    };
    let load = |n: usize, k: usize| setup.loads.get(3 * n + k).copied().unwrap_or(0.0);
    let largest = setup.loads.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    nodes.iter().enumerate().all(|(n, x)| {
        let Some(image) = image_of(x) else { return false };
        (0..3).all(|k| {
            let sign = if k == axis { -1.0 } else { 1.0 };
            setup.constraints.is_held(n, k) == setup.constraints.is_held(image, k)
                && (load(n, k) - sign * load(image, k)).abs() <= 1e-9 * largest
        })
    })
}

/// Whether the images of the tool's sampled points lie on the tool. Only points over `part`, seen along the tool's
/// direction, are tested.
fn is_tool_symmetric(tool: &ToolSetup, axis: usize, at: f64, near: f64, part: &Aabb) -> bool {
    let over = |point: &Vec3| {
        let place = point + tool.offset;
        let over = |k: usize| (part.min[k]..=part.max[k]).contains(&place[k]);
        (0..3).filter(|&k| tool.direction[k].abs() < 0.5).all(over)
    };
    // Symmetry faces that were removed from a tool are images of other faces.
    let complete = tool.surface.complete();
    let surface = complete.as_ref().unwrap_or(&tool.surface);
    is_surface_symmetric(surface, (axis, at - tool.offset[axis]), near, &over)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::test_tools::plane;
    use kanagata_contact::ToolSurface;
    use kanagata_solver::sheet::hex_mesh::rectangle;
    use kanagata_solver::{Placement, SheetSide};

    #[test]
    fn a_tool_is_its_own_image_or_not() {
        let tool = |x: f64| ToolSetup {
            name: "t".into(),
            surface: Arc::new(ToolSurface::new(plane(
                "t",
                Vec3::new(x, -1.0, 0.0),
                Vec3::x() * 6.0,
                Vec3::y() * 2.0,
                Vec3::z(),
            ))),
            offset: Vec3::new(1.0, 0.0, 0.0),
            direction: Vec3::z(),
            placement: Placement::AsGiven,
            friction: 0.0,
            side: SheetSide::Bottom,
            stop: None,
        };
        // From -3 to 3, moved by 1.
        assert!(is_tool_symmetric(&tool(-3.0), 0, 1.0, 1e-6, &EVERYWHERE));
        assert!(!is_tool_symmetric(&tool(-3.0), 0, 0.9, 1e-6, &EVERYWHERE));
        assert!(is_tool_symmetric(&tool(-3.0), 1, 0.0, 1e-6, &EVERYWHERE));
        assert!(!is_tool_symmetric(&tool(-3.0), 1, 0.1, 1e-6, &EVERYWHERE));
    }

    /// A tool from -1 to 6 at the plane x = 0 of a sheet from 0 to 5: what is there of the far side is an image. One from
    /// -6 with a step at -3 is not.
    #[test]
    fn a_tool_may_end_on_the_far_side_of_a_symmetry_plane() {
        let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
        let tool = |from: f64, more: Option<f64>| {
            let mut model = plane("t", from * x - y, (6.0 - from) * x, 2.0 * y, z);
            let step = |at: f64| plane("t", -6.0 * x - y + at * z, 3.0 * x, 2.0 * y, z);
            model.patches.extend(more.into_iter().flat_map(|at| step(at).patches));
            ToolSetup {
                name: "t".into(),
                surface: Arc::new(ToolSurface::new(model)),
                offset: Vec3::zeros(),
                direction: z,
                placement: Placement::AsGiven,
                friction: 0.0,
                side: SheetSide::Bottom,
                stop: None,
            }
        };
        let sheet = Aabb { min: Vec3::new(0.0, -1.0, 0.0), max: Vec3::new(5.0, 1.0, 1.0) };
        let far = mirrored(&sheet, 0, 0.0);
        assert!(is_tool_symmetric(&tool(-1.0, None), 0, 0.0, 1e-6, &far));
        assert!(!is_tool_symmetric(&tool(-1.0, None), 0, 0.0, 1e-6, &EVERYWHERE));
        assert!(!is_tool_symmetric(&tool(-3.0, Some(0.5)), 0, 0.0, 1e-6, &far));
        assert!(is_tool_symmetric(&tool(-3.0, Some(0.0)), 0, 0.0, 1e-6, &far));
    }

    /// The far wall of a whole punch is a symmetry face to the contact search; the punch is still symmetric.
    #[test]
    fn a_tool_without_its_symmetry_faces_is_its_own_image() {
        let part =
            |at: Vec3, along: Vec3, up: Vec3, normal: Vec3| plane("t", at, along, up, normal);
        let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
        let mut model = part(-3.0 * x - y, 6.0 * x, 2.0 * y, z);
        let floor = model.patches.len();
        model.patches.extend(part(-3.0 * x - y, 2.0 * y, 4.0 * z, -x).patches);
        let walls = model.patches.len();
        model.patches.extend(part(3.0 * x - y, 2.0 * y, 4.0 * z, x).patches);
        let kept: Vec<bool> = (0..model.patches.len()).map(|k| k < floor || k >= walls).collect();
        let tool = ToolSetup {
            name: "t".into(),
            surface: Arc::new(ToolSurface::new(model).restricted_to(&kept)),
            offset: Vec3::zeros(),
            direction: z,
            placement: Placement::AsGiven,
            friction: 0.0,
            side: SheetSide::Bottom,
            stop: None,
        };
        assert!(is_tool_symmetric(&tool, 0, 0.0, 1e-6, &EVERYWHERE));
        assert!(!is_tool_symmetric(&tool, 0, 0.1, 1e-6, &EVERYWHERE));
    }

    #[test]
    fn only_meshes_with_nodes_on_the_plane_have_halves() {
        let half = |nx: usize, ny: usize, axis: usize| {
            let mesh = rectangle(8.0, 2.0, 1.0, nx, ny, 1);
            halved(&mesh, axis, [4.0, 1.0][axis], 1e-6)
        };
        // 5 x 3 of 9 x 3 columns of two nodes, three unknowns each; 9 x 2.
        assert_eq!((half(8, 2, 0), half(8, 2, 1)), (Some(90), Some(108)));
        // One element across, and an odd number of them.
        assert_eq!((half(8, 1, 1), half(7, 2, 0), half(1, 2, 0)), (None, None, None));
    }
}
