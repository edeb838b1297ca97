//! An earlier run in the folder of a new one. A run that can continue is not replaced without permission.

use std::fs;
use std::path::{Path, PathBuf};

use super::build::BUILD;
use super::checkpoint;
use super::error::RunError;
use super::first_record::{FORMAT, PROGRAM};
use super::folder::RESULT_FILES;
use super::inputs::inputs;
use super::lock;
use super::restart::Restart;
use kanagata_report::record::{RunRecord, Verdict};
use kanagata_scene::Plan;

/// A file that a run would replace in a folder that holds no run; relative to the folder.
pub(super) fn foreign(folder: &Path) -> Option<PathBuf> {
    if lock::file_in(folder).exists() || is_of_run(folder) {
        return None;
    }
    if folder.join("run.json").exists() {
        return Some("run.json".into());
    }
    let results = RESULT_FILES.iter().map(PathBuf::from).find(|name| folder.join(name).exists());
    let sheets = || {
        ["steps", "tools"].into_iter().find_map(|inner| {
            let mut files = fs::read_dir(folder.join(inner)).ok()?.flatten();
            let sheet = files.find(|file| file.path().extension().is_some_and(|e| e == "vtu"))?;
            Some(Path::new(inner).join(sheet.file_name()))
        })
    };
    results.or_else(sheets)
}

/// Whether `run.json` in a folder is the record of a run.
fn is_of_run(folder: &Path) -> bool {
    #[derive(serde::Deserialize)]
    struct Head {
        format: String,
    }
    let text = kanagata_files::read(&folder.join("run.json"), kanagata_files::Input::Description);
    let head = text.ok().and_then(|text| serde_json::from_slice::<Head>(&text).ok());
    head.is_some_and(|head| head.format == FORMAT)
}

/// The record of a run of `plan` by this build in `folder` whose stages are all done; `None` if there is none.
#[must_use]
pub fn completed(folder: &Path, plan: &Plan) -> Option<RunRecord> {
    let text = kanagata_files::read(&folder.join("run.json"), kanagata_files::Input::Description);
    let record = RunRecord::parse(&text.ok()?).ok()?;
    let same = record.build == BUILD && record.inputs == inputs(plan);
    (same && record.verdict.is_complete()).then_some(record)
}

/// Message about the results that a new run of `plan` replaces in `folder`; `None` if there are none.
///
/// The caller holds the lock of the folder: any earlier run there has ended.
///
/// # Errors
/// [`RunError::Unfinished`] for a stopped or killed run of the same inputs that has a checkpoint, unless `overwrite`
/// allows to replace it.
pub(super) fn replaced_results(
    folder: &Path,
    plan: &Plan,
    scene: &Path,
    overwrite: bool,
) -> Result<Option<String>, RunError> {
    let text = kanagata_files::read(&folder.join("run.json"), kanagata_files::Input::Description)
        .unwrap_or_default();
    let record = match RunRecord::parse(&text) {
        Ok(record) => record,
        Err(_) if !is_of_run(folder) => return Ok(None),
        Err(found) => {
            return Ok(Some(format!("{}: an earlier run is replaced ({found})", folder.display())));
        }
    };
    let mut why = String::new();
    if matches!(record.verdict, Verdict::Running | Verdict::Stopped) {
        match checkpoint::read(folder, plan, PROGRAM) {
            Ok((checkpoint, _)) if !overwrite => {
                let increment = checkpoint.folder.record.increments;
                let restart = Restart::of(&record, scene, folder);
                return Err(RunError::Unfinished { folder: folder.into(), increment, restart });
            }
            Ok(_) => {}
            Err(error) => why = format!(" ({})", error.reason()),
        }
    }
    if record.increments == 0 {
        return Ok(None);
    }
    Ok(Some(format!(
        "{}: the results of an earlier run are replaced: {}, {} increments, {}{why}",
        folder.display(),
        record.name,
        record.increments,
        ending(record.verdict)
    )))
}

/// The outcome of an ended run, in words.
fn ending(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Completed | Verdict::Doubtful => "finished",
        Verdict::NotConverged => "not converged",
        Verdict::Running | Verdict::Stopped => "not finished",
    }
}
