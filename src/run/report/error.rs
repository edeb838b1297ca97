//! Errors of a page from the files of a run.

use std::path::PathBuf;

use kanagata_files::WriteError;

/// Why the page of a run cannot be written from its files.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder contains no `run.json`.
    #[error("{}: found no run.json; allowed: the folder of a run, or of a case that contains `run`", folder.display())]
    NoRun {
        /// The folder.
        folder: PathBuf,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// A file of the folder was not written by a run.
    #[error("{}: found {found}; allowed: a file as this program writes it", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// The run is in progress; it may write its page itself.
    #[error("{who} works in {}; allowed: a run that has ended", folder.display())]
    Running {
        /// The folder.
        folder: PathBuf,
        /// The process in words.
        who: String,
    },
    /// The page cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
