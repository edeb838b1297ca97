//! Files that exist only if their creation succeeded as a whole, and the clock of the file server.

use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::temporary::Temporary;

/// Creates the file `path` with the content `bytes`, flushes it, and returns it open for reading and writing. Of several
/// processes, also on different hosts, only one succeeds.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] for an existing path; other errors of the operating system, after which no file
/// remains.
pub fn create_new(path: &Path, bytes: &[u8]) -> io::Result<File> {
    let mut file = OpenOptions::new().read(true).write(true).create_new(true).open(path)?;
    if let Err(error) = file.write_all(bytes).and_then(|()| file.sync_all()) {
        // The error of the write is the one to report.
        let _ = fs::remove_file(path);
        return Err(error);
    }
    Ok(file)
}

/// A name of a temporary file beside `path` that no other process or host uses; [`super::sweep`] removes such files.
#[must_use]
pub fn unique_beside(path: &Path) -> PathBuf {
    let name = path.file_name().map_or_else(|| "out".into(), |n| n.to_string_lossy());
    path.with_file_name(format!(".{name}.{}.tmp", random()))
}

/// A random number from the operating system.
#[must_use]
pub fn random() -> u64 {
    RandomState::new().build_hasher().finish()
}

/// The current time of the file server of the folder of `path`: the modification time of a new file there. Clocks of
/// hosts are not compared.
///
/// # Errors
/// The error of the operating system when the folder is not writable.
pub fn server_time(path: &Path) -> io::Result<SystemTime> {
    let probe = Temporary::file(unique_beside(path));
    create_new(probe.path(), b"\n")?.metadata()?.modified()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn one_creation_succeeds_and_the_clock_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("claim");
        create_new(&path, b"one").unwrap();
        let second = create_new(&path, b"two").unwrap_err();
        assert_eq!(second.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"one");
        let written = fs::metadata(&path).unwrap().modified().unwrap();
        let age = server_time(&path).unwrap().duration_since(written).unwrap_or_default();
        assert!(age < Duration::from_secs(60), "{age:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(server_time(&folder.path().join("no/such")).is_err());
    }

    #[test]
    fn remaining_temporary_files_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let beside = unique_beside(&folder.path().join("run.lock"));
        assert_ne!(beside, unique_beside(&folder.path().join("run.lock")));
        create_new(&beside, b"").unwrap();
        crate::sweep(folder.path());
        assert!(!beside.exists());
    }
}
