//! Errors of reading CAD files.

use std::path::PathBuf;

/// The reason why a CAD file yields no model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CadError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// Neither IGES nor STEP.
    #[error(
        "{file}: neither an IGES file (no S section in column 73) nor a STEP file (no ISO-10303-21): {found}; export the model as IGES 5.3 or STEP AP203/AP214/AP242"
    )]
    UnknownFormat {
        /// The file's name.
        file: String,
        /// Description of its first bytes.
        found: String,
    },
    /// The text violates the grammar of the format or contains inadmissible values.
    #[error("{file}, {place}: {found}; allowed: {allowed}; {remedy}")]
    Invalid {
        /// The file's name.
        file: String,
        /// Line, card and entity, or `#id`.
        place: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
        /// Remedy.
        remedy: String,
    },
}
