//! One process at a time in a folder: a file that the system keeps locked for its process, and frees when that ends,
//! however it ends. In it stands which process that is. Where the file system knows no locks that name alone counts.

use std::fs::File;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::resources::{alive, this_process};
use crate::files::{Input, WriteError, open_lock, read};
use crate::report::record::Process;

/// A folder that this process has to itself until the lock is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A name that stays is of a process that is gone, or of a file that is free.
        let _ = self.file.set_len(0);
    }
}

/// What came of asking for a lock.
#[derive(Debug)]
pub enum Attempt {
    /// It is ours.
    Ours(Lock),
    /// Another process has it; which one, where it has said so.
    Theirs(Option<Process>),
}

/// The lock of a run in its folder.
#[must_use]
pub fn file_in(folder: &Path) -> PathBuf {
    folder.join("run.lock")
}

/// Takes the lock `path`, whose folder is there.
///
/// # Errors
/// [`WriteError`] when the file cannot be made or written.
pub fn take(path: &Path) -> Result<Attempt, WriteError> {
    let failed = |source| WriteError { path: path.to_path_buf(), source };
    let mut file = open_lock(path, true).map_err(failed)?;
    if !free(&file, path) {
        return Ok(Attempt::Theirs(owner(path)));
    }
    let own = this_process().unwrap_or_else(|| Process {
        id: std::process::id(),
        started: 0,
        host: String::new(),
    });
    let text = serde_json::to_vec(&own).unwrap_or_default();
    let written = file.set_len(0).and_then(|()| file.seek(SeekFrom::Start(0)));
    written.and_then(|_| file.write_all(&text)).and_then(|()| file.sync_all()).map_err(failed)?;
    // Without locks two may have found the file free: the later name stays.
    match owner(path) {
        Some(other) if other != own => Ok(Attempt::Theirs(Some(other))),
        _ => Ok(Attempt::Ours(Lock { file })),
    }
}

/// Whether another process has the lock `path`, and which one, where it has said so.
#[must_use]
pub fn holder(path: &Path) -> Option<Option<Process>> {
    let file = open_lock(path, false).ok()?;
    (!free(&file, path)).then(|| owner(path))
}

/// A process in words.
#[must_use]
pub fn named(process: Option<&Process>) -> String {
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

/// Whether nobody else has the file; it is then locked for this process until it is closed. Where the file system
/// knows no locks, the process that is named in it tells.
fn free(file: &File, path: &Path) -> bool {
    locked(file).unwrap_or_else(|| is_free_of(owner(path).as_ref()))
}

/// Whether the process that is named in a lock file is known to be gone: one of another machine is not.
fn is_free_of(owner: Option<&Process>) -> bool {
    owner.is_none_or(|p| alive(p) == Some(false))
}

/// Locks the file: false when another process has it, `None` when it cannot be locked here.
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
        let Attempt::Ours(lock) = take(&path).unwrap() else { panic!("nobody else is there") };
        let Attempt::Theirs(who) = take(&path).unwrap() else { panic!("it is taken") };
        let who = who.unwrap();
        assert_eq!(who.id, std::process::id());
        assert!(named(Some(&who)).contains(&who.id.to_string()));
        assert_eq!(holder(&path), Some(Some(who)));
        drop(lock);
        assert!(holder(&path).is_none());
        assert!(matches!(take(&path).unwrap(), Attempt::Ours(_)));
    }

    #[test]
    fn a_name_that_a_killed_process_left_holds_nobody_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = file_in(folder.path());
        for text in ["{\"id\": 1, \"started\": 1, \"host\": \"gone\"}", "no process"] {
            std::fs::write(&path, text).unwrap();
            assert!(holder(&path).is_none());
            assert!(matches!(take(&path).unwrap(), Attempt::Ours(_)));
        }
        // Without locks of the file system a process of another machine may still be at work.
        let there = Process { id: 1, started: 1, host: "elsewhere 0-0".into() };
        assert!(!is_free_of(Some(&there)) && is_free_of(None));
        assert!(
            named(Some(&there)).contains("process 1 on elsewhere (if it has ended there, delete")
        );
        let own = this_process().unwrap();
        let gone = Process { started: own.started + 1, ..own.clone() };
        assert!(!is_free_of(Some(&own)) && is_free_of(Some(&gone)));
        let unknown = folder.path().join("no/such/run.lock");
        assert!(take(&unknown).unwrap_err().to_string().contains("run.lock"));
    }
}
