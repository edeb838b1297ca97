//! A case and what its run left.

use super::curves::force_rms;
use crate::report::record::RunRecord;
use crate::study::case::Case;
use crate::study::compare::{Profile, Sheet, largest_difference};

/// How a case stands, as far as its folder still belongs to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    Waiting,
    Done,
    Failed,
    /// What it was run with is not what it would be run with.
    Stale,
}

/// A case and what its run left.
pub(super) struct Row<'a> {
    pub(super) case: &'a Case,
    pub(super) standing: Standing,
    pub(super) reason: Option<String>,
    /// The methods it is of; its name when the study names none.
    pub(super) method: String,
    pub(super) record: Option<RunRecord>,
    pub(super) patches: usize,
    pub(super) shape_error: Option<f64>,
    /// Travel [mm] and force [N] of the watched tool while it moves.
    pub(super) curve: Vec<(f64, f64)>,
    pub(super) sheet: Option<Sheet>,
    pub(super) off: Off,
}

/// Differences from the reference.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Off {
    /// RMS of the difference of force over the travel, over the reference's RMS.
    pub(super) force_rms: Option<f64>,
    /// Largest difference of thickness along dx and along dxy [mm].
    pub(super) thickness: [Option<f64>; 2],
}

impl Row<'_> {
    pub(super) fn done(&self) -> bool {
        self.standing == Standing::Done
    }

    /// Whether it is done and its result doubtful.
    pub(super) fn is_doubtful(&self) -> bool {
        self.done() && self.record.as_ref().is_some_and(|record| !record.doubts.is_empty())
    }

    /// The line of a profile of the sheet; empty without one.
    pub(super) fn profile(&self, of: impl Fn(&Sheet) -> &Profile) -> &[(f64, f64)] {
        self.sheet.as_ref().map_or(&[], |sheet| of(sheet))
    }
}

impl Off {
    pub(super) fn between(row: &Row<'_>, reference: &Row<'_>) -> Self {
        let dx = |row| Row::profile(row, |s| &s.dx);
        let dxy = |row| Row::profile(row, |s| &s.dxy);
        Self {
            force_rms: force_rms(&row.curve, &reference.curve),
            thickness: [
                largest_difference(dx(row), dx(reference)),
                largest_difference(dxy(row), dxy(reference)),
            ],
        }
    }

    /// The larger of the two differences of thickness [mm].
    pub(super) fn thickest(&self) -> Option<f64> {
        Some(self.thickness[0]?.max(self.thickness[1]?))
    }
}
