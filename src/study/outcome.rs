//! `outcome.json`: why the command of a case ended without a proof, for the study that waits for it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::case_file::CaseFile;
use kanagata_files::{Input, WriteError, write_atomic};

/// Name of the file in the folder of a case.
const NAME: &str = "outcome.json";

/// How the command of a case ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// Exit code.
    pub exit: u8,
    /// Message with its remedy.
    pub message: String,
    /// SHA-256 of the `case.json` that it was of.
    pub case: String,
}

/// Records that the command of the case in `folder` ended with exit code `exit`.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn record(folder: &Path, exit: u8, message: String) -> Result<(), WriteError> {
    let outcome = Outcome { exit, message, case: CaseFile::digest(folder).unwrap_or_default() };
    write_atomic(&folder.join(NAME), |w| {
        serde_json::to_writer_pretty(&mut *w, &outcome)?;
        writeln!(w)
    })
}

/// The outcome in `folder`, if it is of the case as it is now.
#[must_use]
pub fn read(folder: &Path) -> Option<Outcome> {
    let text = kanagata_files::read(&folder.join(NAME), Input::Description).ok()?;
    let outcome: Outcome = serde_json::from_slice(&text).ok()?;
    (CaseFile::digest(folder).as_ref() == Some(&outcome.case)).then_some(outcome)
}

/// Removes the outcome of an earlier command.
pub fn forget(folder: &Path) {
    // A file that cannot be removed is replaced by the next outcome, and a proof counts more.
    let _ = std::fs::remove_file(folder.join(NAME));
}
