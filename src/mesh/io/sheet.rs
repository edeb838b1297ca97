//! Reads sheet meshes.

use std::path::Path;

use super::mesh_file::MeshFile;
use super::named::{bytes_of, check_points, ending, is_parsed, name_of};
use super::read::{parse, read_file};
use super::volumes::{SheetElements, SheetMesh, Volumes, used};
use super::{abaqus, msh_read, vtu};
use crate::MeshError;

/// Reads a sheet from `.msh` (2.2, 4.1), `.vtu` or an Abaqus deck (`.inp`): its hexahedra or, without any, its
/// quadrilaterals. Other formats of [`super::read`] yield their quadrilaterals. Coordinates are in mm.
///
/// # Errors
/// As [`super::read`]; [`MeshError::Invalid`] also for other element types and for a file without elements.
pub fn read_sheet(path: &Path) -> Result<SheetMesh, MeshError> {
    let name = name_of(path);
    if is_sheet(&name) {
        return parse_sheet(&bytes_of(path)?, &name);
    }
    quads(read_file(path)?, Vec::new(), &name)
}

/// True when [`parse_sheet`] supports files of this name.
fn is_sheet(name: &str) -> bool {
    is_parsed(name) || ending(Path::new(name)) == "inp"
}

/// The sheet in the bytes of a file. The format follows from the extension of its name: `.inp` or one supported by
/// [`super::parse`].
///
/// # Errors
/// As [`read_sheet`]; also for other extensions.
pub fn parse_sheet(bytes: &[u8], name: &str) -> Result<SheetMesh, MeshError> {
    let sheet = match ending(Path::new(name)).as_str() {
        "inp" => abaqus::parse(bytes, name)?,
        "vtu" => {
            let grid = vtu::grid_of(bytes, name)?;
            let results = vtu::results(&grid);
            let volumes = vtu::volumes(&grid, name)?;
            if volumes.hexahedra.is_empty() {
                quads(vtu::surfaces(grid, name)?, results, name)?
            } else {
                SheetMesh { results, ..of_hexahedra(volumes) }
            }
        }
        "msh" => {
            let results = msh_read::fields(bytes);
            match msh_read::parse_sheet(bytes, name)? {
                Ok(volumes) => SheetMesh { results, ..of_hexahedra(volumes) },
                Err(surfaces) => quads(surfaces.into(), results, name)?,
            }
        }
        _ => return quads(parse(bytes, name)?, Vec::new(), name),
    };
    check_points(name, &sheet.points)?;
    Ok(sheet)
}

/// The sheet of the hexahedra of a file.
fn of_hexahedra(Volumes { points, hexahedra }: Volumes) -> SheetMesh {
    let (points, elements) = used(&points, hexahedra);
    let elements = SheetElements::Hexahedra { elements, stacked: false };
    SheetMesh { points, elements, results: Vec::new() }
}

/// The sheet of the surface elements of a file, all of which must be quadrilaterals.
fn quads(file: MeshFile, results: Vec<String>, name: &str) -> Result<SheetMesh, MeshError> {
    let mesh = file.mesh;
    let invalid = |found: String| MeshError::Invalid {
        file: name.into(),
        place: "elements".into(),
        found,
        allowed: "quadrilaterals or hexahedra".into(),
    };
    let mut quads = Vec::with_capacity(mesh.elements.len());
    for (k, element) in mesh.elements.iter().enumerate() {
        let quad = <[u32; 4]>::try_from(element.nodes())
            .map_err(|_| invalid(format!("element {k} with {} nodes", element.nodes().len())))?;
        quads.push(quad);
    }
    if quads.is_empty() {
        return Err(invalid("no element".into()));
    }
    let (points, quads) = used(&mesh.vertices, quads);
    Ok(SheetMesh { points, elements: SheetElements::Quads(quads), results })
}
