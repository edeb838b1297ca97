//! The blank of a scene: its mesh and its constraints.

use std::path::Path;

use super::check::ELEMENTS_MAX;
use super::error::SceneError;
use super::file_sheet::{FileSheet, of_file};
use super::plan::Plan;
use super::refine::refinement;
use super::types::{Blank, BlankShape, Region, Scene, SymmetryPlane};
use kanagata_geometry::Vec3;
use kanagata_solver::Constraints;
use kanagata_solver::sheet::hex_mesh::{HexMesh, disc, quarter_disc, rectangle, thickened};

pub use super::file_sheet::of_sheet;

/// Tolerance of nodes on a plane or a radius, over the largest coordinate: the precision of files with seven digits.
const ON_PLANE_REL: f64 = 1e-6;
/// Largest ratio of coordinate to blank size used for this tolerance.
const COORDINATE_RATIO_MAX: f64 = 100.0;

/// Place, what was found, what is allowed.
pub(super) type Fault = (String, String, String);

/// The undeformed mesh of the blank. `read`: the sheet of its mesh file, if it was read already.
pub(super) fn blank_mesh(
    blank: &Blank,
    scene: &Path,
    folder: &Path,
    read: Option<&FileSheet>,
) -> Result<HexMesh, SceneError> {
    let mut mesh = base_mesh(blank, scene, folder, read)?;
    if !blank.refine.is_empty() {
        let value = |(place, found, allowed): Fault| SceneError::Value {
            path: scene.to_path_buf(),
            place,
            found,
            allowed,
        };
        let refinement = refinement(&blank.refine, &mesh, ELEMENTS_MAX).map_err(value)?;
        mesh = refinement.mesh(&mesh, rim(&blank.shape));
    }
    mesh.nodes.iter_mut().for_each(|x| x.z += blank.z_mm);
    Ok(mesh)
}

/// The mesh of the blank without refinement and shift along z.
fn base_mesh(
    blank: &Blank,
    scene: &Path,
    folder: &Path,
    read: Option<&FileSheet>,
) -> Result<HexMesh, SceneError> {
    let mesh = match &blank.shape {
        BlankShape::Rectangle { corner_mm, size_mm, elements } => {
            let [(sx, sy), (nx, ny)] = [*size_mm, elements.map(|n| n as f64)].map(|p| (p[0], p[1]));
            let mut mesh =
                rectangle(sx, sy, blank.thickness_mm, nx as usize, ny as usize, blank.layers);
            let corner = Vec3::new(corner_mm[0], corner_mm[1], 0.0);
            mesh.nodes.iter_mut().for_each(|x| *x += corner);
            mesh
        }
        BlankShape::QuarterDisc { radius_mm, core, rings } => {
            let (points, quads) = quarter_disc(*radius_mm, *core, *rings);
            thickened(&points, &quads, blank.thickness_mm, blank.layers)
        }
        BlankShape::Disc { radius_mm, core, rings } => {
            let (points, quads) = disc(*radius_mm, *core, *rings);
            thickened(&points, &quads, blank.thickness_mm, blank.layers)
        }
        BlankShape::Mesh { file, state } => match read {
            Some(sheet) => sheet.mesh(blank),
            None => of_file(blank, scene, &folder.join(file), *state)?.mesh(blank),
        },
    };
    Ok(mesh)
}

/// Radius of the curved outline of a blank about the origin [mm], if it has one.
fn rim(shape: &BlankShape) -> Option<f64> {
    match shape {
        BlankShape::QuarterDisc { radius_mm, .. } | BlankShape::Disc { radius_mm, .. } => {
            Some(*radius_mm)
        }
        BlankShape::Rectangle { .. } | BlankShape::Mesh { .. } => None,
    }
}

/// Number of elements in plan whose level of refinement is above that of the scene, since levels of neighbours differ by
/// at most 1. `None` without refinement.
#[must_use]
pub fn raised_elements(plan: &Plan) -> Option<usize> {
    let blank = &plan.scene.blank;
    if blank.refine.is_empty() {
        return None;
    }
    let read = plan.files.iter().find_map(|file| file.sheet.as_deref());
    let base = base_mesh(blank, Path::new(""), &plan.folder, read).ok()?;
    Some(refinement(&blank.refine, &base, ELEMENTS_MAX).ok()?.raised)
}

