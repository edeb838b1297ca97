//! What a model is refined to, and the model it becomes.

use crate::audit::AuditReport;
use crate::convert::ConvertReport;
use crate::tool::ToolModel;

/// What a model is refined to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Largest |shape error| (Eq. 24) [mm], > 0; infinite = any.
    pub tol_mm: f64,
    /// Largest normal error [degrees], > 0; infinite = any.
    pub normal_deg: f64,
    /// Vertices may leave the CAD along their normals, so that the error has two sides. Those on planes stay.
    pub two_sided: bool,
    /// How faces meet.
    pub borders: Borders,
}

/// How the patches of neighbouring faces meet on the edge of the CAD between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Borders {
    /// They share vertices and curves: no gap.
    #[default]
    Conforming,
    /// Every face has the divisions that its own error asks for; borders are no farther apart than the tolerance, nor
    /// than a thousandth of the model's size where there is no tolerance for lengths. Where that takes no fewer
    /// patches, as conforming.
    Independent,
}

/// A model refined to a goal.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The model.
    pub tool: ToolModel,
    /// What its conversion found.
    pub report: ConvertReport,
    /// Its audit.
    pub audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    pub moved_mm: f64,
    /// Largest distance that a vertex was moved within a flat, off its smooth border [mm].
    pub slid_mm: f64,
    /// How its faces meet.
    pub borders: Borders,
    /// False where the search for fewer patches ended at its work limit.
    pub saved_all: bool,
}
