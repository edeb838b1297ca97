//! Options of an audit.

use kanagata_progress::Progress;

/// Options of an audit.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditOptions {
    /// Intervals of the sample grid per patch side (1 to 256).
    pub samples: usize,
    /// Maximum number of patches per CAD face around whose worst points the extremes are refined. With 0, one more point of
    /// each patch that matters is evaluated.
    pub refine: usize,
    /// With `refine` 0: whether the extremes are estimated from the grid instead, which costs nothing.
    pub estimate: bool,
    /// Whether the extremes of the normal error are refined as well, instead of taken from the grid.
    pub refine_normals: bool,
    /// Whether the areas of patches are integrated, instead of summed over the grid.
    pub areas: bool,
    /// Whether the free borders are compared.
    pub borders: bool,
    /// Number of patches listed in `worst`.
    pub worst: usize,
    /// Allowed |shape error| [mm].
    pub tolerance_mm: Option<f64>,
    /// Allowed normal error [degrees].
    pub normal_tolerance_deg: Option<f64>,
    /// Where the progress is reported.
    pub progress: Progress,
}

impl Default for AuditOptions {
    fn default() -> Self {
        Self {
            samples: 8,
            refine: 256,
            estimate: false,
            refine_normals: true,
            areas: true,
            borders: true,
            worst: 10,
            tolerance_mm: None,
            normal_tolerance_deg: None,
            progress: Progress::default(),
        }
    }
}
