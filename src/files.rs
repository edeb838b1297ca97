//! Whole-file output: every file is written beside its name, flushed and renamed, so that no reader
//! ever sees half of one.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// An output file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}; check that the folder exists and has room", path.display())]
pub struct WriteError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// What the system said.
    #[source]
    pub source: io::Error,
}

/// Writes `path` through `body`: into a temporary file beside it, flushed to disk, then renamed over it.
///
/// # Errors
/// [`WriteError`] when the folder is missing, the disk is full or `body` fails; `path` is then untouched.
pub fn write_atomic(
    path: &Path,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let name = path.file_name().map_or_else(|| "out".into(), |n| n.to_string_lossy());
    let beside = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let written = write_and_sync(&beside, body).and_then(|()| fs::rename(&beside, path));
    written.map_err(|source| {
        let _ = fs::remove_file(&beside);
        WriteError { path: path.to_path_buf(), source }
    })
}

fn write_and_sync(
    path: &Path,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    body(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Removes what writers that were killed have left beside their files in `folder`.
pub fn sweep(folder: &Path) {
    let litter = |name: &str| {
        let parts = name.strip_prefix('.').and_then(|n| n.strip_suffix(".tmp"));
        let writer = parts.and_then(|n| n.rsplit_once('.')).map(|(_, pid)| pid);
        writer.is_some_and(|pid| !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit()))
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if litter(&entry.file_name().to_string_lossy()) {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Removes the files of `folder` whose names `goes` picks; folders stay.
pub fn remove_where(folder: &Path, goes: impl Fn(&str) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if goes(&entry.file_name().to_string_lossy()) && entry.path().is_file() {
            // What cannot be removed is written over where it is written at all.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Lower-case hexadecimal SHA-256 of `bytes`.
#[must_use]
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// Takes the SHA-256 of what is written to it.
#[derive(Debug, Default)]
pub struct Sha256Writer(Sha256);

impl Sha256Writer {
    /// Lower-case hexadecimal digest of all that was written.
    #[must_use]
    pub fn hex(self) -> String {
        self.0.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

impl Write for Sha256Writer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failing_body_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        write_atomic(&path, |w| w.write_all(b"first")).unwrap();
        let failed = write_atomic(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn litter_of_killed_writers_is_swept_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        for name in [".run.json.123.tmp", "run.json", ".hidden.tmp", "notes.123.tmp"] {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        sweep(folder.path());
        let left = fs::read_dir(folder.path()).unwrap();
        let mut left: Vec<_> = left.map(|e| e.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, [".hidden.tmp", "notes.123.tmp", "run.json"]);
    }

    #[test]
    fn sha256_of_the_empty_string() {
        assert!(sha256_hex(b"").starts_with("e3b0c44298fc1c14"));
        let mut parts = Sha256Writer::default();
        parts.write_all(b"in ").and_then(|()| parts.write_all(b"parts")).unwrap();
        assert_eq!(parts.hex(), sha256_hex(b"in parts"));
    }
}
