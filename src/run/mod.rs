//! A scene becomes a run folder: `history.csv`, `run.json`, `run.pvd`, `steps/*.vtu`, `report.html`.
//!
//! Everything is written as the run goes on, each file whole or not at all, so that a folder can be looked at
//! (and a killed run still holds what it had). `report.html` is written with the feature `pages` only.

pub mod advice;
pub mod checkpoint;
pub mod cost;
mod earlier_run;
mod error;
pub mod fields;
mod first_record;
pub mod folder;
pub mod formed;
pub mod friction_shear;
pub mod hourglassing;
mod inputs;
pub mod lock;
pub mod necking;
pub mod progress_line;
#[cfg(feature = "pages")]
pub mod report;
pub mod resources;
pub mod restart;
pub mod self_contact;
mod sheet_checks;
pub mod springback;
pub mod status;
pub mod strains;

use std::path::Path;
use std::time::Instant;

use crate::cancel::{Cancel, Section};
use crate::report::record::{LeftOutRecord, RunRecord, Verdict};
use crate::scene::Plan;
use crate::solver::reach::{ExcludedPatches, Guard, exclude_unreachable, reachable};
use crate::solver::{Control, IncrementReport, Simulation, SimulationError};

pub use error::{CheckpointError, RunError};
pub use first_record::PROGRAM;

use folder::RunFolder;

/// What somebody watching a run is told after every increment.
pub struct Progress<'a> {
    /// The increment.
    pub report: &'a IncrementReport<'a>,
    /// Stages done plus the share of the one under way, over all stages: 0 to 1.
    pub done: f64,
    /// Wall time since the start [s].
    pub elapsed_s: f64,
}

/// How a run is run.
#[derive(Default)]
pub struct RunOptions<'a> {
    /// Go on from the checkpoint in the folder.
    pub restart: bool,
    /// Throw away a stopped run of the same inputs that the folder holds, in place of refusing to.
    pub overwrite: bool,
    /// Told what results of an earlier run are replaced, before that is done.
    pub tell: Option<&'a dyn Fn(&str)>,
    /// Leave out what loses no accuracy: patches of tools that the sheet cannot come near.
    pub auto: bool,
    /// Requested from outside: give up the increment under way, save a checkpoint of the last one and stop.
    pub stop: Cancel,
}

