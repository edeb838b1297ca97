//! Completions for shells, and manual pages, of both programs.

use std::path::PathBuf;

use clap::{Command, ValueEnum};
use clap_complete::Shell;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::terminal::{out, put};
use crate::files::write_atomic;

/// One of the two programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Program {
    /// `kanagata`
    Kanagata,
    /// `kanagata-solve`
    KanagataSolve,
}

/// Arguments of `completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata completions bash > ~/.local/share/bash-completion/completions/kanagata\n  \
    kanagata completions zsh --program kanagata-solve > ~/.zfunc/_kanagata-solve\n\n{EXIT_HELP}"))]
pub struct CompletionsArgs {
    /// The shell
    shell: Shell,
    /// The program whose arguments are completed
    #[arg(long, value_enum, default_value_t = Program::Kanagata)]
    program: Program,
}

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata man -o ~/.local/share/man/man1\n\n{EXIT_HELP}"))]
pub struct ManArgs {
    /// Folder for the pages, one for each program and command
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Prints the completion script of a program; `programs` are `kanagata` and `kanagata-solve`.
///
/// # Errors
/// None; other commands share the type.
pub(super) fn completions(args: &CompletionsArgs, programs: [Command; 2]) -> Result<Exit, Failure> {
    let [kanagata, solve] = programs;
    let mut command = if args.program == Program::Kanagata { kanagata } else { solve };
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    String::from_utf8_lossy(&script).lines().for_each(put);
    Ok(Exit::Done)
}

/// Writes the manual pages of the programs, `NAME.1` and `NAME-COMMAND.1`.
///
/// # Errors
/// Exit code 4 when the folder cannot be made or written.
pub(super) fn man(args: &ManArgs, programs: [Command; 2]) -> Result<Exit, Failure> {
    std::fs::create_dir_all(&args.output).map_err(|e| {
        Failure::new(Exit::Io, format!("cannot make the folder {}: {e}", args.output.display()))
    })?;
    for mut program in programs {
        program.build();
        let commands = program.get_subcommands().filter(|c| c.get_name() != "help").cloned();
        for command in commands.chain([program.clone()]) {
            let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
            let page = page(command)?;
            let path = args.output.join(format!("{name}.1"));
            write_atomic(&path, |w| w.write_all(&page))?;
            out!("{}", path.display());
        }
    }
    Ok(Exit::Done)
}

/// The page of a command.
fn page(command: Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    let man = clap_mangen::Man::new(command);
    man.render(&mut page).map_err(|e| Failure::new(Exit::Io, e))?;
    Ok(page)
}
