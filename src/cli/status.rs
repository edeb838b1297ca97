//! `kanagata-solve status DIR`: the current state of a run.

use std::path::PathBuf;

use serde::Serialize;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::remedy::restart_command;
use super::terminal::{out, out_json, out_lines};
use crate::accuracy::{SequenceStatus, sequence_status};
use crate::run::status::{State, Status, StatusError, status};

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata-solve status out/demo\n  kanagata-solve status out/demo --json\n\n\
    States: running, finished, not_converged, stopped (by a signal), killed (its process is gone), elsewhere (neither \
    the process nor its heartbeat can be checked from here).\n\n{EXIT_HELP}"))]
pub struct StatusArgs {
    /// Folder of a run or of a sequence of runs (`run -o`)
    folder: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl From<StatusError> for Failure {
    fn from(error: StatusError) -> Self {
        let exit = if matches!(error, StatusError::Io { .. }) { Exit::Io } else { Exit::Input };
        Self::new(exit, error)
    }
}

/// The status with the command that continues the run.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    status: &'a Status,
    restart: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sequence: Option<&'a SequenceStatus>,
}

/// Prints the status of a run, and of the sequence that it belongs to.
///
/// # Errors
/// Exit code 4 when the folder holds no run, 2 when its files were not written by this program.
pub fn run(args: &StatusArgs) -> Result<Exit, Failure> {
    let sequence = sequence_status(&args.folder);
    // Before a sequence has its results, its state is that of the last run.
    let unfinished = sequence.as_ref().filter(|found| found.state != State::Finished);
    let found = status(unfinished.map_or(&args.folder, |found| &found.last))?;
    let restart = found.restart.as_ref().filter(|_| sequence.is_none()).map(restart_command);
    if args.json {
        let printed = Printed { status: &found, restart, sequence: sequence.as_ref() };
        out_json!("{}", serde_json::to_string_pretty(&printed).map_err(Failure::input)?);
    } else {
        if let Some(sequence) = &sequence {
            out_lines!(sequence);
        }
        out_lines!(found);
        if let Some(command) = restart {
            out!("  continue with {command}");
        }
    }
    Ok(Exit::Done)
}
