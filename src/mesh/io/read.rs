//! Reads surface meshes of all kinds of files.

use std::path::Path;

use super::mesh_file::MeshFile;
use super::named::{bytes_of, ending, is_parsed, judge, name_of, other_ending};
use super::{meshio, msh_read, obj, stl, vtu};
use crate::mesh::{MeshError, SurfaceMesh};

/// Reads a surface mesh; see [`read_file`].
///
/// # Errors
/// Those of [`read_file`].
pub fn read(path: &Path) -> Result<SurfaceMesh, MeshError> {
    Ok(read_file(path)?.mesh)
}

/// Reads a surface mesh and its normals, told by the file's ending: `.msh`, `.stl`, `.obj`, `.vtu`; any other (Abaqus, Nastran, VTK,
/// PLY, ...) is read by Python's meshio if that is installed. Coordinates are taken as mm. `Element::face` is the
/// surface number the file gives (MSH entity, VTU cell array `face`), or [`super::UNATTACHED`].
///
/// # Errors
/// [`MeshError::Read`]; [`MeshError::Invalid`] with line or byte, what was found and what is allowed;
/// [`MeshError::MeshioAbsent`] for a format that is not read here when meshio is not there, and
/// [`MeshError::MeshioFailed`] with what it says when it cannot read the file either.
pub fn read_file(path: &Path) -> Result<MeshFile, MeshError> {
    let name = name_of(path);
    if !is_parsed(&name) {
        let made = meshio::read(path, &name)?;
        judge(&name, &made.mesh.vertices)?;
        return Ok(made);
    }
    parse(&bytes_of(path)?, &name)
}

/// The mesh and the normals in the bytes of a file, whose kind the ending of its name says: `.msh`, `.stl`, `.obj` or `.vtu`.
///
/// # Errors
/// [`MeshError::Invalid`] as for [`read_file`]; also for another ending.
pub fn parse(bytes: &[u8], name: &str) -> Result<MeshFile, MeshError> {
    let made = match ending(Path::new(name)).as_str() {
        "msh" => msh_read::parse(bytes, name)?.into(),
        "stl" => stl::parse(bytes, name)?.into(),
        "obj" => obj::parse(bytes, name)?,
        "vtu" => vtu::surfaces(vtu::grid_of(bytes, name)?, name)?,
        other => return Err(other_ending(name, other, "msh, .stl, .obj, .vtu")),
    };
    judge(name, &made.mesh.vertices)?;
    Ok(made)
}

/// Reads the MSH file that a mesher was asked for, with folded quadrilaterals as they are: the driver judges them.
///
/// # Errors
/// As [`read_file`].
pub fn read_made(path: &Path) -> Result<SurfaceMesh, MeshError> {
    let name = name_of(path);
    let mesh = msh_read::parse_as_made(&bytes_of(path)?, &name)?;
    judge(&name, &mesh.vertices)?;
    Ok(mesh)
}
