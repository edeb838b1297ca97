//! A case and the results of its run.

use super::curves::force_rms;
use crate::case::Case;
use crate::compare::{Profile, Sheet, largest_difference};
use kanagata_report::record::RunRecord;

/// State of a case, including whether its results are current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CaseState {
    Waiting,
    Done,
    Failed,
    /// The inputs have changed since the run.
    Stale,
}

/// A case and the results of its run.
pub(super) struct Row<'a> {
    pub(super) case: &'a Case,
    pub(super) case_state: CaseState,
    pub(super) reason: Option<String>,
    /// Its methods; its name if the study names none.
    pub(super) method: String,
    pub(super) record: Option<RunRecord>,
    /// Build of its run, also of a run that is stale; empty if unknown.
    pub(super) build: String,
    pub(super) patches: usize,
    pub(super) shape_error: Option<f64>,
    /// Travel [mm] and force [N] of the watched tool while its travel increases.
    pub(super) curve: Vec<(f64, f64)>,
    pub(super) sheet: Option<Sheet>,
    /// Files of a run that is done which cannot be read.
    pub(super) unread: Vec<&'static str>,
    pub(super) differences: Differences,
}

/// Differences from the reference.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Differences {
    /// RMS of the force difference over the travel, over the RMS force of the reference.
    pub(super) force_rms: Option<f64>,
    /// Largest differences of thickness along dx and along dxy [mm].
    pub(super) thickness: [Option<f64>; 2],
}

impl Row<'_> {
    pub(super) fn done(&self) -> bool {
        self.case_state == CaseState::Done
    }

    /// Whether the case is done and has doubts.
    pub(super) fn is_doubtful(&self) -> bool {
        self.done() && self.record.as_ref().is_some_and(|record| !record.doubts.is_empty())
    }

    /// A profile of the sheet; empty without a sheet.
    pub(super) fn profile(&self, of: impl Fn(&Sheet) -> &Profile) -> &[(f64, f64)] {
        self.sheet.as_ref().map_or(&[], |sheet| of(sheet))
    }
}

impl Differences {
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

    /// The larger of the two thickness differences [mm].
    pub(super) fn thickest(&self) -> Option<f64> {
        Some(self.thickness[0]?.max(self.thickness[1]?))
    }
}
