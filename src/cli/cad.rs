//! `kanagata`: the command line for CAD, tool models and studies.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use super::exit::{EXIT_HELP, finish};
use super::threads::use_threads;
use super::{
    audit, color, convert, init, inspect, material, mesh, report, run_scene, schema, shell, solve,
    stop, study,
};

/// Turns the CAD of a forming die into smooth, audited tool models.
#[derive(Debug, Parser)]
#[command(name = "kanagata", version, long_version = crate::run::build::version(), after_help = EXIT_HELP)]
struct Kanagata {
    /// Threads to use; results are the same for any number of them.
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
    #[command(flatten)]
    color: color::ColorArgs,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the content of an IGES or STEP file
    Inspect(inspect::InspectArgs),
    /// Mesh the faces of a CAD file
    Mesh(mesh::MeshArgs),
    /// Convert a CAD file to a tool file
    Convert(convert::ConvertArgs),
    /// Convert every body of a CAD file to a tool file of its own
    Split(convert::SplitArgs),
    /// Measure the shape error of a tool file against its CAD (Eq. 24)
    Audit(audit::AuditArgs),
    /// Write a scene to start from, proposed from tools or CAD
    Init(init::InitArgs),
    /// Make the tools of a scene from its CAD, check it, run it
    Run(run_scene::RunSceneArgs),
    /// Run the cases of a study and compare them
    Study(study::StudyArgs),
    /// Write report.html of a case or another run that has ended, from its files
    Report(report::ReportArgs),
    /// List and show the sheet materials of the solver
    Material(material::MaterialArgs),
    /// Print the JSON schema of a file, for editors
    Schema(schema::SchemaArgs),
    /// Print a script that completes arguments in a shell
    Completions(shell::CompletionsArgs),
    /// Write manual pages of both programs
    Man(shell::ManArgs),
}

/// Runs the program with the arguments of the process.
#[must_use]
pub fn main() -> ExitCode {
    let arguments: Kanagata = color::parse();
    stop::listen();
    let command = &arguments.command;
    let computes =
        !matches!(command, Command::Schema(_) | Command::Completions(_) | Command::Man(_));
    if let Err(failure) = use_threads(arguments.threads, computes) {
        return finish(Err(failure));
    }
    finish(match arguments.command {
        Command::Inspect(args) => inspect::run(&args),
        Command::Mesh(args) => mesh::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Split(args) => convert::run_split(&args),
        Command::Audit(args) => audit::run(&args),
        Command::Init(args) => init::run(&args),
        Command::Run(args) => run_scene::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Material(args) => material::run(&args),
        Command::Schema(args) => schema::run(&args),
        Command::Completions(args) => shell::completions(&args, programs()),
        Command::Man(args) => shell::man(&args, programs()),
    })
}

/// The descriptions of the arguments of both programs.
fn programs() -> [clap::Command; 2] {
    [Kanagata::command(), solve::command()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Kanagata::command().debug_assert();
    }
}
