//! Exclusive use of a folder by one process, also among hosts that share a file system.
//!
//! A lock file contains the identity of its holder. Three signs say whether the holder is alive:
//! 1. the lock of the operating system, which ends with the process, however it ends (`system`);
//! 2. on the same host, the process itself;
//! 3. from another host, the heartbeat: the holder writes its file every 30 s (`heartbeat`), and counts as ended when the
//!    last heartbeat is 5 minutes old by the clock of the file server (`holder`).
//!
//! A lock is acquired under a claim (`claim`): the holder is judged, and a new file with the identity is renamed over the
//! lock file. A former holder that is only delayed keeps its own, now nameless file. It finds with [`Lock::check`] that it
//! has lost the lock.

mod claim;
mod heartbeat;
mod holder;
mod identity;
mod system;

use std::fs::{File, rename};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use kanagata_files::temporary::Temporary;
use kanagata_files::{Input, WriteError, create_new, read, unique_beside};
use kanagata_report::record::Process;

use claim::Claim;
use heartbeat::{HEARTBEAT_INTERVAL, Heartbeat};
pub use holder::{HEARTBEAT_EXPIRY, Holder, Place};
pub use identity::{host_name, process_text};
use system::{Kind, LockFile, SystemLock, flock};

/// Longest wait for the claim of another process. A claim takes a few file operations; a longer one is of a process that
/// was stopped or killed meanwhile.
const CLAIM_WAIT: Duration = Duration::from_secs(5);
/// Interval between attempts to claim a lock.
const CLAIM_POLL: Duration = Duration::from_millis(20);

/// Exclusive use of a folder until the lock is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Content of the lock file: the identity of this process.
    text: Vec<u8>,
    file: Arc<File>,
    heartbeat: Option<Heartbeat>,
}

/// Result of an attempt to lock.
#[derive(Debug)]
pub enum Attempt {
    /// This process has acquired the lock.
    Acquired(Lock),
    /// Another process holds the lock.
    HeldByOther(Holder),
}

/// A lock that its holder has lost.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {found}", path.display())]
pub struct Lost {
    /// The lock file.
    pub path: PathBuf,
    /// What was found: the process that holds it now, or the fault of the file.
    pub found: String,
}

impl Lock {
    /// Checks that this process still holds the lock; reads the lock file once. Another host may have taken it after 5
    /// minutes without a heartbeat, for example while this process was stopped.
    ///
    /// # Errors
    /// [`Lost`] if the file is missing, cannot be read, or contains something else.
    pub fn check(&self) -> Result<(), Lost> {
        let found = match read(&self.path, Input::Description) {
            Ok(text) if text == self.text => return Ok(()),
            Ok(text) => match identity::parse(&text) {
                Some(process) => format!("{} holds the lock now", process_text(Some(&process))),
                None => "the lock file names no process".into(),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                "the lock file was deleted".into()
            }
            Err(error) => format!("the lock file cannot be read: {error}"),
        };
        Err(Lost { path: self.path.clone(), found })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        self.heartbeat = None;
        if self.check().is_ok() {
            // If this fails, the remaining identity belongs to an ended process or an unlocked file.
            let _ = self.file.set_len(0);
        }
    }
}

/// Path of the lock file in a run folder.
#[must_use]
pub fn file_in(folder: &Path) -> PathBuf {
    folder.join("run.lock")
}

/// Acquires the lock `path`, whose folder must exist. With `break_lock`, also from a holder that is not known to be alive
/// on this host.
///
/// # Errors
/// [`WriteError`] when the file cannot be read, created or written.
pub fn take(path: &Path, break_lock: bool) -> Result<Attempt, WriteError> {
    take_with(path, break_lock, flock)
        .map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// The holder of the lock `path`; `None` if it is free.
///
/// # Errors
/// The error of the operating system when an existing lock file cannot be read.
pub fn holder(path: &Path) -> io::Result<Option<Holder>> {
    holder::judge(path, flock)
}

/// As [`take`], with the lock function of the system.
fn take_with(path: &Path, break_lock: bool, lock_file: LockFile) -> io::Result<Attempt> {
    let own = identity::own();
    let start = Instant::now();
    let obstacle = || -> io::Result<Option<Holder>> {
        let holder = holder::judge(path, lock_file)?;
        Ok(holder.filter(|holder| !(break_lock && holder.is_breakable())))
    };
    loop {
        if let Some(holder) = obstacle()? {
            return Ok(Attempt::HeldByOther(holder));
        }
        let process = match Claim::make(path, &own)? {
            claim::Attempt::Made(claim) => {
                if let Some(holder) = obstacle()? {
                    return Ok(Attempt::HeldByOther(holder));
                }
                if let Some(lock) = acquire(path, &own, &claim, lock_file)? {
                    return Ok(Attempt::Acquired(lock));
                }
                None
            }
            claim::Attempt::MadeByOther(process) => process,
        };
        if start.elapsed() >= CLAIM_WAIT {
            return Ok(Attempt::HeldByOther(Holder::of_claim(process)));
        }
        sleep(CLAIM_POLL);
    }
}

/// Replaces the lock file by one of the process `own`, if the claim is still valid. `None` if another process was faster.
///
/// # Errors
/// The error of the operating system when the file cannot be written or the heartbeat cannot be started.
fn acquire(
    path: &Path,
    own: &Process,
    claim: &Claim,
    lock_file: LockFile,
) -> io::Result<Option<Lock>> {
    let text = serde_json::to_vec(own)?;
    // The new file is locked and complete before it has the name of the lock.
    let new = Temporary::file(unique_beside(path));
    let file = Arc::new(create_new(new.path(), &text)?);
    if lock_file(&file, Kind::Exclusive) == SystemLock::Held || !claim.is_valid() {
        return Ok(None);
    }
    rename(new.path(), path)?;
    let heartbeat = Heartbeat::start(Arc::clone(&file), text.clone(), HEARTBEAT_INTERVAL)?;
    let lock = Lock { path: path.to_path_buf(), text, file, heartbeat: Some(heartbeat) };
    Ok(lock.check().is_ok().then_some(lock))
}

#[cfg(test)]
mod tests;
