//! A scene becomes a run folder: `history.csv`, `run.json`, `run.pvd`, `steps/*.vtu`, `report.html`.
//!
//! Everything is written as the run goes on, each file whole or not at all, so that a folder can be looked at
//! (and a killed run still holds what it had).

pub mod fields;
pub mod folder;
pub mod report;
pub mod resources;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::files::WriteError;
use crate::report::record::{RunRecord, Verdict};
use crate::scene::{Plan, SceneError};
use crate::solver::{Control, IncrementReport, Simulation, SimulationError};

use folder::RunFolder;

/// Why a run ends early.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene cannot be set up.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of the run folder cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The run folder cannot be made.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The solver cannot start or gave up.
    #[error("{cause}\n  the last good state is in {}", folder.display())]
    Solver {
        /// What the solver said.
        cause: Box<SimulationError>,
        /// The run folder.
        folder: PathBuf,
    },
}

/// What somebody watching a run is told after every increment.
pub struct Progress<'a> {
    /// The increment.
    pub report: &'a IncrementReport<'a>,
    /// Stages done plus the share of the one under way, over all stages: 0 to 1.
    pub done: f64,
    /// Wall time since the start [s].
    pub elapsed_s: f64,
}

/// Runs `plan` (read from `scene_path`) into the folder `output`. `watch` is called after every increment.
///
/// # Errors
/// [`RunError`]; what was computed until then is in the folder.
pub fn run(
    plan: &Plan,
    scene_path: &Path,
    output: &Path,
    watch: &mut dyn FnMut(&Progress<'_>),
) -> Result<RunRecord, RunError> {
    let start = Instant::now();
    let setup = plan.simulation_setup(scene_path)?;
    let unknowns = 3 * setup.body.mesh().nodes.len();
    let mut folder = RunFolder::create(output, plan, unknowns)?;
    let failed = |cause: SimulationError| RunError::Solver {
        cause: Box::new(cause),
        folder: output.to_path_buf(),
    };
    let mut simulation = Simulation::new(setup).map_err(failed)?;
    folder.write_tools(plan, &simulation)?;
    let mut write_error = None;
    let stages = plan.scene.stages.len() as f64;
    let mesh = simulation.body().mesh().clone();
    let outcome = simulation.run(&mut |report| {
        let done = (report.stage as f64 + report.share) / stages;
        watch(&Progress { report, done, elapsed_s: start.elapsed().as_secs_f64() });
        match folder.take(report, &mesh, start) {
            Ok(()) => Control::Continue,
            Err(error) => {
                write_error = Some(error);
                Control::Stop
            }
        }
    });
    if let Some(error) = write_error {
        return Err(error.into());
    }
    folder.write_last_state(&simulation)?;
    let verdict = if outcome.is_ok() { Verdict::Completed } else { Verdict::NoConvergence };
    folder.finish(verdict, outcome.as_ref().err().map(ToString::to_string), start)?;
    report::write(&folder, plan, &simulation)?;
    match outcome {
        Ok(_) => Ok(folder.record),
        Err(cause) => Err(failed(cause)),
    }
}
