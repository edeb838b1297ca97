//! Names and endings of mesh files, their bytes, and the check of their points.

use std::path::Path;

use crate::geometry::Vec3;
use crate::geometry::numbers::first_fault;
use crate::mesh::MeshError;

/// Endings of mesh files, of those read here and of some that meshio reads.
const ENDINGS: [&str; 13] =
    ["msh", "stl", "obj", "vtu", "vtk", "ply", "off", "inp", "bdf", "nas", "fem", "med", "xdmf"];

/// Whether a file's ending is one of mesh files.
#[must_use]
pub fn is_mesh(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Whether [`parse`] reads files of this name.
pub(super) fn is_parsed(name: &str) -> bool {
    matches!(ending(Path::new(name)).as_str(), "msh" | "stl" | "obj" | "vtu")
}

pub(super) fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>, MeshError> {
    crate::files::read(path, crate::files::Input::Mesh)
        .map_err(|source| MeshError::Read { path: path.to_path_buf(), source })
}

pub(super) fn other_ending(file: &str, ending: &str, allowed: &str) -> MeshError {
    MeshError::Invalid {
        file: file.into(),
        place: "file name".into(),
        found: format!("ending '.{ending}'"),
        allowed: format!(".{allowed}"),
    }
}

/// Refuses points whose coordinates are not finite or too large.
pub(super) fn judge(file: &str, points: &[Vec3]) -> Result<(), MeshError> {
    let Some((k, found)) = first_fault(points) else { return Ok(()) };
    Err(MeshError::Invalid {
        file: file.into(),
        place: format!("point {k} of those that elements use, from 0"),
        found,
        allowed: "lengths in mm".into(),
    })
}
