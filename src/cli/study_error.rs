//! Errors of `kanagata study`, with their exit codes.

use std::path::Path;

use super::exit::{Exit, Failure};
use crate::study::StudyError;

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let input = matches!(
            error,
            StudyError::Value { .. }
                | StudyError::Kind(_)
                | StudyError::Busy { .. }
                | StudyError::OtherRuns { .. }
                | StudyError::OtherRunner { .. }
                | StudyError::Refused { .. }
                | StudyError::NotCancelled { refused: true, .. }
        );
        let exit = if input { Exit::Input } else { Exit::Io };
        Self::new(exit, error)
    }
}

pub(super) fn folder(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Folder { path, source }
}

pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Io { path, source }
}

/// An invalid value of the study file or of an option.
pub(super) fn value(path: &Path, place: &str, found: String, allowed: String) -> Failure {
    StudyError::Value { path: path.to_path_buf(), place: place.to_owned(), found, allowed }.into()
}
