//! Outside programs: found by name, run in a folder of their own under a time limit.

use std::fs;
use std::path::PathBuf;
use std::process::Child;
use std::time::{Duration, Instant};

use super::MeshError;

/// The first of `names` on PATH.
pub(super) fn on_path(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::env::split_paths(&path).flat_map(|dir| names.iter().map(move |n| dir.join(n)));
    all.into_iter().find(|p| p.is_file())
}

/// A folder of its own under the system's temporary folder, removed at the end.
pub(super) struct WorkFolder {
    pub path: PathBuf,
}

impl WorkFolder {
    /// A new one; `what` is part of its name.
    pub fn new(what: &str) -> Result<Self, MeshError> {
        let base = std::env::temp_dir();
        let mut last = None;
        for k in 0..1000u32 {
            let path = base.join(format!("kanagata-{what}-{}-{k}", std::process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(e) => last = Some(e),
            }
        }
        let source = last.unwrap_or_else(|| std::io::Error::other("no free name"));
        Err(crate::files::WriteError { path: base, source }.into())
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// Waits for the end of `child`, at most `limit`; false when it had to be killed.
pub(super) fn wait(child: &mut Child, limit: Duration) -> bool {
    let start = Instant::now();
    let mut pause = Duration::from_millis(2);
    loop {
        match child.try_wait() {
            Ok(None) if start.elapsed() < limit => std::thread::sleep(pause),
            Ok(None) => {
                let _ = child.kill();
                let _ = child.wait();
                return false;
            }
            _ => return true,
        }
        pause = (pause * 2).min(Duration::from_millis(50));
    }
}
