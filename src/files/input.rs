//! Reading of external files.
//!
//! Only regular files are read; symbolic links are followed. The file is opened without blocking, so that a FIFO
//! without a writer is rejected at once. Its size is checked before and during reading, because it may grow.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

use super::standard;

/// Kinds of files, each with a size limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// IGES and STEP.
    Cad,
    /// Meshes: MSH, STL, OBJ, VTU, Abaqus decks and files read by meshio.
    Mesh,
    /// Tool files.
    Tool,
    /// Scenes, material cards, studies, records of runs: short JSON files.
    Description,
    /// Tables of numbers (`history.csv`).
    Table,
    /// Checkpoints of runs.
    Checkpoint,
}

const MIB: u64 = 1 << 20;

impl Input {
    /// Size limit [bytes]. A million patches take about 200 MiB as a tool file and as STEP; a checkpoint contains the
    /// state of every material point.
    #[must_use]
    pub fn limit(self) -> u64 {
        match self {
            Self::Cad | Self::Mesh | Self::Tool => 512 * MIB,
            Self::Description => 64 * MIB,
            Self::Table => 256 * MIB,
            Self::Checkpoint => 16 * 1024 * MIB,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Cad => "a CAD file",
            Self::Mesh => "a mesh file",
            Self::Tool => "a tool file",
            Self::Description => "a description in JSON",
            Self::Table => "a table",
            Self::Checkpoint => "a checkpoint",
        }
    }
}

/// Opens a regular file for reading; also returns its size [bytes].
///
/// # Errors
/// The error of the operating system; [`io::ErrorKind::InvalidInput`] for other than regular files, and above the size
/// limit of its kind.
pub fn open(path: &Path, kind: Input) -> io::Result<(File, u64)> {
    let file = without_blocking(OpenOptions::new().read(true)).open(path)?;
    let size = regular(&file)?;
    within(size, kind)?;
    Ok((file, size))
}

/// Reads the bytes of an external file, or of standard input for [`standard::stdin`].
///
/// # Errors
/// As [`open`]; also when the file exceeds the size limit while it is read.
pub fn read(path: &Path, kind: Input) -> io::Result<Vec<u8>> {
    if standard::is_stdin(path) {
        let bytes = standard::read_stdin(kind.limit())?;
        within(bytes.len() as u64, kind)?;
        return Ok(bytes);
    }
    let (file, size) = open(path, kind)?;
    let mut bytes = Vec::new();
    let expected = usize::try_from(size).unwrap_or(usize::MAX);
    bytes.try_reserve(expected.saturating_add(1)).map_err(|_| io::ErrorKind::OutOfMemory)?;
    file.take(kind.limit() + 1).read_to_end(&mut bytes)?;
    within(bytes.len() as u64, kind)?;
    Ok(bytes)
}

/// As [`read`], for UTF-8 text.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] for other text.
pub fn read_text(path: &Path, kind: Input) -> io::Result<String> {
    let invalid = |e| io::Error::new(io::ErrorKind::InvalidData, e);
    String::from_utf8(read(path, kind)?).map_err(invalid)
}

/// The text of a file provided by the operating system (`/proc`).
///
/// # Errors
/// The error of the operating system.
pub fn read_system(path: &str) -> io::Result<String> {
    std::fs::read_to_string(path)
}

/// Opens without waiting for the other end of a FIFO, and without making a terminal the controlling one.
#[cfg(unix)]
fn without_blocking(options: &mut OpenOptions) -> &mut OpenOptions {
    use rustix::fs::OFlags;
    use std::os::unix::fs::OpenOptionsExt as _;
    options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits().cast_signed())
}

#[cfg(not(unix))]
fn without_blocking(options: &mut OpenOptions) -> &mut OpenOptions {
    options
}

/// Size of an open file [bytes], if it is a regular file.
fn regular(file: &File) -> io::Result<u64> {
    let metadata = file.metadata()?;
    if metadata.is_file() {
        return Ok(metadata.len());
    }
    Err(refused(format!("found {}; allowed: a regular file", kind_of(metadata.file_type()))))
}

/// Name of a file type.
pub(super) fn kind_of(kind: std::fs::FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return "a FIFO";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if kind.is_dir() { "a folder" } else { "no regular file" }
}

fn within(size: u64, kind: Input) -> io::Result<()> {
    let limit = kind.limit();
    if size <= limit {
        return Ok(());
    }
    let (found, allowed) = (size.div_ceil(MIB), limit / MIB);
    Err(refused(format!("found {found} MiB; allowed: {allowed} MiB for {}", kind.name())))
}

pub(super) fn refused(what: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn fifo(folder: &Path) -> PathBuf {
        let path = folder.join("pipe");
        let done = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(done.success());
        path
    }

    #[test]
    fn only_regular_files_are_read_and_none_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = fifo(folder.path());
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        for (path, found) in [
            (Path::new("/dev/zero"), "a device"),
            (&link, "a device"),
            (&pipe, "a FIFO"),
            (folder.path(), "a folder"),
        ] {
            let error = read(path, Input::Description).unwrap_err();
            assert!(error.to_string().contains(found), "{error}");
            assert!(error.to_string().contains("allowed: a regular file"), "{error}");
        }
        // The operating system refuses to open a socket.
        assert!(read(&socket, Input::Cad).is_err());
    }

    #[test]
    fn a_file_is_as_large_as_its_kind_may_be() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.json");
        let file = File::create(&path).unwrap();
        // A sparse file, without data on disk.
        file.set_len(Input::Description.limit() + 1).unwrap();
        let error = read(&path, Input::Description).unwrap_err().to_string();
        assert!(error.contains("found 65 MiB; allowed: 64 MiB"), "{error}");
        assert!(open(&path, Input::Mesh).is_ok());
        file.set_len(3).unwrap();
        assert_eq!(read(&path, Input::Description).unwrap(), [0; 3]);
        let missing = read(&folder.path().join("none"), Input::Cad).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
