//! VTU: triangles and quadrilaterals with the cell array `face`.

use super::mesh_file::{MeshFile, UNATTACHED, of_elements};
use super::polygon;
use super::volumes::{Volumes, is_result};
use crate::{MeshError, SurfaceMesh};
use kanagata_geometry::Vec3;
use kanagata_report::vtu_read::{self, Grid, GridArray};
use kanagata_report::{CellKind, DataArray, Vtu};

/// The mesh as a VTU grid with the cell array `face`; further arrays may be added.
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

/// The grid in the bytes of a file.
pub fn grid_of(bytes: &[u8], file: &str) -> Result<Grid, MeshError> {
    vtu_read::parse(bytes).map_err(|(place, found)| MeshError::Invalid {
        file: file.into(),
        place,
        found,
        allowed: "an unstructured grid of one piece, arrays as ascii, base64 or appended, as they are or compressed by zlib".into(),
    })
}

/// Names of the arrays of a grid that indicate a deformed mesh.
pub fn results(grid: &Grid) -> Vec<String> {
    let arrays = grid.point_data.iter().chain(&grid.cell_data);
    arrays.filter(|a| is_result(&a.name, &a.values)).map(|a| a.name.clone()).collect()
}

/// Hexahedra of a grid (VTK cell types 12 and 11); surfaces, lines and points are ignored.
pub fn volumes(grid: &Grid, file: &str) -> Result<Volumes, MeshError> {
    let mut hexahedra = Vec::new();
    for (k, (kind, nodes)) in grid.cells.iter().enumerate() {
        match (kind, <[u32; 8]>::try_from(&nodes[..])) {
            (12, Ok(nodes)) => hexahedra.push(nodes),
            // The nodes of a voxel are ordered along x, then y, then z.
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
    Ok(Volumes { points: grid.points.clone(), hexahedra })
}

/// Corners of the surface elements of a cell: triangles, quadrilaterals, polygons, corner nodes of second-order cells,
/// and triangle strips. Empty for other cells.
fn rings(kind: u8, nodes: &[u32]) -> Vec<Vec<u32>> {
    match (kind, nodes) {
        (5, &[a, b, c]) | (22, &[a, b, c, _, _, _]) => vec![vec![a, b, c]],
        // The nodes of a pixel are ordered along x, then y.
        (8, &[a, b, d, c]) => vec![vec![a, b, c, d]],
        (9, &[_, _, _, _])
        | (23, &[_, _, _, _, _, _, _, _])
        | (28, &[_, _, _, _, _, _, _, _, _]) => {
            vec![nodes[..4].to_vec()]
        }
        (6, strip) => {
            let turned = |k: usize, t: &[u32]| {
                if k.is_multiple_of(2) { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
            };
            strip.windows(3).enumerate().map(|(k, t)| turned(k, t).to_vec()).collect()
        }
        (7, polygon) => vec![polygon.to_vec()],
        _ => Vec::new(),
    }
}

/// True for VTK cell types of surfaces.
fn is_surface(kind: u8) -> bool {
    matches!(kind, 5..=9 | 22 | 23 | 28)
}

/// Surface cells of a grid, and the normals of its point array `Normals`; lines, points and volumes are ignored.
pub fn surfaces(grid: Grid, file: &str) -> Result<MeshFile, MeshError> {
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
        let face = faces.and_then(|a| a.values.get(k)).filter(|f| **f >= 0.0);
        let face = face.map_or(UNATTACHED, |f| *f as u32);
        let rings = rings(*kind, nodes);
        if rings.is_empty() && is_surface(*kind) {
            return Err(MeshError::Invalid {
                file: file.into(),
                place: format!("cell {k}"),
                found: format!("a cell of VTK's type {kind} with {} points", nodes.len()),
                allowed: "triangles of 3, quadrilaterals of 4 points, or 6, 8 or 9 of second order"
                    .into(),
            });
        }
        for ring in rings {
            let ring: Vec<(u32, Vec3)> = ring.iter().map(|&n| (n, normal(n))).collect();
            let parts = polygon::elements(&ring, &grid.points, face);
            elements
                .extend(parts.map_err(|found| polygon::refused(file, format!("cell {k}"), found))?);
        }
    }
    Ok(of_elements(grid.points, elements))
}
