//! Mesh files: MSH 4.1 and VTU written; MSH 2.2 and 4.1 (ASCII, binary), STL, OBJ and VTU read, all others through
//! Python's meshio when it is installed.

mod abaqus;
pub(super) mod cursor;
mod meshio;
mod msh_read;
mod msh_write;
mod obj;
mod polygon;
mod sheet;
mod stl;
mod tags;
#[cfg(test)]
mod tests;
mod vtu;

use std::collections::HashMap;
use std::path::Path;

use super::{Element, MeshError, SurfaceMesh};
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::geometry::numbers::first_fault;

/// Face number of elements whose file names none; [`attach()`](super::attach()) finds it.
pub const UNATTACHED: u32 = u32::MAX;

/// Unit normals at the corners of an element, in the order of its nodes; zero where the file has none.
pub type CornerNormals = [Vec3; 4];

/// What a mesh file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh.
    pub mesh: SurfaceMesh,
    /// Normals of every element's corners: those of OBJ (`vn`), of the point array `Normals` of VTU, and of a point array
    /// of that name (or `nx`, `ny`, `nz`) in what meshio reads; none when the file has none.
    pub normals: Vec<CornerNormals>,
}

impl From<SurfaceMesh> for MeshFile {
    fn from(mesh: SurfaceMesh) -> Self {
        Self { mesh, normals: Vec::new() }
    }
}

/// Endings of mesh files, of those read here and of some that meshio reads.
const ENDINGS: [&str; 13] =
    ["msh", "stl", "obj", "vtu", "vtk", "ply", "off", "inp", "bdf", "nas", "fem", "med", "xdmf"];

/// Whether a file's ending is one of mesh files.
#[must_use]
pub fn is_mesh(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads a surface mesh; see [`read_file`].
///
/// # Errors
/// Those of [`read_file`].
pub fn read(path: &Path) -> Result<SurfaceMesh, MeshError> {
    Ok(read_file(path)?.mesh)
}

/// Reads a surface mesh and its normals, told by the file's ending: `.msh`, `.stl`, `.obj`, `.vtu`; any other (Abaqus, Nastran, VTK,
/// PLY, ...) is read by Python's meshio if that is installed. Coordinates are taken as mm. `Element::face` is the
/// surface number the file gives (MSH entity, VTU cell array `face`), or [`UNATTACHED`].
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

/// Whether [`parse`] reads files of this name.
fn is_parsed(name: &str) -> bool {
    matches!(ending(Path::new(name)).as_str(), "msh" | "stl" | "obj" | "vtu")
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, MeshError> {
    crate::files::read(path, crate::files::Input::Mesh)
        .map_err(|source| MeshError::Read { path: path.to_path_buf(), source })
}

fn other_ending(file: &str, ending: &str, allowed: &str) -> MeshError {
    MeshError::Invalid {
        file: file.into(),
        place: "file name".into(),
        found: format!("ending '.{ending}'"),
        allowed: format!(".{allowed}"),
    }
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

/// Refuses points whose coordinates are not finite or too large.
fn judge(file: &str, points: &[Vec3]) -> Result<(), MeshError> {
    let Some((k, found)) = first_fault(points) else { return Ok(()) };
    Err(MeshError::Invalid {
        file: file.into(),
        place: format!("point {k} of those that elements use, from 0"),
        found,
        allowed: "lengths in mm".into(),
    })
}

/// Writes a mesh by the file's ending: `.msh` (MSH 4.1, ASCII, one surface entity a CAD face) or `.vtu`.
///
/// # Errors
/// [`MeshError::Write`]; [`MeshError::Invalid`] for another ending.
pub fn write(mesh: &SurfaceMesh, path: &Path) -> Result<(), MeshError> {
    let ending = ending(path);
    match ending.as_str() {
        "msh" => Ok(msh_write::write(mesh, path)?),
        "vtu" => Ok(vtu::grid(mesh).write(path)?),
        _ => Err(other_ending(&path.display().to_string(), &ending, "msh, .vtu")),
    }
}

pub use sheet::{SheetElements, SheetMesh, parse_sheet, read_sheet};
pub use vtu::grid as to_vtu;

/// The element over a ring of vertices that each have a normal, if enough of them differ; with the normals of its corners.
fn with_normals(ring: &[(u32, Vec3)], face: u32) -> Option<(Element, CornerNormals)> {
    let ids: Vec<u32> = ring.iter().map(|corner| corner.0).collect();
    let element = Element::from_ring(&ids, face)?;
    let mut normals = [Vec3::zeros(); 4];
    for (normal, node) in normals.iter_mut().zip(element.nodes()) {
        let given = ring.iter().find(|corner| corner.0 == *node).map(|corner| corner.1);
        *normal = given.and_then(unit).unwrap_or_default();
    }
    Some((element, normals))
}

/// A mesh of such elements; without normals when all of them are zero.
fn of_elements(vertices: Vec<Vec3>, elements: Vec<(Element, CornerNormals)>) -> MeshFile {
    let (elements, normals): (Vec<_>, Vec<_>) = elements.into_iter().unzip();
    let mut mesh = SurfaceMesh { vertices, elements };
    mesh.compact();
    let none = normals.iter().flatten().all(|n| *n == Vec3::zeros());
    MeshFile { mesh, normals: if none { Vec::new() } else { normals } }
}

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