/// Runs `plan` (read from `scene_path`) into the folder `output`. `watch` is called after every increment.
/// Without the feature `pages` no `report.html` is written.
///
/// # Errors
/// [`RunError`]; what was computed until then is in the folder.
pub fn run(
    plan: &Plan,
    scene_path: &Path,
    output: &Path,
    options: &RunOptions<'_>,
    watch: &mut dyn FnMut(&Progress<'_>),
) -> Result<RunRecord, RunError> {
    let start = Instant::now();
    let Prepared { mut simulation, guard, findings, holders, left_out } =
        prepare(plan, scene_path, options.auto)?;
    let _lock = alone_in(output, options)?;
    let section = options.stop.section();
    simulation.set_cancel(options.stop.clone());
    let run = Run { plan, scene_path, output, options, guard, start };
    let mut folder = if options.restart {
        run.restored_folder(&mut simulation)?
    } else {
        run.new_folder(&simulation)?
    };
    folder.watch_holders(&holders);
    folder.doubt_scene(findings.iter().filter_map(advice::Finding::as_doubt).collect());
    folder.left_out(left_out.into_iter());
    let ended = run
        .go_on(&mut simulation, &mut folder, watch)
        .and_then(|outcome| run.end(&simulation, &mut folder, outcome, section));
    match ended {
        Ok(()) => Ok(folder.record),
        Err(error) => {
            if matches!(error, RunError::Write(_)) {
                folder.stopped_by(&error);
            }
            Err(error)
        }
    }
}

/// A simulation that can begin, and what its scene is known for before that.
struct Prepared {
    simulation: Simulation,
    /// Of the patches that were left out; `None` where none may be.
    guard: Option<Guard>,
    findings: Vec<advice::Finding>,
    holders: Vec<advice::holder::Holder>,
    left_out: Vec<LeftOutRecord>,
}

/// Places the tools of a scene and judges it; with `auto` patches that the sheet cannot come near are left out.
///
/// # Errors
/// [`RunError::Refused`] for a scene with a finding of level error; [`RunError::Solver`] where tools cannot be placed.
fn prepare(plan: &Plan, scene_path: &Path, auto: bool) -> Result<Prepared, RunError> {
    let mut setup = plan.simulation_setup(scene_path)?;
    setup.place().map_err(not_begun)?;
    let findings = advice::doubts(plan, &setup, 1.0);
    if let Some(error) = findings.iter().find(|finding| finding.level == advice::Level::Error) {
        return Err(RunError::Refused { path: scene_path.into(), what: error.to_string() });
    }
    let holders = advice::holder::holders(&setup, &reachable(&setup));
    let (left_out, guard) = if auto {
        let (left_out, guard) = exclude_unreachable(&mut setup).map_err(not_begun)?;
        (left_out, Some(guard))
    } else {
        (Vec::new(), None)
    };
    let record = |left: &ExcludedPatches| LeftOutRecord {
        tool: plan.scene.tools[left.tool].name.clone(),
        patches: left.patches,
        of: left.of,
    };
    let left_out = left_out.iter().map(record).collect();
    let simulation = Simulation::new(setup).map_err(not_begun)?;
    Ok(Prepared { simulation, guard, findings, holders, left_out })
}

/// The error of a run that ends before its folder is touched.
fn not_begun(cause: SimulationError) -> RunError {
    RunError::Solver { cause: Box::new(cause), more: String::new(), folder: None }
}

/// What is to be said beside where and why the solver gave up; `begins`: at the beginning of a stage.
fn to_giving_up(record: &RunRecord, simulation: &Simulation, begins: bool) -> String {
    let inside = if begins { simulation.inside() } else { Vec::new() };
    let mut said: String =
        inside.iter().map(|inside| format!(". Where the stage begins {inside}")).collect();
    if !said.is_empty() {
        said += "; a tool must come in clear of the sheet as that has been formed by then";
    }
    said += ". A check of the scene names places where tools begin inside the sheet or leave it too little room";
    said.extend(record.doubts.iter().map(|doubt| format!("\n  doubt {doubt}")));
    said
}

/// Keeps other runs out of the folder until the lock is dropped. A folder that is to be gone on in and is not there
/// needs none; one that holds files of others is left to them.
fn alone_in(output: &Path, options: &RunOptions<'_>) -> Result<Option<lock::Lock>, RunError> {
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
    match lock::take(&lock::file_in(output))? {
        lock::Attempt::Ours(lock) => Ok(Some(lock)),
        lock::Attempt::Theirs(process) => {
            let who = lock::named(process.as_ref());
            Err(RunError::Busy { folder: output.to_path_buf(), who })
        }
    }
}

/// What stays the same while a run goes on.
struct Run<'a> {
    plan: &'a Plan,
    scene_path: &'a Path,
    output: &'a Path,
    options: &'a RunOptions<'a>,
    guard: Option<Guard>,
    start: Instant,
}

