//! Options of `kanagata study` that say where its cases run.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::exit::Failure;
use super::study_error::io;
use crate::study::file::Study;
use crate::study::runner::Runner;
use crate::study::runner::process::{self, NAMES, Processes};
use crate::study::runner::slurm::{self, Options, Slurm};
use crate::study::runner::template::Template;
use crate::study::schedule::MAX_TRIES;

/// Expected time of a task of an engine [min] that its own cost hardly matters to: Slurm takes about 0.3 s a task.
const TASK_MINUTES: f64 = 5.0;
/// Largest number of cases at a time on a host.
const PLACES_MAX: usize = 1000;

/// Where cases run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum RunnerKind {
    /// Child processes of this program
    #[default]
    Local,
    /// Job arrays of Slurm
    Slurm,
    /// The command given with --submit
    Command,
}

/// Options of the runners.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Where cases run")]
pub struct RunnerArgs {
    /// Where cases run
    #[arg(long, value_enum, default_value_t)]
    runner: RunnerKind,
    /// Command that runs a case, split as by a shell, with {case}, {dir}, {host}, {threads}, {memory_mb}, {minutes}, {name}:
    /// 'ssh {host} cd {dir} && {case}'
    #[arg(long, value_name = "COMMAND", required_if_eq("runner", "command"))]
    submit: Option<Template>,
    /// Command that ends with exit code 0 while an engine knows {ticket}, the last word that --submit printed
    #[arg(long, value_name = "COMMAND", requires = "submit")]
    poll: Option<Template>,
    /// Command that ends {ticket}
    #[arg(long, value_name = "COMMAND", requires = "poll")]
    end: Option<Template>,
    /// Hosts for {host}, with the number of cases at a time: a,b:2
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "submit")]
    hosts: Vec<String>,
    /// The solver where the cases run; default: kanagata-solve beside this program
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,
    /// Account of Slurm's jobs
    #[arg(long, value_name = "NAME")]
    account: Option<String>,
    /// Partition of Slurm's jobs
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,
    /// Another option of sbatch (--sbatch=--qos=long), split as by a shell; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Expected time below which cases share a task of Slurm [min]; default 5
    #[arg(long, value_name = "MINUTES")]
    task_minutes: Option<f64>,
    /// Submissions of a case without progress before it counts as failed; default 3
    #[arg(long, value_name = "N")]
    max_tries: Option<usize>,
    /// Submit and end; the same command later continues
    #[arg(long)]
    pub(super) detach: bool,
    /// Print the commands or scripts and submit nothing
    #[arg(long, conflicts_with = "detach")]
    pub(super) emit: bool,
    /// Ask all submitted cases to end; they save checkpoints
    #[arg(long, conflicts_with_all = ["detach", "emit", "only", "prepare", "collect", "status"])]
    pub(super) cancel: bool,
}

impl RunnerArgs {
    /// Whether any option is given.
    pub(super) fn is_given(&self) -> bool {
        self.runner != RunnerKind::Local || self.submit.is_some() || self.detach || self.emit
    }

    /// Whether cases run as child processes on this machine.
    pub(super) fn is_local(&self) -> bool {
        self.runner == RunnerKind::Local
    }

    /// These options for the runner `name` of earlier submissions, if none is given.
    pub(super) fn of(&self, name: &str) -> Self {
        let slurm = self.is_local() && name == "slurm";
        Self { runner: if slurm { RunnerKind::Slurm } else { self.runner }, ..self.clone() }
    }

    /// Submissions of a case without progress before it counts as failed.
    pub(super) fn max_tries(&self) -> usize {
        self.max_tries.unwrap_or(MAX_TRIES).max(1)
    }

    /// Smallest expected time of a task [s].
    pub(super) fn task_s(&self) -> f64 {
        let default = if self.runner == RunnerKind::Slurm { TASK_MINUTES } else { 0.0 };
        60.0 * self.task_minutes.unwrap_or(default).max(0.0)
    }

