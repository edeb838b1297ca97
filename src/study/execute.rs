//! Runs the cases that are not done, each in its own process; interrupted runs continue from their checkpoint.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::StudyError;
use super::case::Case;
use super::follow::ranks;
use super::inputs::{completed_run, digest, folder_of, has_run, inputs, scene_text};
pub use super::manifest::{Entry, Manifest, State};
use super::process;
use crate::cancel::Cancel;
use crate::files::write_atomic;
use crate::run::lock::{self, Attempt, Lock, Lost};

/// How cases are run.
pub struct Execution<'a> {
    /// Folder of the study.
    pub folder: &'a Path,
    /// Path of the solver.
    pub program: &'a Path,
    /// Number of concurrent cases.
    pub jobs: usize,
    /// Threads per case.
    pub threads: usize,
    /// Run failed cases again.
    pub repeat_failed: bool,
    /// Take the folder from a study that is not known to be alive on this host.
    pub break_lock: bool,
    /// Stop request: running cases save a checkpoint and stop, and no other case starts.
    pub stop: &'a Cancel,
}

/// Runs all cases that are not done, leaders before the cases that follow them. `say` receives a message at the start
/// and the end of each. A case whose `run.json` proves completion counts as done.
///
/// # Errors
/// [`StudyError`] when another study uses the folder, the solver cannot be started, or the manifest cannot be read or
/// written. A failed case is an entry with its reason.
pub fn execute(
    cases: &[Case],
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Manifest, StudyError> {
    let lock = match lock::take(&how.folder.join("study.lock"), how.break_lock)? {
        Attempt::Acquired(lock) => lock,
        Attempt::HeldByOther(holder) => {
            return Err(StudyError::Busy { folder: how.folder.to_path_buf(), holder });
        }
    };
    let mut manifest = Manifest::read_or_set_aside(how.folder, say)?;
    for rank in ranks(cases) {
        manifest = execute_rank(&rank, manifest, &lock, how, say)?;
    }
    Ok(manifest)
}

/// Writes the manifest, if the study still holds its folder.
///
/// # Errors
/// [`StudyError::LockLost`], [`StudyError::Write`].
fn write_manifest(manifest: &Manifest, lock: &Lock, folder: &Path) -> Result<(), StudyError> {
    let lost = |lost: Lost| StudyError::LockLost { folder: folder.into(), found: lost.found };
    lock.check().map_err(lost)?;
    Ok(manifest.write(folder)?)
}

/// The entry of a case before any run, and whether the case must run.
fn entry_before(case: &Case, manifest: &Manifest, how: &Execution<'_>) -> (Entry, bool) {
    let entry_of = |inputs, state, reason| Entry { inputs, state, reason };
    let done = |id: &String| manifest.cases.get(id).is_some_and(|e| e.state == State::Done);
    if let Some(other) = case.follows.as_ref().filter(|other| !done(other)) {
        let reason = format!("follows {other}, which is not done");
        return (entry_of(String::new(), State::Waiting, Some(reason)), false);
    }
    let inputs = match inputs(case, how.folder) {
        Ok(inputs) => inputs,
        Err(reason) => return (entry_of(String::new(), State::Failed, Some(reason)), false),
    };
    let digest = digest(&inputs);
    let known = manifest.cases.get(&case.id).filter(|e| e.inputs == digest);
    // A run is repeated if its folder was removed.
    let kept = |e: &&Entry| e.state == State::Failed || has_run(case, how.folder);
    let ended = known.filter(|e| e.state != State::Waiting).filter(kept).cloned();
    let entry = ended.unwrap_or_else(|| {
        let (state, reason) =
            completed_run(case, how.folder, &inputs).unwrap_or((State::Waiting, None));
        entry_of(digest, state, reason)
    });
    let runs = match entry.state {
        State::Waiting => true,
        State::Failed => how.repeat_failed,
        State::Done => false,
    };
    (entry, runs)
}

/// Runs cases that are independent of each other.
fn execute_rank(
    cases: &[&Case],
    mut manifest: Manifest,
    lock: &Lock,
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<Manifest, StudyError> {
    let mut open = Vec::new();
    for &case in cases {
        let (entry, runs) = entry_before(case, &manifest, how);
        if let (false, Some(reason)) = (runs, &entry.reason) {
            say(&format!("{}: {}: {reason}", case.id, entry.state.name()));
        }
        open.extend(runs.then_some(case));
        manifest.cases.insert(case.id.clone(), entry);
    }
    write_manifest(&manifest, lock, how.folder)?;
    let shared = Shared { lock, manifest: Mutex::new(manifest), next: AtomicUsize::new(0) };
    let work = || shared.work(&open, how, say);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..how.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|w| match w.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    Ok(shared.manifest.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Data shared by the workers.
struct Shared<'a> {
    lock: &'a Lock,
    manifest: Mutex<Manifest>,
    /// Index of the next case.
    next: AtomicUsize,
}

impl Shared<'_> {
    /// Takes and runs cases until none is left or a stop is requested.
    fn work(
        &self,
        open: &[&Case],
        how: &Execution<'_>,
        say: &(dyn Fn(&str) + Sync),
    ) -> Result<(), StudyError> {
        while let Some(case) = open.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            if how.stop.is_requested() {
                break;
            }
            say(&format!("{}: begins", case.id));
            let (state, reason) = match run(case, how, say) {
                Err(error @ StudyError::Start { .. }) => return Err(error),
                Err(error) => (State::Failed, Some(error.to_string())),
                Ok(ended) => ended,
            };
            say(&format!("{}: {}", case.id, reason.as_deref().unwrap_or("done")));
            // The map is consistent even if a worker panicked.
            let mut manifest = self.manifest.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(entry) = manifest.cases.get_mut(&case.id) {
                (entry.state, entry.reason) = (state, reason);
            }
            write_manifest(&manifest, self.lock, how.folder)?;
        }
        Ok(())
    }
}

/// Runs a case to its end or continues it. Returns its state, and why it ended early.
fn run(
    case: &Case,
    how: &Execution<'_>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<(State, Option<String>), StudyError> {
    let folder = folder_of(how.folder, &case.id);
    let output = folder.join("run");
    let tell = |text: &str| say(&format!("{}: {text}", case.id));
    if let Some(reason) = process::wait_for(&output, how.stop, &tell) {
        return Ok((State::Waiting, Some(reason)));
    }
    let scene = put_scene(case, &folder)?;
    let start = |restart: bool| {
        let mut command = Command::new(how.program);
        command.arg("--threads").arg(how.threads.to_string()).arg("run").arg(&scene);
        command.arg("-o").arg(&output).args(["-q", "--tied", "--accept-doubts"]);
        // A run that cannot continue starts again.
        command.arg(if restart { "--restart" } else { "--overwrite" });
        let failed = |source| StudyError::Start { path: how.program.to_path_buf(), source };
        process::run(&mut command, how.stop).map_err(failed)
    };
    let saved = |n: u8| output.join(format!("checkpoint-{n}.bin")).exists();
    let (mut status, mut message) = start(saved(0) || saved(1))?;
    if status.code() == Some(2) && (saved(0) || saved(1)) {
        // The checkpoint has other inputs.
        (status, message) = start(false)?;
    }
    Ok(match status.code() {
        Some(0) => (State::Done, None),
        // It continues in the next execution of the study.
        Some(5) => (State::Waiting, Some(message)),
        None => {
            let reason = format!("killed ({status}); the same command continues it {message}");
            (State::Waiting, Some(reason.trim_end().to_owned()))
        }
        Some(_) => (State::Failed, Some(message)),
    })
}

/// Writes the scene of a case into its folder.
fn put_scene(case: &Case, folder: &Path) -> Result<PathBuf, StudyError> {
    fs::create_dir_all(folder)
        .map_err(|source| StudyError::Folder { path: folder.to_path_buf(), source })?;
    let scene = folder.join("case.scene.json");
    let text = scene_text(case);
    if crate::files::read(&scene, crate::files::Input::Description).ok().as_deref()
        != Some(text.as_slice())
    {
        write_atomic(&scene, |w| w.write_all(&text))?;
    }
    Ok(scene)
}
