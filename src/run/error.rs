//! Why a run ends early, and why one cannot continue.

use std::path::{Path, PathBuf};

use super::restart::Restart;
use crate::files::WriteError;
use crate::scene::SceneError;
use crate::solver::SimulationError;

/// Why a run ends early.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene cannot be set up.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of the run folder cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The scene can have no result.
    #[error("{}: {what}", path.display())]
    Refused {
        /// The scene file.
        path: PathBuf,
        /// What was found, and what to do.
        what: String,
    },
    /// The run folder cannot be made.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// Another process works in the folder.
    #[error(
        "{}: {who} works in this folder; allowed: one run at a time; wait for it, end it (`kill`; it leaves a checkpoint), or use another folder", folder.display()
    )]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// The process, in words.
        who: String,
    },
    /// A run of the same inputs in the folder was stopped, and can be gone on with.
    #[error(
        "{}: a run of the same inputs was stopped here and has a checkpoint of increment {increment}; continue it (`restart`), discard it and start again (`overwrite`), or use another folder", folder.display()
    )]
    Unfinished {
        /// The run folder.
        folder: PathBuf,
        /// Increment after which the checkpoint was written.
        increment: usize,
        /// What continues it.
        restart: Restart,
    },
    /// A folder that no run was in has files that one would replace.
    #[error(
        "{}: no run of this program was in this folder, and one would replace {} there; use another folder, or allow that (`overwrite`)", folder.display(), found.display()
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// One of the files.
        found: PathBuf,
    },
    /// There is nothing to go on from.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The sheet came where patches had been left out.
    #[error(
        "increment {increment}: node {node} has come within the contact search's reach of a patch of `{tool}` that was left out (`auto`); run with all patches\n  the state at the end of that increment is in {}/steps/last.vtu", folder.display()
    )]
    LeftOut {
        /// Increment, whose result may be wrong.
        increment: usize,
        /// Tool.
        tool: String,
        /// Node.
        node: usize,
        /// The run folder.
        folder: PathBuf,
    },
    /// The solver cannot start or gave up.
    #[error("{cause}{more}{}", last_state(folder.as_deref()))]
    Solver {
        /// What the solver said.
        cause: Box<SimulationError>,
        /// What the sheet at its last balance, and other commands, say to that.
        more: String,
        /// The run folder, where there is a state in it.
        folder: Option<PathBuf>,
    },
}

/// Where the last good state is, in words.
fn last_state(folder: Option<&Path>) -> String {
    folder.map_or_else(String::new, |f| format!("\n  the last good state is in {}", f.display()))
}

/// Why a run cannot go on from its folder.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// No checkpoint that can be used.
    #[error("{}: no checkpoint to continue from ({why}); start the run anew", folder.display())]
    None {
        /// The run folder.
        folder: PathBuf,
        /// What was found.
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
    /// An input has changed since.
    #[error(
        "{}: `{input}` has changed since the checkpoint was written (found SHA-256 {found}, allowed {expected}); restore it, or start the run anew", folder.display()
    )]
    Changed {
        /// The run folder.
        folder: PathBuf,
        /// The scene or a tool file.
        input: String,
        /// Digest now.
        found: String,
        /// Digest then.
        expected: String,
    },
    /// Written by another version of the program.
    #[error(
        "{}: the checkpoint was written by {found}, this is {expected}; start the run anew", folder.display()
    )]
    Program {
        /// The run folder.
        folder: PathBuf,
        /// Program then.
        found: String,
        /// Program now.
        expected: String,
    },
}

impl CheckpointError {
    /// Why, in a few words without the folder and what to do.
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