/// Constraints from symmetry planes and `holds`. Hanging nodes have none of their own.
pub(super) fn constraints(scene: &Scene, mesh: &HexMesh) -> Result<Constraints, Fault> {
    let nodes = &mesh.nodes[..];
    let mut constraints = Constraints::none(nodes.len());
    let tolerance = tolerance(nodes);
    for (k, plane) in scene.symmetry.iter().enumerate() {
        let axis = plane.normal.index();
        check_plane(&scene.symmetry[..k], plane, nodes)
            .map_err(|(found, allowed)| (format!("symmetry[{k}]"), found, allowed))?;
        if constraints.symmetry_plane(nodes, axis, plane.at_mm, tolerance) == 0 {
            let found = format!("{} mm, where the blank has no node", plane.at_mm);
            let place = format!("symmetry[{k}].at_mm");
            return Err((place, found, "a side of the blank".into()));
        }
    }
    for (k, hold) in scene.holds.iter().enumerate() {
        let place = format!("holds[{k}].where");
        let found = nodes_in(&hold.region, nodes, &place)?;
        if found.iter().all(|&node| mesh.masters(node).is_some()) {
            let allowed = "a region that holds the nodes on both sides of them, too";
            return Err((place, "hanging nodes only".into(), allowed.into()));
        }
        for node in found {
            hold.axes.iter().for_each(|axis| constraints.hold(node, axis.index()));
        }
    }
    mesh.hanging_nodes().for_each(|(node, _)| constraints.hang(node));
    Ok(constraints)
}

/// Checks that a symmetry plane differs from those `before` it and that all nodes are on one side. The error: what was
/// found, what is allowed.
fn check_plane(
    before: &[SymmetryPlane],
    plane: &SymmetryPlane,
    nodes: &[Vec3],
) -> Result<(), (String, String)> {
    let near = tolerance(nodes);
    let (axis, at) = (plane.normal.index(), plane.at_mm);
    let name = format!("{} = {at} mm", ["x", "y", "z"][axis]);
    let same = |p: &SymmetryPlane| p.normal == plane.normal && (p.at_mm - at).abs() <= near;
    if let Some(first) = before.iter().position(same) {
        return Err((
            format!("{name} again, as symmetry[{first}]"),
            "every plane once: each halves the forces on the modelled part".into(),
        ));
    }
    let extend = |range: [f64; 2], x: &Vec3| [range[0].min(x[axis]), range[1].max(x[axis])];
    let [low, high] = nodes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], extend);
    if low < at - near && high > at + near {
        return Err((
            format!("{name} inside the blank, which reaches from {low} to {high} mm"),
            "a side of the blank: model what lies on one side of the plane, or leave the plane out"
                .into(),
        ));
    }
    Ok(())
}

/// Nodes of the region at the key `place` of the scene.
pub(super) fn nodes_in(region: &Region, nodes: &[Vec3], place: &str) -> Result<Vec<usize>, Fault> {
    let near = tolerance(nodes);
    let inside = |x: &Vec3| match region {
        Region::All(all) => *all,
        Region::Plane(plane) => (x[plane.normal.index()] - plane.at_mm).abs() <= near,
        Region::BeyondRadiusMm(radius) => x.xy().norm() >= radius - near,
        Region::Box { min_mm, max_mm } => {
            (0..3).all(|k| (min_mm[k] - near..=max_mm[k] + near).contains(&x[k]))
        }
    };
    let found: Vec<usize> = (0..nodes.len()).filter(|&n| inside(&nodes[n])).collect();
    if found.is_empty() {
        return Err((place.into(), "no node".into(), "a region that holds nodes".into()));
    }
    Ok(found)
}

/// Tolerance of the distance of nodes on a plane or a radius [mm]. It follows the precision of the coordinates, limited
/// to a multiple of the blank size for a blank far from the origin.
fn tolerance(nodes: &[Vec3]) -> f64 {
    let (size, farthest) = nodes.iter().fold((0.0, 0.0), |(size, far): (f64, f64), x| {
        (size.max((x - nodes[0]).amax()), far.max(x.amax()))
    });
    tolerance_of(size, farthest)
}

