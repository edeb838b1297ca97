//! Who holds a lock, judged from the system's lock, the process and its heartbeat.

use std::fmt;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;
use std::time::Duration;

use super::identity::{has_heartbeat, host_name, parse, process_text};
use super::system::{Kind, LockFile, SystemLock};
use crate::resources::alive;
use kanagata_files::{Input, open, server_time};
use kanagata_report::record::Process;

/// Age of the last heartbeat at which a holder on another host counts as ended. Ten heartbeats: a file server may be
/// restarted meanwhile. Doubled, a folder stays locked 5 minutes longer after its host has failed.
pub const HEARTBEAT_EXPIRY: Duration = Duration::from_secs(300);

/// Where the holder of a lock is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A living process of this host.
    Here,
    /// A process of another host, or of one that does not identify processes.
    Elsewhere {
        /// Age of its last heartbeat, by the clock of the file server; `None` if it cannot be measured.
        heartbeat: Option<Duration>,
        /// Whether the file system reports its lock.
        locked: bool,
    },
    /// The file system reports a lock, but the file names no living process.
    Unknown,
}

/// The holder of a lock.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// The process, if the lock file names one.
    pub process: Option<Process>,
    /// Where it is.
    pub place: Place,
}

impl Holder {
    /// Whether the lock may be broken: the holder is not known to be alive on this host.
    #[must_use]
    pub fn is_breakable(&self) -> bool {
        self.place != Place::Here
    }

    /// Whether the holder is known to be alive: its process runs here, or its heartbeat or lock is seen.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        match self.place {
            Place::Here | Place::Unknown => true,
            Place::Elsewhere { heartbeat, locked } => locked || heartbeat.is_some(),
        }
    }

    /// Age of the last heartbeat of a holder on another host.
    #[must_use]
    pub fn heartbeat(&self) -> Option<Duration> {
        match self.place {
            Place::Elsewhere { heartbeat, .. } => heartbeat,
            Place::Here | Place::Unknown => None,
        }
    }

    /// How to wait for the holder or end it.
    #[must_use]
    pub fn remedy(&self) -> String {
        // An unknown holder is not the process that the file names.
        let process = self.process.as_ref().filter(|_| self.place != Place::Unknown);
        let kill = process.map_or("kill".into(), |p| format!("kill {}", p.id));
        let host = process.and_then(host_name);
        let Some(host) = host.filter(|_| self.place != Place::Here) else {
            return format!("wait for it, or end it (`{kill}`; checkpoints remain)");
        };
        let end = format!("wait for it, or end it on {host} (`{kill}`; checkpoints remain)");
        if self.heartbeat().is_some_and(|age| age < HEARTBEAT_EXPIRY) {
            let minutes = HEARTBEAT_EXPIRY.as_secs() / 60;
            return format!("{end}; it counts as ended {minutes} minutes after its last heartbeat");
        }
        end
    }

    /// The holder of a claim, which is acquiring the lock.
    pub(super) fn of_claim(process: Option<Process>) -> Self {
        let place = match process.as_ref().map(alive) {
            Some(Some(true)) => Place::Here,
            Some(None) => Place::Elsewhere { heartbeat: None, locked: false },
            Some(Some(false)) | None => Place::Unknown,
        };
        Self { process, place }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&process_text(self.process.as_ref()))?;
        let Place::Elsewhere { heartbeat, locked } = self.place else { return Ok(()) };
        match heartbeat {
            Some(age) => write!(f, " (last heartbeat {} s ago", age.as_secs())?,
            None => write!(f, " (last heartbeat unknown")?,
        }
        let still = locked && heartbeat.is_none_or(|age| age >= HEARTBEAT_EXPIRY);
        f.write_str(if still { "; the file system still reports its lock)" } else { ")" })
    }
}

