//! Tool models of meshes without CAD, with normals from the file or estimated from the facets.
//!
//! - [`orient`]: consistent orientation of the elements of each connected part
//! - [`fans`]: groups of element corners at a vertex, bounded by creases, with a common normal
//! - [`estimate`]: area-weighted means of facet normals

mod estimate;
mod fans;
mod orient;
#[cfg(test)]
mod tests;

use super::conversion::{Conversion, Source};
use super::normals::{NormalTable, merge_normals};
use super::{ConvertError, ConvertOptions, ConvertReport};
use kanagata_geometry::Vec3;
use kanagata_mesh::SurfaceMesh;
use kanagata_mesh::io::{CornerNormals, MeshFile, UNATTACHED};
use kanagata_tool::{ToolKind, ToolModel};

use self::fans::Fans;

/// Counts of normals by source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NormalSource {
    /// Number of element corners with a normal from the file.
    pub given: usize,
    /// Number of element corners with an estimated normal.
    pub estimated: usize,
    /// Number of smooth regions: they are bounded by creases and free edges.
    pub regions: usize,
}

/// Converts a mesh without CAD. Normals that the file does not contain are estimated. An edge is a crease where the
/// facets meet at more than `crease_deg`. If no element has a face, each gets the number of its smooth region.
///
/// # Errors
/// [`ConvertError::NoElements`], [`ConvertError::OneSided`], [`ConvertError::Kind`] for Bezier patches;
/// [`ConvertError::Normal`] where all facets at a vertex have zero area.
pub fn convert_mesh(
    file: &MeshFile,
    options: &ConvertOptions,
    crease_deg: f64,
) -> Result<(ToolModel, ConvertReport, NormalSource), ConvertError> {
    if options.kind == ToolKind::Bezier {
        return Err(ConvertError::Kind);
    }
    if file.mesh.elements.is_empty() {
        return Err(ConvertError::NoElements);
    }
    let mut file = orient::orient(file)?;
    let fans = Fans::new(&file.mesh, crease_deg.to_radians().cos());
    let regions = assign_faces(&mut file.mesh, &fans);
    let (corners, source) = corner_normals(&file, &fans)?;
    let table = number_normals(&file.mesh, &corners, options.smooth_deg.to_radians());
    let source = NormalSource { regions, ..source };
    let conversion = Conversion::new(Source::Mesh(&table), &file.mesh, options)?;
    let (tool, report) = conversion.convert_and_repair()?;
    Ok((tool, report, source))
}

/// Assigns faces to elements without one and returns the number of regions. The face is the region if no element of the
/// mesh has a face, otherwise face 0.
fn assign_faces(mesh: &mut SurfaceMesh, fans: &Fans) -> usize {
    let attached = mesh.elements.iter().any(|e| e.face != UNATTACHED);
    for (element, &region) in mesh.elements.iter_mut().zip(&fans.region_of) {
        if !attached {
            element.face = region;
        } else if element.face == UNATTACHED {
            element.face = 0;
        }
    }
    fans.regions
}

/// Normal of each corner of each element: from the file, otherwise estimated.
fn corner_normals(
    file: &MeshFile,
    fans: &Fans,
) -> Result<(Vec<CornerNormals>, NormalSource), ConvertError> {
    let mesh = &file.mesh;
    let mut corners = file.normals.clone();
    corners.resize(mesh.elements.len(), [Vec3::zeros(); 4]);
    let mut source = NormalSource { given: 0, estimated: 0, regions: 0 };
    let mut estimated: Option<Vec<Vec3>> = None;
    for (k, (element, normals)) in mesh.elements.iter().zip(&mut corners).enumerate() {
        for (at, &node) in element.nodes().iter().enumerate() {
            if normals[at] != Vec3::zeros() {
                source.given += 1;
                continue;
            }
            source.estimated += 1;
            let all = estimated.get_or_insert_with(|| estimate::mean_normals(mesh, fans));
            normals[at] = all[fans.fan_at(k, at)];
            if normals[at] == Vec3::zeros() {
                let x = mesh.vertices[node as usize];
                let face = format!("element {k} of the mesh");
                return Err(ConvertError::Normal { face, x: x.x, y: x.y, z: x.z });
            }
        }
    }
    Ok((corners, source))
}

/// Merges the normals of each vertex within `smooth` [rad] and indexes them by element corner.
fn number_normals(mesh: &SurfaceMesh, corners: &[CornerNormals], smooth: f64) -> NormalTable {
    let mut at: Vec<Vec<(usize, usize)>> = vec![Vec::new(); mesh.vertices.len()];
    let mut ids: Vec<Vec<u32>> = Vec::with_capacity(mesh.elements.len());
    for (k, element) in mesh.elements.iter().enumerate() {
        element.nodes().iter().enumerate().for_each(|(c, &node)| at[node as usize].push((k, c)));
        ids.push(vec![0; element.nodes().len()]);
    }
    let mut normals: Vec<Vec3> = Vec::new();
    for places in &at {
        let here: Vec<Vec3> = places.iter().map(|&(k, c)| corners[k][c]).collect();
        let numbers = merge_normals(&here, smooth, &mut normals);
        places.iter().zip(numbers).for_each(|(&(k, c), number)| ids[k][c] = number);
    }
    NormalTable { normals, ids, ..NormalTable::default() }
}
