//! Writes surface meshes.

use std::path::Path;

use super::named::{ending, other_ending};
use super::{msh_write, vtu};
use crate::{MeshError, SurfaceMesh};

/// Writes a mesh; the format follows from the extension: `.msh` (MSH 4.1, ASCII, one surface entity per CAD face) or
/// `.vtu`.
///
/// # Errors
/// [`MeshError::Write`]; [`MeshError::Invalid`] for other extensions.
pub fn write(mesh: &SurfaceMesh, path: &Path) -> Result<(), MeshError> {
    let ending = ending(path);
    match ending.as_str() {
        "msh" => Ok(msh_write::write(mesh, path)?),
        "vtu" => Ok(vtu::grid(mesh).write(path)?),
        _ => Err(other_ending(&path.display().to_string(), &ending, "msh, .vtu")),
    }
}
