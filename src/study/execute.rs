//! Runs the cases that are not done: each in a process of its own, gone on with where it was killed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::cases::Case;
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
}

/// Folder of a case.
#[must_use]
pub fn folder_of(study: &Path, case: &str) -> PathBuf {
    study.join("cases").join(case)
}

/// Runs all cases that are not done; `say` is told of each that begins and ends.
///
/// # Errors
/// [`StudyError`] when files cannot be read or written; a case that fails is an entry with its reason.
pub fn execute(
    cases: &[Case],
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Manifest, StudyError> {
    let mut manifest = Manifest::read(how.folder);
    let mut open = Vec::new();
    for case in cases {
        let inputs = digest(case)?;
        let old = manifest.cases.get(&case.id).filter(|e| e.inputs == inputs);
        let fresh = Entry { inputs, state: State::Waiting, reason: None };
        let entry = old.cloned().unwrap_or(fresh);
        if entry.state == State::Waiting || (how.again && entry.state == State::Failed) {
            open.push(case);
        }
        manifest.cases.insert(case.id.clone(), entry);
    }
    let manifest = Mutex::new(manifest);
    let next = AtomicUsize::new(0);
    let work = || -> Result<(), StudyError> {
        while let Some(case) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            say(&format!("{}: begins", case.id));
            let (state, reason) = run(case, how)?;
            say(&format!("{}: {}", case.id, reason.as_deref().unwrap_or("done")));
            // A worker that panicked has left the map whole.
            let mut shared = manifest.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
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
    let manifest = manifest.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    manifest.write(how.folder)?;
    Ok(manifest)
}

fn digest(case: &Case) -> Result<String, StudyError> {
    let mut all = serde_json::to_vec(&case.scene).unwrap_or_default();
    let tools = case.scene.get("tools").and_then(serde_json::Value::as_array);
    for tool in tools.into_iter().flatten() {
        if let Some(file) = tool.get("file").and_then(serde_json::Value::as_str) {
            let path = PathBuf::from(file);
            let bytes = fs::read(&path).map_err(|source| StudyError::Io { path, source })?;
            all.extend(sha256_hex(&bytes).into_bytes());
        }
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
        command.arg("-o").arg(folder.join("run")).arg("-q").stdin(Stdio::null());
        if restart {
            command.arg("--restart");
        }
        command.output().map_err(io(how.program))
    };
    let saved = |n: u8| folder.join(format!("run/checkpoint-{n}.bin")).exists();
    let mut output = start(saved(0) || saved(1))?;
    if output.status.code() == Some(2) && (saved(0) || saved(1)) {
        // A checkpoint of other inputs.
        output = start(false)?;
    }
    if output.status.success() {
        return Ok((State::Done, None));
    }
    let said = String::from_utf8_lossy(&output.stderr).trim().replace('\n', " ");
    let state = match output.status.code() {
        // Killed or stopped: it goes on next time.
        None | Some(5) => State::Waiting,
        Some(_) => State::Failed,
    };
    Ok((state, Some(said)))
}
