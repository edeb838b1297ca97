//! `kanagata-solve`: the command line of the forming solver.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use super::exit::{EXIT_HELP, finish};
use super::threads::use_threads;
use super::{case, check, color, report, run, status, stop};

/// Forms a sheet against rigid tools with an implicit finite-element solver.
#[derive(Debug, Parser)]
#[command(name = "kanagata-solve", version, long_version = crate::run::build::version(), after_help = EXIT_HELP)]
struct Solve {
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
    /// Check a scene and its tools: findings and expected cost
    Check(check::CheckArgs),
    /// Run a scene into a folder
    Run(run::RunArgs),
    /// Run, continue or prove done the cases of a study; the same command may be given any number of times
    Case(case::CaseArgs),
    /// Show the state of a run: increment, travels, forces, checkpoint, how to continue
    Status(status::StatusArgs),
    /// Write report.html of a run that has ended, from its files
    Report(report::ReportArgs),
}

/// The description of the program's arguments.
pub(super) fn command() -> clap::Command {
    Solve::command()
}

/// Runs the program with the arguments of the process.
#[must_use]
pub fn main() -> ExitCode {
    let arguments: Solve = color::parse();
    stop::listen();
    let computes = !matches!(arguments.command, Command::Status(_));
    if let Err(failure) = use_threads(arguments.threads, computes) {
        return finish(Err(failure));
    }
    finish(match arguments.command {
        Command::Check(args) => check::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Case(args) => case::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Report(args) => report::run(&args),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Solve::command().debug_assert();
    }
}
