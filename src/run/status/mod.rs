//! Status of a run from the files of its folder: running, ended or killed.

mod text;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;

use super::checkpoint;
use super::lock;
use super::progress_line::line;
use super::resources;
use super::restart::Restart;
use kanagata_report::doubt::Doubt;
use kanagata_report::record::{
    History, HistoryRow, LimitMarginRecord, QualityVerdict, RunRecord, ThinningRecord, Verdict,
};

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
    /// Its process is running; on another host, it holds the folder and has a heartbeat.
    Running,
    /// All stages are done.
    Finished,
    /// The solver did not converge.
    NotConverged,
    /// Stopped by a signal.
    Stopped,
    /// Its process has ended without a verdict; on another host, it has lost the folder or has had no heartbeat for 5
    /// minutes.
    Killed,
    /// No verdict, and neither the process nor its heartbeat can be checked from here.
    Elsewhere,
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
    /// Name of the other host of a run without verdict.
    pub host: Option<String>,
    /// Age of the last heartbeat of a run on another host, by the clock of the file server [s].
    pub heartbeat_s: Option<f64>,
    /// The solver's message if the run ended early.
    pub message: Option<String>,
    /// Doubts so far.
    pub doubts: Vec<Doubt>,
    /// Element with the largest thinning in the last equilibrium with tools.
    pub thinning: Option<ThinningRecord>,
    /// Element with the smallest margin to the forming limit; `None` without a limit.
    pub margin: Option<LimitMarginRecord>,
    /// Verdict on the quality of the part so far.
    pub quality: Option<QualityVerdict>,
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
    let text = kanagata_files::read(&path, kanagata_files::Input::Description)
        .map_err(|source| StatusError::Io { path: path.clone(), source })?;
    let record: RunRecord = RunRecord::parse(&text)
        .map_err(|found| StatusError::Invalid { path: path.clone(), found })?;
    let history = read_history(folder, record.increments)?;
    let Found { state, host, heartbeat_s } = find(&record, folder);
    let last = history.rows.last();
    let time = last.map_or(0.0, |row| row.time);
    let checkpoint = newest_checkpoint(folder);
    let restart = checkpoint.is_some().then(|| restart_of_ended(&record, state, folder)).flatten();
    Ok(Status {
        folder: folder.display().to_string(),
        name: record.name.clone(),
        state,
        host,
        heartbeat_s,
        message: record.message.clone(),
        doubts: record.doubts.clone(),
        thinning: record.formability.as_ref().map(|f| f.thinning),
        margin: record.formability.as_ref().and_then(|f| f.margin),
        quality: record.quality_verdict(),
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

/// State of a run and of its process on another host.
struct Found {
    state: State,
    host: Option<String>,
    heartbeat_s: Option<f64>,
}

/// The state of the run in a folder, from its verdict, its process, and the lock of the folder.
fn find(record: &RunRecord, folder: &Path) -> Found {
    let here = |state| Found { state, host: None, heartbeat_s: None };
    match record.verdict {
        Verdict::Completed | Verdict::Doubtful => here(State::Finished),
        Verdict::NotConverged => here(State::NotConverged),
        Verdict::Stopped => here(State::Stopped),
        Verdict::Running => match record.process.as_ref().map(resources::alive) {
            Some(Some(true)) => here(State::Running),
            Some(Some(false)) => here(State::Killed),
            None | Some(None) => find_elsewhere(record, folder),
        },
    }
}

/// The state of a run whose process cannot be looked up on this host, from the lock of its folder.
fn find_elsewhere(record: &RunRecord, folder: &Path) -> Found {
    let process = record.process.as_ref();
    let host = process.and_then(lock::host_name).map(str::to_owned);
    let (state, heartbeat) = match lock::holder(&lock::file_in(folder)) {
        Err(_) => (State::Elsewhere, None),
        Ok(None) if process.is_none() => (State::Elsewhere, None),
        Ok(None) => (State::Killed, None),
        Ok(Some(holder)) if process.is_some() && holder.process.as_ref() != process => {
            (State::Killed, None)
        }
        Ok(Some(holder)) => {
            let state = if holder.is_alive() { State::Running } else { State::Elsewhere };
            (state, holder.heartbeat())
        }
    };
    Found { state, host, heartbeat_s: heartbeat.map(|age| age.as_secs_f64()) }
}

/// The history up to the last increment of `run.json`; rows after it belong to an earlier run.
fn read_history(folder: &Path, increments: usize) -> Result<History, StatusError> {
    let path = folder.join("history.csv");
    let Ok(text) = kanagata_files::read_text(&path, kanagata_files::Input::Table) else {
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
    use kanagata_report::record::Process;
    use kanagata_report::record::Quality;

    fn record() -> RunRecord {
        let text = r#"{"format": "kanagata-run", "version": 2, "program": "p", "name": "n",
            "verdict": "running", "increments": 0, "iterations": 0, "step_cuts": 0, "wall_s": 0.0,
            "cpu_s": 0.0, "peak_mb": 0.0, "timings_s": {}, "threads": 1, "unknowns": 3,
            "force_error": 0.0, "energy_error": 0.0, "penetration_mm": 0.0, "inputs": {}}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_record_without_verdict_is_of_a_process_that_lives_or_not() {
        let folder = tempfile::tempdir().unwrap();
        let state = |r: &RunRecord| find(r, folder.path()).state;
        let mut r = record();
        assert_eq!(state(&r), State::Elsewhere);
        r.process = resources::this_process();
        if let Some(process) = r.process.clone() {
            assert_eq!(state(&r), State::Running);
            // The same process id, reused by a later process.
            r.process = Some(Process { started: process.started + 1, ..process });
            assert_eq!(state(&r), State::Killed);
        }
        r.verdict = Verdict::NotConverged;
        assert_eq!(state(&r), State::NotConverged);
    }

    #[test]
    fn a_run_on_another_host_is_judged_from_its_lock() {
        let folder = tempfile::tempdir().unwrap();
        let there = Process { id: 7, started: 1, host: "there 0-0 pid:[1]".into() };
        let mut r = record();
        r.process = Some(there.clone());
        r.write(&folder.path().join("run.json")).unwrap();
        assert_eq!(status(folder.path()).unwrap().state, State::Killed, "no lock");
        let path = lock::file_in(folder.path());
        let locked_by = |process: &Process, age_s: u64| {
            std::fs::write(&path, serde_json::to_vec(process).unwrap()).unwrap();
            let file = std::fs::File::options().write(true).open(&path).unwrap();
            file.set_modified(SystemTime::now() - std::time::Duration::from_secs(age_s)).unwrap();
            status(folder.path()).unwrap()
        };
        let running = locked_by(&there, 105);
        assert_eq!((running.state, running.host.as_deref()), (State::Running, Some("there")));
        assert!(running.heartbeat_s.unwrap() >= 100.0);
        let text = running.to_string();
        assert!(text.contains(": running on there (last heartbeat 1:4"), "{text}");
        let killed = locked_by(&there, 400);
        assert_eq!(killed.state, State::Killed);
        let text = killed.to_string();
        assert!(text.contains(": killed: its process on there has ended"), "{text}");
        let other = Process { id: 8, ..there.clone() };
        assert_eq!(locked_by(&other, 1).state, State::Killed);
        // A process without heartbeat.
        let old = Process { host: "there 0-0".into(), ..there };
        r.process = Some(old.clone());
        r.write(&folder.path().join("run.json")).unwrap();
        let unknown = locked_by(&old, 400);
        assert_eq!(unknown.state, State::Elsewhere);
        assert!(unknown.to_string().contains("its process on there cannot be checked"));
    }

    #[test]
    fn the_formability_so_far_is_in_the_status() {
        let folder = tempfile::tempdir().unwrap();
        let mut r = record();
        let place = serde_json::json!({"percent": 12.5, "element": 3, "at_mm": [1.0, 2.0, 3.0]});
        let formability = serde_json::json!({
            "increment": 3, "area_mm2": 1.0, "thinning": place, "thickening": place,
            "margin": {"margin": 0.25, "major": 0.3, "minor": 0.0, "limit_major": 0.4,
                "element": 3, "at_mm": [1.0, 2.0, 3.0], "turned": false},
            "zones": {"insufficient_stretch": 1.0, "wrinkling_tendency": 0.0, "thickening": 0.0,
                "strong_wrinkling": 0.0},
            "turned_paths": {"angle_deg": 30.0, "elements": 0, "share": 0.0, "largest_deg": 0.0}
        });
        r.formability = Some(serde_json::from_value(formability).unwrap());
        r.quality = Some(Quality { max_thinning: Some(0.1), ..Quality::default() });
        r.write(&folder.path().join("run.json")).unwrap();
        let text = status(folder.path()).unwrap().to_string();
        for line in [
            "\n  thinning   12.5 % at (1.0, 2.0, 3.0) mm",
            "\n  margin     0.25 at (1.0, 2.0, 3.0) mm",
            "\n  quality    a limit of quality is exceeded",
        ] {
            assert!(text.contains(line), "{text}");
        }
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
            pressure_mpa: Vec::new(),
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
