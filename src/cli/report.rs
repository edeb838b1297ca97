//! `kanagata-solve report DIR` and `kanagata report DIR`: the page of a run that has ended, from its files.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::terminal::{err, out};
use crate::run::report::{ReportError, WrittenPage, write_from_files};

/// Arguments of `report`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata-solve report out/demo\n  kanagata report out/study/cases/St-85\n\n\
    The page is made of run.json, history.csv, steps/*.vtu and the scene of the run. Notes name the\n\
    parts that it lacks if the scene or a file it names has changed or steps/last.vtu is missing.\n\n{EXIT_HELP}"))]
pub struct ReportArgs {
    /// Folder of a run (`run -o`), or of a case of a study
    folder: PathBuf,
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        let exit = match error {
            ReportError::Io { .. } | ReportError::Write(_) => Exit::Io,
            _ => Exit::Input,
        };
        Self::new(exit, error)
    }
}

/// Writes `report.html` and prints its path.
///
/// # Errors
/// Exit code 2 for a folder without a run or with a run in progress, 4 when files cannot be read or written.
pub fn run(args: &ReportArgs) -> Result<Exit, Failure> {
    let WrittenPage { path, missing } = write_from_files(&args.folder)?;
    for part in missing {
        err!("note: not on the page: {part}");
    }
    out!("{}", path.display());
    Ok(Exit::Done)
}
