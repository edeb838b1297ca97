//! Tool models of meshes without CAD: with the normals that the file gives, or with those estimated from its vertices.
//!
//! - [`orient`]: elements turned so that all of a part look the same way
//! - [`fans`]: corners at a vertex that have one normal: those between creases
//! - [`estimate`]: means of the facets' normals

mod estimate;
mod fans;
mod orient;
#[cfg(test)]
mod tests;

use super::ground::{Ground, Source};
use super::normals::{NormalTable, merged};
use super::{ConvertError, ConvertOptions, ConvertReport};
use crate::geometry::Vec3;
use crate::mesh::SurfaceMesh;
use crate::mesh::io::{CornerNormals, MeshFile, UNATTACHED};
use crate::tool::{ToolKind, ToolModel};

use self::fans::Fans;

/// Where the normals of such a model come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NormalSource {
    /// Corners whose normals the file gives.
    pub given: usize,
    /// Corners whose normals were estimated.
    pub estimated: usize,
    /// Parts that meet in creases, or not at all.
    pub regions: usize,
}

/// Converts a mesh without CAD. Where the file gives no normals, they are estimated; elements that meet at more than
/// `crease_deg` meet in a crease. Elements without a face get the number of the region between creases that they are in.
///
/// # Errors
/// [`ConvertError::NoElements`], [`ConvertError::OneSided`], [`ConvertError::Kind`] for Bezier patches;
/// [`ConvertError::Normal`] where the mesh is a line.
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
    let mut file = orient::oriented(file)?;
    let fans = Fans::new(&file.mesh, crease_deg.to_radians().cos());
    let regions = number_faces(&mut file.mesh, &fans);
    let (corners, source) = corner_normals(&file, &fans)?;
    let table = numbered(&file.mesh, &corners, options.smooth_deg.to_radians());
    let source = NormalSource { regions, ..source };
    let ground = Ground::new(Source::Own(&table), &file.mesh, options)?;
    let (tool, report) = ground.convert_and_repair()?;
    Ok((tool, report, source))
}

/// Gives elements without a face that of their region; returns how many faces there are then.
fn number_faces(mesh: &mut SurfaceMesh, fans: &Fans) -> usize {
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

/// The normal of every corner of every element.
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
            let all = estimated.get_or_insert_with(|| estimate::normals(mesh, fans));
            normals[at] = all[fans.of(k, at)];
            if normals[at] == Vec3::zeros() {
                let x = mesh.vertices[node as usize];
                let face = format!("element {k} of the mesh");
                return Err(ConvertError::Normal { face, x: x.x, y: x.y, z: x.z });
            }
        }
    }
    Ok((corners, source))
}

/// Numbers the normals; those at a vertex that differ by less than `smooth` [rad] are one, their mean.
fn numbered(mesh: &SurfaceMesh, corners: &[CornerNormals], smooth: f64) -> NormalTable {
    let mut at: Vec<Vec<(usize, usize)>> = vec![Vec::new(); mesh.vertices.len()];
    let mut ids: Vec<Vec<u32>> = Vec::with_capacity(mesh.elements.len());
    for (k, element) in mesh.elements.iter().enumerate() {
        element.nodes().iter().enumerate().for_each(|(c, &node)| at[node as usize].push((k, c)));
        ids.push(vec![0; element.nodes().len()]);
    }
    let mut normals: Vec<Vec3> = Vec::new();
    for places in &at {
        let here: Vec<Vec3> = places.iter().map(|&(k, c)| corners[k][c]).collect();
        let numbers = merged(&here, smooth, &mut normals);
        places.iter().zip(numbers).for_each(|(&(k, c), number)| ids[k][c] = number);
    }
    NormalTable { normals, ids, ..NormalTable::default() }
}
