//! The run folder during a run.

mod files;
mod record;
mod steps;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use self::files::{COLLECTION, HISTORY, ITERATIONS, LastReport, ToolFile, first_files};
use super::advice::holder::Holder;
use super::build::{BUILD, cpu_class};
use super::contact_pressure;
use super::error::RunError;
use super::fields;
use super::first_record::first_record;
use super::formability::Judged;
use super::formed::Formed;
use super::necking::Necking;
use super::resources::{Clock, peak_megabytes, this_process};
use super::section::sections;
use super::sheet_checks::{check_sheet, record_inside_tools, record_necking};
use super::springback::Springback;
use super::strain_path::StrainPaths;
use super::strains::of_sheet;
use super::waves::Waves;
use kanagata_contact::ToolSurface;
use kanagata_files::{WriteError, remove_where, sweep};
use kanagata_geometry::Vec3;
use kanagata_report::doubt::Doubt;
use kanagata_report::record::{
    Energies, ExcludedPatchesRecord, History, HistoryRow, IterationRow, RunRecord, Verdict,
    write_iterations,
};
use kanagata_scene::Plan;
use kanagata_scene::types::{Section, SymmetryPlane};
use kanagata_solver::material::forming_limit::Diagram;
use kanagata_solver::{IncrementReport, Simulation};

/// A run folder and the data written to it.
#[derive(Serialize, Deserialize)]
pub struct RunFolder {
    /// The folder.
    pub path: PathBuf,
    /// Content of `run.json`.
    pub record: RunRecord,
    /// Content of `history.csv`.
    pub history: History,
    vtu_every: usize,
    planes: Vec<SymmetryPlane>,
    last_stage: Option<usize>,
    force_scale: f64,
    iterations: Vec<IterationRow>,
    /// Orders of convergence of the increments, ascending.
    orders: Vec<f64>,
    /// Wall and processor time of earlier processes of the run [s].
    spent_s: [f64; 2],
    /// The sheet in the last equilibrium with tools.
    pub(super) springback: Springback,
    /// Doubts about the scene.
    scene_doubts: Vec<Doubt>,
    /// Largest travel of each blank holder while a force drives it [mm].
    farthest: Vec<Option<f64>>,
    /// Blank holders of the scene.
    #[serde(skip)]
    holders: Vec<Holder>,
    /// State of the necking check.
    #[serde(default)]
    necking: Necking,
    /// Strain path of every element so far.
    #[serde(default)]
    pub(super) strain_paths: StrainPaths,
    /// Forming limit diagram of the blank.
    #[serde(skip)]
    diagram: Diagram,
    /// Surfaces of the tools.
    #[serde(skip)]
    surfaces: Vec<Arc<ToolSurface>>,
    /// The last file of each tool.
    #[serde(default)]
    tool_files: Vec<ToolFile>,
    #[serde(default)]
    last_report: Option<LastReport>,
    /// Offsets of waves at the last written step.
    #[serde(default)]
    waves: Waves,
}

/// Result files of a run beside `run.json`.
pub(super) const RESULT_FILES: [&str; 4] = [HISTORY, ITERATIONS, COLLECTION, "report.html"];

