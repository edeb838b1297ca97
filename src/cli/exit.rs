//! Exit codes, and the one place where errors are printed.

use super::remedy::remedy;
use super::terminal::{err, lost};
use crate::report::doubt::Doubt;
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

/// Exit codes of both programs, as `--help` documents them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// 0: done.
    Done = 0,
    /// 1: the result is doubtful, or a limit was exceeded (`audit --tol`, checks of a study).
    Limit = 1,
    /// 2: bad usage or bad input; also a folder that another process works in.
    Input = 2,
    /// 3: the solver did not converge.
    NoConvergence = 3,
    /// 4: a file could not be read or written.
    Io = 4,
    /// 5: stopped by a signal; the run can continue.
    Stopped = 5,
}

impl Exit {
    /// [`Exit::Limit`] with doubts that are not accepted.
    #[must_use]
    pub fn of_doubts(doubts: &[Doubt], accepted: bool) -> Self {
        if doubts.is_empty() || accepted { Self::Done } else { Self::Limit }
    }
}

/// The text about exit codes at the end of every help page.
pub const EXIT_HELP: &str = "Exit codes: 0 done, 1 doubtful result or limit exceeded, 2 bad usage or input, 3 not converged, \
     4 a file could not be read or written, 5 stopped by a signal (continue with --restart).";

/// An error about a file that its own message does not name.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {source}")]
struct OfFile {
    file: String,
    source: Box<dyn Error + Send + Sync>,
}

/// Why a command fails: exit code and error.
#[derive(Debug)]
pub struct Failure {
    /// Exit code.
    pub exit: Exit,
    /// The error to print.
    pub error: Box<dyn Error + Send + Sync>,
}

impl Failure {
    /// A failure with this exit code.
    pub fn new(exit: Exit, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self { exit, error: error.into() }
    }

    /// Bad usage or input (exit code 2).
    pub fn input(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::new(Exit::Input, error)
    }

    /// Invalid input (exit code 2) in a file that the error does not name.
    pub fn of_file(file: &Path, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::input(OfFile { file: file.display().to_string(), source: error.into() })
    }
}

impl From<crate::files::WriteError> for Failure {
    fn from(error: crate::files::WriteError) -> Self {
        Self::new(Exit::Io, error)
    }
}

impl From<crate::cad::CadError> for Failure {
    fn from(error: crate::cad::CadError) -> Self {
        let exit =
            if matches!(error, crate::cad::CadError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// The exit code of the process for the outcome of a command. An error is printed with its remedy. Lost lines of
/// standard output are an error too.
#[must_use]
pub fn finish(outcome: Result<Exit, Failure>) -> ExitCode {
    match outcome {
        Ok(exit) => match lost() {
            None => ExitCode::from(exit as u8),
            Some(why) => {
                err!("error: cannot write standard output: {why}; check that it has room");
                ExitCode::from(Exit::Io as u8)
            }
        },
        Err(failure) => {
            err!("error: {}", failure.error);
            if let Some(remedy) = remedy(&*failure.error) {
                err!("  try: {remedy}");
            }
            ExitCode::from(failure.exit as u8)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunError;
    use crate::run::lock::{Holder, Place};
    use crate::study::StudyError;

    #[test]
    fn a_busy_folder_is_wrong_input() {
        let holder = || Holder { process: None, place: Place::Here };
        let run = RunError::Busy { folder: "out".into(), holder: holder() };
        let study = StudyError::Busy { folder: "out".into(), holder: holder() };
        assert_eq!([Failure::from(run).exit, Failure::from(study).exit], [Exit::Input; 2]);
        let folder = || std::io::Error::from(std::io::ErrorKind::PermissionDenied);
        let run = RunError::Folder { path: "out".into(), source: folder() };
        let study = StudyError::Folder { path: "out".into(), source: folder() };
        assert_eq!([Failure::from(run).exit, Failure::from(study).exit], [Exit::Io; 2]);
    }
}
