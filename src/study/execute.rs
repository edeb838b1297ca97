//! Runs the cases that are not done: each in a process of its own, gone on with where it was killed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::cases::Case;
use super::follow::ranks;
use super::process;
use crate::files::{WriteError, sha256_hex, write_atomic};

/// How a case stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Not begun, or broken off.
    Waiting,
    /// All stages done.
    Done,
    /// It ended early.
    Failed,
}

/// A case in the manifest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Entry {
    /// SHA-256 of the scene and its tool files.
    pub inputs: String,
    /// How it stands.
    pub state: State,
    /// Why it ended early.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// `manifest.json`: the cases of a study by name.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// Cases.
    pub cases: BTreeMap<String, Entry>,
}

impl Manifest {
    /// The manifest in `folder`; an empty one when there is none that can be read.
    #[must_use]
    pub fn read(folder: &Path) -> Self {
        let text = fs::read(folder.join("manifest.json")).unwrap_or_default();
        serde_json::from_slice(&text).unwrap_or_default()
    }

    fn write(&self, folder: &Path) -> Result<(), WriteError> {
        write_atomic(&folder.join("manifest.json"), |w| {
            serde_json::to_writer_pretty(&mut *w, self)?;
            writeln!(w)
        })
    }
}

/// How cases are run.
pub struct Execution<'a> {
    /// Folder of the study.
    pub folder: &'a Path,
    /// The solver.
    pub program: &'a Path,
    /// Cases at a time.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
    /// Run cases that failed before again.
    pub again: bool,
    /// Set from outside: ask the runs under way to leave a checkpoint, begin no other.
    pub stop: &'a AtomicBool,
}

/// Folder of a case.
#[must_use]
pub fn folder_of(study: &Path, case: &str) -> PathBuf {
    study.join("cases").join(case)
}

/// Runs all cases that are not done, those that follow another behind it; `say` is told of each that begins and ends.
///
/// # Errors
/// [`StudyError`] when files cannot be read or written; a case that fails is an entry with its reason.
pub fn execute(
    cases: &[Case],
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Manifest, StudyError> {
    let mut manifest = Manifest::read(how.folder);
    for rank in ranks(cases) {
        manifest = execute_rank(&rank, manifest, how, say)?;
    }
    manifest.write(how.folder)?;
    Ok(manifest)
}

/// How a case stands before anything runs, and whether it is to be run.
fn standing(
    case: &Case,
    manifest: &Manifest,
    how: &Execution<'_>,
) -> Result<(Entry, bool), StudyError> {
    let done = |id: &String| manifest.cases.get(id).is_some_and(|e| e.state == State::Done);
    if let Some(other) = case.follows.as_ref().filter(|other| !done(other)) {
        let reason = Some(format!("follows {other}, which is not done"));
        return Ok((Entry { inputs: String::new(), state: State::Waiting, reason }, false));
    }
    let inputs = digest(case, how.folder)?;
    let old = manifest.cases.get(&case.id).filter(|e| e.inputs == inputs);
    let entry = old.cloned().unwrap_or(Entry { inputs, state: State::Waiting, reason: None });
    let runs = match entry.state {
        State::Waiting => true,
        State::Failed => how.again,
        State::Done => false,
    };
    Ok((entry, runs))
}

/// Runs cases that do not wait for each other.
fn execute_rank(
    cases: &[&Case],
    mut manifest: Manifest,
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Manifest, StudyError> {
    let mut open = Vec::new();
    for &case in cases {
        let (entry, runs) = standing(case, &manifest, how)?;
        open.extend(runs.then_some(case));
        manifest.cases.insert(case.id.clone(), entry);
    }
    let manifest = Mutex::new(manifest);
    let next = AtomicUsize::new(0);
    let work = || -> Result<(), StudyError> {
        while let Some(case) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            if how.stop.load(Ordering::Relaxed) {
                break;
            }
            say(&format!("{}: begins", case.id));
            let (state, reason) = run(case, how)?;
            say(&format!("{}: {}", case.id, reason.as_deref().unwrap_or("done")));
            // A worker that panicked has left the map whole.
            let mut shared = manifest.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(entry) = shared.cases.get_mut(&case.id) {
                (entry.state, entry.reason) = (state, reason);
            }
            shared.write(how.folder)?;
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..how.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|w| match w.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    Ok(manifest.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// SHA-256 of the scene, its tool files and the history it follows.
pub(super) fn digest(case: &Case, study: &Path) -> Result<String, StudyError> {
    let mut all = serde_json::to_vec(&case.scene).unwrap_or_default();
    let tools = case.scene.get("tools").and_then(serde_json::Value::as_array);
    let files = tools.into_iter().flatten().filter_map(|tool| tool.get("file")?.as_str());
    let followed = case.follows.iter().map(|id| folder_of(study, id).join("run/history.csv"));
    for path in files.map(PathBuf::from).chain(followed) {
        let bytes = fs::read(&path).map_err(|source| StudyError::Io { path, source })?;
        all.extend(sha256_hex(&bytes).into_bytes());
    }
    Ok(sha256_hex(&all))
}

fn run(case: &Case, how: &Execution<'_>) -> Result<(State, Option<String>), StudyError> {
    let folder = folder_of(how.folder, &case.id);
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| StudyError::Io { path, source }
    };
    fs::create_dir_all(&folder).map_err(io(&folder))?;
    let scene = folder.join("case.scene.json");
    let text = serde_json::to_vec_pretty(&case.scene).unwrap_or_default();
    if fs::read(&scene).ok().as_deref() != Some(text.as_slice()) {
        write_atomic(&scene, |w| w.write_all(&text))?;
    }
    let start = |restart: bool| {
        let mut command = Command::new(how.program);
        command.arg("--threads").arg(how.threads.to_string()).arg("run").arg(&scene);
        command.arg("-o").arg(folder.join("run")).arg("-q");
        if restart {
            command.arg("--restart");
        }
        process::run(&mut command, how.stop).map_err(io(how.program))
    };
    let saved = |n: u8| folder.join(format!("run/checkpoint-{n}.bin")).exists();
    let (mut status, mut said) = start(saved(0) || saved(1))?;
    if status.code() == Some(2) && (saved(0) || saved(1)) {
        // A checkpoint of other inputs.
        (status, said) = start(false)?;
    }
    let state = match status.code() {
        Some(0) => return Ok((State::Done, None)),
        // Killed or stopped: it goes on next time.
        None | Some(5) => State::Waiting,
        Some(_) => State::Failed,
    };
    Ok((state, Some(said)))
}