impl RunFolder {
    /// Creates the folder for the scene file `scene` and writes the first `run.json`.
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
        // Results of an earlier run are removed: they would be mistaken for this one's.
        for folder in ["steps", "tools"] {
            remove_where(&path.join(folder), |name| name.ends_with(".vtu"));
        }
        remove_where(path, |name| RESULT_FILES.contains(&name));
        let tools = plan.scene.tools.iter().map(|t| t.name.clone()).collect();
        let folder = Self {
            path: path.to_path_buf(),
            record: RunRecord { files: first_files(), ..first_record(plan, scene, unknowns) },
            history: History { tools, rows: Vec::new() },
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
            strain_paths: StrainPaths::default(),
            diagram: Diagram::default(),
            surfaces: Vec::new(),
            tool_files: Vec::new(),
            last_report: None,
            waves: Waves::default(),
        };
        folder.record.write(&path.join("run.json"))?;
        Ok(folder)
    }

    /// Continues in the folder of a restarted run.
    ///
    /// # Errors
    /// [`RunError::Folder`], [`RunError::Write`] when the folder cannot be written.
    pub fn resume(&mut self) -> Result<(), RunError> {
        make_folders(&self.path)?;
        // State and page of the interruption: with the next increment they are those of an earlier state.
        remove_where(&self.path.join("steps"), |name| name == "last.vtu");
        remove_where(&self.path, |name| name == "report.html");
        self.spent_s = [self.record.wall_s, self.record.cpu_s];
        self.record.threads = rayon::current_num_threads();
        self.record.verdict = Verdict::Running;
        self.record.message = None;
        self.record.process = this_process();
        append(&mut self.record.build, BUILD);
        append(&mut self.record.cpu, cpu_class());
        // Steps removed since then are dropped from the collection.
        let (path, files) = (&self.path, &mut self.record.files);
        files.steps.retain(|step| step.paths().all(|file| path.join(file).is_file()));
        files.last = None;
        self.write_collection()?;
        Ok(())
    }

    /// Records that the run stopped because a file could not be written, if `run.json` itself can be.
    pub fn record_write_error(&mut self, error: &RunError) {
        self.record.verdict = Verdict::Stopped;
        self.record.message = Some(error.to_string());
        // With a full disk this fails too; the error is also returned to the caller.
        let _ = self.record.write(&self.path.join("run.json"));
    }

    /// Records the excluded patches.
    pub fn set_excluded_patches(&mut self, what: impl Iterator<Item = ExcludedPatchesRecord>) {
        self.record.excluded_patches = what.collect();
    }

    /// Records a converged increment: a history row, updated records, and a VTU file if one is due.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn record_increment(
        &mut self,
        report: &IncrementReport<'_>,
        clock: &Clock,
    ) -> Result<(), WriteError> {
        if report.increment > 0 {
            self.history.rows.push(row(report));
            self.record_iterations(report.increment, report.history);
            self.record_convergence(report);
        }
        self.keep_report(report);
        self.update_record(report, clock);
        self.record_holder_lift(report);
        let (mesh, now) = (report.body.mesh(), report.displacements);
        let formed = Formed::of(report.body, now);
        let positions = fields::positions(mesh, now);
        self.record_pressures(report, &positions);
        self.record_holder_lost(report, &positions);
        self.record_sheet(report, &formed, &positions);
        let strains = of_sheet(mesh, now);
        if !report.free {
            self.strain_paths.update(&strains);
        }
        let judged = Judged::new(&self.diagram, strains);
        if !report.free {
            let found = judged.record(report.increment, mesh, &positions, &self.strain_paths);
            self.record.formability = found;
        }
        let due = self.vtu_every > 0 && report.increment.is_multiple_of(self.vtu_every);
        let first = self.last_stage.replace(report.stage).is_none();
        if first || due || report.ends_stage() {
            let limits = judged.cell_data();
            self.write_step(report, &formed, limits)?;
        }
        self.record.doubts = self.record.all_doubts(&self.scene_doubts);
        self.history.write(&self.path.join(HISTORY))?;
        write_iterations(&self.path.join(ITERATIONS), &self.iterations)?;
        self.record.write(&self.path.join("run.json"))
    }

    /// Records thickness, strains and faults of the sheet, with its nodes at `positions` [mm].
    fn record_sheet(&mut self, report: &IncrementReport<'_>, formed: &Formed, positions: &[Vec3]) {
        self.record.thickness = fields::thickness(report.body.mesh(), report.displacements);
        check_sheet(&mut self.record, report, positions, &self.planes);
        let necking = self.necking.update(report, positions);
        record_necking(&mut self.record, necking);
        self.record.strain = formed.record(report.body, positions);
    }

    /// Records nodes inside tools at the end of a stage.
    pub fn record_inside_tools(&mut self, simulation: &Simulation, stage: &str) {
        let thickness = simulation.body().mesh().mean_thickness();
        record_inside_tools(&mut self.record, simulation.inside(), stage, thickness);
    }

    /// Sets the blank holders of the scene.
    pub fn set_holders(&mut self, holders: &[Holder]) {
        self.holders = holders.to_vec();
    }

    /// Sets the forming limit diagram of the blank.
    pub fn set_diagram(&mut self, diagram: Diagram) {
        self.diagram = diagram;
    }

    /// Sets the doubts about the scene.
    pub fn set_scene_doubts(&mut self, doubts: Vec<Doubt>) {
        self.scene_doubts = doubts;
        self.record.doubts = self.record.all_doubts(&self.scene_doubts);
    }

    /// Records the increment that did not converge: its cost, and the iterations of the last attempt.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn record_failure(&mut self, simulation: &Simulation) -> Result<(), WriteError> {
        let done = simulation.summary();
        self.record.iterations = done.iterations;
        self.record.step_cuts = done.cuts;
        self.record.active_set_cycling = done.timings.cycling;
        self.record_iterations(done.increments + 1, simulation.last_attempt());
        write_iterations(&self.path.join(ITERATIONS), &self.iterations)
    }

    /// Records the sections of the sheet: in the last equilibrium with tools, and at the end if the tools were released.
    pub fn record_sections(&mut self, planes: &[Section], simulation: &Simulation) {
        let mesh = simulation.body().mesh();
        let now = fields::positions(mesh, simulation.displacements());
        let is_released = self.record.springback.is_some();
        let held =
            if is_released { fields::positions(mesh, self.springback.held()) } else { now.clone() };
        let released = is_released.then_some(&now[..]);
        self.record.sections = sections(mesh, planes, &held, released);
    }

    /// Writes the verdict. A completed run with doubts is doubtful.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn finish(
        &mut self,
        verdict: Verdict,
        message: Option<String>,
        clock: &Clock,
    ) -> Result<(), WriteError> {
        self.record.verdict = verdict;
        self.record.message = message;
        if verdict.is_complete() {
            self.record.tools_never_touched = self.history.untouched();
        }
        self.record.doubts = self.record.all_doubts(&self.scene_doubts);
        if verdict.is_complete() {
            self.record.verdict = self.record.completed_verdict();
        }
        self.record.wall_s = self.spent_s[0] + clock.wall_s();
        self.record.cpu_s = self.spent_s[1] + clock.cpu_s();
        self.record.peak_mb = self.record.peak_mb.max(peak_megabytes());
        self.record.write(&self.path.join("run.json"))
    }
}

/// Adds `now` to a list of builds or classes that computed parts of a run, if it is not the last of them.
fn append(list: &mut String, now: &str) {
    if !list.ends_with(now) {
        *list = if list.is_empty() { now.to_owned() } else { format!("{list} then {now}") };
    }
}

/// Creates the folders of a run and removes incomplete files from them.
fn make_folders(path: &Path) -> Result<(), RunError> {
    for folder in [path.to_path_buf(), path.join("steps"), path.join("tools")] {
        fs::create_dir_all(&folder)
            .map_err(|source| RunError::Folder { path: folder.clone(), source })?;
        sweep(&folder);
    }
    Ok(())
}

/// The history row of an increment.
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
        pressure_mpa: contact_pressure::of_report(report)
            .into_iter()
            .map(|found| found.map_or([0.0; 2], |p| [p.mean_mpa, p.max_mpa]))
            .collect(),
        contacts: [report.contacts, report.slipping],
        energy: Energies { external: e.external, internal: e.internal, friction: e.friction },
    }
}
