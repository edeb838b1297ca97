//! Penetration of tools into the faces of the sheet.
//!
//! Contact conditions act on nodes. Between nodes the face of an element, a bilinear surface, may penetrate a tool. A
//! face of width w bridges a convex radius R with a sag of about w²/(8 R), and a feature narrower than w may pass
//! between nodes. After each increment the depth is measured from both sides:
//!
//! - from the sheet: signed distance of the midpoints of faces and of their sides to every tool;
//! - from the tool: distance of its convex features (`features`) behind the closest face (`faces`).
//!
//! The largest depth is reported. It is a measure of mesh resolution, not of convergence: nodes satisfy their
//! conditions.

pub(crate) mod faces;
mod features;

use crate::sheet::hex_mesh::HexMesh;
use crate::tools::tool::{SheetSide, Tool};
use faces::{Face, faces_of};
pub(crate) use features::Features;
use kanagata_geometry::Vec3;

/// The deepest point of a tool inside a face of the sheet, or of a face inside a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacePenetration {
    /// Index of the tool.
    pub tool: usize,
    /// Depth [mm].
    pub depth: f64,
    /// Position [mm].
    pub at: Vec3,
}

/// Penetration in one configuration.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaceDepths {
    /// The deepest of all; `None` if there is none.
    pub deepest: Option<FacePenetration>,
    /// Largest depth in the faces of each element [mm]; 0 where there is none.
    pub of_elements: Vec<f64>,
}

impl FaceDepths {
    /// Adds depths [mm], positions and elements for one tool. Of equal ones the first is the deepest, whatever the number of
    /// threads.
    pub(crate) fn add(&mut self, tool: usize, found: &[(f64, Vec3, u32)]) {
        for &(depth, at, element) in found {
            let known = &mut self.of_elements[element as usize];
            *known = known.max(depth);
            if depth > self.deepest.map_or(0.0, |deepest| deepest.depth) {
                self.deepest = Some(FacePenetration { tool, depth, at });
            }
        }
    }
}

/// Data that do not change during a run: element faces on either side of the sheet, features of every tool.
pub(crate) struct Penetration {
    sides: Vec<(SheetSide, Vec<Face>)>,
    pub(crate) features: Vec<Features>,
}

impl Penetration {
    /// For a sheet with elements at most `longest_edge` [mm] long.
    pub(crate) fn of(mesh: &HexMesh, tools: &[Tool], longest_edge: f64) -> Self {
        let mut sides: Vec<(SheetSide, Vec<Face>)> = Vec::new();
        for tool in tools {
            let side = tool.setup.side;
            if !sides.iter().any(|(existing, _)| *existing == side) {
                sides.push((side, faces_of(mesh, side)));
            }
        }
        let features = tools.iter().map(|t| Features::of(&t.setup.surface, longest_edge)).collect();
        Self { sides, features }
    }

    pub(crate) fn faces(&self, side: SheetSide) -> &[Face] {
        self.sides.iter().find(|(existing, _)| *existing == side).map_or(&[], |(_, faces)| faces)
    }
}

#[cfg(test)]
mod tests;
