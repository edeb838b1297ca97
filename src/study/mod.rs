//! Studies: one scene in many variants, run, kept, gone on with and compared.
//!
//! [`file`] is the description, [`cases`] makes a scene of every combination of choices, [`execute`] runs those that
//! are not done ([`follow`]: in which order, where cases take the increments of others), [`mod@collect`] puts their records side by side,
//! [`checks`] holds them against what the study is expected to show.

pub mod cases;
pub mod checks;
pub mod collect;
pub mod compare;
pub mod execute;
pub mod file;
pub mod follow;
mod output;
pub mod patches;
mod process;
pub mod stability;

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
