//! `kanagata schema NAME`: the JSON schemas of files, for editors that complete and check.

use clap::builder::PossibleValuesParser;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::terminal::put;

/// Names and texts of the schemas.
const SCHEMAS: [(&str, &str); 8] = [
    ("scene", include_str!("../../schemas/scene.schema.json")),
    ("study", include_str!("../../schemas/study.schema.json")),
    ("tool", include_str!("../../schemas/tool.schema.json")),
    ("run", include_str!("../../schemas/run.schema.json")),
    ("audit", include_str!("../../schemas/audit.schema.json")),
    ("case", include_str!("../../schemas/case.schema.json")),
    ("stability", include_str!("../../schemas/stability.schema.json")),
    ("patches", include_str!("../../schemas/patches.schema.json")),
];

/// Arguments of `schema`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata schema scene > scene.schema.json\n\n\
    A scene with the key `\"$schema\": \"scene.schema.json\"` is completed and checked by editors.\n\n{EXIT_HELP}"))]
pub struct SchemaArgs {
    /// The file that it describes
    #[arg(value_parser = PossibleValuesParser::new(SCHEMAS.map(|(name, _)| name)))]
    name: String,
}

/// Prints a schema.
///
/// # Errors
/// None; other commands share the type.
pub fn run(args: &SchemaArgs) -> Result<Exit, Failure> {
    let found = SCHEMAS.iter().find(|(name, _)| *name == args.name);
    found.iter().flat_map(|(_, text)| text.lines()).for_each(put);
    Ok(Exit::Done)
}
