//! What a conversion gives.

use crate::audit::AuditReport;
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::{ConvertReport, renumber};
use crate::tool::ToolModel;

/// What a conversion gives, whichever way it was made.
pub(super) struct Converted {
    pub(super) tool: ToolModel,
    pub(super) report: ConvertReport,
    pub(super) refined: Option<Fit>,
}

impl Converted {
    /// Gives faces the numbers that they have in the whole model: `whole[f]` for face f.
    pub(super) fn renumber(&mut self, whole: &[usize]) {
        renumber(&mut self.tool, whole);
        let (finer, bare) = (&mut self.report.finer, &mut self.report.bare);
        finer.iter_mut().chain(bare).for_each(|f| *f = whole[*f]);
    }
}

/// What refinement says of its model.
pub(super) struct Fit {
    pub(super) audit: AuditReport,
    /// Largest distance that a vertex was moved off the CAD [mm].
    pub(super) moved_mm: f64,
    /// Largest distance that a vertex slid within a flat, off its smooth border [mm].
    pub(super) slid_mm: f64,
    pub(super) borders: Meeting,
    /// The search for fewer patches ended by itself, not at its work limit.
    pub(super) saved_all: bool,
    /// Faces were to be divided independently.
    pub(super) asked_apart: bool,
}
