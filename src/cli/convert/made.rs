//! A tool whose file is written, and what is printed of it.

use std::collections::BTreeSet;

use super::args::ConvertArgs;
use super::converted::{Converted, Fit};
use super::folds::warn_of_folds;
use super::kinds::print_within;
use super::print::{print_reach, print_report};
use crate::convert::bezier::Within;
use crate::reach::Reached;
use crate::report::doubt::Doubt;

/// A tool whose file is written, with doubts about its CAD or the offset of it.
pub(super) struct Made {
    pub(super) tool: MadeTool,
    pub(super) source_doubts: Vec<Doubt>,
}

/// A tool by the kind of its patches.
pub(super) enum MadeTool {
    /// Nagata patches or facets.
    Patches { made: Box<Converted>, reached: Option<Reached> },
    /// Bezier patches.
    Bezier { within: Box<Within>, reached: Option<Reached> },
}

impl Made {
    /// Prints the figures of the tool, and warnings.
    pub(super) fn print(&self, args: &ConvertArgs) {
        match &self.tool {
            MadeTool::Patches { made, reached } => {
                print_report(made);
                warn_of_folds(args, made);
                reached.iter().for_each(print_reach);
            }
            MadeTool::Bezier { within, reached } => print_within(within, reached.as_ref()),
        }
    }

    /// Doubts about the tool: of its CAD or the offset, and tolerances that are exceeded.
    pub(super) fn doubts(&self) -> Vec<Doubt> {
        let fit = match &self.tool {
            MadeTool::Patches { made, .. } => made.refined.as_ref(),
            MadeTool::Bezier { .. } => None,
        };
        let of_source = self.source_doubts.iter().cloned();
        of_source.chain(fit.into_iter().flat_map(Fit::doubts)).collect()
    }

    /// Numbers of faces and patches, and the shape error where it is known.
    pub(super) fn figures(&self) -> String {
        let (tool, error_mm) = match &self.tool {
            MadeTool::Patches { made, .. } => {
                (&made.tool, made.refined.as_ref().map(|fit| fit.audit.worst_mm()))
            }
            MadeTool::Bezier { within, .. } => (&within.tool, Some(within.report.error_mm)),
        };
        let faces: BTreeSet<u32> = tool.faces.iter().copied().collect();
        let error = error_mm.map_or_else(String::new, |e| format!(", shape error {e:.5} mm"));
        format!("{} faces, {} patches{error}", faces.len(), tool.patches.len())
    }
}
