//! Standard input and output in place of a file.
//!
//! A program makes [`stdin`] and [`stdout`] of the name `-`. Before that no path stands for them, so that a name in a foreign
//! file cannot. Standard input is read once and kept, as some files are read twice (for their content and for their SHA-256).

use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

const STDIN: &str = "<stdin>";
const STDOUT: &str = "<stdout>";
/// Whether the program has been given standard input, standard output.
static IS_GIVEN: [AtomicBool; 2] = [AtomicBool::new(false), AtomicBool::new(false)];

/// The path that stands for standard input from now on.
#[must_use]
pub fn stdin() -> PathBuf {
    IS_GIVEN[0].store(true, Ordering::Relaxed);
    STDIN.into()
}

/// The path that stands for standard output from now on.
#[must_use]
pub fn stdout() -> PathBuf {
    IS_GIVEN[1].store(true, Ordering::Relaxed);
    STDOUT.into()
}

/// Whether a path stands for standard input.
#[must_use]
pub fn is_stdin(path: &Path) -> bool {
    IS_GIVEN[0].load(Ordering::Relaxed) && path == Path::new(STDIN)
}

/// Whether a path stands for standard output.
#[must_use]
pub fn is_stdout(path: &Path) -> bool {
    IS_GIVEN[1].load(Ordering::Relaxed) && path == Path::new(STDOUT)
}

/// The bytes of standard input, up to one more than `limit`.
///
/// # Errors
/// The error of the operating system.
pub(super) fn read_stdin(limit: u64) -> io::Result<Vec<u8>> {
    static KEPT: Mutex<Option<Vec<u8>>> = Mutex::new(None);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if kept.is_none() {
        let mut bytes = Vec::new();
        io::stdin().lock().take(limit + 1).read_to_end(&mut bytes)?;
        *kept = Some(bytes);
    }
    Ok(kept.clone().unwrap_or_default())
}

/// Writes `bytes` to standard output. A reader that has closed the pipe has seen enough.
///
/// # Errors
/// The error of the operating system.
pub(super) fn write_stdout(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
