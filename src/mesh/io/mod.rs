//! Mesh files: MSH 4.1 and VTU written; MSH 2.2 and 4.1 (ASCII, binary), STL, OBJ and VTU read, all others through
//! Python's meshio when it is installed.

mod abaqus;
pub(super) mod cursor;
mod meshio;
mod msh_read;
mod msh_write;
mod obj;
mod sheet;
mod stl;
#[cfg(test)]
mod tests;
mod vtu;

use std::collections::HashMap;
use std::path::Path;

use super::{Element, MeshError, SurfaceMesh};
use crate::geometry::Vec3;

/// Face number of elements whose file names none; [`attach()`](super::attach()) finds it.
pub const UNATTACHED: u32 = u32::MAX;

/// Reads a surface mesh, told by the file's ending: `.msh`, `.stl`, `.obj`, `.vtu`; any other (Abaqus, Nastran, VTK,
/// PLY, ...) is read by Python's meshio if that is installed. Coordinates are taken as mm. `Element::face` is the
/// surface number the file gives (MSH entity, VTU cell array `face`), or [`UNATTACHED`].
///
/// # Errors
/// [`MeshError::Read`]; [`MeshError::Invalid`] with line or byte, what was found and what is allowed;
/// [`MeshError::MeshioAbsent`] for a format that is not read here when meshio is not there, and
/// [`MeshError::MeshioFailed`] with what it says when it cannot read the file either.
pub fn read(path: &Path) -> Result<SurfaceMesh, MeshError> {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ending == "vtu" {
        return vtu::read(path, &name);
    }
    let bytes = std::fs::read(path)
        .map_err(|source| MeshError::Read { path: path.to_path_buf(), source })?;
    match ending.as_str() {
        "msh" => msh_read::parse(&bytes, &name),
        "stl" => stl::parse(&bytes, &name),
        "obj" => obj::parse(&bytes, &name),
        _ => meshio::read(path, &name),
    }
}

/// Writes a mesh by the file's ending: `.msh` (MSH 4.1, ASCII, one surface entity a CAD face) or `.vtu`.
///
/// # Errors
/// [`MeshError::Write`]; [`MeshError::Invalid`] for another ending.
pub fn write(mesh: &SurfaceMesh, path: &Path) -> Result<(), MeshError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "msh" => Ok(msh_write::write(mesh, path)?),
        "vtu" => Ok(vtu::grid(mesh).write(path)?),
        _ => Err(MeshError::Invalid {
            file: path.display().to_string(),
            place: "file name".into(),
            found: format!("ending '.{ending}'"),
            allowed: ".msh, .vtu".into(),
        }),
    }
}

pub use sheet::{SheetElements, SheetMesh, read_sheet};
pub use vtu::grid as to_vtu;

/// Merges vertices with the same coordinates (to the bit) into a mesh.
#[derive(Default)]
struct Merger {
    mesh: SurfaceMesh,
    known: HashMap<[u64; 3], u32>,
}

impl Merger {
    fn vertex(&mut self, p: Vec3) -> u32 {
        // 0.0 and -0.0 are the same place.
        let key = [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
        *self.known.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(p);
            self.mesh.vertices.len() as u32 - 1
        })
    }

    fn triangle(&mut self, corners: [Vec3; 3]) {
        let ids = corners.map(|p| self.vertex(p));
        self.mesh.elements.extend(Element::from_ring(&ids, UNATTACHED));
    }
}
