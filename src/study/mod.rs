//! Studies: variants of a scene that are run, kept, continued and compared.
//!
//! - [`file`]: the study file; [`mod@read`] reads it, `validate` checks it
//! - [`cases`]: a scene for every combination of the choices, or for every row of the table ([`table_cases`])
//! - [`execute`]: runs the cases that are not done; [`follow`]: their order; [`manifest`]: their state
//! - [`mod@collect`]: compares their records; [`checks`]: expected results; [`mod@metrics`]: results of one run

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
pub mod metrics;
mod output;
pub mod patches;
mod process;
pub mod read;
pub mod stability;
pub mod table_cases;
mod table_check;
mod validate;

use std::path::PathBuf;

use crate::files::WriteError;

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
        "{}: {who} works in this folder; allowed: one study at a time; wait for it, end it (`kill`; its runs leave checkpoints), or use another folder", folder.display()
    )]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// The process, in words.
        who: String,
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
