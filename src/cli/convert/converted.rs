//! Result of a conversion.

use crate::audit::{AuditReport, doubts_advising};
use crate::convert::tolerance::Borders as Meeting;
use crate::convert::{ConvertReport, renumber};
use crate::report::doubt::Doubt;
use crate::tool::ToolModel;

/// Result of a conversion by any method.
pub(super) struct Converted {
    pub(super) tool: ToolModel,
    pub(super) report: ConvertReport,
    pub(super) refined: Option<Fit>,
}

impl Converted {
    /// Renumbers faces to indices of the whole model: `whole[f]` for face f.
    pub(super) fn renumber(&mut self, whole: &[usize]) {
        renumber(&mut self.tool, whole);
        let (finer, bare) = (&mut self.report.finer, &mut self.report.bare);
        finer.iter_mut().chain(bare).for_each(|f| *f = whole[*f]);
        let Some(fit) = &mut self.refined else { return };
        let renumbered = |f: &mut u32| *f = whole[*f as usize] as u32;
        fit.audit.worst.iter_mut().for_each(|w| renumbered(&mut w.face));
        fit.audit.faces.iter_mut().for_each(|f| renumbered(&mut f.face));
    }
}

impl Fit {
    /// Doubts about a model that is not within its goal.
    pub(super) fn doubts(&self) -> Vec<Doubt> {
        let limit = if self.search_converged { "" } else { " at its limit of work or time" };
        let advice = |_| {
            format!(
                "The search for a finer model ended{limit}. Allow a larger error, or repair this face in the CAD."
            )
        };
        doubts_advising(&self.audit, &advice)
    }
}

/// Result of a refinement.
pub(super) struct Fit {
    pub(super) audit: AuditReport,
    /// Largest distance of a vertex from the CAD [mm].
    pub(super) moved_mm: f64,
    /// Largest shift of a vertex within a flat face, off its smooth border [mm].
    pub(super) slid_mm: f64,
    pub(super) borders: Meeting,
    /// Whether the search for fewer patches has converged rather than reached its work limit.
    pub(super) search_converged: bool,
    /// Whether independent borders were requested.
    pub(super) independent_requested: bool,
}
