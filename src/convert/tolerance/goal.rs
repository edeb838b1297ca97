//! Goal and result of a refinement.

use std::time::Duration;

use crate::ConvertReport;
use kanagata_audit::AuditReport;
use kanagata_tool::ToolModel;

/// Tolerances of a refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Maximum absolute shape error (Eq. 24) [mm], > 0; infinite = not limited.
    pub tol_mm: f64,
    /// Maximum normal error [degrees], > 0; infinite = not limited.
    pub normal_deg: f64,
    /// Vertices may move off the CAD along their normals, so that the error has both signs. Vertices of planes stay in
    /// the plane.
    pub two_sided: bool,
    /// Connection of adjacent faces.
    pub borders: Borders,
}

/// What a refinement aims at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// The smallest shape error with at most this many patches.
    Patches {
        /// Number of patches.
        patches: usize,
        /// As [`Goal::two_sided`].
        two_sided: bool,
        /// Connection of adjacent faces.
        borders: Borders,
    },
    /// The fewest patches within a goal, in about this time if it is given.
    Within(Goal, Option<Duration>),
}

/// Connection of the patches of adjacent faces at their common CAD edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Borders {
    /// The patches share vertices and curves, without a gap.
    #[default]
    Conforming,
    /// Every face has the divisions that its own error requires. The border gap is at most the tolerance, or 1e-3 of
    /// the model size without a length tolerance. If this saves no patches, the model is conforming.
    Independent,
}

/// A model refined to a goal.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The model.
    pub tool: ToolModel,
    /// Report of the conversion.
    pub report: ConvertReport,
    /// Audit of the model.
    pub audit: AuditReport,
    /// Maximum distance by which a vertex was moved off the CAD [mm].
    pub moved_mm: f64,
    /// Maximum distance by which a vertex was moved within a flat, off its smooth border [mm].
    pub slid_mm: f64,
    /// Connection of adjacent faces.
    pub borders: Borders,
    /// False when the search for fewer patches ended at its limit of work or time.
    pub saved_all: bool,
}
