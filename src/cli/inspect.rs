//! `kanagata inspect FILE [--health] [--json]`.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::terminal::{out_json, out_lines};
use crate::cad::health::Health;
use crate::cad::inspect::Inspection;

/// Arguments of `inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata inspect fixtures/forming/cross_die_144.igs --health\n\n{EXIT_HELP}"))]
pub struct InspectArgs {
    /// IGES or STEP file
    file: PathBuf,
    /// Also list faults: free edges and gaps, inverted, tiny and duplicate faces
    #[arg(long)]
    health: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Output of `inspect --json`.
#[derive(serde::Serialize)]
struct Printed {
    #[serde(flatten)]
    facts: Inspection,
    #[serde(skip_serializing_if = "Option::is_none")]
    health: Option<Health>,
}

/// Prints the content of the file.
///
/// # Errors
/// Exit code 2 for a file that is not CAD, 4 when it cannot be read.
pub fn run(args: &InspectArgs) -> Result<Exit, Failure> {
    let (model, diagnostics) = crate::cad::read(&args.file)?;
    let facts = crate::cad::inspect::inspect(&model, &diagnostics);
    let health = args.health.then(|| model.health());
    if args.json {
        let all = Printed { facts, health };
        out_json!("{}", serde_json::to_string_pretty(&all).map_err(Failure::input)?);
        return Ok(Exit::Done);
    }
    out_lines!(facts);
    if let Some(health) = health {
        out_lines!(health.to_text(&model));
    }
    Ok(Exit::Done)
}
