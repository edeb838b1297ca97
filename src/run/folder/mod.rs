//! The run folder while it grows.

mod record;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::advice::holder::Holder;
use super::error::RunError;
use super::fields;
use super::first_record::first_record;
use super::formed::Formed;
use super::necking::Necking;
use super::resources::{cpu_seconds, peak_megabytes, this_process};
use super::springback::Springback;
use crate::files::{WriteError, remove_where, sweep};
use crate::report::doubt::Doubt;
use crate::report::record::{
    Energies, ExcludedPatchesRecord, History, HistoryRow, IterationRow, RunRecord, Verdict,
    write_iterations,
};
use crate::report::{DataArray, write_pvd};
use crate::scene::Plan;
use crate::scene::types::SymmetryPlane;
use crate::solver::{IncrementReport, Simulation};

/// Divisions of a patch in the tool's picture.
const TOOL_DIVISIONS: usize = 6;

/// A run folder and what has been put into it.
#[derive(Serialize, Deserialize)]
pub struct RunFolder {
    /// The folder.
    pub path: PathBuf,
    /// `run.json` as it stands.
    pub record: RunRecord,
    /// `history.csv` as it stands.
    pub history: History,
    steps: Vec<(f64, String)>,
    vtu_every: usize,
    planes: Vec<SymmetryPlane>,
    last_stage: Option<usize>,
    force_scale: f64,
    iterations: Vec<IterationRow>,
    /// Orders of convergence shown so far, ascending.
    orders: Vec<f64>,
    /// Wall and processor time of the processes before this one [s].
    spent_s: [f64; 2],
    /// The sheet as its tools last held it.
    pub(super) springback: Springback,
    /// Doubts about the scene.
    scene_doubts: Vec<Doubt>,
    /// Farthest travel of each tool while a force drove it as a blank holder [mm].
    farthest: Vec<Option<f64>>,
    /// Blank holders: the tool, and the stages in which a force drives it.
    #[serde(skip)]
    holders: Vec<(usize, Vec<bool>)>,
    /// Thinning so far.
    #[serde(default)]
    necking: Necking,
}

/// Files beside `run.json` that tell of one run.
pub(super) const RESULTS: [&str; 4] = ["history.csv", "iterations.csv", "run.pvd", "report.html"];

impl RunFolder {
    /// Makes the folder for the scene file `scene` and writes the first `run.json`.
    ///
    /// # Errors
    /// [`RunError::Folder`], [`RunError::Write`].
    pub fn create(
        path: &Path,
        plan: &Plan,
        scene: &Path,
        unknowns: usize,
    ) -> Result<Self, RunError> {
        make_folders(path)?;
        // What an earlier run left would pass for this one's.
        for folder in ["steps", "tools"] {
            remove_where(&path.join(folder), |name| name.ends_with(".vtu"));
        }
        remove_where(path, |name| RESULTS.contains(&name));
        let tools = plan.scene.tools.iter().map(|t| t.name.clone()).collect();
        let folder = Self {
            path: path.to_path_buf(),
            record: first_record(plan, scene, unknowns),
            history: History { tools, rows: Vec::new() },
            steps: Vec::new(),
            vtu_every: plan.scene.output.vtu_every,
            planes: plan.scene.symmetry.clone(),
            last_stage: None,
            force_scale: 0.0,
            iterations: Vec::new(),
            orders: Vec::new(),
            spent_s: [0.0; 2],
            springback: Springback::default(),
            scene_doubts: Vec::new(),
            farthest: vec![None; plan.scene.tools.len()],
            holders: Vec::new(),
            necking: Necking::default(),
        };
        folder.record.write(&path.join("run.json"))?;
        Ok(folder)
    }

    /// Takes up the folder of a run that goes on.
    ///
    /// # Errors
    /// [`RunError::Folder`], [`RunError::Write`] where it cannot be written to.
    pub fn resume(&mut self) -> Result<(), RunError> {
        make_folders(&self.path)?;
        self.spent_s = [self.record.wall_s, self.record.cpu_s];
        self.record.threads = rayon::current_num_threads();
        self.record.verdict = Verdict::Running;
        self.record.message = None;
        self.record.process = this_process();
        // What was removed meanwhile cannot be shown.
        let (path, steps) = (&self.path, &mut self.steps);
        steps.retain(|(_, name)| path.join(name).is_file());
        write_pvd(&path.join("run.pvd"), steps)?;
        Ok(())
    }

    /// Notes that the run stopped at a file that could not be written, as far as `run.json` itself can be.
    pub fn stopped_by(&mut self, error: &RunError) {
        self.record.verdict = Verdict::Stopped;
        self.record.message = Some(error.to_string());
        // With a full disk nothing can be noted; the error is on the terminal.
        let _ = self.record.write(&self.path.join("run.json"));
    }

    /// Notes what was left out.
    pub fn left_out(&mut self, what: impl Iterator<Item = ExcludedPatchesRecord>) {
        self.record.excluded_patches = what.collect();
    }

