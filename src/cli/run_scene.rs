//! `kanagata run SCENE -o DIR`: tools from CAD, check, run, report.

use super::check;
use super::doubts::print_doubts;
use super::earlier::note_results;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::run;
use super::stages::{progress, show_unless};
use super::terminal::{err, out};
use crate::prelude::{Error, ErrorKind, MadeTool, make_tools_watched};
use crate::scene::set_value::SetValue;

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
    let (of_tools, set) =
        prepared(args).inspect_err(|failure| note_results(args.output(), failure))?;
    let of_run = run::run(&args.with(set))?;
    Ok(if of_run == Exit::Done { of_tools } else { of_run })
}

/// Makes the tools and checks the scene. Returns the exit code for doubts about the tools, and all values to set: those
/// given, and the files of tools that are made for them.
fn prepared(args: &run::RunArgs) -> Result<(Exit, Vec<SetValue>), Failure> {
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
    let mut set = args.set().to_vec();
    for tool in made.iter().filter(|tool| tool.is_variant) {
        set.push(file_of(tool).map_err(Failure::input)?);
    }
    if !args.is_quiet() {
        check::print(args.scene(), &set)?;
    }
    Ok((of_tools, set))
}

/// The value that names the file of a tool.
fn file_of(made: &MadeTool) -> Result<SetValue, String> {
    let file = serde_json::Value::String(made.file.clone());
    SetValue::new(&format!("tools.{}.file", made.name), &file.to_string())
}

fn print(made: &MadeTool) {
    let MadeTool { name, file, tool, is_new, .. } = made;
    let error =
        tool.shape_error_mm().map_or_else(String::new, |e| format!(", shape error {e:.4} mm"));
    let kept = if *is_new { "" } else { " (as it was)" };
    out!("  {name}: {} patches{error}, {file}{kept}", tool.patches());
}