impl Run<'_> {
    /// The folder of the newest checkpoint, the simulation put back to it.
    fn restored_folder(&self, simulation: &mut Simulation) -> Result<RunFolder, RunError> {
        let checkpoint = checkpoint::read(self.output, self.plan, PROGRAM)?;
        simulation.resume(checkpoint.state).map_err(not_begun)?;
        let mut folder = checkpoint.folder;
        folder.resume()?;
        Ok(folder)
    }

    /// The folder of a run that begins in it, with its tools; what is replaced there is told.
    fn new_folder(&self, simulation: &Simulation) -> Result<RunFolder, RunError> {
        let Self { plan, scene_path, output, options, .. } = *self;
        let told = earlier_run::replaced(output, plan, scene_path, options.overwrite)?;
        if let (Some(told), Some(tell)) = (told, options.tell) {
            tell(&told);
        }
        let unknowns = 3 * simulation.body().mesh().nodes.len();
        let folder = RunFolder::create(output, plan, scene_path, unknowns)?;
        checkpoint::remove(output);
        folder.write_tools(plan, simulation)?;
        Ok(folder)
    }

    /// That the sheet has not come to patches that were left out.
    fn look_for_breach(
        &self,
        simulation: &Simulation,
        folder: &mut RunFolder,
    ) -> Result<(), RunError> {
        let found = self.guard.as_ref().and_then(|guard| guard.find_violation(simulation));
        let Some((tool, node)) = found else { return Ok(()) };
        let (tool, folder_path) = (self.plan.scene.tools[tool].name.clone(), folder.path.clone());
        let increment = simulation.summary().increments;
        let error = RunError::LeftOut { increment, tool, node, folder: folder_path };
        folder.write_last_state(simulation, Some(node))?;
        folder.finish(Verdict::NotConverged, Some(error.to_string()), self.start)?;
        Err(error)
    }

    /// Increment by increment to the end, with checkpoints.
    fn go_on(
        &self,
        simulation: &mut Simulation,
        folder: &mut RunFolder,
        watch: &mut dyn FnMut(&Progress<'_>),
    ) -> Result<Result<(), SimulationError>, RunError> {
        let every = self.plan.scene.output.checkpoint_every;
        let mut count = 0;
        loop {
            match self.advance(simulation, folder, watch)? {
                Ok(true) => {}
                Ok(false) => return Ok(Ok(())),
                Err(error) => {
                    if matches!(error, SimulationError::Stopped { .. }) {
                        checkpoint::write(folder, &simulation.state(), count)?;
                    }
                    return Ok(Err(error));
                }
            }
            self.look_for_breach(simulation, folder)?;
            let increment = simulation.summary().increments;
            let stop = self.options.stop.is_requested();
            if stop || (every > 0 && increment.is_multiple_of(every)) {
                checkpoint::write(folder, &simulation.state(), count)?;
                count += 1;
            }
            if stop {
                return Ok(Err(SimulationError::Stopped { increment }));
            }
        }
    }

    /// One increment, written to the folder; whether more follow.
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
            watch(&Progress { report, done, elapsed_s: self.start.elapsed().as_secs_f64() });
            write_error = folder.take(report, self.start).err();
            if write_error.is_some() { Control::Stop } else { Control::Continue }
        });
        if let Some(error) = write_error {
            return Err(error.into());
        }
        if let Some(stage) = ended {
            folder.look_into_tools(simulation, &stage);
        }
        Ok(more)
    }

    /// Writes how the run ended; an error where it did not end by itself.
    fn end(
        &self,
        simulation: &Simulation,
        folder: &mut RunFolder,
        outcome: Result<(), SimulationError>,
        section: Section,
    ) -> Result<(), RunError> {
        let gave_up = match &outcome {
            Err(SimulationError::GaveUp { node, share, .. }) => Some((*node, *share == 0.0)),
            _ => None,
        };
        folder.write_last_state(simulation, gave_up.map(|(node, _)| node))?;
        if gave_up.is_some() {
            folder.take_failure(simulation)?;
        }
        let verdict = match &outcome {
            Ok(()) => Verdict::Completed,
            Err(SimulationError::Stopped { .. }) => Verdict::Stopped,
            Err(_) => Verdict::NotConverged,
        };
        let more = gave_up
            .map_or(String::new(), |(_, begins)| to_giving_up(&folder.record, simulation, begins));
        let message = outcome.as_ref().err().map(|cause| format!("{cause}{more}"));
        folder.finish(verdict, message, self.start)?;
        if verdict.is_complete() {
            checkpoint::remove(&folder.path);
        }
        // The results are complete: a report that is stopped loses none.
        if verdict != Verdict::Stopped {
            self.options.stop.complete();
            drop(section);
            #[cfg(feature = "pages")]
            report::write(folder, self.plan, simulation)?;
        }
        outcome.map_err(|cause| RunError::Solver {
            cause: Box::new(cause),
            more,
            folder: Some(folder.path.clone()),
        })
    }
}
