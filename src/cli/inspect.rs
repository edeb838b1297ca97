//! `kanagata inspect FILE [--json]`.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};

/// Arguments of `inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata inspect fixtures/forming/cross_die_144.igs\n\n{EXIT_HELP}"))]
pub struct InspectArgs {
    /// IGES or STEP file
    file: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Prints what the file holds.
///
/// # Errors
/// Exit code 2 for a file that is no CAD, 4 when it cannot be read.
pub fn run(args: &InspectArgs) -> Result<Exit, Failure> {
    let (model, diagnostics) = crate::cad::read(&args.file)?;
    let found = crate::cad::inspect::inspect(&model, &diagnostics);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&found).map_err(Failure::input)?);
    } else {
        println!("{found}");
    }
    Ok(Exit::Done)
}
