//! External programs: looked up by name, run in a separate folder and process group, with limits of time, log and
//! output.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use super::MeshError;
use kanagata_files::temporary::{Group, Temporary};

/// The first of `names` on PATH.
pub(super) fn on_path(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::env::split_paths(&path).flat_map(|dir| names.iter().map(move |n| dir.join(n)));
    all.into_iter().find(|p| p.is_file()).map(from_any_folder)
}

/// Absolute path of a file of the current folder, valid for a program that runs in another folder.
pub(super) fn from_any_folder(path: PathBuf) -> PathBuf {
    // Fails only without a current folder, where no relative path is valid.
    std::path::absolute(&path).unwrap_or(path)
}

/// Number of bytes kept from the end of a program's output; the rest is read and discarded.
const LOG_BYTES: usize = 100_000;
/// Number of bytes that a program may write into its folder: more than the largest mesh read, including the part.
const OUTPUT_BYTES: u64 = 2 << 30;

/// A temporary folder, removed at the end; `what` is part of its name.
pub(super) fn work_folder(what: &str) -> Result<Temporary, MeshError> {
    Temporary::folder(what)
        .map_err(|source| kanagata_files::WriteError { path: std::env::temp_dir(), source }.into())
}

/// How a program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// Exited.
    Ended(ExitStatus),
    /// Killed at the time limit.
    TooLong,
    /// Killed at the output limit.
    TooLarge,
}

/// Result of a program.
#[derive(Debug)]
pub(super) struct Outcome {
    pub end: End,
    /// End of its output.
    pub log: Vec<u8>,
}

/// Message for a program killed at the output limit.
pub(super) fn too_large() -> String {
    format!("it wrote more than {} MiB into its folder; mesh coarser", OUTPUT_BYTES >> 20)
}

/// Runs a program in `folder` for at most `limit`. On return it and all programs it started have ended.
///
/// # Errors
/// The error of the operating system when it does not start.
pub(super) fn run(command: &mut Command, folder: &Path, limit: Duration) -> io::Result<Outcome> {
    command.current_dir(folder).stdin(Stdio::null());
    let (reader, writer) = io::pipe()?;
    command.stdout(writer.try_clone()?).stderr(writer);
    let mut group = Group::start(command)?;
    // The command holds the writing end of the pipe, which must be closed for the reader to reach its end.
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let (sender, log) = mpsc::channel();
    std::thread::spawn(move || sender.send(end_of(reader)));
    let end = wait(&mut group, folder, limit);
    drop(group);
    // A program that has left its group may keep the pipe open.
    let log = log.recv_timeout(Duration::from_secs(1)).unwrap_or_default();
    Ok(Outcome { end: end?, log })
}

/// The last bytes of a stream.
fn end_of(mut from: impl Read) -> Vec<u8> {
    let (mut kept, mut part) = (Vec::new(), [0; 1 << 16]);
    // Output until the pipe broke is reported.
    while let Ok(n @ 1..) = from.read(&mut part) {
        kept.extend_from_slice(&part[..n]);
        if kept.len() > 2 * LOG_BYTES {
            kept.drain(..kept.len() - LOG_BYTES);
        }
    }
    kept.drain(..kept.len().saturating_sub(LOG_BYTES));
    kept
}

/// Waits until a program ends or reaches one of its limits.
fn wait(group: &mut Group, folder: &Path, limit: Duration) -> io::Result<End> {
    let start = Instant::now();
    let mut pause = Duration::from_millis(2);
    loop {
        if let Some(status) = group.child().try_wait()? {
            return Ok(End::Ended(status));
        }
        if start.elapsed() >= limit {
            return Ok(End::TooLong);
        }
        if size_of(folder) > OUTPUT_BYTES {
            return Ok(End::TooLarge);
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(50));
    }
}

/// Total size of the files in a folder [bytes].
fn size_of(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|m| m.len()).sum()
}
