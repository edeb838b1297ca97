//! A run folder.

use std::path::{Path, PathBuf};

use super::error::{Error, ErrorKind};
use crate::files::{Input, read, read_text};
use crate::report::doubt::Doubt;
use crate::report::record::{History, HistoryRow, RunRecord, Verdict};

/// Progress of a run after an increment; increment 0 is the state before the first.
#[derive(Debug, Clone, PartialEq)]
pub struct RunProgress {
    /// The increment: travels, forces, counts and energies.
    pub row: HistoryRow,
    /// Fraction of the process that is done, 0 to 1.
    pub done: f64,
    /// Wall time since the start [s].
    pub elapsed_s: f64,
}

/// The results of a run.
///
/// ```no_run
/// use kanagata::prelude::{Run, Verdict};
///
/// let run = Run::open("out/demo/run")?;
/// assert_eq!(run.verdict(), Verdict::Completed);
/// let force = run.history().rows.last().map(|row| row.force_n.clone());
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Run {
    folder: PathBuf,
    record: RunRecord,
    history: History,
}

impl Run {
    /// Reads `run.json` and `history.csv` of a run folder, also of a run that has not ended.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] for files that cannot be read, [`ErrorKind::Input`] for files of another program.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let folder = folder.as_ref().to_path_buf();
        let io = |path: &Path, cause| {
            Error::new(ErrorKind::Io, format!("cannot read {}: {cause}", path.display()))
        };
        let input = |path: &Path, found| Error::input(format!("{}: {found}", path.display()));
        let path = folder.join("run.json");
        let text = read(&path, Input::Description).map_err(|e| io(&path, e))?;
        let record = RunRecord::parse(&text).map_err(|found| input(&path, found))?;
        let path = folder.join("history.csv");
        let text = read_text(&path, Input::Description).map_err(|e| io(&path, e))?;
        let history = History::parse(&text).map_err(|found| input(&path, found))?;
        Ok(Self { folder, record, history })
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// How the run ended.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.record.verdict
    }

    /// Why the result must not be trusted as it is.
    #[must_use]
    pub fn doubts(&self) -> &[Doubt] {
        &self.record.doubts
    }

    /// All of `run.json`.
    #[must_use]
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// Travels, forces and energies of every increment.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Results as one flat table: verdict, forces by tool, thickness, draw-in, springback, cost.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] and [`ErrorKind::Input`] name the file.
    #[cfg(feature = "pages")]
    pub fn metrics(&self) -> Result<crate::study::metrics::Metrics, Error> {
        crate::study::metrics::metrics(&self.folder).map_err(Error::input)
    }

    /// VTU file of the sheet at every step that was written, with its process time.
    #[must_use]
    pub fn steps(&self) -> Vec<(f64, PathBuf)> {
        let steps = self.record.files.steps.iter();
        steps.map(|step| (step.time, self.folder.join(&step.sheet))).collect()
    }
}
