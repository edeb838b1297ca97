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
use kanagata_files::{Sha256Writer, WriteError, sha256_hex, write_atomic};
use kanagata_report::record::RunRecord;
use kanagata_scene::Plan;
use kanagata_solver::snapshot::SimulationState;

/// Version of the file format.
const FORMAT_VERSION: u32 = 19;
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

/// Writes checkpoint number `count` of a run: even numbers replace the first file, odd ones the second.
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
    let text =
        kanagata_files::read_text(&folder.join("run.json"), kanagata_files::Input::Description)
            .unwrap_or_default();
    let record = serde_json::from_str::<RunRecord>(&text);
    record.is_ok_and(|record| record.verdict.is_complete())
}

/// The newest complete checkpoint in a folder, and the number of the next one ([`write()`]), which replaces the other file.
/// Its inputs must be those of `plan`, and its program `program`.
///
/// # Errors
/// [`CheckpointError`].
pub fn read(
    folder: &Path,
    plan: &Plan,
    program: &str,
) -> Result<(Checkpoint, usize), CheckpointError> {
    let (file, mut checkpoint) = newest_readable(folder).map_err(|why| {
        let folder = folder.to_path_buf();
        if has_completed(&folder) {
            CheckpointError::Completed { folder }
        } else {
            CheckpointError::None { folder, why }
        }
    })?;
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
    Ok((checkpoint, file + 1))
}

/// The readable checkpoint with the most increments, the first of two equal ones, and which file it is.
///
/// # Errors
/// The fault of each file if none can be read.
fn newest_readable(folder: &Path) -> Result<(usize, Checkpoint), String> {
    let mut faults = Vec::new();
    let mut found: Option<(usize, Checkpoint)> = None;
    let increments = |one: &Checkpoint| one.folder.record.increments;
    for (k, file) in files(folder).iter().enumerate() {
        match read_one(file) {
            Ok(one) if found.as_ref().is_none_or(|(_, f)| increments(f) < increments(&one)) => {
                found = Some((k, one));
            }
            Ok(_) => {}
            Err(why) => faults.push(why),
        }
    }
    found.ok_or_else(|| faults.join(", "))
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
    let (file, checkpoint) = newest_readable(folder).ok()?;
    let [first, second] = files(folder);
    let path = if file == 0 { first } else { second };
    Some((path, checkpoint.folder.record.increments))
}

fn read_one(file: &Path) -> Result<Checkpoint, String> {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let bytes = kanagata_files::read(file, kanagata_files::Input::Checkpoint)
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::strains::SheetStrain;
    use kanagata_solver::assembly::Body;
    use kanagata_solver::element::ElementKind;
    use kanagata_solver::material::elastic::Elastic;
    use kanagata_solver::sheet::hex_mesh::rectangle;
    use kanagata_solver::{Constraints, Limits, Simulation, SimulationSetup};

    /// The state of a block that nothing has moved.
    fn state() -> SimulationState {
        let mesh = rectangle(1.0, 1.0, 1.0, 1, 1, 1);
        let mut constraints = Constraints::none(mesh.nodes.len());
        (0..mesh.nodes.len()).for_each(|n| constraints.hold(n, 2));
        let material = Arc::new(Elastic { young: 210_000.0, poisson: 0.3 });
        let setup = SimulationSetup {
            body: Body::new(mesh, ElementKind::Hex8, material).unwrap(),
            constraints,
            loads: Vec::new(),
            tools: Vec::new(),
            stages: Vec::new(),
            limits: Limits::default(),
            share: 1.0,
        };
        Simulation::new(setup).unwrap().state()
    }

    /// A run folder after so many increments.
    fn run_folder(path: &Path, increments: usize) -> RunFolder {
        let record = serde_json::json!({"format": "kanagata-run", "version": 2, "program": "p", "name": "n",
            "verdict": "running", "increments": increments, "iterations": 0, "step_cuts": 0, "wall_s": 0.0,
            "cpu_s": 0.0, "peak_mb": 0.0, "timings_s": {}, "threads": 1, "unknowns": 3,
            "force_error": 0.0, "energy_error": 0.0, "penetration_mm": 0.0, "inputs": {}});
        let history = kanagata_report::record::History { tools: Vec::new(), rows: Vec::new() };
        serde_json::from_value(serde_json::json!({"path": path, "record": record, "history": history,
            "vtu_every": 1, "planes": [], "last_stage": null, "force_scale": 0.0,
            "iterations": [], "orders": [], "spent_s": [0.0, 0.0],
            "springback": crate::springback::Springback::default(), "scene_doubts": [], "farthest": []}))
        .unwrap()
    }

    #[test]
    fn the_next_checkpoint_replaces_the_older_or_the_broken_file() {
        let folder = tempfile::tempdir().unwrap();
        let (path, state) = (folder.path(), state());
        let save = |increments: usize, count: usize| {
            write(&run_folder(path, increments), &state, count).unwrap();
        };
        let name = |k: usize| path.join(format!("checkpoint-{k}.bin"));
        // Whether `newest` and `newest_readable` agree on file `k` with so many increments.
        let is_newest = |k: usize, increments: usize| {
            let (file, found) = newest_readable(path).unwrap();
            newest(path) == Some((name(k), increments))
                && (file, found.folder.record.increments) == (k, increments)
        };
        assert!(newest(path).is_none() && newest_readable(path).is_err());
        save(1, 0);
        save(2, 1);
        assert!(is_newest(1, 2));
        save(3, newest_readable(path).unwrap().0 + 1);
        assert!(is_newest(0, 3), "the older file was replaced");
        save(4, newest_readable(path).unwrap().0 + 1);
        assert!(is_newest(1, 4));
        // As many increments in both.
        save(4, newest_readable(path).unwrap().0 + 1);
        assert!(is_newest(0, 4));
        fs::write(name(0), "cut off").unwrap();
        assert!(is_newest(1, 4));
        save(5, newest_readable(path).unwrap().0 + 1);
        assert!(is_newest(0, 5));
    }

    /// Strain paths with numbers of all digits are the same bits after a restart.
    #[test]
    fn strain_paths_are_restored_bit_by_bit() {
        let folder = tempfile::tempdir().unwrap();
        let strain = |tensor: [f64; 3]| SheetStrain { tensor, ..SheetStrain::default() };
        let mut run = run_folder(folder.path(), 3);
        for k in 1..4 {
            let turn = (0.7 * f64::from(k)).sin() / 7.0;
            run.strain_paths.update(&[strain([turn, 0.1 / 3.0, -turn]), strain([0.0; 3])]);
        }
        write(&run, &state(), 0).unwrap();
        let (_, found) = newest_readable(folder.path()).unwrap();
        assert_eq!(found.folder.strain_paths, run.strain_paths);
        assert!(run.strain_paths.has_turned(0) && !run.strain_paths.has_turned(1));
    }
}
