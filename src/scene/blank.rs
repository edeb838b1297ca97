//! The blank of a scene: its mesh, what holds it, what pulls it.

use std::path::Path;

use super::read::SceneError;
use super::types::{Blank, BlankShape, Region, Scene};
use crate::geometry::Vec3;
use crate::mesh::io;
use crate::solver::Constraints;
use crate::solver::blank::{HexMesh, quarter_disc, rectangle, thickened};

/// Nodes this close to a plane or a radius are on it [share of the blank's size].
const ON: f64 = 1e-9;

/// Place, what was found, what is allowed.
type Fault = (String, String, String);

/// The blank's mesh before forming.
pub(super) fn blank_mesh(
    blank: &Blank,
    scene: &Path,
    folder: &Path,
) -> Result<HexMesh, SceneError> {
    let mut mesh = match &blank.shape {
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
        BlankShape::Mesh { file } => {
            let (points, quads) = quads_of_file(scene, &folder.join(file))?;
            thickened(&points, &quads, blank.thickness_mm, blank.layers)
        }
    };
    mesh.nodes.iter_mut().for_each(|x| x.z += blank.z_mm);
    Ok(mesh)
}

fn quads_of_file(scene: &Path, file: &Path) -> Result<(Vec<Vec3>, Vec<[u32; 4]>), SceneError> {
    let at = |cause: String| SceneError::Blank { path: scene.to_path_buf(), cause };
    let mesh = io::read(file).map_err(|e| at(e.to_string()))?;
    let mut quads = Vec::with_capacity(mesh.elements.len());
    for (k, element) in mesh.elements.iter().enumerate() {
        let Ok(quad) = <[u32; 4]>::try_from(element.nodes()) else {
            let found = format!("element {k} with {} nodes", element.nodes().len());
            return Err(at(format!("{}: found {found}; allowed: quadrilaterals", file.display())));
        };
        quads.push(quad);
    }
    if quads.is_empty() {
        return Err(at(format!("{}: found no element; allowed: quadrilaterals", file.display())));
    }
    Ok(used(&mesh.vertices, &quads))
}

/// The points that elements use, and the elements by them.
fn used(points: &[Vec3], quads: &[[u32; 4]]) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let mut number = vec![u32::MAX; points.len()];
    let mut kept = Vec::with_capacity(points.len());
    let quads = quads
        .iter()
        .map(|quad| {
            quad.map(|n| {
                let id = &mut number[n as usize];
                if *id == u32::MAX {
                    *id = kept.len() as u32;
                    kept.push(points[n as usize]);
                }
                *id
            })
        })
        .collect();
    (kept, quads)
}

/// Symmetry planes and held nodes.
pub(super) fn constraints(scene: &Scene, nodes: &[Vec3]) -> Result<Constraints, Fault> {
    let mut constraints = Constraints::none(nodes.len());
    let tolerance = ON * size(nodes);
    for (k, plane) in scene.symmetry.iter().enumerate() {
        let axis = plane.normal.index();
        if constraints.symmetry_plane(nodes, axis, plane.at_mm, tolerance) == 0 {
            let found = format!("{} mm, where the blank has no node", plane.at_mm);
            let place = format!("symmetry[{k}].at_mm");
            return Err((place, found, "a side of the blank".into()));
        }
    }
    for (k, hold) in scene.holds.iter().enumerate() {
        for node in nodes_in(&hold.region, nodes, &format!("holds[{k}].where"))? {
            hold.axes.iter().for_each(|axis| constraints.hold(node, axis.index()));
        }
    }
    Ok(constraints)
}

/// Forces on the nodes of the modelled part [N], which is one of `share` like parts; empty without loads.
pub(super) fn loads(scene: &Scene, nodes: &[Vec3], share: f64) -> Result<Vec<f64>, Fault> {
    if scene.loads.is_empty() {
        return Ok(Vec::new());
    }
    let mut forces = vec![0.0; 3 * nodes.len()];
    for (k, load) in scene.loads.iter().enumerate() {
        let there = nodes_in(&load.region, nodes, &format!("loads[{k}].where"))?;
        for &node in &there {
            for (axis, force) in load.force_n.iter().enumerate() {
                forces[3 * node + axis] += force / (share * there.len() as f64);
            }
        }
    }
    Ok(forces)
}

fn nodes_in(region: &Region, nodes: &[Vec3], place: &str) -> Result<Vec<usize>, Fault> {
    let near = ON * size(nodes);
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

fn size(nodes: &[Vec3]) -> f64 {
    nodes.iter().map(|x| x.amax()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_mesh_file_of_quads_makes_a_sheet_and_others_say_why_not() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("x.scene.json");
        let file = folder.path().join("x.obj");
        std::fs::write(&file, "v 0 0 9\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 2 3 4 5\n").unwrap();
        let (points, quads) = quads_of_file(&scene, &file).unwrap();
        let mesh = thickened(&points, &quads, 0.5, 1);
        assert_eq!((points.len(), mesh.nodes.len(), mesh.elements.len()), (4, 8, 1));
        assert!((mesh.nodes[1] - mesh.nodes[0] - Vec3::z() * 0.5).norm() < 1e-15);
        std::fs::write(&file, "v 0 0 0\nv 2 0 0\nv 2 1 0\nf 1 2 3\n").unwrap();
        let message = quads_of_file(&scene, &file).unwrap_err().to_string();
        assert!(
            message.contains("3 nodes") && message.contains("allowed: quadrilaterals"),
            "{message}"
        );
    }
}
