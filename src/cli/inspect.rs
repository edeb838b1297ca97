//! `kanagata inspect FILE [--tree] [--list] [--entities] [--health] [--json]`.

use std::path::PathBuf;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::paths::input_path;
use super::select::SelectArgs;
use super::terminal::{out_json, out_lines};
use crate::cad::Creases;
use crate::cad::health::Health;
use crate::cad::inspect::{Inspection, Tree, inspect, tree};

/// Arguments of `inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata inspect fixtures/forming/cross_die_144.igs --health\n  \
    kanagata inspect fixtures/bodies/press.stp --tree\n  \
    kanagata inspect fixtures/bodies/press.stp --bodies die --facing +z --list\n\n{EXIT_HELP}"))]
pub struct InspectArgs {
    /// IGES or STEP file; - for standard input
    #[arg(value_parser = input_path)]
    file: PathBuf,
    /// List bodies, layers and colours with the numbers of their faces; faces are split at creases as for a tool
    #[arg(long)]
    tree: bool,
    /// List every face: number, entity, name, surface, body, area, layers, colour
    #[arg(long)]
    list: bool,
    /// Count the entities of the file by kind
    #[arg(long)]
    entities: bool,
    /// Also list faults: free edges and gaps, inverted, tiny and duplicate faces
    #[arg(long)]
    health: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    select: SelectArgs,
}

/// Output of `inspect --json`.
#[derive(serde::Serialize)]
struct Printed {
    #[serde(flatten)]
    facts: Inspection,
    #[serde(skip_serializing_if = "Option::is_none")]
    tree: Option<Tree>,
    #[serde(skip_serializing_if = "Option::is_none")]
    health: Option<Health>,
}

/// Prints the content of the file.
///
/// # Errors
/// Exit code 2 for a file that is not CAD, 4 when it cannot be read.
pub fn run(args: &InspectArgs) -> Result<Exit, Failure> {
    let lists_faces = args.tree || args.list || args.select.is_given();
    // The numbers of faces are those of tool models, which are split at creases.
    let creases = if lists_faces { Creases::Cut } else { Creases::Kept };
    let (whole, diagnostics) = crate::cad::read_with(&args.file, creases)?;
    let chosen = args.select.choose(&args.file, &whole)?;
    let model = chosen.as_ref().map_or(&whole, |c| &c.model);
    let facts = inspect(model, &diagnostics);
    let tree = (args.tree || args.list).then(|| tree(model, chosen.as_ref().map(|c| &c.kept[..])));
    if args.json {
        let health = args.health.then(|| model.health());
        let all = Printed { facts, tree, health };
        out_json!("{}", serde_json::to_string_pretty(&all).map_err(Failure::input)?);
        return Ok(Exit::Done);
    }
    let health = model.health();
    out_lines!(facts.to_text(&health.verdict()));
    if let Some(tree) = tree {
        if args.tree {
            out_lines!(tree.to_text());
        }
        if args.list {
            out_lines!(tree.faces_text());
        }
    }
    if args.entities {
        out_lines!(facts.entities_text());
    }
    if args.health {
        out_lines!(health.to_text(model));
    }
    Ok(Exit::Done)
}
