//! Atomic output: every file is written under a temporary name, flushed and renamed, so that no reader sees an
//! incomplete file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::input::{kind_of, refused};
use super::standard;
use super::temporary::Temporary;

/// An output file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}{}", path.display(), hint(source))]
pub struct WriteError {
    /// Path of the output file.
    pub path: PathBuf,
    /// Error of the operating system.
    #[source]
    pub source: io::Error,
}

/// Remedy for an error of the operating system; a rejection contains its own.
fn hint(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::InvalidInput => "",
        io::ErrorKind::FileTooLarge => "; raise the limit of file sizes (`ulimit -f`)",
        _ => "; check that the folder exists and has room",
    }
}

/// Maximum number of symbolic links in a chain, as in the operating system.
const LINKS_MAX: usize = 40;

/// Creates or empties a file that receives the output of a child program.
///
/// # Errors
/// [`WriteError`] when the folder is missing or the file cannot be written.
pub fn create_log(path: &Path) -> Result<File, WriteError> {
    File::create(path).map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// Writes `path` through `body`: into a temporary file next to it, flushed to disk, renamed over it, and the folder
/// flushed. For a symbolic link the target file is replaced. An existing file keeps its permissions.
/// [`standard::stdout`] is written to standard output, once `body` has ended.
///
/// # Errors
/// [`WriteError`] when the folder is missing, the disk is full, `body` fails, or the path is a device, FIFO, socket or
/// folder; an existing file is then unchanged.
pub fn write_atomic(
    path: &Path,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    if standard::is_stdout(path) {
        let mut bytes = Vec::new();
        let written = body(&mut bytes).and_then(|()| standard::write_stdout(&bytes));
        return written.map_err(|source| WriteError { path: path.to_path_buf(), source });
    }
    let written = target(path).and_then(|(target, old)| {
        let name = target.file_name().map_or_else(|| "out".into(), |n| n.to_string_lossy());
        let beside = target.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
        let temporary = Temporary::file(beside);
        write_and_sync(temporary.path(), old, body)?;
        fs::rename(temporary.path(), &target)?;
        sync_folder(&target)
    });
    written.map_err(|source| WriteError { path: path.to_path_buf(), source })
}

/// Target of a path after symbolic links, and the permissions of an existing file.
fn target(path: &Path) -> io::Result<(PathBuf, Option<fs::Permissions>)> {
    let mut target = path.to_path_buf();
    for _ in 0..LINKS_MAX {
        let there = match fs::symlink_metadata(&target) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok((target, None)),
            other => other?,
        };
        if !there.is_symlink() {
            if there.is_file() {
                return Ok((target, Some(there.permissions())));
            }
            let found = kind_of(there.file_type());
            let allowed = "a new file, or a regular one that is replaced; give another name";
            return Err(refused(format!("found {found}; allowed: {allowed}")));
        }
        // Relative links are relative to their own folder.
        let to = fs::read_link(&target)?;
        target = target.parent().map_or(to.clone(), |folder| folder.join(&to));
    }
    Err(refused(format!("found more than {LINKS_MAX} symbolic links; allowed: a regular file")))
}

fn write_and_sync(
    path: &Path,
    permissions: Option<fs::Permissions>,
    body: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    // Remainder of a process with the same id.
    let _ = fs::remove_file(path);
    let file = OpenOptions::new().write(true).create_new(true).open(path)?;
    if let Some(permissions) = permissions {
        // On file systems without permissions the defaults are used.
        let _ = file.set_permissions(permissions);
    }
    let mut file = BufWriter::new(file);
    body(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Flushes the folder of a file, so that its new name is on disk.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // File systems that cannot flush a folder, and folders that are writable but not readable.
        Err(e)
            if matches!(
                e.kind(),
                io::ErrorKind::InvalidInput
                    | io::ErrorKind::Unsupported
                    | io::ErrorKind::PermissionDenied
            ) =>
        {
            Ok(())
        }
        other => other,
    }
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Removes temporary files of killed writers in `folder`.
pub fn sweep(folder: &Path) {
    let litter = |name: &str| {
        let parts = name.strip_prefix('.').and_then(|n| n.strip_suffix(".tmp"));
        let writer = parts.and_then(|n| n.rsplit_once('.')).map(|(_, pid)| pid);
        writer.is_some_and(|pid| !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit()))
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if litter(&entry.file_name().to_string_lossy()) {
            // A remaining temporary file is harmless.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Removes the files of `folder` whose names satisfy `selected`; folders are kept.
pub fn remove_where(folder: &Path, selected: impl Fn(&str) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if selected(&entry.file_name().to_string_lossy()) && entry.path().is_file() {
            // A remaining file is overwritten by later output.
            let _ = fs::remove_file(entry.path());
        }
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

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_what_is_no_regular_file_is_refused() {
        use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let put = |name: &str, text: &[u8]| write_atomic(&at(name), |w| w.write_all(text));
        fs::create_dir(at("real")).unwrap();
        // A relative chain whose target does not exist yet.
        symlink("second", at("first")).unwrap();
        symlink("real/file", at("second")).unwrap();
        put("first", b"one").unwrap();
        fs::set_permissions(at("real/file"), fs::Permissions::from_mode(0o640)).unwrap();
        put("first", b"two").unwrap();
        assert_eq!(fs::read(at("real/file")).unwrap(), b"two");
        assert_eq!(fs::metadata(at("first")).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(["first", "second"].iter().all(|n| at(n).is_symlink()));
        symlink("round", at("round")).unwrap();
        symlink("/dev/null", at("null")).unwrap();
        let made = std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
        assert!(made.success());
        for (name, found) in
            [("pipe", "a FIFO"), ("null", "a device"), ("real", "a folder"), ("round", "links")]
        {
            let error = put(name, b"x").unwrap_err().to_string();
            assert!(error.contains(found) && error.contains("allowed: "), "{error}");
        }
        assert!(fs::symlink_metadata(at("pipe")).unwrap().file_type().is_fifo());
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
