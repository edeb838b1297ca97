//! Exclusive right to judge a lock and to write its file, for the moment in which it is acquired.
//!
//! The claim is a file beside the lock that only one process can create, also on file systems without locks.

use std::fs::{hard_link, remove_file, rename};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Serialize;

use super::holder::age;
use super::identity::parse;
use crate::resources::alive;
use kanagata_files::{Input, create_new, open, random, read, unique_beside};
use kanagata_report::record::Process;

/// Age at which a claim of another host counts as abandoned. A claim takes a few file operations, below 1 s on a loaded
/// server. Doubled, a folder stays closed a minute longer after a host fails within them.
const CLAIM_EXPIRY: Duration = Duration::from_secs(60);

/// Content of the file of a claim.
#[derive(Serialize)]
struct Content<'a> {
    #[serde(flatten)]
    process: &'a Process,
    /// Distinguishes claims of one process.
    number: u64,
}

/// A claim, which ends when it is dropped.
pub(super) struct Claim {
    path: PathBuf,
    text: Vec<u8>,
}

/// Result of an attempt to claim a lock.
pub(super) enum Attempt {
    /// This process has the claim.
    Made(Claim),
    /// Another process has or had it; `None` if it is not identified.
    MadeByOther(Option<Process>),
}

impl Claim {
    /// Claims the lock file `lock` for the process `own`. An abandoned claim is removed, for the next attempt.
    ///
    /// # Errors
    /// The error of the operating system when the file cannot be created or read.
    pub(super) fn make(lock: &Path, own: &Process) -> io::Result<Attempt> {
        let path = path(lock);
        let text = serde_json::to_vec(&Content { process: own, number: random() })?;
        match create_new(&path, &text) {
            Ok(_) => return Ok(Attempt::Made(Self { path, text })),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
        let found = match read(&path, Input::Description) {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(Attempt::MadeByOther(None));
            }
            Err(error) => return Err(error),
        };
        let process = parse(&found);
        if is_abandoned(&path, process.as_ref()) {
            remove(&path, &found);
        }
        Ok(Attempt::MadeByOther(process))
    }

    /// Whether the claim still exists: one that is too old is removed by others.
    pub(super) fn is_valid(&self) -> bool {
        read(&self.path, Input::Description).is_ok_and(|found| found == self.text)
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        if self.is_valid() {
            // A remaining claim is removed as abandoned.
            let _ = remove_file(&self.path);
        }
    }
}

/// The file of a claim for the lock file `lock`.
fn path(lock: &Path) -> PathBuf {
    let name = lock.file_name().map_or_else(|| "lock".into(), |n| n.to_string_lossy());
    lock.with_file_name(format!(".{name}.claim"))
}

/// Whether the process of a claim has ended, or cannot be looked up and the claim is too old.
fn is_abandoned(path: &Path, process: Option<&Process>) -> bool {
    process.and_then(alive).map_or_else(
        || {
            open(path, Input::Description)
                .and_then(|(file, _)| age(path, &file))
                .is_ok_and(|age| age >= CLAIM_EXPIRY)
        },
        |alive| !alive,
    )
}

/// Removes the claim with the content `abandoned`. Only one of several processes can rename it; a claim made by another
/// process in the meantime is put back.
fn remove(path: &Path, abandoned: &[u8]) {
    let moved = unique_beside(path);
    if rename(path, &moved).is_err() {
        return;
    }
    if read(&moved, Input::Description).is_ok_and(|found| found != abandoned) {
        // Without it, the other process makes a new claim.
        let _ = hard_link(&moved, path);
    }
    let _ = remove_file(&moved);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{File, write};
    use std::time::SystemTime;

    fn made(lock: &Path) -> Option<Claim> {
        match Claim::make(lock, &crate::lock::identity::own()).unwrap() {
            Attempt::Made(claim) => Some(claim),
            Attempt::MadeByOther(_) => None,
        }
    }

    #[test]
    fn one_claim_at_a_time_until_it_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let lock = folder.path().join("run.lock");
        let claim = made(&lock).unwrap();
        assert!(claim.is_valid() && made(&lock).is_none() && claim.is_valid());
        drop(claim);
        assert!(!path(&lock).exists());
        let claim = made(&lock).unwrap();
        write(path(&lock), "of another").unwrap();
        assert!(!claim.is_valid());
        drop(claim);
        assert!(path(&lock).exists(), "a claim of another process is not removed");
    }

    #[test]
    fn an_abandoned_claim_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let lock = folder.path().join("run.lock");
        let there = br#"{"id": 1, "started": 1, "host": "there 0-0 pid:[1]", "number": 3}"#;
        for (text, age_s, abandoned) in
            [(&there[..], 30, false), (&there[..], 90, true), (b"", 30, false), (b"", 90, true)]
        {
            write(path(&lock), text).unwrap();
            let file = File::options().write(true).open(path(&lock)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age_s)).unwrap();
            assert!(made(&lock).is_none());
            assert_eq!(made(&lock).is_some(), abandoned, "{age_s} s");
            let _ = remove_file(path(&lock));
        }
        if let Some(own) = crate::resources::this_process() {
            let gone = Process { started: own.started + 1, ..own };
            write(path(&lock), serde_json::to_vec(&gone).unwrap()).unwrap();
            assert!(made(&lock).is_none() && made(&lock).is_some());
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_claim_made_in_the_meantime_is_put_back() {
        let folder = tempfile::tempdir().unwrap();
        let lock = folder.path().join("run.lock");
        let claim = made(&lock).unwrap();
        remove(&path(&lock), b"an older claim");
        assert!(claim.is_valid());
        let text = claim.text.clone();
        remove(&path(&lock), &text);
        assert!(!claim.is_valid());
    }
}
