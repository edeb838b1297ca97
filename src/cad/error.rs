//! Why a CAD file gives no model.

use std::path::PathBuf;

/// Why a CAD file gives no model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CadError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
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
        /// What its first bytes look like.
        found: String,
    },
    /// The text breaks the format's grammar or says something that cannot be.
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
        /// What to do.
        remedy: String,
    },
}
