//! VTU: triangles and quads with the cell array `face`.

use std::path::Path;

use super::sheet::{Volumes, is_result};
use super::{MeshFile, UNATTACHED, of_elements, with_normals};
use crate::geometry::Vec3;
use crate::mesh::{MeshError, SurfaceMesh};
use crate::report::vtu_read::{self, GridArray, VtuError};
use crate::report::{CellKind, DataArray, Vtu};

/// The mesh as a VTU grid with the cell array `face`, to which more arrays may be added.
#[must_use]
pub fn grid(mesh: &SurfaceMesh) -> Vtu {
    let mut out = Vtu::new(mesh.vertices.clone());
    for e in &mesh.elements {
        let kind = if e.nodes().len() == 3 { CellKind::Triangle } else { CellKind::Quad };
        out.push_cell(kind, e.nodes());
    }
    let faces = mesh.elements.iter().map(|e| e.face as i32).collect();
    out.cell_data.push(DataArray::integer("face", faces));
    out
}

fn grid_of(path: &Path, file: &str) -> Result<vtu_read::Grid, MeshError> {
    vtu_read::read(path).map_err(|e| match e {
        VtuError::Io { path, source } => MeshError::Read { path, source },
        VtuError::Invalid { place, found, .. } => MeshError::Invalid {
            file: file.into(),
            place,
            found,
            allowed: "an unstructured grid of one piece, arrays as ascii, base64 or appended, as they are or compressed by zlib".into(),
        },
    })
}

/// Names of the arrays of a VTU file that say its mesh has been deformed.
pub fn results(path: &Path, file: &str) -> Result<Vec<String>, MeshError> {
    let grid = grid_of(path, file)?;
    let arrays = grid.point_data.into_iter().chain(grid.cell_data);
    Ok(arrays.filter(|a| is_result(&a.name, &a.values)).map(|a| a.name).collect())
}

/// Reads the hexahedra of a VTU file (cells of VTK's types 12 and 11); surfaces, lines and points are passed over.
pub fn read_volumes(path: &Path, file: &str) -> Result<Volumes, MeshError> {
    let grid = grid_of(path, file)?;
    let mut hexahedra = Vec::new();
    for (k, (kind, nodes)) in grid.cells.iter().enumerate() {
        match (kind, <[u32; 8]>::try_from(&nodes[..])) {
            (12, Ok(nodes)) => hexahedra.push(nodes),
            // A voxel counts its nodes along x, then y, then z.
            (11, Ok([a, b, d, c, e, f, h, g])) => hexahedra.push([a, b, c, d, e, f, g, h]),
            (1..=9 | 21..=23 | 28, _) => {}
            _ => {
                return Err(MeshError::Invalid {
                    file: file.into(),
                    place: format!("cell {k}"),
                    found: format!("a cell of VTK's type {kind} with {} points", nodes.len()),
                    allowed: "hexahedra of eight points (type 12)".into(),
                });
            }
        }
    }
    Ok(Volumes { points: grid.points, hexahedra })
}

/// Reads the triangles and quads of a VTU file, and the normals of its point array `Normals`; other cells are passed over.
pub fn read(path: &Path, file: &str) -> Result<MeshFile, MeshError> {
    let grid = grid_of(path, file)?;
    let faces = grid.cell_data.iter().find(|a| a.name == "face" && a.components == 1);
    let is_normals = |a: &&GridArray| a.name.eq_ignore_ascii_case("normals") && a.components == 3;
    let normals = grid.point_data.iter().find(is_normals);
    let normal = |n: u32| {
        let k = 3 * n as usize;
        let given = normals.and_then(|a| a.values.get(k..k + 3));
        given.map_or_else(Vec3::zeros, Vec3::from_column_slice)
    };
    let mut elements = Vec::new();
    for (k, (kind, nodes)) in grid.cells.iter().enumerate() {
        if !matches!((kind, nodes.len()), (5, 3) | (9, 4)) {
            continue;
        }
        if let Some(&n) = nodes.iter().find(|&&n| n as usize >= grid.points.len()) {
            return Err(MeshError::Invalid {
                file: file.into(),
                place: format!("cell {k}"),
                found: format!("point {n}"),
                allowed: format!("points 0 to {}", grid.points.len().saturating_sub(1)),
            });
        }
        let face = faces.and_then(|a| a.values.get(k)).filter(|f| **f >= 0.0);
        let ring: Vec<(u32, Vec3)> = nodes.iter().map(|&n| (n, normal(n))).collect();
        elements.extend(with_normals(&ring, face.map_or(UNATTACHED, |f| *f as u32)));
    }
    Ok(of_elements(grid.points, elements))
}
