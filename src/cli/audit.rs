//! `kanagata audit TOOL --cad FILE`.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};

/// Arguments of `audit`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata audit die.tool.json --cad die.igs --tol 0.02 --json die.audit.json\n\n{EXIT_HELP}"))]
pub struct AuditArgs {
    /// Tool file
    tool: PathBuf,
    /// The CAD file it was made from
    #[arg(long, value_name = "FILE")]
    cad: PathBuf,
}

/// Audits the tool.
///
/// # Errors
/// Exit code 1 above the tolerance, 2 for bad input, 4 when files cannot be read or written.
pub fn run(args: &AuditArgs) -> Result<Exit, Failure> {
    let _ = args;
    Err(Failure::input("audit"))
}
