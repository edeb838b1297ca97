//! Reads surface meshes of all supported formats.

use std::path::Path;

use super::mesh_file::MeshFile;
use super::named::{bytes_of, check_points, ending, is_parsed, name_of, other_ending};
use super::{meshio, msh_read, obj, stl, vtu};
use crate::{MeshError, SurfaceMesh};

/// Reads a surface mesh; see [`read_file`].
///
/// # Errors
/// Those of [`read_file`].
pub fn read(path: &Path) -> Result<SurfaceMesh, MeshError> {
    Ok(read_file(path)?.mesh)
}

/// Reads a surface mesh and its normals. The format follows from the extension: `.msh`, `.stl`, `.obj`, `.vtu`; others
/// (Abaqus, Nastran, VTK, PLY, ...) are read by Python's meshio if installed. Coordinates are in mm. `Element::face` is
/// the surface number in the file (MSH entity, VTU cell array `face`), or [`super::UNATTACHED`].
///
/// # Errors
/// [`MeshError::Read`]; [`MeshError::Invalid`] with line or byte, finding and admissible values;
/// [`MeshError::MeshioAbsent`] for other formats without meshio, and [`MeshError::MeshioFailed`] with the message of
/// meshio.
pub fn read_file(path: &Path) -> Result<MeshFile, MeshError> {
    let name = name_of(path);
    if !is_parsed(&name) {
        let made = meshio::read(path, &name)?;
        check_points(&name, &made.mesh.vertices)?;
        return Ok(made);
    }
    parse(&bytes_of(path)?, &name)
}

/// The mesh and the normals in the bytes of a file. The format follows from the extension of its name: `.msh`, `.stl`,
/// `.obj` or `.vtu`.
///
/// # Errors
/// [`MeshError::Invalid`] as for [`read_file`]; also for other extensions.
pub fn parse(bytes: &[u8], name: &str) -> Result<MeshFile, MeshError> {
    let made = match ending(Path::new(name)).as_str() {
        "msh" => msh_read::parse(bytes, name)?.into(),
        "stl" => stl::parse(bytes, name)?.into(),
        "obj" => obj::parse(bytes, name)?,
        "vtu" => vtu::surfaces(vtu::grid_of(bytes, name)?, name)?,
        other => return Err(other_ending(name, other, "msh, .stl, .obj, .vtu")),
    };
    check_points(name, &made.mesh.vertices)?;
    Ok(made)
}

/// Reads the MSH file of a mesher, with folded quadrilaterals unchanged; the driver checks them.
///
/// # Errors
/// As [`read_file`].
pub fn read_unchecked(path: &Path) -> Result<SurfaceMesh, MeshError> {
    let name = name_of(path);
    let mesh = msh_read::parse_unchecked(&bytes_of(path)?, &name)?;
    check_points(&name, &mesh.vertices)?;
    Ok(mesh)
}
