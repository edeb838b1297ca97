//! Exclusive use of a folder by one process.
//!
//! A lock file is locked by the system until the process ends, however it ends; it contains the identity of the process.
//! On file systems without locks only that identity counts.

use std::fs::File;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::resources::{alive, this_process};
use crate::files::{Input, WriteError, open_lock, read};
use crate::report::record::Process;

/// Exclusive use of a folder until the lock is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // If this fails, the remaining identity belongs to an ended process or an unlocked file.
        let _ = self.file.set_len(0);
    }
}

/// Result of an attempt to lock.
#[derive(Debug)]
pub enum Attempt {
    /// This process has acquired the lock.
    Acquired(Lock),
    /// Another process holds the lock; `None` if it is not identified.
    HeldByOther(Option<Process>),
}

/// Path of the lock file in a run folder.
#[must_use]
pub fn file_in(folder: &Path) -> PathBuf {
    folder.join("run.lock")
}

/// Acquires the lock `path`, whose folder must exist.
///
/// # Errors
/// [`WriteError`] when the file cannot be created or written.
pub fn take(path: &Path) -> Result<Attempt, WriteError> {
    let failed = |source| WriteError { path: path.to_path_buf(), source };
    let mut file = open_lock(path, true).map_err(failed)?;
    if !free(&file, path) {
        return Ok(Attempt::HeldByOther(owner(path)));
    }
    let own = this_process().unwrap_or_else(|| Process {
        id: std::process::id(),
        started: 0,
        host: String::new(),
    });
    let text = serde_json::to_vec(&own).unwrap_or_default();
    let written = file.set_len(0).and_then(|()| file.seek(SeekFrom::Start(0)));
    written.and_then(|_| file.write_all(&text)).and_then(|()| file.sync_all()).map_err(failed)?;
    // Without system locks two processes may find the file free: the later identity wins.
    match owner(path) {
        Some(other) if other != own => Ok(Attempt::HeldByOther(Some(other))),
        _ => Ok(Attempt::Acquired(Lock { file })),
    }
}

/// `None` if no other process holds the lock `path`; otherwise its identity, if known.
#[must_use]
pub fn holder(path: &Path) -> Option<Option<Process>> {
    let file = open_lock(path, false).ok()?;
    (!free(&file, path)).then(|| owner(path))
}

/// A process in words.
#[must_use]
pub fn process_text(process: Option<&Process>) -> String {
    match process {
        Some(p) => match p.host.split(' ').next() {
            None | Some("") => format!("process {}", p.id),
            Some(host) if alive(p).is_none() => {
                format!("process {} on {host} (if it has ended there, delete the lock file)", p.id)
            }
            Some(host) => format!("process {} on {host}", p.id),
        },
        None => "another process".into(),
    }
}

fn owner(path: &Path) -> Option<Process> {
    serde_json::from_slice(&read(path, Input::Description).ok()?).ok()
}

/// Whether no other process holds the file, which is then locked for this process until it is closed. Without system
/// locks the identity in the file decides.
fn free(file: &File, path: &Path) -> bool {
    locked(file).unwrap_or_else(|| is_free_of(owner(path).as_ref()))
}

/// Whether the process named in a lock file is known to have ended. A process of another machine is not.
fn is_free_of(owner: Option<&Process>) -> bool {
    owner.is_none_or(|p| alive(p) == Some(false))
}

/// Locks the file: false if another process holds it, `None` if it cannot be locked here.
#[cfg(unix)]
fn locked(file: &File) -> Option<bool> {
    use rustix::fs::{FlockOperation, flock};
    use rustix::io::Errno;
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Some(true),
        Err(Errno::WOULDBLOCK) => Some(false),
        Err(_) => None,
    }
}

#[cfg(not(unix))]
fn locked(_: &File) -> Option<bool> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_of_one_and_free_when_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = file_in(folder.path());
        assert!(holder(&path).is_none());
        let Attempt::Acquired(lock) = take(&path).unwrap() else { panic!("nobody else is there") };
        let Attempt::HeldByOther(who) = take(&path).unwrap() else { panic!("it is taken") };
        let who = who.unwrap();
        assert_eq!(who.id, std::process::id());
        assert!(process_text(Some(&who)).contains(&who.id.to_string()));
        assert_eq!(holder(&path), Some(Some(who)));
        drop(lock);
        assert!(holder(&path).is_none());
        assert!(matches!(take(&path).unwrap(), Attempt::Acquired(_)));
    }

    #[test]
    fn the_name_of_a_killed_process_locks_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = file_in(folder.path());
        for text in ["{\"id\": 1, \"started\": 1, \"host\": \"gone\"}", "no process"] {
            std::fs::write(&path, text).unwrap();
            assert!(holder(&path).is_none());
            assert!(matches!(take(&path).unwrap(), Attempt::Acquired(_)));
        }
        // Without system locks a process of another machine may still be running.
        let there = Process { id: 1, started: 1, host: "elsewhere 0-0".into() };
        assert!(!is_free_of(Some(&there)) && is_free_of(None));
        assert!(
            process_text(Some(&there))
                .contains("process 1 on elsewhere (if it has ended there, delete")
        );
        let own = this_process().unwrap();
        let gone = Process { started: own.started + 1, ..own.clone() };
        assert!(!is_free_of(Some(&own)) && is_free_of(Some(&gone)));
        let unknown = folder.path().join("no/such/run.lock");
        assert!(take(&unknown).unwrap_err().to_string().contains("run.lock"));
    }
}
