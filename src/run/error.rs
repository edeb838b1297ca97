//! Errors that end a run early or prevent it from continuing.

use std::path::{Path, PathBuf};

use super::lock::Holder;
use super::restart::Restart;
use kanagata_files::WriteError;
use kanagata_scene::SceneError;
use kanagata_solver::SimulationError;

/// Why a run ends early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene cannot be set up.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of the run folder cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The scene has an error and is refused.
    #[error("{}: {what}", path.display())]
    Refused {
        /// The scene file.
        path: PathBuf,
        /// The finding and its remedy.
        what: String,
    },
    /// The run folder cannot be created.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// Another process holds the lock of the folder.
    #[error(
        "{}: {holder} works in this folder; allowed: one run at a time; use another folder, or {}", folder.display(), holder.remedy()
    )]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// The process.
        holder: Holder,
    },
    /// The run no longer holds the lock of its folder.
    #[error(
        "{}: this run has lost its folder ({found}); it has ended and written nothing further; use another folder, or wait for the other run to end", folder.display()
    )]
    LockLost {
        /// The folder.
        folder: PathBuf,
        /// The process that holds the lock now, or the fault of the lock file, in words.
        found: String,
    },
    /// The folder holds a stopped run of the same inputs that can continue.
    #[error(
        "{}: a run of the same inputs was stopped here and has a checkpoint of increment {increment}; continue it (`restart`), discard it and start again (`overwrite`), or use another folder", folder.display()
    )]
    Unfinished {
        /// The run folder.
        folder: PathBuf,
        /// Increment after which the checkpoint was written.
        increment: usize,
        /// How to continue it.
        restart: Restart,
    },
    /// The folder holds a run of the same inputs by this build that is done and must be kept.
    #[error("{}: a run of the same inputs is done here; allowed: another folder, or to replace it (`overwrite`)", folder.display())]
    AlreadyComplete {
        /// The run folder.
        folder: PathBuf,
    },
    /// The folder holds no run, but files that a run would replace.
    #[error(
        "{}: no run of this program was in this folder, and one would replace {} there; use another folder, or allow that (`overwrite`)", folder.display(), found.display()
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// One of the files.
        found: PathBuf,
    },
    /// The run cannot continue from its folder.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The sheet has reached excluded patches.
    #[error(
        "increment {increment}: node {node} is within the contact search distance of an excluded patch of `{tool}` (`auto`); run with all patches\n  the state at the end of that increment is in {}/steps/last.vtu", folder.display()
    )]
    ExcludedPatchReached {
        /// The increment; its result may be wrong.
        increment: usize,
        /// Tool.
        tool: String,
        /// Node.
        node: usize,
        /// The run folder.
        folder: PathBuf,
    },
    /// The solver cannot start or has not converged.
    #[error("{cause}{more}{}", last_state(folder.as_deref()))]
    Solver {
        /// The error of the solver.
        cause: Box<SimulationError>,
        /// Details from the last equilibrium, and other commands that may help.
        more: String,
        /// The run folder, if it holds a state.
        folder: Option<PathBuf>,
    },
}

/// Position of the last equilibrium state, in words.
fn last_state(folder: Option<&Path>) -> String {
    folder.map_or_else(String::new, |f| format!("\n  the last good state is in {}", f.display()))
}

/// Why a run cannot continue from its folder.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// No usable checkpoint.
    #[error("{}: no checkpoint to continue from ({why}); start the run anew", folder.display())]
    None {
        /// The run folder.
        folder: PathBuf,
        /// Why there is none.
        why: String,
    },
    /// All stages are done.
    #[error(
        "{}: the run in it has completed all stages, nothing is left to continue; start the run anew to repeat them", folder.display()
    )]
    Completed {
        /// The run folder.
        folder: PathBuf,
    },
    /// An input has changed since the checkpoint.
    #[error(
        "{}: `{input}` has changed since the checkpoint was written (found SHA-256 {found}, allowed {expected}); restore it, or start the run anew", folder.display()
    )]
    Changed {
        /// The run folder.
        folder: PathBuf,
        /// The scene or a tool file.
        input: String,
        /// Current digest.
        found: String,
        /// Digest in the checkpoint.
        expected: String,
    },
    /// Written by another version of the program.
    #[error(
        "{}: the checkpoint was written by {found}, this is {expected}; start the run anew", folder.display()
    )]
    Program {
        /// The run folder.
        folder: PathBuf,
        /// Program that wrote it.
        found: String,
        /// Current program.
        expected: String,
    },
}

impl CheckpointError {
    /// The reason in a few words, without folder and remedy.
    #[must_use]
    pub fn reason(&self) -> String {
        match self {
            Self::None { why, .. } => format!("no checkpoint: {why}"),
            Self::Completed { .. } => "all stages are done".into(),
            Self::Changed { input, .. } => format!("`{input}` has changed since"),
            Self::Program { found, .. } => format!("by {found}"),
        }
    }
}
