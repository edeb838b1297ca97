//! `kanagata-solve status DIR`: what a run folder says now.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::say::{out, out_json};
use crate::run::status::{StatusError, status};

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata-solve status out/demo\n  kanagata-solve status out/demo --json\n\n\
    States: running, finished, not_converged, stopped (by a signal), killed (its process is gone), elsewhere (another \
    machine's).\n\n{EXIT_HELP}"))]
pub struct StatusArgs {
    /// Folder of a run (`run -o`)
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

/// Prints what the folder says.
///
/// # Errors
/// Exit code 4 when the folder holds no run, 2 when its files are not of this program.
pub fn run(args: &StatusArgs) -> Result<Exit, Failure> {
    let found = status(&args.folder)?;
    if args.json {
        out_json!("{}", serde_json::to_string_pretty(&found).map_err(Failure::input)?);
    } else {
        out!("{found}");
    }
    Ok(Exit::Done)
}
