//! `kanagata run SCENE -o DIR`: tools from CAD, check, run, report.

use super::check;
use super::doubts::print_doubts;
use super::earlier::note_results;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::run;
use super::stages::{progress, show_unless};
use super::terminal::{err, out};
use crate::prelude::{Error, ErrorKind, MadeTool, make_tools_watched};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata init --tools die.igs punch.igs -o cup.scene.json\n  kanagata run cup.scene.json -o out\n\n\
    Tools with `cad` in the scene are converted first, unless their files were made from the same CAD in the same way. The scene is\n\
    then checked and run as by kanagata-solve.\n\n{EXIT_HELP}"))]
pub struct RunSceneArgs {
    #[command(flatten)]
    run: run::RunArgs,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let exit = match error.kind() {
            ErrorKind::Io => Exit::Io,
            ErrorKind::Input => Exit::Input,
            ErrorKind::NoConvergence => Exit::NoConvergence,
            ErrorKind::Stopped => Exit::Stopped,
        };
        Self::new(exit, error)
    }
}

/// Makes the tools, checks the scene and runs it.
///
/// # Errors
/// Exit codes as of `kanagata convert` and `kanagata-solve run`.
pub fn run(args: &RunSceneArgs) -> Result<Exit, Failure> {
    let args = &args.run;
    args.forget_metrics()?;
    let of_tools = prepared(args).inspect_err(|failure| note_results(args.output(), failure))?;
    let of_run = run::run(args)?;
    Ok(if of_run == Exit::Done { of_tools } else { of_run })
}

/// Makes the tools and checks the scene. Returns the exit code for doubts about the tools.
fn prepared(args: &run::RunArgs) -> Result<Exit, Failure> {
    let note = &mut |name: &str| {
        if !args.is_quiet() {
            err!("note: {name} is made from its CAD");
        }
    };
    let shown = show_unless(args.has_no_bar());
    let made = make_tools_watched(args.scene(), args.set(), note, &progress())?;
    drop(shown);
    if !args.is_quiet() {
        made.iter().for_each(print);
    }
    let mut doubts: Vec<_> = Vec::new();
    for MadeTool { name, tool, .. } in &made {
        doubts.extend(tool.doubts().iter().cloned().map(|mut doubt| {
            doubt.text = format!("{name}: {}", doubt.text);
            doubt
        }));
    }
    print_doubts(&doubts, args.accepts_doubts());
    let of_tools = Exit::of_doubts(&doubts, args.accepts_doubts());
    if !args.is_quiet() {
        check::print(args.scene(), args.set())?;
    }
    Ok(of_tools)
}

fn print(made: &MadeTool) {
    let MadeTool { name, tool, is_new } = made;
    let error =
        tool.shape_error_mm().map_or_else(String::new, |e| format!(", shape error {e:.4} mm"));
    let kept = if *is_new { "" } else { " (as it was)" };
    out!("  {name}: {} patches{error}{kept}", tool.patches());
}
