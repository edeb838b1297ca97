//! `kanagata study FILE -o DIR`: runs and compares the cases of a study, draws stability maps, or compares patches with
//! their accuracy and time.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use super::exit::{EXIT_HELP, Exit, Failure};
use super::output_clash::refuse_clashes;
use super::read::{LostFaces, read_model};
use super::study_cases::forming;
use super::study_runner::RunnerArgs;
use super::study_status;
use super::terminal::out;
use crate::study::StudyError;
use crate::study::patches::{self, PatchStudy};
use crate::study::read::{Description, read, table_file};
use crate::study::stability;

/// Arguments of `study`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  tools/models out/models\n  \
    kanagata study fixtures/studies/cross-tool.json --tools out/models -o out/study --quick\n  \
    kanagata study fixtures/studies/stability.json -o out/stability\n  \
    kanagata study fixtures/studies/patches.json -o out/patches\n\n\
    Cases that are done are not run again; those that were stopped or killed continue from their checkpoint. A study whose\n\
    runs are of other inputs or of another build says so and ends (exit code 2) unless --renew is given.\n\
    The folder then holds order.json, study.csv, cost.csv, study.html, and in cases/NAME case.json, case.scene.json and run.\n\
    On a cluster: docs/guide/cluster.md.\n\n{EXIT_HELP}"))]
pub struct StudyArgs {
    /// Study file (schemas/study.schema.json, stability.schema.json or patches.schema.json); with --status or --cancel
    /// the folder of a study
    pub(super) file: PathBuf,
    /// Folder for the results; created if missing
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["status", "cancel"])]
    pub(super) output: Option<PathBuf>,
    /// Folder that the scene's tool files are relative to; default: the folder of the study
    #[arg(long, value_name = "DIR")]
    pub(super) tools: Option<PathBuf>,
    /// Cases at a time; default 1
    #[arg(long, value_name = "N")]
    pub(super) jobs: Option<NonZeroUsize>,
    /// Only the case of this name, or if there is none all cases whose names contain it, and those they follow; may be
    /// repeated
    #[arg(long, value_name = "CASE")]
    pub(super) only: Vec<String>,
    /// Apply the changes of the study for a coarse trial run
    #[arg(long)]
    pub(super) quick: bool,
    /// Run failed cases again
    #[arg(long)]
    pub(super) again: bool,
    /// Run cases again whose runs are of other inputs or of another build, and lose those
    #[arg(long)]
    pub(super) renew: bool,
    /// Take DIR although a study on another host seems to work in it; refused for a study that is alive on this host
    #[arg(long)]
    pub(super) break_lock: bool,
    /// End with exit code 0 instead of 1 when results are doubtful; tables and pages keep the doubts
    #[arg(long)]
    pub(super) accept_doubts: bool,
    /// Run nothing, only compare existing results
    #[arg(long, conflicts_with_all = ["only", "again", "jobs", "renew", "break_lock"])]
    pub(super) collect: bool,
    /// Run nothing, only write the scene and case.json of every case
    #[arg(long, conflicts_with_all = ["collect", "again"])]
    pub(super) prepare: bool,
    /// Show the state of the study in the folder FILE
    #[arg(long, conflicts_with_all = ["collect", "prepare", "again", "renew", "quick"])]
    status: bool,
    /// With --status: print JSON
    #[arg(long, requires = "status")]
    json: bool,
    #[command(flatten)]
    pub(super) runner: RunnerArgs,
}

impl StudyArgs {
    /// The folder for the results; given unless another is asked for its state.
    pub(super) fn folder(&self) -> &Path {
        self.output.as_deref().unwrap_or(&self.file)
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let input = matches!(
            error,
            StudyError::Value { .. }
                | StudyError::Busy { .. }
                | StudyError::OtherRuns { .. }
                | StudyError::OtherRunner { .. }
                | StudyError::Refused { .. }
        );
        let exit = if input { Exit::Input } else { Exit::Io };
        Self::new(exit, error)
    }
}

pub(super) fn folder(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Folder { path, source }
}

pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Io { path, source }
}

/// Runs the study.
///
/// # Errors
/// Exit code 1 when a check fails or results are doubtful, 2 for an invalid study, 3 when a case failed, 4 when files
/// cannot be read or written, 5 when stopped.
pub fn run(args: &StudyArgs) -> Result<Exit, Failure> {
    if args.status {
        return study_status::run(args.folder(), args.json);
    }
    if args.runner.cancel {
        return super::study_cases::cancel(args);
    }
    let output = args.folder();
    let written = ["study.csv", "cost.csv", "study.html"].map(|name| output.join(name));
    let outputs = written.each_ref().map(|path| ("--output, for", Some(path.as_path())));
    refuse_clashes(&[&args.file], &outputs)?;
    match read(&args.file)? {
        Description::Forming(study) => {
            if let Some(table) = table_file(&study, &args.file) {
                refuse_clashes(&[&table], &outputs)?;
            }
            forming(args, &study)
        }
        Description::Stability(study) => {
            only_of_forming(args, "kanagata-stability")?;
            std::fs::create_dir_all(output).map_err(folder(output))?;
            for line in stability::run(&study, &args.file, output)? {
                out!("{line}");
            }
            for name in stability::DRAWINGS {
                out!("  {}", output.join(name).with_extension("svg").display());
            }
            Ok(Exit::Done)
        }
        Description::Patches(study) => {
            only_of_forming(args, "kanagata-patches")?;
            patch_study(args, &study)
        }
    }
}

/// Refuses options that apply to forming studies only.
fn only_of_forming(args: &StudyArgs, format: &str) -> Result<(), Failure> {
    let given = [
        ("--tools", args.tools.is_some()),
        ("--jobs", args.jobs.is_some()),
        ("--only", !args.only.is_empty()),
        ("--quick", args.quick),
        ("--again", args.again),
        ("--renew", args.renew),
        ("--break-lock", args.break_lock),
        ("--collect", args.collect),
        ("--prepare", args.prepare),
        ("--runner", args.runner.is_given()),
    ];
    let given: Vec<&str> =
        given.iter().filter(|(_, given)| *given).map(|(name, _)| *name).collect();
    if given.is_empty() {
        return Ok(());
    }
    Err(value(
        &args.file,
        "format",
        format!("{format} with {}", given.join(" ")),
        format!(
            "-o alone: those are for cases of the solver (kanagata-study), and {format} is done as a whole; leave them out"
        ),
    ))
}

pub(super) fn value(path: &Path, place: &str, found: String, allowed: String) -> Failure {
    StudyError::Value { path: path.to_path_buf(), place: place.to_owned(), found, allowed }.into()
}

fn patch_study(args: &StudyArgs, study: &PatchStudy) -> Result<Exit, Failure> {
    let output = args.folder();
    let model = read_model(
        &args.file.parent().unwrap_or(Path::new("")).join(&study.cad),
        LostFaces::Refuse,
    )?;
    std::fs::create_dir_all(output).map_err(folder(output))?;
    let lost = patches::run(study, &model, [&args.file, output], &|line| out!("{line}"))?;
    if lost > 0 {
        out!("{lost} models could not be made; patches.csv has the reasons");
    }
    out!("  {}", output.join("patches.html").display());
    Ok(Exit::Done)
}
