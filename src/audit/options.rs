//! Choices of an audit.

/// Choices of an audit.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditOptions {
    /// Intervals of the grid of points along a side of a patch (1 to 256).
    pub samples: usize,
    /// Patches of each CAD face around whose worst points the extremes are searched for, at most.
    pub refine: usize,
    /// Whether the extremes of the normal error are searched for too: else they are those of the grid.
    pub refine_normals: bool,
    /// Whether the free borders are compared.
    pub borders: bool,
    /// How many patches `worst` lists.
    pub worst: usize,
    /// Largest |shape error| allowed [mm].
    pub tolerance_mm: Option<f64>,
    /// Largest normal error allowed [degrees].
    pub normal_tolerance_deg: Option<f64>,
}

impl Default for AuditOptions {
    fn default() -> Self {
        Self {
            samples: 8,
            refine: 256,
            refine_normals: true,
            borders: true,
            worst: 10,
            tolerance_mm: None,
            normal_tolerance_deg: None,
        }
    }
}