    /// Writes each tool, placed, as `tools/NAME.vtu`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write_tools(&self, plan: &Plan, simulation: &Simulation) -> Result<(), WriteError> {
        let shifts = simulation.tool_shifts();
        for ((tool, loaded), shift) in plan.scene.tools.iter().zip(&plan.tools).zip(&shifts) {
            let path = self.path.join("tools").join(format!("{}.vtu", tool.name));
            fields::tool(loaded.surface.model(), TOOL_DIVISIONS, shift).write(&path)?;
        }
        Ok(())
    }

    /// Takes a converged increment: a line of history, now and then a VTU, the records brought up to date.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn take(&mut self, report: &IncrementReport<'_>, start: Instant) -> Result<(), WriteError> {
        if report.increment > 0 {
            self.history.rows.push(row(report));
            self.take_iterations(report.increment, report.history);
            self.take_convergence(report);
        }
        self.update_record(report, start);
        self.look_at_holders(report);
        let (mesh, now) = (report.body.mesh(), report.displacements);
        let formed = Formed::of(report.body, now);
        self.record.thickness = fields::thickness(mesh, now);
        let positions = fields::positions(mesh, now);
        self.record.look_at(report, &positions, &self.planes);
        let necking = self.necking.take(report, &positions);
        self.record.take_necking(necking);
        self.record.strain = formed.record(report.body, &positions);
        let stage_end = report.ends_stage();
        let due = self.vtu_every > 0 && report.increment.is_multiple_of(self.vtu_every);
        let first = self.last_stage.is_none();
        self.last_stage = Some(report.stage);
        if first || due || stage_end {
            let name = format!("steps/{:06}.vtu", report.increment);
            fields::sheet(mesh, now, report.contact_forces, &formed)
                .write(&self.path.join(&name))?;
            if self.steps.last().is_none_or(|(_, last)| *last != name) {
                self.steps.push((report.time, name));
            }
            write_pvd(&self.path.join("run.pvd"), &self.steps)?;
        }
        self.record.doubts = self.record.judged(&self.scene_doubts);
        self.history.write(&self.path.join("history.csv"))?;
        write_iterations(&self.path.join("iterations.csv"), &self.iterations)?;
        self.record.write(&self.path.join("run.json"))
    }

    /// Notes where the sheet is inside tools at the end of a stage.
    pub fn look_into_tools(&mut self, simulation: &Simulation, stage: &str) {
        let thickness = simulation.body().mesh().mean_thickness();
        self.record.look_into_tools(simulation.inside(), stage, thickness);
    }

    /// Takes the blank holders of the scene.
    pub fn watch_holders(&mut self, holders: &[Holder]) {
        self.holders = holders.iter().map(|h| (h.tool, h.forced.clone())).collect();
    }

    /// Takes the doubts about the scene.
    pub fn doubt_scene(&mut self, doubts: Vec<Doubt>) {
        self.scene_doubts = doubts;
        self.record.doubts = self.record.judged(&self.scene_doubts);
    }

    /// Takes the increment that the solver gave up: what it cost, and the iterations of its last attempt.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn take_failure(&mut self, simulation: &Simulation) -> Result<(), WriteError> {
        let done = simulation.summary();
        self.record.iterations = done.iterations;
        self.record.step_cuts = done.cuts;
        self.record.active_set_cycling = done.timings.cycling;
        self.take_iterations(done.increments + 1, simulation.last_attempt());
        write_iterations(&self.path.join("iterations.csv"), &self.iterations)
    }

    /// Writes the state the simulation stands at as `steps/last.vtu`, with a mark at `node`: where the solver gave up.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write_last_state(
        &self,
        simulation: &Simulation,
        node: Option<usize>,
    ) -> Result<(), WriteError> {
        let mesh = simulation.body().mesh();
        let forces = simulation.contact_forces();
        let now = simulation.displacements();
        let mut grid = fields::sheet(mesh, now, &forces, &Formed::of(simulation.body(), now));
        if let Some(worst) = node {
            let mark = |node: usize| if node == worst { 1.0 } else { 0.0 };
            let marks = (0..mesh.nodes.len()).map(mark).collect();
            grid.point_data.push(DataArray::scalar("gave_up_here", marks));
        }
        grid.write(&self.path.join("steps/last.vtu"))
    }

    /// Writes the verdict; a completed run with doubts is doubtful.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn finish(
        &mut self,
        verdict: Verdict,
        message: Option<String>,
        start: Instant,
    ) -> Result<(), WriteError> {
        self.record.verdict = verdict;
        self.record.message = message;
        if verdict.is_complete() {
            self.record.tools_never_touched = self.history.untouched();
        }
        self.record.doubts = self.record.judged(&self.scene_doubts);
        if verdict.is_complete() {
            self.record.verdict = self.record.completed_verdict();
        }
        self.record.wall_s = self.spent_s[0] + start.elapsed().as_secs_f64();
        self.record.cpu_s = self.spent_s[1] + cpu_seconds();
        self.record.peak_mb = self.record.peak_mb.max(peak_megabytes());
        self.record.write(&self.path.join("run.json"))
    }
}

/// Makes the folders of a run where they are missing, and clears them of files half written.
fn make_folders(path: &Path) -> Result<(), RunError> {
    for folder in [path.to_path_buf(), path.join("steps"), path.join("tools")] {
        fs::create_dir_all(&folder)
            .map_err(|source| RunError::Folder { path: folder.clone(), source })?;
        sweep(&folder);
    }
    Ok(())
}

/// The line of history of an increment.
#[must_use]
pub fn row(report: &IncrementReport<'_>) -> HistoryRow {
    let e = &report.energies;
    HistoryRow {
        increment: report.increment,
        stage: report.stage_name.to_owned(),
        time: report.time,
        travel_mm: report.tools.iter().map(|t| t.travel).collect(),
        force_n: report.tools.iter().map(|t| t.force).collect(),
        iterations: report.iterations,
        contacts: [report.contacts, report.slipping],
        energy: Energies { external: e.external, internal: e.internal, friction: e.friction },
    }
}
