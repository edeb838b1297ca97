//! `kanagata convert FILE -o TOOL` and, in [`split`], `kanagata split FILE -o FOLDER`: [`mesh_only`] for meshes, [`kinds`] for
//! Bezier patches and tool files, [`make`] for the rest.

mod args;
mod converted;
mod folds;
mod kinds;
mod made;
mod make;
mod mesh_only;
mod offset;
mod offset_args;
mod options;
mod print;
mod provenance;
mod split;

pub use self::args::ConvertArgs;
use self::kinds::exchange;
use self::make::make_tool;
pub(super) use self::split::named_bodies;
pub use self::split::{SplitArgs, run as run_split};
use super::exit::{Exit, Failure};
use super::read::read_model;
use crate::cli::doubts::print_conversion_doubts;
use crate::cli::output_clash::refuse_clashes;
use crate::cli::stages::show;
use crate::cli::terminal::out;
use crate::convert::ConvertError;
use crate::convert::tolerance::ToleranceError;
use crate::mesh::io;

impl From<ConvertError> for Failure {
    fn from(error: ConvertError) -> Self {
        Self::input(error)
    }
}

impl From<ToleranceError> for Failure {
    fn from(error: ToleranceError) -> Self {
        Self::input(error)
    }
}

/// Converts the file.
///
/// # Errors
/// Exit code 2 for a file that is not CAD or cannot be meshed; 4 when files cannot be read or
/// written.
pub fn run(args: &ConvertArgs) -> Result<Exit, Failure> {
    args.check_borders()?;
    args.check_refinement()?;
    args.how.mesher.check()?;
    refuse_clashes(&args.inputs(), &[("--output", Some(&args.output))])?;
    let shown = show(args.how.quiet);
    if let Some(to) = args.to {
        return exchange(args, to);
    }
    if io::is_mesh(&args.file) {
        return mesh_only::convert(args);
    }
    args.check_cad()?;
    let whole = read_model(&args.file, args.how.mesher.lost_faces())?;
    let made = make_tool(args, &whole)?;
    drop(shown);
    made.print(args);
    out!("  {}", args.output.display());
    let doubts = made.doubts();
    print_conversion_doubts(&doubts, args.how.accept_doubts);
    Ok(Exit::of_doubts(&doubts, args.how.accept_doubts))
}
