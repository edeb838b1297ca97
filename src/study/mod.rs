//! Studies: variants of a scene that are run, kept, continued and compared.
//!
//! - [`file`]: the study file; [`mod@read`] reads it, `validate` checks it
//! - [`cases`]: a scene for every combination of the choices, or for every row of the table ([`table_cases`])
//! - [`prepare`]: a folder for each with its scene and [`case_file`]; [`follow`]: their order
//! - [`schedule`]: has a [`runner`] run those that are not done; [`mod@run_case`]: the command of a case
//! - [`mod@states`]: their state, from the files in their folders
//! - [`mod@collect`]: compares their records; [`checks`]: expected results; [`mod@metrics`]: results of one run

pub mod case;
pub mod case_file;
pub mod cases;
pub mod checks;
pub mod collect;
pub mod compare;
pub mod file;
pub mod follow;
mod groups;
mod inputs;
pub mod metrics;
pub mod outcome;
mod output;
pub mod patches;
pub mod prepare;
mod proof;
pub mod read;
pub mod run_case;
pub mod runner;
pub mod schedule;
pub mod stability;
pub mod states;
pub mod status;
pub mod table_cases;
mod table_check;
mod validate;

use std::path::PathBuf;

use kanagata_files::{WriteError, WrongKind};
use kanagata_run::lock::Holder;

/// Why a study cannot be read or run.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// The file of the study is of another kind.
    #[error(transparent)]
    Kind(#[from] WrongKind),
    /// A folder cannot be created.
    #[error("cannot make the folder {}: {source}; check that there is room and no file of its name", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// The solver cannot be started.
    #[error(
        "cannot start {}: {source}; allowed: the program of the solver", path.display()
    )]
    Start {
        /// The solver.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// Another process holds the lock of the folder.
    #[error(
        "{}: {holder} works in this folder; allowed: one study at a time; use another folder, or {}", folder.display(), holder.remedy()
    )]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// The process.
        holder: Holder,
    },
    /// The study no longer holds the lock of its folder.
    #[error(
        "{}: this study has lost its folder ({found}); it has ended and written nothing further; use another folder, or wait for the other study to end", folder.display()
    )]
    LockLost {
        /// The folder.
        folder: PathBuf,
        /// The process that holds the lock now, or the fault of the lock file, in words.
        found: String,
    },
    /// Runs in the folder are of other inputs or of another build.
    #[error("{}: {}; allowed: runs of the present inputs by this build", folder.display(), listed(cases))]
    OtherRuns {
        /// The folder.
        folder: PathBuf,
        /// Cases, and what differs.
        cases: Vec<(String, String)>,
    },
    /// Cases have been submitted with another runner.
    #[error(
        "{}: cases are submitted with the runner {runner}; found {asked}; allowed: that runner, or to end them first",
        folder.display()
    )]
    OtherRunner {
        /// The folder.
        folder: PathBuf,
        /// Runner that has tickets.
        runner: String,
        /// Runner that was asked for.
        asked: &'static str,
    },
    /// The engine of a runner refuses a submission.
    #[error(
        "{runner} refuses the submission: {reason}; allowed: what it offers (memory, time, account, partition)"
    )]
    Refused {
        /// The runner.
        runner: &'static str,
        /// Its message.
        reason: String,
    },
    /// The engine of a runner does not answer.
    #[error("{runner} does not answer, nothing is known to be submitted: {reason}")]
    NoAnswer {
        /// The runner.
        runner: &'static str,
        /// Its message.
        reason: String,
    },
    /// The engine of a runner has not ended submitted cases.
    #[error("{runner} has not ended all submitted cases: {reason}")]
    NotCancelled {
        /// The runner.
        runner: &'static str,
        /// Its message.
        reason: String,
        /// Whether asking again does not help.
        refused: bool,
    },
    /// The study or one of its scenes is invalid.
    #[error("{}, {place}: found {found}; allowed: {allowed}", path.display())]
    Value {
        /// The study file.
        path: PathBuf,
        /// Position or key.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A result file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Largest number of cases in a message.
const LISTED_MAX: usize = 5;

/// Cases and what differs, in words.
fn listed(cases: &[(String, String)]) -> String {
    let named = cases.iter().take(LISTED_MAX).map(|(case, what)| format!("{case}: {what}"));
    let mut text = named.collect::<Vec<_>>().join("; ");
    if cases.len() > LISTED_MAX {
        text += &format!("; and {} more", cases.len() - LISTED_MAX);
    }
    text
}
