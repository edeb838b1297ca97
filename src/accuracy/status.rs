//! State of a sequence of runs from the files of its folder.

use std::fmt::{self, Write as _};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;

use super::publish::RUNS;
use kanagata_files::{Input, read};
use kanagata_report::record::{AccuracyRecord, RunRecord};
use kanagata_run::lock;
use kanagata_run::status::{State, Status, status};

/// A run of a sequence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequenceRun {
    /// Its folder, within that of the sequence.
    pub folder: String,
    /// State of the run.
    pub state: State,
    /// Increments done.
    pub increment: usize,
    /// Unknowns of its sheet.
    pub unknowns: usize,
    /// Wall time until the last increment [s].
    pub wall_s: f64,
}

/// State of a sequence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequenceStatus {
    /// [`State::Running`] while a process holds the folder, [`State::Finished`] with its results there; otherwise the state of
    /// the last run, or [`State::Killed`] between two runs.
    pub state: State,
    /// The runs in the order of their last increments.
    pub runs: Vec<SequenceRun>,
    /// The estimated errors of a finished sequence.
    pub accuracy: Option<AccuracyRecord>,
    /// Folder of the last run.
    #[serde(skip)]
    pub last: PathBuf,
}

/// State of the sequence in `folder`; `None` if there is none.
#[must_use]
pub fn sequence_status(folder: &Path) -> Option<SequenceStatus> {
    let mut found: Vec<(SystemTime, PathBuf, Status, RunRecord)> = fs::read_dir(folder.join(RUNS))
        .ok()?
        .flatten()
        .filter_map(|entry| run_in(&entry.path()))
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let (_, last, last_status, _) = found.last()?;
    let accuracy = record_in(folder).and_then(|record| record.accuracy);
    let state = match lock::holder(&lock::file_in(folder)) {
        Ok(Some(holder)) if holder.is_alive() => State::Running,
        _ if accuracy.is_some() => State::Finished,
        // No run of it is being made, and there is no result.
        _ if last_status.state == State::Finished => State::Killed,
        _ => last_status.state,
    };
    let run = |(_, path, status, record): &(SystemTime, PathBuf, Status, RunRecord)| SequenceRun {
        folder: format!("{RUNS}/{}", path.file_name().unwrap_or_default().to_string_lossy()),
        state: status.state,
        increment: status.increment,
        unknowns: record.unknowns,
        wall_s: status.wall_s,
    };
    Some(SequenceStatus {
        state,
        runs: found.iter().map(run).collect(),
        accuracy: accuracy.filter(|_| state == State::Finished),
        last: last.clone(),
    })
}

/// Time of the last record, folder, state and record of a run.
fn run_in(folder: &Path) -> Option<(SystemTime, PathBuf, Status, RunRecord)> {
    let record = record_in(folder)?;
    let written = fs::metadata(folder.join("run.json")).and_then(|m| m.modified()).ok()?;
    Some((written, folder.to_path_buf(), status(folder).ok()?, record))
}

fn record_in(folder: &Path) -> Option<RunRecord> {
    RunRecord::parse(&read(&folder.join("run.json"), Input::Description).ok()?).ok()
}

impl fmt::Display for SequenceStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = String::from(match self.state {
            State::Running => "sequence of runs to an accuracy: running",
            State::Finished => "sequence of runs to an accuracy: finished",
            _ => {
                "sequence of runs to an accuracy: not finished; the command that began it continues it"
            }
        });
        for (k, run) in self.runs.iter().enumerate() {
            let state = match run.state {
                State::Running => "running",
                State::Finished => "done",
                State::NotConverged => "not converged",
                State::Stopped => "stopped",
                State::Killed => "killed",
                State::Elsewhere => "running at its last update",
            };
            let SequenceRun { folder, increment, unknowns, wall_s, .. } = run;
            let _ = write!(
                out,
                "\n  run {:<6} {folder}: {state}, {increment} increments, {unknowns} unknowns, {wall_s:.1} s",
                k + 1
            );
        }
        for q in self.accuracy.iter().flat_map(|record| &record.quantities) {
            let error = q.error.map_or_else(|| "not known".into(), |e| format!("+- {e:.4}"));
            let _ = write!(out, "\n  error      {} {:.4} {}, {error}", q.name, q.value, q.unit);
        }
        f.write_str(&out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::{QuantityRecord, Verdict};

    fn record(verdict: Verdict) -> RunRecord {
        RunRecord { name: "strip".into(), verdict, increments: 7, unknowns: 90, ..blank() }
    }

    fn blank() -> RunRecord {
        let text = r#"{"format": "kanagata-run", "version": 2, "program": "p", "name": "n",
            "verdict": "running", "increments": 0, "iterations": 0, "step_cuts": 0, "wall_s": 0.0,
            "cpu_s": 0.0, "peak_mb": 0.0, "timings_s": {}, "threads": 1, "unknowns": 3,
            "force_error": 0.0, "energy_error": 0.0, "penetration_mm": 0.0, "inputs": {}}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_sequence_is_not_finished_until_its_results_are_in_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(sequence_status(folder.path()), None);
        for (name, verdict) in [("a", Verdict::Doubtful), ("b", Verdict::Stopped)] {
            let run = folder.path().join(RUNS).join(name);
            fs::create_dir_all(&run).unwrap();
            record(verdict).write(&run.join("run.json")).unwrap();
            let written = fs::File::options().write(true).open(run.join("run.json")).unwrap();
            let late = if name == "b" { 10 } else { 20 };
            let then = SystemTime::now() - std::time::Duration::from_secs(late);
            written.set_modified(then).unwrap();
        }
        let found = sequence_status(folder.path()).unwrap();
        assert_eq!((found.state, found.runs.len()), (State::Stopped, 2));
        assert_eq!(found.runs[1].folder, "accuracy/b");
        let text = found.to_string();
        assert!(text.contains("continues it") && text.contains("accuracy/b: stopped, 7"), "{text}");

        let quantity = QuantityRecord {
            name: "thickness".into(),
            unit: "mm".into(),
            value: 0.9,
            error: Some(0.01),
            ..QuantityRecord::default()
        };
        let accuracy = AccuracyRecord { quantities: vec![quantity], ..AccuracyRecord::default() };
        let done = RunRecord { accuracy: Some(accuracy), ..record(Verdict::Completed) };
        done.write(&folder.path().join("run.json")).unwrap();
        let found = sequence_status(folder.path()).unwrap();
        assert_eq!(found.state, State::Finished);
        assert!(found.to_string().contains("thickness 0.9000 mm, +- 0.0100"), "{found}");
    }
}
