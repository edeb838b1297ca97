//! What the audit of the patches of a face says.

use crate::geometry::Vec3;

/// What the audit of a face's patches says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Figures {
    /// Patches.
    pub patches: usize,
    /// Largest |shape error| [mm]; infinite when the face cannot be meshed so.
    pub error_mm: f64,
    /// Largest normal error [degrees]; infinite when the face cannot be meshed so.
    pub normal_deg: f64,
    /// How far sides that lost their curves, as patches folded, are from the creases they are on [mm]: what the faces
    /// beyond them are then off, though a flat is not.
    pub cut_mm: f64,
    /// Where the error is largest, if there are patches.
    pub worst: Option<Vec3>,
    /// Measured edges of the plan's model, each with the largest distance of the patches' sides on it from it [mm]: at free
    /// borders the part of it within the patches, as moving vertices along their normals takes off the other.
    pub off: Vec<(usize, f64)>,
}

impl Figures {
    /// No patches: a face of no area, or one that cannot be meshed so, whose errors are infinite.
    pub(super) const fn bare(error: f64) -> Self {
        Self {
            patches: 0,
            error_mm: error,
            normal_deg: error,
            cut_mm: 0.0,
            worst: None,
            off: Vec::new(),
        }
    }
}
