//! Checkpoints of a run: two alternating files, so that one is complete whenever the process dies.
//!
//! Format: first line `kanagata-checkpoint VERSION SHA256` with the digest of the rest; then one line of JSON
//! ([`Head`]); then the history of the material points as bytes.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::CheckpointError;
use super::folder::RunFolder;
use super::inputs::inputs;
use crate::files::{Sha256Writer, WriteError, sha256_hex, write_atomic};
use crate::report::record::RunRecord;
use crate::scene::Plan;
use crate::solver::snapshot::SimulationState;

/// Version of the file format.
const FORMAT_VERSION: u32 = 15;
const MAGIC: &str = "kanagata-checkpoint";

/// The first line of a file whose other lines have the digest `sha256`.
#[must_use]
pub fn first_line(sha256: &str) -> String {
    format!("{MAGIC} {FORMAT_VERSION} {sha256}")
}

/// A checkpoint without the history of the material points.
#[derive(Serialize, Deserialize)]
struct Head<F, S> {
    folder: F,
    state: S,
}

/// A checkpoint read from a file.
pub struct Checkpoint {
    /// The run folder at the time of the checkpoint.
    pub folder: RunFolder,
    /// The simulation.
    pub state: SimulationState,
}

fn files(folder: &Path) -> [PathBuf; 2] {
    ["checkpoint-0.bin", "checkpoint-1.bin"].map(|name| folder.join(name))
}

/// Writes checkpoint number `count` (from 0) of a run.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full; the previous checkpoint is unchanged.
pub fn write(folder: &RunFolder, state: &SimulationState, count: usize) -> Result<(), WriteError> {
    let path = &files(&folder.path)[count % 2];
    // The body is serialised twice, once for its digest, to avoid a copy of the history in memory.
    let body = |w: &mut dyn Write| {
        serde_json::to_writer(&mut *w, &Head { folder, state })?;
        w.write_all(b"\n")?;
        w.write_all(&state.material)
    };
    write_atomic(path, |w| {
        let mut digest = Sha256Writer::default();
        body(&mut digest)?;
        writeln!(w, "{}", first_line(&digest.hex()))?;
        body(w)
    })
}

/// Removes the checkpoints of a finished run.
pub fn remove(folder: &Path) {
    // A file that cannot be removed does no harm.
    files(folder).iter().for_each(|f| drop(fs::remove_file(f)));
}

/// Whether the record in the folder belongs to a run with all stages done.
fn has_completed(folder: &Path) -> bool {
    let text = crate::files::read_text(&folder.join("run.json"), crate::files::Input::Description)
        .unwrap_or_default();
    let record = serde_json::from_str::<RunRecord>(&text);
    record.is_ok_and(|record| record.verdict.is_complete())
}

/// The newest complete checkpoint in a folder. Its inputs must be those of `plan`, and its program `program`.
///
/// # Errors
/// [`CheckpointError`].
pub fn read(folder: &Path, plan: &Plan, program: &str) -> Result<Checkpoint, CheckpointError> {
    let mut checkpoint = newest_readable(folder)?;
    let RunFolder { record, history, .. } = &checkpoint.folder;
    if record.program != program {
        return Err(CheckpointError::Program {
            folder: folder.into(),
            found: record.program.clone(),
            expected: program.into(),
        });
    }
    check_inputs(folder, record, plan)?;
    let of_plan = plan.scene.tools.iter().map(|tool| &tool.name);
    if !history.tools.iter().eq(of_plan) {
        let why = "its history is of other tools than the scene's".into();
        return Err(CheckpointError::None { folder: folder.into(), why });
    }
    checkpoint.folder.path = folder.to_path_buf();
    Ok(checkpoint)
}

/// The readable checkpoint with the most increments.
///
/// # Errors
/// If there is none: [`CheckpointError::Completed`] or [`CheckpointError::None`].
fn newest_readable(folder: &Path) -> Result<Checkpoint, CheckpointError> {
    let mut faults = Vec::new();
    let mut found: Option<Checkpoint> = None;
    let increments = |one: &Checkpoint| one.folder.record.increments;
    for file in files(folder) {
        match read_one(&file) {
            Ok(one) if found.as_ref().is_none_or(|f| increments(f) < increments(&one)) => {
                found = Some(one);
            }
            Ok(_) => {}
            Err(why) => faults.push(why),
        }
    }
    found.ok_or_else(|| {
        let (folder, why) = (folder.to_path_buf(), faults.join(", "));
        if has_completed(&folder) {
            CheckpointError::Completed { folder }
        } else {
            CheckpointError::None { folder, why }
        }
    })
}

/// Compares the inputs of a run with those of the plan.
///
/// # Errors
/// [`CheckpointError::Changed`] for the first difference.
fn check_inputs(folder: &Path, record: &RunRecord, plan: &Plan) -> Result<(), CheckpointError> {
    let inputs = inputs(plan);
    for (input, expected) in &record.inputs {
        let now = inputs.get(input).map_or("none", String::as_str);
        if now != expected {
            return Err(CheckpointError::Changed {
                folder: folder.into(),
                input: input.clone(),
                found: now.into(),
                expected: expected.clone(),
            });
        }
    }
    Ok(())
}

/// File and increment of the newest complete checkpoint in a folder.
#[must_use]
pub fn newest(folder: &Path) -> Option<(PathBuf, usize)> {
    let whole = files(folder).into_iter().filter_map(|file| {
        let increments = read_one(&file).ok()?.folder.record.increments;
        Some((file, increments))
    });
    whole.max_by_key(|(_, increments)| *increments)
}

fn read_one(file: &Path) -> Result<Checkpoint, String> {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let bytes = crate::files::read(file, crate::files::Input::Checkpoint)
        .map_err(|e| format!("{name}: {e}"))?;
    parse(&bytes).map_err(|what| format!("{name}: {what}"))
}

/// Parses the bytes of a checkpoint.
///
/// # Errors
/// Why they cannot be used.
pub fn parse(bytes: &[u8]) -> Result<Checkpoint, String> {
    let line = |from: usize| bytes[from..].iter().position(|b| *b == b'\n').map(|k| from + k);
    let first = line(0).ok_or("no first line")?;
    let words = String::from_utf8_lossy(&bytes[..first]);
    if words != first_line(&sha256_hex(&bytes[first + 1..])) {
        return Err("version or digest is wrong".into());
    }
    let second = line(first + 1).ok_or("no second line")?;
    let Head { folder, mut state } =
        serde_json::from_slice::<Head<RunFolder, SimulationState>>(&bytes[first + 1..second])
            .map_err(|e| e.to_string())?;
    if !folder.history.is_whole() {
        return Err("an increment of its history lacks the travel or force of a tool".into());
    }
    state.material = bytes[second + 1..].to_vec();
    Ok(Checkpoint { folder, state })
}
