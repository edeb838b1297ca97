//! `kanagata-solve case DIR...`: runs, continues or proves done the cases of a study.

use std::path::{Path, PathBuf};

use super::exit::{EXIT_HELP, Exit, Failure};
use super::remedy::remedy;
use super::run::stop_with_input;
use super::stop;
use super::terminal::{err, out};
use crate::report::record::RunRecord;
use crate::run::{RunOptions, WriteReport};
use crate::study::outcome;
use crate::study::run_case::{CaseEnd, CaseError, run_case};

/// Arguments of `case`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata study examples/strip/table.study.json -o out/strip --prepare\n  \
    kanagata-solve case out/strip/cases/*\n\n\
    A case is a folder with case.json and case.scene.json. The same command may be given any number of times, by any\n\
    machine: a case that is proved done is left alone, one with a checkpoint is continued, others begin. Doubts are kept in\n\
    run.json. A case whose inputs or build are not those of case.json is refused (exit code 2).\n\
    The exit code is the first that is not 0.\n\n{EXIT_HELP}"))]
pub struct CaseArgs {
    /// Folders of cases, run one after the other
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Run a case again whose earlier run did not converge
    #[arg(long)]
    again: bool,
    /// Take a run's folder although a run on another host seems to work in it; refused for one that is alive on this host
    #[arg(long)]
    break_lock: bool,
    /// Stop with a checkpoint when standard input ends: the run does not outlive the program that started it
    #[arg(long)]
    tied: bool,
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        match error {
            CaseError::File(error) => error.into(),
            CaseError::Scene(error) => Self::from(crate::run::RunError::Scene(error)),
            CaseError::Run(error) => error.into(),
            CaseError::Differs { .. } => Self::input(error),
            CaseError::LeaderNotDone { .. } => Self::new(Exit::Stopped, error),
            CaseError::NotConverged { .. } => Self::new(Exit::NoConvergence, error),
        }
    }
}

/// Runs the cases.
///
/// # Errors
/// The first failure, after all cases: exit code 2 for a case that cannot be run, 3 without convergence, 4 when files
/// cannot be read or written, 5 when stopped or when the case that it follows is not done.
pub fn run(args: &CaseArgs) -> Result<Exit, Failure> {
    if args.tied {
        stop_with_input();
    }
    let mut first = None;
    for folder in &args.folders {
        if stop::request().is_requested() {
            break;
        }
        if let Err(failure) = one(folder, args) {
            if first.is_some() || args.folders.len() > 1 {
                err!("error: {}", failure.error);
            }
            first.get_or_insert(failure);
        }
    }
    first.map_or(Ok(Exit::Done), Err)
}

/// Runs a case and leaves its outcome in its folder.
fn one(folder: &Path, args: &CaseArgs) -> Result<(), Failure> {
    let (stop, break_lock) = (stop::request().clone(), args.break_lock);
    let report = WriteReport::NotConverged;
    let options = RunOptions { stop, break_lock, report, ..RunOptions::default() };
    let ended = run_case(folder, args.again, options, &mut |_| {});
    match ended.map_err(Failure::from) {
        Ok(end) => {
            outcome::forget(folder);
            let text = match end {
                CaseEnd::AlreadyDone => "already done".into(),
                CaseEnd::Run(record) => done(&record),
            };
            out!("{}: {text}", folder.display());
            Ok(())
        }
        Err(failure) => {
            let remedy = remedy(&*failure.error).map_or_else(String::new, |r| format!("; {r}"));
            let message = format!("{}{remedy}", failure.error).replace('\n', " ");
            // The holder of a folder in use records its own outcome.
            if !is_busy(&failure)
                && folder.is_dir()
                && let Err(error) = outcome::record(folder, failure.exit as u8, message)
            {
                err!("note: the outcome is not recorded: {error}");
            }
            Err(failure)
        }
    }
}

fn done(record: &RunRecord) -> String {
    let doubts = match record.doubts.len() {
        0 => String::new(),
        1 => ", 1 doubt".into(),
        count => format!(", {count} doubts"),
    };
    format!("{}, {} increments, {:.1} s{doubts}", record.verdict, record.increments, record.wall_s)
}

fn is_busy(failure: &Failure) -> bool {
    matches!(
        failure.error.downcast_ref::<crate::run::RunError>(),
        Some(crate::run::RunError::Busy { .. })
    )
}
