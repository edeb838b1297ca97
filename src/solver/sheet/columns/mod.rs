//! Sheet from an imported mesh: detects the thickness direction, groups nodes in columns, orients quadrilaterals
//! consistently.
//!
//! The thickness direction follows from the connectivity, not from dimensions. Two elements with a common face share
//! their directions: the one across the face and the two along it. Linked directions form families; a candidate for
//! the thickness is a family with exactly one direction of every element. A structured rectangle has three candidates
//! (x, y and z), irregular quadrilaterals have one. Among several, the one with columns closest to the given
//! thickness is used, otherwise the one with the shortest columns.

mod error;
mod families;
mod stacks;
#[cfg(test)]
mod tests;
mod turning;

pub use error::SheetError;
pub use turning::oriented;

use families::{all_different, candidates, check_connected, common_faces};
use stacks::Stacks;

use super::hex_mesh::HexMesh;
use kanagata_geometry::Vec3;

/// Sheet from hexahedra with corners in the order of VTK, gmsh and Abaqus (a ring of four and the ring above it). The
/// upper face is on the +z side or, for a vertical sheet, on the side of the larger of +x and +y.
///
/// `stacked`: the two rings are known to be the lower and the upper face of each element. `thickness` [mm]: selects
/// among several candidate directions the one whose columns are closest to this length.
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
    let shared = common_faces(elements)?;
    check_connected(elements.len(), shared.iter().map(|[a, b]| [a.0, b.0]))?;
    let candidates =
        if stacked { vec![vec![2; elements.len()]] } else { candidates(elements, &shared) };
    // Closest to the given thickness, or shortest; among equals the one closest to z.
    let mut best: Option<([f64; 2], Stacks)> = None;
    let mut fault = SheetError::NoDirection;
    for directions in &candidates {
        match Stacks::new(points, elements, directions) {
            Ok(stacks) => {
                let [length, along_z] = stacks.measures(points);
                let deviation = thickness.map_or(length, |thickness| (length - thickness).abs());
                let better = best.as_ref().is_none_or(|([smallest, z], _)| {
                    let alike = (deviation - smallest).abs() <= 1e-3 * length;
                    if alike { along_z > *z } else { deviation < *smallest }
                });
                if better {
                    best = Some(([deviation, along_z], stacks));
                }
            }
            Err(error) => fault = error,
        }
    }
    let (_, stacks) = best.ok_or(fault)?;
    stacks.mesh(points, elements)
}
