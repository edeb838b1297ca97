//! Result of the evaluation of one face.

use kanagata_geometry::Vec3;

/// Errors of the patches of one face.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FaceResult {
    /// Number of patches.
    pub patches: usize,
    /// Maximum absolute shape error [mm]; infinite when there are no valid patches.
    pub error_mm: f64,
    /// Maximum normal error [degrees]; infinite when there are no valid patches.
    pub normal_deg: f64,
    /// Maximum distance from their creases of sides that lost their curves because patches folded [mm]. The error
    /// appears on the adjacent face when this face is flat.
    pub crease_deviation_mm: f64,
    /// Positions of the maximum errors of the worst patches [mm] and these errors [mm], the largest first.
    pub worst_points: Vec<(Vec3, f64)>,
    /// Measured edges of the plan, each with the maximum distance of the patch sides on it [mm]. At free borders only
    /// the component within the patches counts; the normal component is removed by the vertex motion.
    pub edge_deviations: Vec<(usize, f64)>,
}

impl FaceResult {
    /// Result without patches: `error` is zero for a face without area and infinite for a face without valid patches.
    pub(super) const fn without_patches(error: f64) -> Self {
        Self {
            patches: 0,
            error_mm: error,
            normal_deg: error,
            crease_deviation_mm: 0.0,
            worst_points: Vec::new(),
            edge_deviations: Vec::new(),
        }
    }
}
