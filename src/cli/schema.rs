//! `kanagata schema NAME`: the JSON schemas of files, for editors that complete and check.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::paths::output_path;
use super::terminal::put;
use crate::files::write_atomic;

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
    /// File for the schema; - or nothing for standard output
    #[arg(short, long, value_name = "FILE", value_parser = output_path)]
    output: Option<PathBuf>,
}

/// Prints a schema.
///
/// # Errors
/// Exit code 4 when the file cannot be written.
pub fn run(args: &SchemaArgs) -> Result<Exit, Failure> {
    let found = SCHEMAS.iter().find(|(name, _)| *name == args.name);
    let text = found.map_or("", |(_, text)| text);
    match &args.output {
        Some(path) => write_atomic(path, |w| w.write_all(text.as_bytes()))?,
        None => text.lines().for_each(put),
    }
    Ok(Exit::Done)
}
