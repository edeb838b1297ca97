//! Standard input and output in place of a file.
//!
//! [`STDIN`] and [`STDOUT`] are what a program makes of the name `-`. Standard input is read once and kept, as some files are
//! read twice (for their content and for their SHA-256).

use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Path that stands for standard input.
pub const STDIN: &str = "<stdin>";
/// Path that stands for standard output.
pub const STDOUT: &str = "<stdout>";

/// Whether a path stands for standard input.
#[must_use]
pub fn is_stdin(path: &Path) -> bool {
    path == Path::new(STDIN)
}

/// Whether a path stands for standard output.
#[must_use]
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new(STDOUT)
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
