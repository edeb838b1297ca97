//! Runs a scene into a run folder: `history.csv`, `run.json`, `run.pvd`, `steps/*.vtu`, `report.html`.
//!
//! Files are written during the run, each completely or not at all: a folder is readable at any time, and a killed run
//! keeps its results. `report.html` needs the feature `pages`.

pub mod advice;
pub mod build;
pub mod checkpoint;
mod contact_fields;
pub mod contact_pressure;
pub mod cost;
pub mod draw_in;
mod earlier_run;
mod error;
pub mod fields;
mod first_record;
pub mod folder;
pub mod formability;
pub mod formed;
pub mod friction_shear;
pub mod holding;
pub mod hourglassing;
mod inputs;
pub mod lock;
pub mod necking;
mod options;
pub mod progress_line;
pub mod propose;
#[cfg(feature = "pages")]
pub mod report;
pub mod resources;
pub mod restart;
pub mod section;
pub mod self_contact;
mod sheet_checks;
pub mod springback;
pub mod status;
mod strain_path;
pub mod strains;
mod tensor_fields;
pub mod waves;

use std::path::Path;

use kanagata_cancel::Section;
use kanagata_report::record::{ExcludedPatchesRecord, RunRecord, Verdict};
use kanagata_scene::Plan;
use kanagata_solver::material::forming_limit::Diagram;
use kanagata_solver::reach::{ExcludedPatches, Guard, exclude_unreachable};
use kanagata_solver::{Control, IncrementReport, Simulation, SimulationError};

pub use earlier_run::completed;
pub use error::{CheckpointError, RunError};
pub use first_record::PROGRAM;
pub use inputs::inputs as inputs_of;
pub use options::{RunOptions, WriteReport};

use folder::RunFolder;
use resources::Clock;

/// Progress of a run after an increment.
pub struct Progress<'a> {
    /// The increment.
    pub report: &'a IncrementReport<'a>,
    /// Fraction of the process that is done, from 0 to 1: completed stages plus the completed fraction of the current
    /// one, over all stages.
    pub done: f64,
    /// Wall time since the start [s].
    pub elapsed_s: f64,
}

