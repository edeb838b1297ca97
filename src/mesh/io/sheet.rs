//! Files of a sheet: hexahedra, or quadrilaterals that still want a thickness.

use std::path::Path;

use super::{abaqus, msh_read, vtu};
use crate::geometry::{Aabb, Vec3};
use crate::mesh::MeshError;

/// Hexahedra of a file that may also have surfaces.
pub(super) struct Volumes {
    pub(super) points: Vec<Vec3>,
    pub(super) hexahedra: Vec<[u32; 8]>,
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
    let made = parse_sheet(path)?;
    super::judge(path, &made.points)?;
    Ok(made)
}

fn parse_sheet(path: &Path) -> Result<SheetMesh, MeshError> {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let bytes = || {
        std::fs::read(path).map_err(|source| MeshError::Read { path: path.to_path_buf(), source })
    };
    let volumes = match ending.as_str() {
        "inp" => return abaqus::parse(&bytes()?, &name),
        "vtu" => Some(vtu::read_volumes(path, &name)?),
        "msh" => Some(msh_read::parse_volumes(&bytes()?, &name)?),
        _ => None,
    };
    if let Some(Volumes { points, hexahedra }) = volumes.filter(|v| !v.hexahedra.is_empty()) {
        let (points, elements) = used(&points, hexahedra);
        let elements = SheetElements::Hexahedra { elements, stacked: false };
        return Ok(SheetMesh { points, elements });
    }
    let mesh = super::read(path)?;
    let invalid = |found: String| MeshError::Invalid {
        file: name.clone(),
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
    Ok(SheetMesh { points, elements: SheetElements::Quads(quads) })
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
