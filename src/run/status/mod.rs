//! Status of a run from the files of its folder: running, ended or killed.

mod text;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;

use super::checkpoint;
use super::progress_line::line;
use super::resources;
use super::restart::Restart;
use crate::report::doubt::Doubt;
use crate::report::record::{History, HistoryRow, RunRecord, Verdict};

/// Why a status cannot be read.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum StatusError {
    /// `run.json` is missing or cannot be read.
    #[error("cannot read {}: {source}; allowed: the folder of a run", path.display())]
    Io {
        /// `run.json`.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// A file of the folder was not written by a run.
    #[error("{}: found {found}; allowed: a file as this program writes it", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
}

/// State of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Its process is running.
    Running,
    /// All stages are done.
    Finished,
    /// The solver did not converge.
    NotConverged,
    /// Stopped by a signal.
    Stopped,
    /// Its process has ended without a verdict.
    Killed,
    /// No verdict, and the process cannot be looked up (another host, no `/proc`).
    Elsewhere,
}

impl State {
    fn text(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Finished => "finished",
            Self::NotConverged => "not converged",
            Self::Stopped => "stopped",
            Self::Killed => "killed: its process is gone",
            Self::Elsewhere => {
                "running at its last update; its process cannot be checked from here"
            }
        }
    }
}

/// A tool after the last increment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolStatus {
    /// Name.
    pub name: String,
    /// Travel along its direction [mm].
    pub travel_mm: f64,
    /// Force on the sheet along its direction, of the whole process [N].
    pub force_n: f64,
}

/// The newest complete checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckpointStatus {
    /// File name.
    pub file: String,
    /// Increment after which it was written.
    pub increment: usize,
    /// Age [s].
    pub age_s: f64,
}

/// Status of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    /// The folder.
    pub folder: String,
    /// Name of the scene.
    pub name: String,
    /// State of the run.
    pub state: State,
    /// The solver's message if the run ended early.
    pub message: Option<String>,
    /// Doubts so far.
    pub doubts: Vec<Doubt>,
    /// Increments done.
    pub increment: usize,
    /// Stage of the last increment.
    pub stage: Option<String>,
    /// Process time: completed stages plus the completed fraction of the current stage.
    pub time: f64,
    /// Number of stages; 0 if unknown.
    pub stages: usize,
    /// Newton iterations, including those of increments that were cut.
    pub iterations: usize,
    /// Step cuts.
    pub cuts: usize,
    /// Number of nodes in contact, and number of these that slip.
    pub contacts: [usize; 2],
    /// Tools after the last increment.
    pub tools: Vec<ToolStatus>,
    /// Wall time at the last increment [s].
    pub wall_s: f64,
    /// Estimated wall time left, in proportion to the process time done [s]; of a running process only.
    pub left_s: Option<f64>,
    /// Age of `run.json` [s].
    pub updated_s: f64,
    /// The last history row as printed by `run --lines`.
    pub last_line: Option<String>,
    /// The checkpoint from which a restart would continue.
    pub checkpoint: Option<CheckpointStatus>,
    /// How to continue; `None` if nothing is left to do or there is no checkpoint.
    #[serde(skip)]
    pub restart: Option<Restart>,
}

/// Reads the status from a run folder.
///
/// # Errors
/// [`StatusError`] when there is no `run.json`, or a file was not written by this program.
pub fn status(folder: &Path) -> Result<Status, StatusError> {
    let path = folder.join("run.json");
    let text = crate::files::read(&path, crate::files::Input::Description)
        .map_err(|source| StatusError::Io { path: path.clone(), source })?;
    let record: RunRecord = RunRecord::parse(&text)
        .map_err(|found| StatusError::Invalid { path: path.clone(), found })?;
    let history = read_history(folder, record.increments)?;
    let state = state(&record);
    let last = history.rows.last();
    let time = last.map_or(0.0, |row| row.time);
    let checkpoint = newest_checkpoint(folder);
    let restart = checkpoint.is_some().then(|| restart_of_ended(&record, state, folder)).flatten();
    Ok(Status {
        folder: folder.display().to_string(),
        name: record.name.clone(),
        state,
        message: record.message.clone(),
        doubts: record.doubts.clone(),
        increment: record.increments,
        stage: last.map(|row| row.stage.clone()),
        time,
        stages: record.stages,
        iterations: record.iterations,
        cuts: record.step_cuts,
        contacts: last.map_or([0; 2], |row| row.contacts),
        tools: last.map_or_else(Vec::new, |row| tools(&history.tools, row)),
        wall_s: record.wall_s,
        left_s: time_left(&record, state, time),
        updated_s: age(&path),
        last_line: last.map(|row| line(&history.tools, row)),
        checkpoint,
        restart,
    })
}

/// Estimated wall time left of a running process with the process time `time` [s].
fn time_left(record: &RunRecord, state: State, time: f64) -> Option<f64> {
    let running = matches!(state, State::Running | State::Elsewhere);
    (running && time > 0.0 && record.stages > 0)
        .then(|| record.wall_s * (record.stages as f64 - time).max(0.0) / time)
}

