//! VTU: triangles and quads with the cell array `face`.

use std::path::Path;

use super::UNATTACHED;
use crate::mesh::{Element, MeshError, SurfaceMesh};
use crate::report::vtu_read::{self, VtuError};
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

/// Reads the triangles and quads of a VTU file; other cells are passed over.
pub fn read(path: &Path, file: &str) -> Result<SurfaceMesh, MeshError> {
    let grid = vtu_read::read(path).map_err(|e| match e {
        VtuError::Io { path, source } => MeshError::Read { path, source },
        VtuError::Invalid { place, found, .. } => MeshError::Invalid {
            file: file.into(),
            place,
            found,
            allowed: "an uncompressed unstructured grid, ascii or inline base64".into(),
        },
    })?;
    let faces = grid.cell_data.iter().find(|a| a.name == "face" && a.components == 1);
    let mut mesh = SurfaceMesh { vertices: grid.points, elements: Vec::new() };
    for (k, (kind, nodes)) in grid.cells.iter().enumerate() {
        if !matches!((kind, nodes.len()), (5, 3) | (9, 4)) {
            continue;
        }
        if let Some(&n) = nodes.iter().find(|&&n| n as usize >= mesh.vertices.len()) {
            return Err(MeshError::Invalid {
                file: file.into(),
                place: format!("cell {k}"),
                found: format!("point {n}"),
                allowed: format!("points 0 to {}", mesh.vertices.len().saturating_sub(1)),
            });
        }
        let face = faces.and_then(|a| a.values.get(k)).filter(|f| **f >= 0.0);
        mesh.elements.extend(Element::from_ring(nodes, face.map_or(UNATTACHED, |f| *f as u32)));
    }
    mesh.compact();
    Ok(mesh)
}
