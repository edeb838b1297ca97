//! `kanagata study FILE -o DIR`: runs the cases of a study that are not done and compares them; draws maps of where
//! methods fail; measures what accuracy costs in patches and time.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use super::cad::read_model;
use super::exit::{EXIT_HELP, Exit, Failure};
use super::say::out;
use super::stop::stop_flag;
use crate::study::StudyError;
use crate::study::cases::cases;
use crate::study::checks::Outcome;
use crate::study::collect::collect;
use crate::study::execute::{Execution, State, execute};
use crate::study::file::{Description, Study, read};
use crate::study::follow::with_leaders;
use crate::study::patches::{self, PatchStudy};
use crate::study::stability;

/// Arguments of `study`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  tools/models out/models\n  \
    kanagata study fixtures/studies/cross-tool.json --tools out/models -o out/study --quick\n  \
    kanagata study fixtures/studies/stability.json -o out/stability\n  \
    kanagata study fixtures/studies/patches.json -o out/patches\n\n\
    Cases that are done are not run again; those that were killed go on from their checkpoint. The folder then holds\n\
    manifest.json, study.csv, study.html and cases/NAME/run.\n\n{EXIT_HELP}"))]
pub struct StudyArgs {
    /// Study file (schemas/study.schema.json, stability.schema.json or patches.schema.json)
    file: PathBuf,
    /// Folder for the results; made if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Folder that the scene's tool files are relative to; the study's own when not given
    #[arg(long, value_name = "DIR")]
    tools: Option<PathBuf>,
    /// Cases at a time
    #[arg(long, default_value_t = 1, value_name = "N")]
    jobs: usize,
    /// Only cases whose name holds this, and those they follow; may be given more than once
    #[arg(long, value_name = "CASE")]
    only: Vec<String>,
    /// With the study's changes for a quick look
    #[arg(long)]
    quick: bool,
    /// Run cases that failed again
    #[arg(long)]
    again: bool,
    /// Run nothing, only compare what there is
    #[arg(long)]
    collect: bool,
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let exit = if matches!(error, StudyError::Value { .. }) { Exit::Input } else { Exit::Io };
        Self::new(exit, error)
    }
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_path_buf();
    move |source| StudyError::Io { path, source }
}

/// Runs the study.
///
/// # Errors
/// Exit code 1 when a check does not hold, 2 for a study that cannot be run, 3 when a case failed, 4 when files cannot be read or written, 5 when it was stopped.
pub fn run(args: &StudyArgs) -> Result<Exit, Failure> {
    match read(&args.file)? {
        Description::Forming(study) => forming(args, &study),
        Description::Stability(study) => {
            std::fs::create_dir_all(&args.output).map_err(io(&args.output))?;
            for line in stability::run(&study, &args.file, &args.output)? {
                out!("{line}");
            }
            for name in stability::DRAWINGS {
                out!("  {}", args.output.join(name).with_extension("svg").display());
            }
            Ok(Exit::Done)
        }
        Description::Patches(study) => patch_study(args, &study),
    }
}

fn patch_study(args: &StudyArgs, study: &PatchStudy) -> Result<Exit, Failure> {
    let model = read_model(&args.file.parent().unwrap_or(Path::new("")).join(&study.cad))?;
    std::fs::create_dir_all(&args.output).map_err(io(&args.output))?;
    let lost = patches::run(study, &model, [&args.file, &args.output], &|line| out!("{line}"))?;
    if lost > 0 {
        out!("{lost} models could not be made; patches.csv has the reasons");
    }
    out!("  {}", args.output.join("patches.html").display());
    Ok(Exit::Done)
}

fn forming(args: &StudyArgs, study: &Study) -> Result<Exit, Failure> {
    let own = args.file.parent().map(PathBuf::from).unwrap_or_default();
    let tools = args.tools.clone().unwrap_or(own);
    std::fs::create_dir_all(&args.output).map_err(io(&args.output))?;
    let tools = tools.canonicalize().map_err(io(&tools))?;
    let all = cases(study, &tools, args.quick);
    let named =
        |id: &str| args.only.is_empty() || args.only.iter().any(|o| id.contains(o.as_str()));
    let open = with_leaders(&all, |id| !args.collect && named(id));
    let this = std::env::current_exe().map_err(io(Path::new("this program")))?;
    let program = this.with_file_name(format!("kanagata-solve{}", std::env::consts::EXE_SUFFIX));
    let threads = (rayon::current_num_threads() / args.jobs.max(1)).max(1);
    let stop = stop_flag();
    let how = Execution {
        folder: &args.output,
        program: &program,
        jobs: args.jobs,
        threads,
        again: args.again,
        stop: &stop,
    };
    let manifest = execute(&open, &how, &|line| out!("{line}"))?;
    if stop.load(Ordering::Relaxed) {
        out!("stopped; the same command goes on from there");
        return Ok(Exit::Stopped);
    }
    let checks = collect(study, &all, &manifest, &args.output)?;
    let failed = open
        .iter()
        .filter(|c| manifest.cases.get(&c.id).is_some_and(|entry| entry.state != State::Done));
    let failed = failed.count();
    out!("{} cases, {failed} of those run not done", all.len());
    for (check, outcome) in &checks {
        let [state, value] = outcome.words();
        out!("  {state:13} {}: {value}, {} expected", check.says, check.allowed());
    }
    out!("  {}", args.output.join("study.html").display());
    let broken = checks.iter().any(|(_, outcome)| matches!(outcome, Outcome::Fails { .. }));
    Ok(match (failed, broken) {
        (1.., _) => Exit::NoConvergence,
        (0, true) => Exit::Limit,
        (0, false) => Exit::Done,
    })
}