/// How to continue a stopped or killed run, if its scene is known.
fn restart_of_ended(record: &RunRecord, state: State, folder: &Path) -> Option<Restart> {
    let scene = record.scene.as_ref()?;
    let ended = matches!(state, State::Stopped | State::Killed);
    ended.then(|| Restart::of(record, scene.as_ref(), folder))
}

fn state(record: &RunRecord) -> State {
    match (record.verdict, &record.process) {
        (Verdict::Completed | Verdict::Doubtful, _) => State::Finished,
        (Verdict::NotConverged, _) => State::NotConverged,
        (Verdict::Stopped, _) => State::Stopped,
        (Verdict::Running, None) => State::Elsewhere,
        (Verdict::Running, Some(process)) => match resources::alive(process) {
            Some(true) => State::Running,
            Some(false) => State::Killed,
            None => State::Elsewhere,
        },
    }
}

/// The history up to the last increment of `run.json`; rows after it belong to an earlier run.
fn read_history(folder: &Path, increments: usize) -> Result<History, StatusError> {
    let path = folder.join("history.csv");
    let Ok(text) = crate::files::read_text(&path, crate::files::Input::Table) else {
        return Ok(History::default());
    };
    let mut history = History::parse(&text)
        .map_err(|found| StatusError::Invalid { path: path.clone(), found })?;
    // The history is written just before run.json and may be one row ahead.
    history.rows.retain(|row| row.increment <= increments.saturating_add(1));
    Ok(history)
}

fn tools(names: &[String], row: &HistoryRow) -> Vec<ToolStatus> {
    let numbers = row.travel_mm.iter().zip(&row.force_n);
    let of = |(name, (&travel_mm, &force_n)): (&String, (&f64, &f64))| ToolStatus {
        name: name.clone(),
        travel_mm,
        force_n,
    };
    names.iter().zip(numbers).map(of).collect()
}

fn newest_checkpoint(folder: &Path) -> Option<CheckpointStatus> {
    let (path, increment) = checkpoint::newest(folder)?;
    let file = path.file_name()?.to_string_lossy().into_owned();
    Some(CheckpointStatus { file, increment, age_s: age(&path) })
}

/// Age of a file [s]; 0 if the system does not report it.
fn age(path: &Path) -> f64 {
    let written = std::fs::metadata(path).and_then(|m| m.modified()).ok();
    let past = written.and_then(|at| SystemTime::now().duration_since(at).ok());
    past.map_or(0.0, |d| d.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::record::Process;

    fn record() -> RunRecord {
        let text = r#"{"format": "kanagata-run", "version": 2, "program": "p", "name": "n",
            "verdict": "running", "increments": 0, "iterations": 0, "step_cuts": 0, "wall_s": 0.0,
            "cpu_s": 0.0, "peak_mb": 0.0, "timings_s": {}, "threads": 1, "unknowns": 3,
            "force_error": 0.0, "energy_error": 0.0, "penetration_mm": 0.0, "inputs": {}}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_record_without_verdict_is_of_a_process_that_lives_or_not() {
        let mut r = record();
        assert_eq!(state(&r), State::Elsewhere);
        r.process = resources::this_process();
        if let Some(process) = r.process.clone() {
            assert_eq!(state(&r), State::Running);
            // The same process id, reused by a later process.
            r.process = Some(Process { started: process.started + 1, ..process.clone() });
            assert_eq!(state(&r), State::Killed);
            r.process = Some(Process { host: "elsewhere".into(), ..process });
            assert_eq!(state(&r), State::Elsewhere);
        }
        r.verdict = Verdict::NotConverged;
        assert_eq!(state(&r), State::NotConverged);
    }

    #[test]
    fn a_folder_tells_its_last_increment_and_no_line_of_the_run_before() {
        let folder = tempfile::tempdir().unwrap();
        let missing = status(folder.path()).unwrap_err().to_string();
        assert!(missing.contains("run.json") && missing.contains("allowed"), "{missing}");
        let mut r = record();
        (r.increments, r.wall_s, r.stages) = (1, 30.0, 2);
        (r.verdict, r.scene) = (Verdict::Stopped, Some("/a b/x.json".into()));
        r.write(&folder.path().join("run.json")).unwrap();
        let row = |increment: usize| HistoryRow {
            increment,
            stage: "clamp, then draw".into(),
            time: 0.5 * increment as f64,
            travel_mm: vec![2.5],
            force_n: vec![-100.0],
            iterations: 4,
            contacts: [7, 2],
            energy: Default::default(),
        };
        let rows = [1, 2, 3].map(row).to_vec();
        let history = History { tools: vec!["die".into()], rows };
        history.write(&folder.path().join("history.csv")).unwrap();
        let found = status(folder.path()).unwrap();
        assert_eq!((found.state, found.time, found.left_s), (State::Stopped, 1.0, None));
        assert_eq!(found.stage.as_deref(), Some("clamp, then draw"));
        assert_eq!(
            found.tools,
            [ToolStatus { name: "die".into(), travel_mm: 2.5, force_n: -100.0 }]
        );
        assert_eq!((found.checkpoint, found.restart), (None, None));
        std::fs::write(folder.path().join("history.csv"), "increment,stage\n1,2,3\n").unwrap();
        assert!(matches!(status(folder.path()), Err(StatusError::Invalid { .. })));
    }
}