/// The same tolerance for a blank of this size and largest coordinate [mm].
pub(super) fn tolerance_of(size: f64, farthest: f64) -> f64 {
    ON_PLANE_REL * farthest.clamp(size, COORDINATE_RATIO_MAX * size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::complete_blank;

    fn nodes() -> Vec<Vec3> {
        rectangle(4.0, 2.0, 1.0, 4, 2, 1).nodes
    }

    #[test]
    fn regions_find_their_nodes() {
        let count = |text: &str| {
            let region: Region = serde_json::from_str(text).unwrap();
            nodes_in(&region, &nodes(), "here").map(|found| found.len())
        };
        assert_eq!(count(r#"{"all": true}"#), Ok(30));
        assert_eq!(count(r#"{"plane": {"normal": "x", "at_mm": 4.0}}"#), Ok(6));
        assert_eq!(count(r#"{"beyond_radius_mm": 4.0}"#), Ok(6));
        assert_eq!(count(r#"{"box": {"min_mm": [0, 0, 0], "max_mm": [1, 1, 0]}}"#), Ok(4));
        assert_eq!(count(r#"{"beyond_radius_mm": 5.0}"#).unwrap_err().0, "here");
    }

    #[test]
    fn a_disc_lies_about_the_origin() {
        let shape = serde_json::json!({"disc": {"radius_mm": 10.0, "core": 2, "rings": 3}});
        let blank = serde_json::json!({"shape": shape, "thickness_mm": 1.0, "z_mm": 2.0});
        let blank: Blank = serde_json::from_value(blank).unwrap();
        let mesh = blank_mesh(&blank, Path::new("x"), Path::new(""), None).unwrap();
        assert_eq!((mesh.column_count(), mesh.elements.len()), (25 + 48, 16 + 48));
        let centre: Vec3 = mesh.nodes.iter().sum::<Vec3>() / mesh.nodes.len() as f64;
        assert!((centre - Vec3::z() * 2.5).norm() < 1e-14, "{centre}");
        assert!(
            (mesh.nodes.iter().map(|x| x.xy().norm()).fold(0.0, f64::max) - 10.0).abs() < 1e-13
        );
    }

    #[test]
    fn a_symmetry_plane_is_a_side_of_the_blank_and_given_once() {
        let nodes = nodes();
        let planes = |text: &str| -> Result<(), (String, String)> {
            let planes: Vec<SymmetryPlane> = serde_json::from_str(text).unwrap();
            (0..planes.len()).try_for_each(|k| check_plane(&planes[..k], &planes[k], &nodes))
        };
        let x_and_y = r#"[{"normal": "x"}, {"normal": "y"}, {"normal": "y", "at_mm": 2.0}]"#;
        assert_eq!(planes(x_and_y), Ok(()));
        // Round-off in a mesh of another program.
        assert_eq!(planes(r#"[{"normal": "x", "at_mm": 1e-7}]"#), Ok(()));
        let twice = planes(r#"[{"normal": "x"}, {"normal": "x"}, {"normal": "y"}]"#).unwrap_err();
        assert!(twice.0.contains("x = 0 mm again, as symmetry[0]"), "{twice:?}");
        let inside = planes(r#"[{"normal": "y", "at_mm": 1.0}]"#).unwrap_err();
        assert!(inside.0.contains("y = 1 mm inside the blank"), "{inside:?}");
        assert!(inside.1.contains("a side of the blank"), "{inside:?}");
    }

    fn blank(file: &str, thickness_mm: f64, layers: usize) -> Blank {
        let shape = serde_json::json!({"mesh": {"file": file}});
        serde_json::from_value(
            serde_json::json!({"shape": shape, "thickness_mm": thickness_mm, "layers": layers}),
        )
        .unwrap()
    }

    #[test]
    fn a_mesh_file_of_quads_makes_a_sheet_and_others_say_why_not() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("x.scene.json");
        let file = folder.path().join("x.obj");
        let read =
            |thickness| blank_mesh(&blank("x.obj", thickness, 1), &scene, folder.path(), None);
        // Seen from below: the element is reversed.
        std::fs::write(&file, "v 0 0 9\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 5 4 3 2\n").unwrap();
        let mesh = read(0.5).unwrap();
        assert_eq!((mesh.nodes.len(), mesh.elements.len()), (8, 1));
        assert!((mesh.nodes[1] - mesh.nodes[0] - Vec3::z() * 0.5).norm() < 1e-15);
        let message = read(0.0).unwrap_err().to_string();
        assert!(message.contains("blank.thickness_mm"), "{message}");
        std::fs::write(&file, "v 0 0 0\nv 2 0 0\nv 2 1 0\nf 1 2 3\n").unwrap();
        let message = read(0.5).unwrap_err().to_string();
        assert!(message.contains("3 nodes") && message.contains("allowed: quadri"), "{message}");
    }

    /// Nodes and elements in lines, numbered from 1, with `sep` between numbers.
    fn rows(whole: &HexMesh, lying: &[[u32; 8]], sep: &str) -> [String; 2] {
        let nodes = whole
            .nodes
            .iter()
            .enumerate()
            .map(|(n, x)| format!("{}{sep}{}{sep}{}{sep}{}\n", n + 1, x.x, x.y, x.z));
        let elements = lying.iter().enumerate().map(|(k, e)| {
            let ids: Vec<String> = e.iter().map(|n| (n + 1).to_string()).collect();
            let middle = if sep == " " { "5 2 0 1 " } else { "" };
            format!("{}{sep}{middle}{}\n", k + 1, ids.join(sep))
        });
        [nodes.collect(), elements.collect()]
    }

    /// Writes a sheet as `x.inp`, `x.msh` and `x.vtu`; its elements lie on their sides.
    fn write_formats(folder: &Path, whole: &HexMesh) {
        let lying = whole.elements.iter().map(|e| [0, 3, 7, 4, 1, 2, 6, 5].map(|k| e[k]));
        let lying: Vec<[u32; 8]> = lying.collect();
        let write = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
        let [nodes, elements] = rows(whole, &lying, ",");
        write("x.inp", format!("*NODE\n{nodes}*ELEMENT, TYPE=C3D8R\n{elements}"));
        let [nodes, elements] = rows(whole, &lying, " ");
        let (n, e) = (whole.nodes.len(), lying.len());
        write(
            "x.msh",
            format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n{nodes}$EndNodes\n\
                 $Elements\n{e}\n{elements}$EndElements\n"
            ),
        );
        let mut grid = kanagata_report::Vtu::new(whole.nodes.clone());
        lying.iter().for_each(|e| grid.push_cell(kanagata_report::CellKind::Hexahedron, e));
        grid.write(&folder.join("x.vtu")).unwrap();
    }

    /// The same sheet in three formats.
    #[test]
    fn hexahedra_of_every_format_make_the_sheet_that_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("x.scene.json");
        write_formats(folder.path(), &rectangle(6.0, 4.0, 1.0, 3, 2, 2));
        let volume = |m: &HexMesh| -> f64 {
            let x = |n: u32| m.nodes[n as usize];
            let of = |e: &[u32; 8]| {
                (x(e[1]) - x(e[0])).cross(&(x(e[3]) - x(e[0]))).dot(&(x(e[4]) - x(e[0])))
            };
            m.elements.iter().map(of).sum()
        };
        for name in ["x.inp", "x.msh", "x.vtu"] {
            let mut own = blank(name, 0.0, 1);
            own.z_mm = 0.25;
            let mesh = blank_mesh(&own, &scene, folder.path(), None).unwrap();
            assert_eq!((mesh.column_count(), mesh.nodes_per_column), (12, 3), "{name}");
            assert!((volume(&mesh) - 24.0).abs() < 1e-12, "{name}");
            let low = mesh.bottom_nodes().iter().all(|&n| mesh.nodes[n as usize].z == 0.25);
            assert!(low, "{name}");
            let planned = complete_blank(&mut own, &scene, folder.path()).unwrap().unwrap();
            assert_eq!((own.thickness_mm, own.layers), (1.0, 2));
            // The file is not read a second time.
            let again = blank_mesh(&own, &scene, Path::new("gone"), planned.sheet.as_deref());
            assert_eq!(again.unwrap(), mesh, "{name}");
            let message =
                blank_mesh(&blank(name, 0.8, 1), &scene, folder.path(), None).unwrap_err();
            assert!(message.to_string().contains("0.8"), "{message}");
            let message =
                blank_mesh(&blank(name, 1.0, 3), &scene, folder.path(), None).unwrap_err();
            assert!(message.to_string().contains("2 layers"), "{message}");
        }
    }

    #[test]
    fn an_element_of_another_kind_is_named_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("x.scene.json");
        let tetrahedron = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n\
             $Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n";
        std::fs::write(folder.path().join("x.msh"), tetrahedron).unwrap();
        let message = blank_mesh(&blank("x.msh", 1.0, 1), &scene, folder.path(), None).unwrap_err();
        let message = message.to_string();
        assert!(message.contains("x.msh, line 9") && message.contains("type 4"), "{message}");
    }
}
