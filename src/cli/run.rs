//! `kanagata-solve run SCENE -o DIR`: runs a scene with progress on the terminal.

use std::path::{Path, PathBuf};

use super::accuracy;
use super::doubts::print_doubts;
use super::earlier::{forget_metrics, note_results};
use super::exit::{EXIT_HELP, Exit, Failure};
use super::output_clash::refuse_clashes;
use super::paths::named_path;
use super::progress_bar::{progress_bar, show};
use super::quantity::time_s;
use super::run_summary::print_record;
use super::stop;
use super::terminal::{end_bar, err, out, put};
use crate::accuracy::Limits;
use crate::report::record::RunRecord;
use crate::run::folder::row;
use crate::run::progress_line::{HEADER, json_line, line};
use crate::run::report::write_from_files;
use crate::run::{RunError, RunOptions, WriteReport, completed};
use crate::scene::accuracy::Accuracy;
use crate::scene::read::read_with;
use crate::scene::set_value::SetValue;
use crate::scene::{Plan, SceneError};
use crate::solver::SimulationError;
use crate::study::metrics;

/// Arguments of `run`.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata-solve run fixtures/dome/dome.scene.json -o out/dome\n\n\
    `kanagata-solve status DIR` says how it stands. A run of the same inputs that is done is not\n\
    repeated; one that was stopped is continued (--restart) or discarded (--overwrite). Other results in DIR are replaced.\n\
    The folder then holds history.csv, run.json, run.pvd, steps/*.vtu, tools/*.vtu and report.html.\n\n{EXIT_HELP}"))]
pub struct RunArgs {
    /// Scene file
    #[arg(value_parser = named_path)]
    scene: PathBuf,
    /// Folder for the results; created if missing
    #[arg(short, long, value_name = "DIR", value_parser = named_path)]
    output: PathBuf,
    /// Set a value of the scene: keys, names of tools or indices, joined by dots (tools.die.friction=0.08); may be repeated
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<SetValue>,
    /// Also write results as one flat JSON object: verdict, forces by tool, thickness, draw-in, springback, cost
    #[arg(long, value_name = "FILE", value_parser = named_path)]
    metrics: Option<PathBuf>,
    /// Continue from the checkpoint in DIR, with the same results as an uninterrupted run
    #[arg(long)]
    restart: bool,
    /// Start again although DIR holds a run of the same inputs or files of no run, and discard them
    #[arg(long, conflicts_with = "restart")]
    overwrite: bool,
    /// Take DIR although a run on another host seems to work in it; refused for a run that is alive on this host
    #[arg(long)]
    break_lock: bool,
    /// Refine mesh, layers, points and increments from run to run until the estimated errors are below this: `1%` for
    /// all, or force=1%,thickness=1%,draw-in=0.1mm,springback=0.05mm; also `accuracy` in the scene. A sequence that was
    /// stopped is continued
    #[arg(long, value_name = "ERROR", value_parser = accuracy::accuracy)]
    accuracy: Option<Accuracy>,
    /// Wall time that the runs for an accuracy may take, as `10min`; the best result within it is given
    #[arg(long, value_name = "TIME", value_parser = time_s)]
    budget: Option<f64>,
    /// Exclude what does not change results (tool patches that the sheet cannot touch); run.json lists them
    #[arg(long)]
    auto: bool,
    /// When to write report.html: at the end of every run, or only when the solver does not converge; `report
    /// DIR` writes it later
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = When::Always)]
    report: When,
    /// Stop with a checkpoint when standard input ends: the run does not outlive the program that started it
    #[arg(long)]
    tied: bool,
    /// End with exit code 0 instead of 1 when the result is doubtful; run.json keeps the list
    #[arg(long)]
    accept_doubts: bool,
    /// No progress bar and no summary: only doubts (stderr)
    #[arg(short, long)]
    quiet: bool,
    /// One line per increment instead of the bar
    #[arg(long, conflicts_with_all = ["quiet", "json"])]
    lines: bool,
    /// One line of JSON per increment instead of the bar, and run.json in one line at the end
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

impl RunArgs {
    /// The scene file.
    pub(super) fn scene(&self) -> &Path {
        &self.scene
    }

    /// Values of the scene that are set.
    pub(super) fn set(&self) -> &[SetValue] {
        &self.set
    }

    /// The same with these values set.
    pub(super) fn with(&self, set: Vec<SetValue>) -> Self {
        Self { set, ..self.clone() }
    }

    /// The folder for the results.
    pub(super) fn output(&self) -> &Path {
        &self.output
    }

    /// Removes the metrics of an earlier run.
    pub(super) fn forget_metrics(&self) -> Result<(), Failure> {
        let metrics = self.metrics.as_deref();
        refuse_clashes(&[&self.scene], &[("--metrics", metrics)])?;
        forget_metrics(metrics)
    }

    /// Whether doubts leave the exit code at 0.
    pub(super) fn accepts_doubts(&self) -> bool {
        self.accept_doubts
    }

    /// Whether there is no progress bar.
    pub(super) fn has_no_bar(&self) -> bool {
        self.is_quiet() || self.lines
    }

    /// Whether standard output is for nothing, or for JSON only.
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet || self.json
    }
}

/// When `report.html` is written.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum When {
    Always,
    Failed,
}

impl From<When> for WriteReport {
    fn from(when: When) -> Self {
        match when {
            When::Always => Self::Always,
            When::Failed => Self::NotConverged,
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let exit = match &error {
            RunError::Scene(SceneError::Io { .. })
            | RunError::Write(_)
            | RunError::LockLost { .. }
            | RunError::Folder { .. } => Exit::Io,
            RunError::Scene(_)
            | RunError::Busy { .. }
            | RunError::Checkpoint(_)
            | RunError::Refused { .. }
            | RunError::Foreign { .. }
            | RunError::AlreadyComplete { .. }
            | RunError::Unfinished { .. } => Exit::Input,
            RunError::Solver { cause, .. } => match **cause {
                SimulationError::Setup(_) | SimulationError::NoTouch { .. } => Exit::Input,
                SimulationError::Stopped { .. } => Exit::Stopped,
                _ => Exit::NoConvergence,
            },
            RunError::ExcludedPatchReached { .. } => Exit::NoConvergence,
        };
        Self::new(exit, error)
    }
}

/// Runs the scene.
///
/// # Errors
/// Exit code 2 for a scene that cannot be run, 3 when the solver does not converge, 4 when files cannot be read or
/// written. A doubtful result (exit code 1) is not an error.
pub fn run(args: &RunArgs) -> Result<Exit, Failure> {
    args.forget_metrics()?;
    run_or_continue(args).inspect_err(|failure| note_results(&args.output, failure))
}

/// Runs the scene, continues an interrupted run, or reports a run of the same inputs that is done.
fn run_or_continue(args: &RunArgs) -> Result<Exit, Failure> {
    let plan = read_with(&args.scene, &args.set)?;
    if args.tied {
        stop_with_input();
    }
    if args.accuracy.is_some() || plan.scene.accuracy.is_some() {
        return report(args, &accuracy::run(&sequence(args), &plan)?);
    }
    if args.budget.is_some() {
        return Err(Failure::input(
            "--budget without an accuracy; allowed: with --accuracy or `accuracy` in the scene",
        ));
    }
    if !args.restart
        && !args.overwrite
        && let Some(record) = completed(&args.output, &plan)
    {
        err!(
            "note: {}: a run of the same inputs is done and was not repeated (--overwrite repeats it)",
            args.output.display()
        );
        // It may have been killed while it wrote its page.
        if matches!(args.report, When::Always) && !args.output.join("report.html").exists() {
            write_from_files(&args.output)?;
        }
        return report(args, &record);
    }
    match solve(args, &plan) {
        Ok(record) => report(args, &record),
        Err(error) => {
            // An optimiser needs the verdict of a run that did not converge too. The error of the run counts more.
            let has_folder = matches!(error, RunError::Solver { folder: Some(_), .. });
            if has_folder && let Err(failure) = write_metrics(args) {
                err!("note: the metrics are not written: {}", failure.error);
            }
            Err(error.into())
        }
    }
}

/// The sequence of runs to an accuracy that the arguments ask for.
fn sequence(args: &RunArgs) -> accuracy::Request<'_> {
    accuracy::Request {
        scene: &args.scene,
        set: &args.set,
        output: &args.output,
        accuracy: args.accuracy,
        limits: Limits {
            wall_s: args.budget,
            overwrite: args.overwrite,
            auto: args.auto,
            break_lock: args.break_lock,
            stop: stop::request().clone(),
        },
        lines: args.lines,
        json: args.json,
        quiet: args.quiet || args.json,
        page: matches!(args.report, When::Always),
    }
}

/// Runs the plan with progress on the terminal.
fn solve(args: &RunArgs, plan: &Plan) -> Result<RunRecord, RunError> {
    let bar = progress_bar(args.has_no_bar());
    let tell = |message: &str| err!("note: {message}");
    let options = RunOptions {
        restart: args.restart,
        overwrite: args.overwrite,
        notify: (!args.quiet).then_some(&tell as &dyn Fn(&str)),
        auto: args.auto,
        break_lock: args.break_lock,
        keep_complete: false,
        report: args.report.into(),
        stop: stop::request().clone(),
    };
    if args.lines {
        out!("{HEADER}");
    }
    let tools: Vec<String> = plan.scene.tools.iter().map(|t| t.name.clone()).collect();
    let outcome =
        crate::run::run(plan, &args.scene, &args.output, &options, &mut |progress| match (
            args.lines, args.json,
        ) {
            (false, false) => show(&bar, progress),
            _ if progress.report.increment == 0 => {}
            (true, _) => put(&line(&tools, &row(progress.report))),
            (_, true) => put(&json_line(&tools, &row(progress.report))),
        });
    end_bar(&bar);
    outcome
}

/// Prints and writes the results of a run that has ended; doubts come before anything that may fail.
fn report(args: &RunArgs, record: &RunRecord) -> Result<Exit, Failure> {
    if args.json {
        put(&serde_json::to_string(record).map_err(Failure::input)?);
    } else if !args.quiet {
        print_record(record, &args.output);
        record.accuracy.iter().for_each(accuracy::print);
    }
    print_doubts(&record.doubts, args.accept_doubts);
    write_metrics(args)?;
    Ok(Exit::of_doubts(&record.doubts, args.accept_doubts))
}

/// Writes the metrics of the run if asked for.
fn write_metrics(args: &RunArgs) -> Result<(), Failure> {
    let Some(path) = &args.metrics else { return Ok(()) };
    Ok(metrics::write(path, &metrics::metrics(&args.output)?)?)
}

/// Requests a stop when standard input ends.
pub(super) fn stop_with_input() {
    std::thread::spawn(move || {
        // A read error counts as the end.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        stop::stop();
    });
}
