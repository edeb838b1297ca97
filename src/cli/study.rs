//! `kanagata study FILE -o DIR`: runs and compares the cases of a study, draws stability maps, or compares patches with
//! their accuracy and time.

use std::path::Path;

use super::exit::{Exit, Failure};
use super::output_clash::refuse_clashes;
use super::read::{LostFaces, read_model};
pub use super::study_args::StudyArgs;
use super::study_cases::forming;
use super::study_error::{folder, value};
use super::study_status;
use super::terminal::out;
use crate::study::patches::{self, PatchStudy};
use crate::study::read::{Description, read, table_file};
use crate::study::stability;

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
