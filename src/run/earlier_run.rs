//! What an earlier run left in a folder where another begins: a run that can be gone on with is not thrown away unasked.

use std::fs;
use std::path::{Path, PathBuf};

use super::checkpoint;
use super::error::RunError;
use super::first_record::{FORMAT, PROGRAM};
use super::folder::RESULTS;
use super::lock;
use super::restart::Restart;
use crate::report::record::{RunRecord, Verdict};
use crate::scene::Plan;

/// A file that a run would replace in a folder in which none was: relative to it.
pub(super) fn foreign(folder: &Path) -> Option<PathBuf> {
    if lock::file_in(folder).exists() || is_of_run(folder) {
        return None;
    }
    if folder.join("run.json").exists() {
        return Some("run.json".into());
    }
    let results = RESULTS.iter().map(PathBuf::from).find(|name| folder.join(name).exists());
    let sheets = || {
        ["steps", "tools"].into_iter().find_map(|inner| {
            let mut files = fs::read_dir(folder.join(inner)).ok()?.flatten();
            let sheet = files.find(|file| file.path().extension().is_some_and(|e| e == "vtu"))?;
            Some(Path::new(inner).join(sheet.file_name()))
        })
    };
    results.or_else(sheets)
}

/// Whether `run.json` of a folder is a run's.
fn is_of_run(folder: &Path) -> bool {
    #[derive(serde::Deserialize)]
    struct Head {
        format: String,
    }
    let text = crate::files::read(&folder.join("run.json"), crate::files::Input::Description);
    let head = text.ok().and_then(|text| serde_json::from_slice::<Head>(&text).ok());
    head.is_some_and(|head| head.format == FORMAT)
}

/// What is replaced in `folder` by a run of `plan` that begins there, in words; `None` where there are no results. Asked while
/// the folder's lock is held: whatever run it tells of has ended.
///
/// # Errors
/// [`RunError::Unfinished`] for a run of the same inputs that was stopped or killed and has a checkpoint, unless it may be
/// replaced (`overwrite`).
pub(super) fn replaced(
    folder: &Path,
    plan: &Plan,
    scene: &Path,
    overwrite: bool,
) -> Result<Option<String>, RunError> {
    let text = crate::files::read(&folder.join("run.json"), crate::files::Input::Description)
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

/// How a run that is over ended, in words.
fn ending(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Completed | Verdict::Doubtful => "finished",
        Verdict::NotConverged => "not converged",
        Verdict::Running | Verdict::Stopped => "not finished",
    }
}