/// Runs `plan` (read from `scene_path`) into the folder `output` and calls `watch` after every increment.
///
/// Without the feature `pages` no `report.html` is written.
///
/// # Errors
/// [`RunError`]; results up to then remain in the folder.
pub fn run(
    plan: &Plan,
    scene_path: &Path,
    output: &Path,
    options: &RunOptions<'_>,
    watch: &mut dyn FnMut(&Progress<'_>),
) -> Result<RunRecord, RunError> {
    let clock = Clock::start();
    let Prepared { mut simulation, guard, findings, holders, excluded_patches, diagram } =
        prepare(plan, scene_path, options.auto)?;
    let lock = lock_folder(output, options)?;
    if options.keep_complete && completed(output, plan).is_some() {
        return Err(RunError::AlreadyComplete { folder: output.to_path_buf() });
    }
    let section = options.stop.section();
    simulation.set_cancel(options.stop.clone());
    let run = Run { plan, scene_path, output, options, guard, clock, lock };
    let (mut folder, next) = if options.restart {
        run.restored_folder(&mut simulation)?
    } else {
        (run.new_folder(&simulation)?, 0)
    };
    folder.set_holders(&holders);
    folder.set_diagram(diagram);
    folder.set_tools(plan);
    let doubts = findings.iter().filter_map(advice::Finding::as_doubt);
    folder.set_scene_doubts(doubts.chain(advice::accuracy::unjudged(plan)).collect());
    folder.set_excluded_patches(excluded_patches.into_iter());
    let ended = run
        .advance_all(&mut simulation, &mut folder, next, watch)
        .and_then(|outcome| run.end(&simulation, &mut folder, outcome, section));
    if ended.is_err() {
        // In a folder that another run has taken over, files are missing or foreign.
        run.check_lock()?;
    }
    if let Err(error @ RunError::Write(_)) = &ended {
        folder.record_write_error(error);
    }
    ended.map(|()| folder.record)
}

/// A simulation before its first increment, and the findings about its scene.
struct Prepared {
    simulation: Simulation,
    /// Detects contact with excluded patches; `None` if none are excluded.
    guard: Option<Guard>,
    findings: Vec<advice::Finding>,
    holders: Vec<advice::holder::Holder>,
    excluded_patches: Vec<ExcludedPatchesRecord>,
    diagram: Diagram,
}

/// Places the tools of a scene and checks it. With `auto`, patches that the sheet cannot touch are excluded.
///
/// # Errors
/// [`RunError::Refused`] for a scene with a finding of level error; [`RunError::Solver`] if tools cannot be placed.
fn prepare(plan: &Plan, scene_path: &Path, auto: bool) -> Result<Prepared, RunError> {
    let mut setup = plan.simulation_setup(scene_path)?;
    let diagram = plan.forming_limit_diagram(scene_path)?;
    setup.place().map_err(setup_error)?;
    let findings = advice::doubts(plan, &setup, 1.0);
    if let Some(error) = findings.iter().find(|finding| finding.level == advice::Level::Error) {
        return Err(RunError::Refused { path: scene_path.into(), what: error.to_string() });
    }
    let holders = advice::holder::holders(&setup);
    let (excluded_patches, guard) = if auto {
        let (excluded_patches, guard) = exclude_unreachable(&mut setup).map_err(setup_error)?;
        (excluded_patches, Some(guard))
    } else {
        (Vec::new(), None)
    };
    let record = |left: &ExcludedPatches| ExcludedPatchesRecord {
        tool: plan.scene.tools[left.tool].name.clone(),
        patches: left.patches,
        total: left.of,
    };
    let excluded_patches = excluded_patches.iter().map(record).collect();
    let simulation = Simulation::new(setup).map_err(setup_error)?;
    Ok(Prepared { simulation, guard, findings, holders, excluded_patches, diagram })
}

/// An error before the run folder is touched.
fn setup_error(cause: SimulationError) -> RunError {
    RunError::Solver { cause: Box::new(cause), more: String::new(), folder: None }
}

/// Details beside the solver's error: penetration at the start of the stage (`begins`), a hint, and the doubts so far.
fn failure_details(record: &RunRecord, simulation: &Simulation, begins: bool) -> String {
    let inside = if begins { simulation.inside() } else { Vec::new() };
    let mut text: String =
        inside.iter().map(|inside| format!(". At the start of the stage {inside}")).collect();
    if !text.is_empty() {
        text += "; a tool must start clear of the formed sheet";
    }
    text += ". A check of the scene reports tools that start inside the sheet or leave too little clearance";
    text.extend(record.doubts.iter().map(|doubt| format!("\n  doubt {doubt}")));
    text
}

/// Locks the folder against other runs until the lock is dropped.
///
/// A restart in a missing folder needs no lock (and fails later). A folder with files of other programs is refused.
///
/// # Errors
/// [`RunError::Foreign`], [`RunError::Folder`], [`RunError::Busy`], [`RunError::Write`].
pub fn lock_folder(
    output: &Path,
    options: &RunOptions<'_>,
) -> Result<Option<lock::Lock>, RunError> {
    if options.restart && !output.is_dir() {
        return Ok(None);
    }
    let foreign =
        if options.restart || options.overwrite { None } else { earlier_run::foreign(output) };
    if let Some(found) = foreign {
        return Err(RunError::Foreign { folder: output.into(), found });
    }
    std::fs::create_dir_all(output)
        .map_err(|source| RunError::Folder { path: output.to_path_buf(), source })?;
    match lock::take(&lock::file_in(output), options.break_lock)? {
        lock::Attempt::Acquired(lock) => Ok(Some(lock)),
        lock::Attempt::HeldByOther(holder) => {
            Err(RunError::Busy { folder: output.to_path_buf(), holder })
        }
    }
}

/// The invariant data of a run.
struct Run<'a> {
    plan: &'a Plan,
    scene_path: &'a Path,
    output: &'a Path,
    options: &'a RunOptions<'a>,
    guard: Option<Guard>,
    clock: Clock,
    lock: Option<lock::Lock>,
}

