//! Files of a sheet: hexahedra, or quadrilaterals that still want a thickness.

use std::path::Path;

use super::{MeshFile, abaqus, ending, is_parsed, judge, msh_read, name_of, vtu};
use crate::geometry::{Aabb, Vec3};
use crate::mesh::MeshError;

/// Hexahedra of a file that may also have surfaces.
pub(super) struct Volumes {
    pub(super) points: Vec<Vec3>,
    pub(super) hexahedra: Vec<[u32; 8]>,
}

/// Whether a field of this name and these values says that a mesh has been deformed. Values that are all zero say that it has not,
/// nor does a thickness that is the same everywhere.
pub(super) fn is_result(name: &str, values: &[f64]) -> bool {
    /// Parts of the names that this and other solvers give results.
    const NAMES: [&str; 6] =
        ["strain", "stress", "displacement", "plastic", "peeq", "contact_force"];
    /// Difference of thicknesses that is rounding, as a fraction.
    const SAME: f64 = 1e-5;
    let name = name.to_lowercase();
    if name.contains("thickness") && !name.contains("strain") {
        let ends = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)]);
        return ends[1] - ends[0] > SAME * ends[1].abs();
    }
    NAMES.iter().any(|part| name.contains(part)) && values.iter().any(|x| *x != 0.0)
}

/// Elements of a sheet, corners as VTK, gmsh and Abaqus order them.
#[derive(Debug, Clone, PartialEq)]
pub enum SheetElements {
    /// Quadrilaterals.
    Quads(Vec<[u32; 4]>),
    /// Hexahedra: a ring of four nodes and the ring above it. `stacked`: the file says that those are the lower and
    /// the upper face of the sheet (continuum shells); otherwise they may lie any way.
    Hexahedra {
        /// Node ids.
        elements: Vec<[u32; 8]>,
        /// Rings are faces of the sheet.
        stacked: bool,
    },
}

/// A sheet as a file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetMesh {
    /// Points that elements use [mm], in the file's order.
    pub points: Vec<Vec3>,
    /// Elements.
    pub elements: SheetElements,
    /// Names of fields that say it has been deformed: strains, stresses, displacements, a thickness that varies.
    pub results: Vec<String>,
}

impl SheetMesh {
    /// Box around all points.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        Aabb::of_points(&self.points)
    }
}

/// Reads a sheet from `.msh` (2.2, 4.1), `.vtu` or an Abaqus deck (`.inp`): its hexahedra or, if there is none, its
/// quadrilaterals; from any other file that [`super::read`] takes, its quadrilaterals. Coordinates are taken as mm.
///
/// # Errors
/// As [`super::read`]; [`MeshError::Invalid`] also for elements of another kind and for a file without any.
pub fn read_sheet(path: &Path) -> Result<SheetMesh, MeshError> {
    let name = name_of(path);
    if is_sheet(&name) {
        return parse_sheet(&super::bytes_of(path)?, &name);
    }
    quads(super::read_file(path)?, Vec::new(), &name)
}

/// Whether [`parse_sheet`] reads files of this name.
fn is_sheet(name: &str) -> bool {
    is_parsed(name) || ending(Path::new(name)) == "inp"
}

/// The sheet in the bytes of a file, whose kind the ending of its name says: `.inp` or one that [`super::parse`] reads.
///
/// # Errors
/// As [`read_sheet`]; also for another ending.
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
        _ => return quads(super::parse(bytes, name)?, Vec::new(), name),
    };
    judge(name, &sheet.points)?;
    Ok(sheet)
}

/// The sheet of a file's hexahedra.
fn of_hexahedra(Volumes { points, hexahedra }: Volumes) -> SheetMesh {
    let (points, elements) = used(&points, hexahedra);
    let elements = SheetElements::Hexahedra { elements, stacked: false };
    SheetMesh { points, elements, results: Vec::new() }
}

/// The sheet of a file's surface elements, all of which are quadrilaterals.
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

/// The points that elements use, in their order, and the elements by them.
pub(super) fn used<const N: usize>(
    points: &[Vec3],
    mut elements: Vec<[u32; N]>,
) -> (Vec<Vec3>, Vec<[u32; N]>) {
    let mut number = vec![u32::MAX; points.len()];
    elements.iter().flatten().for_each(|&n| number[n as usize] = 0);
    let mut kept = Vec::new();
    for (id, p) in number.iter_mut().zip(points).filter(|(id, _)| **id == 0) {
        *id = kept.len() as u32;
        kept.push(*p);
    }
    elements.iter_mut().flatten().for_each(|n| *n = number[*n as usize]);
    (kept, elements)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_a_deformed_sheet_are_told_from_those_of_a_virgin_one() {
        for (name, values, expected) in [
            ("plastic_strain", [0.0, 0.1], true),
            ("plastic_strain", [0.0, 0.0], false),
            ("PEEQ", [0.0, 0.1], true),
            ("Stress_mpa", [1.0, -1.0], true),
            ("displacement_mm", [0.0, 1e-3], true),
            ("thickness_mm", [1.0, 0.9], true),
            ("thickness_mm", [1.0, 1.0 + 1e-8], false),
            ("thickness_strain", [-0.1, -0.1], true),
            ("face", [3.0, 4.0], false),
        ] {
            assert_eq!(is_result(name, &values), expected, "{name} {values:?}");
        }
    }
}
