//! `kanagata study FILE -o DIR`: runs and compares the cases of a study, draws stability maps, or compares patches with
//! their accuracy and time.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use super::doubts::print_doubts;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::output_clash::refuse_clashes;
use super::read::{LostFaces, read_model};
use super::stop;
use super::terminal::{err, out};
use crate::cancel::Cancel;
use crate::study::StudyError;
use crate::study::case::Case;
use crate::study::cases::{Roots, cases, chosen, ids};
use crate::study::checks::Outcome;
use crate::study::collect::{Findings, collect};
use crate::study::execute::{Execution, Manifest, State, execute};
use crate::study::file::Study;
use crate::study::follow::with_leaders;
use crate::study::patches::{self, PatchStudy};
use crate::study::read::{Description, read, table_file};
use crate::study::stability;

/// Arguments of `study`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  tools/models out/models\n  \
    kanagata study fixtures/studies/cross-tool.json --tools out/models -o out/study --quick\n  \
    kanagata study fixtures/studies/stability.json -o out/stability\n  \
    kanagata study fixtures/studies/patches.json -o out/patches\n\n\
    Cases that are done are not run again unless the scene, a file it names or the program's version has changed (remove\n\
    cases/NAME to run one again); those that were killed continue from their checkpoint. A solver that a killed study has\n\
    left behind is asked to end first; one study at a time works in a folder. The folder then holds manifest.json,\n\
    study.csv, study.html and cases/NAME/run.\n\n{EXIT_HELP}"))]
pub struct StudyArgs {
    /// Study file (schemas/study.schema.json, stability.schema.json or patches.schema.json)
    file: PathBuf,
    /// Folder for the results; created if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Folder that the scene's tool files are relative to; default: the folder of the study
    #[arg(long, value_name = "DIR")]
    tools: Option<PathBuf>,
    /// Cases at a time; default 1
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Only the case of this name, or if there is none all cases whose names contain it, and those they follow; may be
    /// repeated
    #[arg(long, value_name = "CASE")]
    only: Vec<String>,
    /// Apply the changes of the study for a coarse trial run
    #[arg(long)]
    quick: bool,
    /// Run failed cases again
    #[arg(long)]
    again: bool,
    /// End with exit code 0 instead of 1 when results are doubtful; tables and pages keep the doubts
    #[arg(long)]
    accept_doubts: bool,
    /// Run nothing, only compare existing results
    #[arg(long, conflicts_with_all = ["only", "again", "jobs"])]
    collect: bool,
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let input = matches!(error, StudyError::Value { .. } | StudyError::Busy { .. });
        let exit = if input { Exit::Input } else { Exit::Io };
        Self::new(exit, error)
    }
}

fn folder(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Folder { path, source }
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Io { path, source }
}

