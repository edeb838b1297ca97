//! A sheet from foreign elements: the thickness direction found, nodes put into columns, quadrilaterals turned alike.
//!
//! What runs through the thickness is told by the mesh itself, not by its measures. Two elements with a common face
//! have their directions in common: the one across the face, and the two along it. Directions of elements linked so
//! fall into families; the thickness is a family with one direction of every element (in a structured rectangle there
//! are three such, along x, y and z; over irregular quadrilaterals only one). Of several, that with columns as long
//! as the sheet is said to be thick is taken, or that with the shortest.

mod error;
mod families;
mod stacks;
#[cfg(test)]
mod tests;
mod turning;

pub use error::SheetError;
pub use turning::oriented;

use families::{all_different, candidates, one_part, shared_faces};
use stacks::Stacks;

use super::hex_mesh::HexMesh;
use crate::geometry::Vec3;

/// A sheet of hexahedra whose corners come in the order of VTK, gmsh and Abaqus (a ring of four and the ring above it).
/// The upper face is the one towards +z or, of a sheet that stands upright, towards its larger of +x and +y.
/// `stacked`: the two rings are known to be the lower and the upper face of each element. `thickness`: of several directions
/// that run through all elements, the one whose columns are nearest to so long [mm] is meant, if it is given.
///
/// # Errors
/// [`SheetError`].
pub fn from_hexahedra(
    points: &[Vec3],
    elements: &[[u32; 8]],
    stacked: bool,
    thickness: Option<f64>,
) -> Result<HexMesh, SheetError> {
    if let Some(element) = elements.iter().position(|e| !all_different(e)) {
        return Err(SheetError::Degenerate { element });
    }
    let shared = shared_faces(elements)?;
    one_part(elements.len(), shared.iter().map(|[a, b]| [a.0, b.0]))?;
    let candidates =
        if stacked { vec![vec![2; elements.len()]] } else { candidates(elements, &shared) };
    // Those of the thickness given, or the shortest; of like ones, those nearer to z.
    let mut best: Option<([f64; 2], Stacks)> = None;
    let mut fault = SheetError::NoDirection;
    for directions in &candidates {
        match Stacks::new(points, elements, directions) {
            Ok(stacks) => {
                let [length, along_z] = stacks.measures(points);
                let off = thickness.map_or(length, |thickness| (length - thickness).abs());
                let better = best.as_ref().is_none_or(|([least, z], _)| {
                    let alike = (off - least).abs() <= 1e-3 * length;
                    if alike { along_z > *z } else { off < *least }
                });
                if better {
                    best = Some(([off, along_z], stacks));
                }
            }
            Err(error) => fault = error,
        }
    }
    let (_, stacks) = best.ok_or(fault)?;
    stacks.mesh(points, elements)
}
