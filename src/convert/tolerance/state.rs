//! Divisions of a model's edges and of the insides of its faces, and what every face makes of them.

use super::figures::Figures;
use crate::geometry::Vec3;
use crate::mesh::mapped::plan::Divisions;

/// Divisions tried, and what every face makes of them.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// Least divisions of each edge.
    pub minima: Vec<usize>,
    /// Divisions of a quarter turn inside each face where that is not up to its edges.
    pub density: Vec<usize>,
    pub divisions: Divisions,
    pub faces: Vec<Figures>,
    /// Error of each face over its tolerance.
    pub badness: Vec<f64>,
}

impl State {
    /// Patches in all.
    pub fn patches(&self) -> usize {
        self.faces.iter().map(|f| f.patches).sum()
    }

    /// Largest shape error [mm] and normal error [degrees] of a face.
    pub fn figures(&self, face: usize) -> (f64, f64) {
        (self.faces[face].error_mm, self.faces[face].normal_deg)
    }

    /// Where the error of a face is largest.
    pub fn worst(&self, face: usize) -> Option<Vec3> {
        self.faces[face].worst
    }

    /// Measured edges of a face, each with how far the patches' sides on it are from it [mm].
    pub fn off(&self, face: usize) -> &[(usize, f64)] {
        &self.faces[face].off
    }

    /// Divisions of edges and insides of faces: what the mesh depends on.
    pub fn key(&self) -> (Divisions, Vec<usize>) {
        (self.divisions.clone(), self.density.clone())
    }

    /// True when it has these divisions.
    pub fn is_of(&self, (divisions, density): &(Divisions, Vec<usize>)) -> bool {
        self.divisions == *divisions && self.density == *density
    }

    /// Error of a face over the tolerance, without its share.
    pub fn badness(&self, face: usize) -> f64 {
        self.badness[face]
    }
}
