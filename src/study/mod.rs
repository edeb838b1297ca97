//! Studies: one scene in many variants, run, kept, gone on with and compared.
//!
//! [`file`] is the description ([`mod@read`] reads it, `validate` says what it may be), [`cases`] makes a scene of every combination of choices, [`execute`] runs those that
//! are not done ([`follow`]: in which order, where cases take the increments of others; [`manifest`]: how they stand), [`mod@collect`] puts their records side by side,
//! [`checks`] holds them against what the study is expected to show.

pub mod case;
pub mod cases;
pub mod checks;
pub mod collect;
pub mod compare;
pub mod execute;
pub mod file;
pub mod follow;
mod inputs;
pub mod manifest;
mod output;
pub mod patches;
mod process;
pub mod read;
pub mod stability;
mod validate;

use std::path::PathBuf;

use crate::files::WriteError;

/// Why a study cannot be made or run.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// A folder that cannot be made.
    #[error("cannot make the folder {}: {source}; check that there is room and no file of its name", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
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
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// Another study works in the folder.
    #[error(
        "{}: {who} works in this folder; allowed: one study at a time; wait for it, end it (`kill`; its runs leave checkpoints), or use another folder", folder.display()
    )]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// The process, in words.
        who: String,
    },
    /// A study or a scene of it that makes no sense.
    #[error("{}, {place}: found {found}; allowed: {allowed}", path.display())]
    Value {
        /// The study file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A file of the results cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
