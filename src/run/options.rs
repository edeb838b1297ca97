//! Options of a run.

use kanagata_cancel::Cancel;
#[cfg(feature = "pages")]
use kanagata_report::record::Verdict;

/// When a run writes `report.html`, most of which is the plotting script. Without it the page can be written later from
/// the files of the run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum WriteReport {
    /// At the end of every run, unless it was stopped.
    #[default]
    Always,
    /// Only when the solver does not converge.
    NotConverged,
}

impl WriteReport {
    /// Whether the page of a run with this verdict is written.
    #[cfg(feature = "pages")]
    pub(super) fn applies(self, verdict: Verdict) -> bool {
        match self {
            Self::Always => verdict != Verdict::Stopped,
            Self::NotConverged => verdict == Verdict::NotConverged,
        }
    }
}

/// Options of a run.
#[derive(Default, Clone)]
pub struct RunOptions<'a> {
    /// Continue from the checkpoint in the folder.
    pub restart: bool,
    /// Replace a stopped run of the same inputs in the folder. Without it such a folder is refused.
    pub overwrite: bool,
    /// Refuse to replace a run of the same inputs by this build that is done, also one that has ended since it was looked for.
    pub keep_complete: bool,
    /// Receives a message about results of an earlier run, before they are replaced.
    pub notify: Option<&'a dyn Fn(&str)>,
    /// Exclude tool patches that the sheet cannot touch, which does not change results.
    pub auto: bool,
    /// Take the folder from a run that is not known to be alive on this host. That run ends at its next increment.
    pub break_lock: bool,
    /// When `report.html` is written; it needs the feature `pages`.
    pub report: WriteReport,
    /// Stop request: abort the current increment, save a checkpoint of the last one and stop.
    pub stop: Cancel,
}
