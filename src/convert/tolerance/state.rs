//! State of a search: divisions of edges and faces, with the resulting errors.

use std::sync::Arc;

use super::face_result::FaceResult;
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::plan::Divisions;

/// Divisions of a model and the resulting errors of its faces.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// Minimum divisions of each edge.
    pub minima: Vec<usize>,
    /// Divisions per quarter turn inside each face, where they are independent of its edges.
    pub density: Vec<usize>,
    /// Divisions of all edges consistent with `minima`.
    pub divisions: Divisions,
    /// Result of each face.
    pub faces: Vec<Arc<FaceResult>>,
    /// Error of each face over the tolerance.
    pub error_ratios: Vec<f64>,
}

impl State {
    /// Total number of patches.
    pub fn patches(&self) -> usize {
        self.faces.iter().map(|f| f.patches).sum()
    }

    /// Maximum shape error [mm] and normal error [degrees] of a face.
    pub fn errors(&self, face: usize) -> (f64, f64) {
        (self.faces[face].error_mm, self.faces[face].normal_deg)
    }

    /// Position of the maximum error of a face [mm].
    pub fn worst_point(&self, face: usize) -> Option<Vec3> {
        self.faces[face].worst_points.first().map(|p| p.0)
    }

    /// Measured edges of a face, each with the maximum distance of the patch sides on it [mm].
    pub fn edge_deviations(&self, face: usize) -> &[(usize, f64)] {
        &self.faces[face].edge_deviations
    }

    /// Error of a face over the tolerance, without its tolerance factor.
    pub fn error_ratio(&self, face: usize) -> f64 {
        self.error_ratios[face]
    }
}