    /// The runner for the study in the existing folder `study`, with `jobs` places here.
    ///
    /// # Errors
    /// Exit code 2 for options that have no meaning together, or a template with unknown names.
    pub(super) fn runner(
        &self,
        study: &Path,
        file: Option<&Study>,
        jobs: usize,
        again: bool,
    ) -> Result<Box<dyn Runner>, Failure> {
        let study = study.canonicalize().map_err(io(study))?;
        let program = self.program.clone().map_or_else(solver, Ok)?;
        if self.runner == RunnerKind::Slurm {
            let options = self.sbatch_options(file)?;
            return Ok(Box::new(Slurm::new(slurm::Setup { study, program, options, again })));
        }
        if self.is_local() && (self.detach || self.submit.is_some()) {
            let found = if self.detach { "--detach" } else { "--submit" };
            return Err(Failure::input(format!(
                "{found}: found --runner local; allowed: --runner slurm or command, whose cases outlive this program"
            )));
        }
        let places = if self.hosts.is_empty() {
            vec!["localhost".to_owned(); jobs]
        } else {
            places(&self.hosts)?
        };
        let setup = process::Setup {
            study,
            program,
            submit: self.submit.clone(),
            poll: self.poll.clone(),
            cancel: self.end.clone(),
            places,
            tied: !self.detach && !self.emit && self.poll.is_none(),
            again,
        };
        check_templates(&setup)?;
        Ok(Box::new(Processes::new(setup)))
    }

    /// Options of sbatch: those of the study file, then those of the command line, which count more.
    ///
    /// # Errors
    /// Exit code 2 for a text that is no option: `sbatch` would take it for the script.
    fn sbatch_options(&self, file: Option<&Study>) -> Result<Options, Failure> {
        let slurm = file.and_then(|study| study.slurm.clone()).unwrap_or_default();
        let mut options = Options::default();
        for (name, own, given) in [
            ("account", &slurm.account, &self.account),
            ("partition", &slurm.partition, &self.partition),
        ] {
            if let Some(value) = given.as_ref().or(own.as_ref()) {
                options.set(name, value).map_err(refused(value))?;
            }
        }
        for text in slurm.options.iter().chain(&self.sbatch) {
            options.add(text).map_err(refused(text))?;
        }
        Ok(options)
    }
}

/// The failure for a text of which `why` is wrong as an option of sbatch.
/// The solver beside this program.
fn solver() -> Result<PathBuf, Failure> {
    let own = std::env::current_exe().map_err(io(Path::new("this program")))?;
    Ok(own.with_file_name(format!("kanagata-solve{}", std::env::consts::EXE_SUFFIX)))
}

fn refused(text: &str) -> impl FnOnce(String) -> Failure {
    move |why| {
        Failure::input(format!(
            "options of sbatch (`slurm` of the study, --sbatch): found {text:?} {why}; allowed: options with their dashes, and quotes around values with spaces (--comment=\"two words\")"
        ))
    }
}

/// Checks the names in the templates.
///
/// # Errors
/// Exit code 2 with the option and what is wrong with it.
fn check_templates(setup: &process::Setup) -> Result<(), Failure> {
    let templates = [
        ("--submit", &setup.submit, &NAMES[..]),
        ("--poll", &setup.poll, &["ticket"]),
        ("--end", &setup.cancel, &["ticket"]),
    ];
    for (option, template, names) in templates {
        let unknown = template.as_ref().and_then(|template| template.unknown(names));
        if let Some(name) = unknown {
            let names: Vec<String> = names.iter().map(|name| format!("{{{name}}}")).collect();
            let allowed = names.join(", ");
            return Err(Failure::input(format!("{option}: found {{{name}}}; allowed: {allowed}")));
        }
    }
    if setup.submit.as_ref().is_some_and(|submit| !submit.uses("case")) {
        return Err(Failure::input(
            "--submit: found no {case}; allowed: a command with {case}, which runs the case",
        ));
    }
    Ok(())
}

/// A place for every case at a time of `HOST` or `HOST:N`.
fn places(hosts: &[String]) -> Result<Vec<String>, Failure> {
    let mut places = Vec::new();
    for text in hosts {
        let (host, count) = match text.rsplit_once(':') {
            Some((host, count)) => (host, count.parse().ok()),
            None => (text.as_str(), Some(1)),
        };
        let count = count.filter(|n| (1..=PLACES_MAX).contains(n) && !host.is_empty());
        let Some(count) = count else {
            let allowed = format!("HOST or HOST:N with N from 1 to {PLACES_MAX}");
            return Err(Failure::input(format!("--hosts: found '{text}'; allowed: {allowed}")));
        };
        places.extend(std::iter::repeat_n(host.to_owned(), count));
    }
    Ok(places)
}
