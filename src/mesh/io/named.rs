//! Names and extensions of mesh files, reading of their bytes, and validation of points.

use std::path::Path;

use crate::MeshError;
use kanagata_geometry::Vec3;
use kanagata_geometry::numbers::first_fault;

/// Extensions of mesh files, both supported ones and some read by meshio.
const ENDINGS: [&str; 13] =
    ["msh", "stl", "obj", "vtu", "vtk", "ply", "off", "inp", "bdf", "nas", "fem", "med", "xdmf"];

/// True for the extension of a mesh file.
#[must_use]
pub fn is_mesh(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// True when [`parse`] supports files of this name.
pub(super) fn is_parsed(name: &str) -> bool {
    matches!(ending(Path::new(name)).as_str(), "msh" | "stl" | "obj" | "vtu")
}

pub(super) fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>, MeshError> {
    kanagata_files::read(path, kanagata_files::Input::Mesh)
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

/// Rejects points with inadmissible coordinates.
pub(super) fn check_points(file: &str, points: &[Vec3]) -> Result<(), MeshError> {
    let Some((k, found)) = first_fault(points) else { return Ok(()) };
    Err(MeshError::Invalid {
        file: file.into(),
        place: format!("point {k} of those that elements use, from 0"),
        found,
        allowed: "lengths in mm".into(),
    })
}