/// Runs the study.
///
/// # Errors
/// Exit code 1 when a check fails or results are doubtful, 2 for an invalid study, 3 when a case failed, 4 when files
/// cannot be read or written, 5 when stopped.
pub fn run(args: &StudyArgs) -> Result<Exit, Failure> {
    let written = ["manifest.json", "study.csv", "study.html"].map(|name| args.output.join(name));
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
            std::fs::create_dir_all(&args.output).map_err(folder(&args.output))?;
            for line in stability::run(&study, &args.file, &args.output)? {
                out!("{line}");
            }
            for name in stability::DRAWINGS {
                out!("  {}", args.output.join(name).with_extension("svg").display());
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
        ("--collect", args.collect),
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

fn value(path: &Path, place: &str, found: String, allowed: String) -> Failure {
    StudyError::Value { path: path.to_path_buf(), place: place.to_owned(), found, allowed }.into()
}

fn patch_study(args: &StudyArgs, study: &PatchStudy) -> Result<Exit, Failure> {
    let model = read_model(
        &args.file.parent().unwrap_or(Path::new("")).join(&study.cad),
        LostFaces::Refuse,
    )?;
    std::fs::create_dir_all(&args.output).map_err(folder(&args.output))?;
    let lost = patches::run(study, &model, [&args.file, &args.output], &|line| out!("{line}"))?;
    if lost > 0 {
        out!("{lost} models could not be made; patches.csv has the reasons");
    }
    out!("  {}", args.output.join("patches.html").display());
    Ok(Exit::Done)
}

/// Absolute paths of the folder of the study and of that of its tools.
fn folders(args: &StudyArgs) -> Result<[PathBuf; 2], Failure> {
    let own = args.file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let own = own.canonicalize().map_err(io(own))?;
    let tools = match &args.tools {
        None => own.clone(),
        Some(given) => given.canonicalize().map_err(|e| {
            let found = format!("{}: {e}", given.display());
            let allowed =
                "a folder with tool files (`tools/models DIR` makes those of the studies here)";
            value(&args.file, "--tools", found, allowed.into())
        })?,
    };
    Ok([own, tools])
}

/// The selected cases and those they follow.
fn wanted(args: &StudyArgs, study: &Study, all: &[Case]) -> Result<Vec<Case>, Failure> {
    let ids = ids(study);
    let chosen = chosen(&ids, &args.only).map_err(|name| {
        let allowed = format!("a case, or a part of its name: {}", ids.join(", "));
        value(&args.file, "--only", format!("'{name}'"), allowed)
    })?;
    Ok(with_leaders(all, |id| chosen.contains(id)))
}

fn run_cases(args: &StudyArgs, open: &[Case], stop: &Cancel) -> Result<Manifest, Failure> {
    let this = std::env::current_exe().map_err(io(Path::new("this program")))?;
    let program = this.with_file_name(format!("kanagata-solve{}", std::env::consts::EXE_SUFFIX));
    let jobs = args.jobs.map_or(1, NonZeroUsize::get);
    let threads = (rayon::current_num_threads() / jobs).max(1);
    let folder = &args.output;
    let how =
        Execution { folder, program: &program, jobs, threads, repeat_failed: args.again, stop };
    Ok(execute(open, &how, &|line| out!("{line}"))?)
}

fn forming(args: &StudyArgs, study: &Study) -> Result<Exit, Failure> {
    let [own, tools] = folders(args)?;
    let all = cases(study, &Roots { tools: &tools, own: &own }, args.quick);
    let open = wanted(args, study, &all)?;
    std::fs::create_dir_all(&args.output).map_err(folder(&args.output))?;
    let manifest = if args.collect {
        Manifest::read(&args.output)?
    } else {
        let stop = stop::request();
        let section = stop.section();
        let manifest = run_cases(args, &open, stop)?;
        drop(section);
        if stop.is_requested() {
            out!("stopped; the same command continues from the checkpoints");
            return Ok(Exit::Stopped);
        }
        manifest
    };
    let Findings { checks, doubts } = collect(study, &all, &manifest, &args.output)?;
    let failed = if args.collect { 0 } else { not_done(&open, &manifest) };
    if !args.collect && open.iter().any(|case| lacks_files(case, &manifest)) {
        err!(
            "  try: `tools/models DIR` or `kanagata convert` makes tool files; --tools gives their folder"
        );
    }
    out!("{} cases, {failed} of those run not done", all.len());
    for (check, outcome) in &checks {
        let [state, value] = outcome.texts();
        out!("  {state:13} {}: {value}, {} expected", check.says, check.allowed());
    }
    out!("  {}", args.output.join("study.html").display());
    print_doubts(&doubts, args.accept_doubts);
    let broken = checks.iter().any(|(_, outcome)| matches!(outcome, Outcome::Fails { .. }));
    Ok(match (failed, broken) {
        (1.., _) => Exit::NoConvergence,
        (0, true) => Exit::Limit,
        (0, false) => Exit::of_doubts(&doubts, args.accept_doubts),
    })
}

/// Whether a case could not start because a file of its scene cannot be read.
fn lacks_files(case: &Case, manifest: &Manifest) -> bool {
    let entry = manifest.cases.get(&case.id);
    entry.is_some_and(|e| e.state == State::Failed && e.inputs.is_empty())
}

fn not_done(open: &[Case], manifest: &Manifest) -> usize {
    let done = |c: &&Case| manifest.cases.get(&c.id).is_some_and(|e| e.state == State::Done);
    open.len() - open.iter().filter(done).count()
}