impl Run<'_> {
    /// Checks that the run still holds the lock of its folder, before it writes there.
    fn check_lock(&self) -> Result<(), RunError> {
        let lost = |lost: lock::Lost| RunError::LockLost {
            folder: self.output.to_path_buf(),
            found: lost.found,
        };
        self.lock.as_ref().map_or(Ok(()), lock::Lock::check).map_err(lost)
    }

    /// The folder of the newest checkpoint, from which the simulation is restored, and the number of the next checkpoint.
    fn restored_folder(&self, simulation: &mut Simulation) -> Result<(RunFolder, usize), RunError> {
        let (checkpoint, next) = checkpoint::read(self.output, self.plan, PROGRAM)?;
        simulation.resume(checkpoint.state).map_err(setup_error)?;
        let mut folder = checkpoint.folder;
        folder.resume()?;
        Ok((folder, next))
    }

    /// The folder of a new run, with its tools. Earlier results there are reported and replaced.
    fn new_folder(&self, simulation: &Simulation) -> Result<RunFolder, RunError> {
        let Self { plan, scene_path, output, options, .. } = *self;
        let message = earlier_run::replaced_results(output, plan, scene_path, options.overwrite)?;
        if let (Some(message), Some(notify)) = (message, options.notify) {
            notify(&message);
        }
        let unknowns = 3 * simulation.body().mesh().nodes.len();
        let mut folder = RunFolder::create(output, plan, scene_path, unknowns)?;
        checkpoint::remove(output);
        folder.set_tools(plan);
        folder.write_tools(simulation)?;
        Ok(folder)
    }

    /// Checks that the sheet has not reached excluded patches.
    fn check_excluded_patches(
        &self,
        simulation: &Simulation,
        folder: &mut RunFolder,
    ) -> Result<(), RunError> {
        let found = self.guard.as_ref().and_then(|guard| guard.find_violation(simulation));
        let Some((tool, node)) = found else { return Ok(()) };
        let (tool, folder_path) = (self.plan.scene.tools[tool].name.clone(), folder.path.clone());
        let increment = simulation.summary().increments;
        let error = RunError::ExcludedPatchReached { increment, tool, node, folder: folder_path };
        self.check_lock()?;
        folder.write_last_state(simulation, Some(node))?;
        folder.finish(Verdict::NotConverged, Some(error.to_string()), &self.clock)?;
        Err(error)
    }

    /// Advances increment by increment to the end and writes checkpoints, from number `count` on. The inner result is that
    /// of the solver.
    fn advance_all(
        &self,
        simulation: &mut Simulation,
        folder: &mut RunFolder,
        mut count: usize,
        watch: &mut dyn FnMut(&Progress<'_>),
    ) -> Result<Result<(), SimulationError>, RunError> {
        let every = self.plan.scene.output.checkpoint_every;
        loop {
            match self.advance(simulation, folder, watch)? {
                Ok(true) => {}
                Ok(false) => return Ok(Ok(())),
                Err(error) => {
                    if matches!(error, SimulationError::Stopped { .. }) {
                        self.check_lock()?;
                        checkpoint::write(folder, &simulation.state(), count)?;
                    }
                    return Ok(Err(error));
                }
            }
            self.check_excluded_patches(simulation, folder)?;
            let increment = simulation.summary().increments;
            let stop = self.options.stop.is_requested();
            if stop || (every > 0 && increment.is_multiple_of(every)) {
                self.check_lock()?;
                checkpoint::write(folder, &simulation.state(), count)?;
                count += 1;
            }
            if stop {
                return Ok(Err(SimulationError::Stopped { increment }));
            }
        }
    }

    /// One increment, recorded in the folder. True if more follow.
    fn advance(
        &self,
        simulation: &mut Simulation,
        folder: &mut RunFolder,
        watch: &mut dyn FnMut(&Progress<'_>),
    ) -> Result<Result<bool, SimulationError>, RunError> {
        let stages = self.plan.scene.stages.len() as f64;
        let (mut write_error, mut ended) = (None, None);
        let more = simulation.advance(&mut |report| {
            ended = report.ends_stage().then(|| report.stage_name.to_owned());
            let done = (report.stage as f64 + report.share) / stages;
            watch(&Progress { report, done, elapsed_s: self.clock.wall_s() });
            let recorded = self
                .check_lock()
                .and_then(|()| folder.record_increment(report, &self.clock).map_err(Into::into));
            write_error = recorded.err();
            if write_error.is_some() { Control::Stop } else { Control::Continue }
        });
        if let Some(error) = write_error {
            return Err(error);
        }
        if let Some(stage) = ended {
            folder.record_inside_tools(simulation, &stage);
        }
        Ok(more)
    }

    /// Records the outcome, if the run still holds its folder. An error of the solver is returned.
    fn end(
        &self,
        simulation: &Simulation,
        folder: &mut RunFolder,
        outcome: Result<(), SimulationError>,
        section: Section,
    ) -> Result<(), RunError> {
        let failed = match &outcome {
            Err(SimulationError::GaveUp { node, share, .. }) => Some((*node, *share == 0.0)),
            _ => None,
        };
        self.check_lock()?;
        folder.write_last_state(simulation, failed.map(|(node, _)| node))?;
        folder.record_sections(&self.plan.scene.output.sections, simulation);
        if failed.is_some() {
            folder.record_failure(simulation)?;
        }
        let verdict = verdict_of(&outcome);
        let details = |(_, begins)| failure_details(&folder.record, simulation, begins);
        let more = failed.map_or_else(String::new, details);
        let message = outcome.as_ref().err().map(|cause| format!("{cause}{more}"));
        folder.finish(verdict, message, &self.clock)?;
        if verdict.is_complete() {
            checkpoint::remove(&folder.path);
        }
        if verdict != Verdict::Stopped {
            self.report(simulation, folder, (verdict, section))?;
        }
        outcome.map_err(|cause| RunError::Solver {
            cause: Box::new(cause),
            more,
            folder: Some(folder.path.clone()),
        })
    }

    /// Writes the report of complete results, outside `section`: a stop request meanwhile loses no results.
    fn report(
        &self,
        simulation: &Simulation,
        folder: &RunFolder,
        (verdict, section): (Verdict, Section),
    ) -> Result<(), RunError> {
        self.options.stop.complete();
        drop(section);
        self.check_lock()?;
        #[cfg(feature = "pages")]
        if self.options.report.applies(verdict) {
            report::write(folder, self.plan, simulation)?;
        }
        #[cfg(not(feature = "pages"))]
        let _ = (simulation, folder, verdict);
        Ok(())
    }
}

/// Verdict of a run that ended, before its doubts are judged.
fn verdict_of(outcome: &Result<(), SimulationError>) -> Verdict {
    match outcome {
        Ok(()) => Verdict::Completed,
        Err(SimulationError::Stopped { .. }) => Verdict::Stopped,
        Err(_) => Verdict::NotConverged,
    }
}

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../contact/test_tools.rs"]
mod test_tools;
