//! Files, folders and child programs limited to the lifetime of the process.
//!
//! They are removed by their owners. A process ended by a signal cannot return to the owners; therefore all of them are
//! in a global list, processed by [`end_all`]. The list does not affect any result.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Existing files, folders and programs.
#[derive(Default)]
struct List {
    paths: Vec<PathBuf>,
    /// Process groups, by the id of their first process.
    groups: Vec<u32>,
}

static LIST: Mutex<List> = Mutex::new(List { paths: Vec::new(), groups: Vec::new() });

fn list() -> MutexGuard<'static, List> {
    // The list is consistent whenever its lock is free.
    LIST.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or folder removed when dropped, and by [`end_all`].
#[derive(Debug)]
pub struct Temporary {
    path: PathBuf,
}

impl Temporary {
    /// A file that does not exist yet.
    #[must_use]
    pub fn file(path: PathBuf) -> Self {
        list().paths.push(path.clone());
        Self { path }
    }

    /// Creates a folder under the system's temporary folder, accessible to this user only; `what` is part of its name.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn folder(what: &str) -> io::Result<Self> {
        /// Maximum number of names tried: those of killed processes may still exist.
        const NAMES: u32 = 1000;
        let base = std::env::temp_dir();
        let mut all = list();
        let mut last = io::Error::other("no free name");
        for k in 0..NAMES {
            let path = base.join(format!("kanagata-{what}-{}-{k}", std::process::id()));
            match make_own(&path) {
                Ok(()) => {
                    all.paths.push(path.clone());
                    return Ok(Self { path });
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => last = e,
                Err(e) => return Err(e),
            }
        }
        Err(last)
    }

    /// Path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        remove(&self.path);
        list().paths.retain(|path| *path != self.path);
    }
}

#[cfg(unix)]
fn make_own(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt as _;
    fs::DirBuilder::new().mode(0o700).create(path)
}

#[cfg(not(unix))]
fn make_own(path: &Path) -> io::Result<()> {
    fs::create_dir(path)
}

/// Removes a file, or a folder with its contents; a missing one is no error.
fn remove(path: &Path) {
    if fs::symlink_metadata(path).is_ok_and(|m| m.is_dir()) {
        let _ = fs::remove_dir_all(path);
    } else {
        let _ = fs::remove_file(path);
    }
}

/// A child program in a separate process group, with all programs it starts.
#[derive(Debug)]
pub struct Group {
    child: Child,
}

impl Group {
    /// Starts a program.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn start(command: &mut Command) -> io::Result<Self> {
        own_group(command);
        // The list is locked during the start, so that every started program is in it.
        let mut all = list();
        let child = command.spawn()?;
        all.groups.push(child.id());
        Ok(Self { child })
    }

    /// The program.
    pub fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Kills all programs of the group and waits for the first one.
    pub fn end(&mut self) {
        end_group(self.child.id());
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // The first process may have ended and left others, which keep its id as group id.
        self.end();
        let own = self.child.id();
        list().groups.retain(|group| *group != own);
    }
}

/// Gives a program a process group of its own: signals of the terminal do not reach it.
#[cfg(unix)]
pub fn own_group(command: &mut Command) {
    use std::os::unix::process::CommandExt as _;
    command.process_group(0);
}

/// Process groups are of Unix.
#[cfg(not(unix))]
pub fn own_group(_: &mut Command) {}

/// Kills every process of a group.
#[cfg(unix)]
fn end_group(group: u32) {
    use rustix::process::{Pid, Signal, kill_process_group};
    if let Some(pid) = i32::try_from(group).ok().and_then(Pid::from_raw) {
        // A group without processes has already ended.
        let _ = kill_process_group(pid, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn end_group(_: u32) {}

/// Ends all child programs and removes all temporary files and folders. The process must end afterwards: creating
/// another one blocks forever.
pub fn end_all() {
    let all = list();
    all.groups.iter().copied().for_each(end_group);
    all.paths.iter().for_each(|path| remove(path));
    // A program may have written once more before it was killed.
    all.paths.iter().for_each(|path| remove(path));
    std::mem::forget(all);
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::process::Stdio;

    #[test]
    fn a_group_ends_with_the_programs_it_started() {
        let folder = Temporary::folder("group-test").unwrap();
        let file = folder.path().join("child");
        let mut command = Command::new("sh");
        let script = format!("sleep 60 & echo $! > '{0}.new'; mv '{0}.new' '{0}'", file.display());
        command.args(["-c", &script]).stdout(Stdio::null());
        let mut group = Group::start(&mut command).unwrap();
        // Its first process ends and leaves another one running.
        while group.child().try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let sleeper: u32 = fs::read_to_string(&file).unwrap().trim().parse().unwrap();
        let there = || {
            let stat = fs::read_to_string(format!("/proc/{sleeper}/stat")).unwrap_or_default();
            stat.rsplit_once(')').is_some_and(|(_, s)| !s.trim_start().starts_with(['Z', 'X']))
        };
        drop(group);
        for _ in 0..500 {
            if !there() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        assert!(!there());
        let path = folder.path().to_path_buf();
        drop(folder);
        assert!(!path.exists());
    }
}