/// The holder of the lock file `path`, which is opened afresh so that a network file system shows its current state.
/// `None` if the lock is free.
///
/// # Errors
/// The error of the operating system when an existing lock file cannot be read.
pub(super) fn judge(path: &Path, lock_file: LockFile) -> io::Result<Option<Holder>> {
    let file = match open(path, Input::Description) {
        Ok((file, _)) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let lock = lock_file(&file, Kind::Shared);
    let mut text = Vec::new();
    (&file).take(Input::Description.limit()).read_to_end(&mut text)?;
    let process = parse(&text);
    let place = place(path, &file, process.as_ref(), lock);
    Ok(place.map(|place| Holder { process, place }))
}

/// Place of the process named in the lock file; `None` if it has ended.
///
/// A living process of this host holds the lock also if the system does not report a lock: some file systems accept
/// every lock.
fn place(path: &Path, file: &File, process: Option<&Process>, lock: SystemLock) -> Option<Place> {
    let locked = lock == SystemLock::Held;
    let unknown = locked.then_some(Place::Unknown);
    let Some(process) = process else { return unknown };
    match alive(process) {
        Some(true) => Some(Place::Here),
        Some(false) => unknown,
        None => {
            let heartbeat = if has_heartbeat(process) { age(path, file).ok() } else { None };
            let expired = heartbeat.is_some_and(|age| age >= HEARTBEAT_EXPIRY);
            (locked || !expired).then_some(Place::Elsewhere { heartbeat, locked })
        }
    }
}

/// Time since the open file `file` at `path` was written, by the clock of the file server.
///
/// # Errors
/// The error of the operating system when the folder is not writable.
pub(super) fn age(path: &Path, file: &File) -> io::Result<Duration> {
    let written = file.metadata()?.modified()?;
    // A server whose clock was set back reports a time before the last heartbeat.
    Ok(server_time(path)?.duration_since(written).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resources::this_process;
    use std::time::SystemTime;

    fn process(host: &str) -> Process {
        Process { id: 7, started: 1, host: host.into() }
    }

    /// The holder of a lock file with this content and age under a lock of the system.
    fn judged(process: &Process, age_s: u64, lock_file: LockFile) -> Option<Holder> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.lock");
        std::fs::write(&path, serde_json::to_vec(process).unwrap()).unwrap();
        let file = File::options().write(true).open(&path).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(age_s)).unwrap();
        judge(&path, lock_file).unwrap()
    }

    const LOCKS: [LockFile; 3] =
        [|_, _| SystemLock::Acquired, |_, _| SystemLock::Held, |_, _| SystemLock::Unsupported];

    #[test]
    fn a_holder_on_another_host_is_alive_until_its_heartbeat_expires() {
        let there = process("there 0-0 pid:[1]");
        for (lock_file, locked) in LOCKS.into_iter().zip([false, true, false]) {
            let young = judged(&there, 200, lock_file).unwrap();
            assert!(matches!(young.place, Place::Elsewhere { locked: l, .. } if l == locked));
            assert!(young.heartbeat().unwrap().as_secs().abs_diff(200) < 20, "{young:?}");
            assert!(young.is_alive() && young.is_breakable());
            assert_eq!(judged(&there, 320, lock_file).is_some(), locked);
        }
        let locked = judged(&there, 320, LOCKS[1]).unwrap();
        assert!(locked.to_string().contains("the file system still reports its lock"));
        assert!(!locked.remedy().contains("minutes"), "{}", locked.remedy());
        // Clocks of the server may be set back.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.lock");
        let file = File::create(&path).unwrap();
        file.set_modified(SystemTime::now() + Duration::from_secs(5000)).unwrap();
        assert_eq!(age(&path, &file).unwrap(), Duration::ZERO);
    }

    #[test]
    fn a_holder_without_heartbeat_cannot_be_judged() {
        let old = process("there 0-0");
        for lock_file in LOCKS {
            let holder = judged(&old, 90_000, lock_file).unwrap();
            assert!(holder.heartbeat().is_none() && holder.is_breakable());
            assert!(holder.to_string().contains("last heartbeat unknown"), "{holder}");
            assert!(!holder.remedy().contains("minutes"));
        }
        assert!(!judged(&old, 90_000, LOCKS[2]).unwrap().is_alive());
    }

    #[test]
    fn a_process_of_this_host_is_looked_up() {
        let Some(own) = this_process() else { return };
        let gone = Process { started: own.started + 1, ..own.clone() };
        for lock_file in LOCKS {
            let holder = judged(&own, 9000, lock_file).unwrap();
            assert!(holder.place == Place::Here && !holder.is_breakable() && holder.is_alive());
            assert!(holder.remedy().contains(&format!("(`kill {}`;", own.id)));
        }
        assert_eq!(judged(&gone, 0, LOCKS[0]), None);
        assert_eq!(judged(&gone, 0, LOCKS[1]).unwrap().place, Place::Unknown);
        assert_eq!(judged(&gone, 0, LOCKS[2]), None);
    }

    #[test]
    fn a_file_without_identity_is_held_by_the_lock_of_the_system_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.lock");
        assert_eq!(judge(&path, LOCKS[1]).unwrap(), None, "no file");
        for text in ["", "no process"] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(judge(&path, LOCKS[0]).unwrap(), None);
            assert_eq!(judge(&path, LOCKS[1]).unwrap().unwrap().place, Place::Unknown);
            assert_eq!(judge(&path, LOCKS[2]).unwrap(), None);
        }
        assert!(judge(folder.path(), LOCKS[0]).is_err(), "a folder");
    }
}
