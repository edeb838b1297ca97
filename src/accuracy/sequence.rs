//! The sequence of runs: the first model, its choices, and meshes of growing fineness.

use std::collections::BTreeMap;
use std::path::Path;

use super::distance::Quantity;
use super::error::AccuracyError;
use super::estimate::MeshError;
use super::model::Model;
use super::options::{Parts, first_increment_error};
use super::records;
use super::runner::{Limits, Observer, Runner, Sequence};
use super::start::start;
use kanagata_report::record::{FacePenetrationRecord, SequenceEnd};
use kanagata_run::cost::estimate;
use kanagata_run::resources::memory_limit_megabytes;
use kanagata_scene::Plan;
use kanagata_scene::accuracy::Accuracy;
use kanagata_scene::preview::SheetCounts;
use kanagata_scene::read::read_with;
use kanagata_scene::set_value::SetValue;

/// Most runs of a sequence.
const RUNS_MAX: usize = 16;
/// Finer first meshes that are tried where the first does not converge.
const STARTS_MAX: usize = 3;
/// Multiple of the allowed errors up to which meshes are refined with the first choices: two more meshes with a ratio of 2
/// and the order 1.3 then are fine enough. On a mesh that is far too coarse the effect of points and layers on a jagged
/// force is not that on a fine mesh; a finer uniform mesh costs more than two that are locally refined.
const COARSE: f64 = 6.0;
/// Fewest meshes with the first choices: layers have an effect of their own on a mesh of two elements over a radius,
/// several times that on one of four.
const MESHES_MIN: usize = 2;
/// Part of what choices leave of the allowed error that the next mesh aims at: the observed order scatters.
const AIM: f64 = 0.8;
/// Penetration over that of the mesh before, above which a tool counts as sharp. On a radius meshes that are finer by 1.4
/// halve it.
const SHARP: f64 = 0.9;
/// Smallest and largest ratio of successive element lengths. A smaller step is little better than the mesh before, a larger
/// one may overshoot what is needed by its square in time.
pub(super) const RATIO_MIN: f64 = 1.4;
const RATIO_MAX: f64 = 2.0;
/// The same where no error is known. With the largest one the choices are made on a mesh of twice the time.
const RATIO_UNKNOWN: f64 = 1.5;
/// Exponent of the time over the unknowns, until it is measured, and its bounds.
const TIME_EXPONENT: f64 = 1.5;
const TIME_EXPONENT_MIN: f64 = 1.0;
const TIME_EXPONENT_MAX: f64 = 2.0;

/// Runs the scene at `scene` (with `set`) to its accuracy, or to `accuracy` if given; runs are in `folder`.
///
/// # Errors
/// [`AccuracyError`]; runs that are done remain and are used by the next call.
pub fn run_to_accuracy(
    scene: &Path,
    set: &[SetValue],
    accuracy: Option<Accuracy>,
    folder: &Path,
    limits: &Limits,
    observer: &mut dyn Observer,
) -> Result<Sequence, AccuracyError> {
    let plan = read_with(scene, set)?;
    let asked = accuracy.or(plan.scene.accuracy);
    let asked = asked.ok_or_else(|| AccuracyError::NoAccuracy { path: scene.into() })?;
    let first = first_model(&plan, scene, &asked)?;
    let mut runner = Runner {
        scene,
        set,
        asked,
        folder,
        limits,
        observer,
        runs: Vec::new(),
        parts: Parts::default(),
        meshes: Vec::new(),
        chosen_after: None,
        changes: BTreeMap::new(),
        pattern: None,
        keeps_steps: true,
        measured_again: Vec::new(),
        chosen: false,
        unmeasured: Vec::new(),
    };
    let base = runner.first_run(first)?;
    runner.check_quantities(base)?;
    let refined = runner.refined_run(base)?;
    runner.push_mesh(refined.unwrap_or(base));
    let ended = runner.refine(COARSE, MESHES_MIN)?;
    let end = runner.choose_and_refine(ended)?;
    Ok(runner.outcome(end))
}

/// The model of the first run.
fn first_model(plan: &Plan, scene: &Path, asked: &Accuracy) -> Result<Model, AccuracyError> {
    let mut setup = plan.simulation_setup(scene)?;
    setup.place().map_err(records::setup_error)?;
    let own = plan.scene.solver.increment_error.unwrap_or(f64::INFINITY);
    start(plan, &setup, first_increment_error(asked).min(own))
        .ok_or_else(|| AccuracyError::MeshFile { path: scene.into() })
}

impl Runner<'_> {
    /// The first run that converges; finer meshes are tried where it does not.
    fn first_run(&mut self, first: Model) -> Result<usize, AccuracyError> {
        let mut model = first;
        for attempt in 0..STARTS_MAX {
            let index = self.run(model.clone(), "mesh", None)?;
            if self.runs[index].results.is_some() {
                return Ok(index);
            }
            if attempt + 1 < STARTS_MAX {
                model = Model { mesh: model.mesh.scaled(RATIO_MIN), ..model };
            }
        }
        Err(records::not_converged(self.runs.last()))
    }

    /// Refuses an accuracy of a quantity that the scene does not have. One fraction for all is that of the quantities that
    /// there are.
    fn check_quantities(&self, base: usize) -> Result<(), AccuracyError> {
        let (asked, results) = (&self.asked, self.runs[base].results());
        if asked.force.is_some_and(|fraction| *asked == Accuracy::of_all(fraction)) {
            return Ok(());
        }
        let missing = [
            (
                "force",
                asked.force.is_some() && results.forces.is_empty(),
                "no stage prescribes the travel of a tool, and forces are given; leave it out",
            ),
            (
                "springback",
                asked.springback.or(asked.springback_mm).is_some() && results.springback.is_none(),
                "no stage releases all tools; add one, or leave it out",
            ),
            (
                "draw_in",
                asked.draw_in.or(asked.draw_in_mm).is_some() && results.border.is_empty(),
                "the blank is not flat and normal to z, and has no draw-in; leave it out",
            ),
        ];
        match missing.into_iter().find(|(_, missing, _)| *missing) {
            Some((key, _, found)) => {
                Err(AccuracyError::NoQuantity { path: self.scene.into(), key, found })
            }
            None => Ok(()),
        }
    }

    /// Refines the mesh until the errors are at most `multiple` times those that are allowed, on `fewest` meshes at least.
    pub(super) fn refine(
        &mut self,
        multiple: f64,
        fewest: usize,
    ) -> Result<SequenceEnd, AccuracyError> {
        loop {
            let last = *self.meshes.last().expect("one at least");
            let ratio = match self.next_ratio(multiple) {
                Ok(ratio) => ratio,
                Err(SequenceEnd::Reached) if self.meshes.len() < fewest => RATIO_UNKNOWN,
                Err(SequenceEnd::Options) if self.measure_again(last)? => continue,
                Err(end) => return Ok(end),
            };
            let model = self.runs[last].model.clone();
            let increment_error = self.allowed_increments(last);
            let mesh = model.mesh.scaled(ratio);
            let next = self.with_levels(Model { mesh, increment_error, ..model })?;
            if let Some(end) = self.exceeded(last, &next)? {
                return Ok(end);
            }
            let index = self.run(next, "mesh", Some(last))?;
            if self.runs[index].results.is_none() {
                return Ok(SequenceEnd::NotConverged);
            }
            self.push_mesh(index);
        }
    }

    /// Ratio of the element lengths of the last mesh to the next; the error: why there is none.
    pub(super) fn next_ratio(&self, multiple: f64) -> Result<f64, SequenceEnd> {
        let results = self.runs[*self.meshes.last().expect("one at least")].results();
        let errors = self.mesh_errors();
        if errors.is_empty() {
            return Ok(RATIO_UNKNOWN);
        }
        let mut ratio = 0.0_f64;
        let mut by_options = true;
        for quantity in Quantity::of(results) {
            let Some(allowed) = quantity.allowed(&self.asked, results) else { continue };
            let Some(mesh) = errors.get(&quantity.name()) else { continue };
            let options = self.parts.together(&quantity);
            if mesh.error.hypot(options) <= multiple * allowed {
                continue;
            }
            by_options &= mesh.error < options && options > allowed;
            let left = if allowed > options {
                (allowed * allowed - options * options).sqrt()
            } else {
                options
            };
            ratio = ratio.max(mesh.ratio_to(AIM * left));
        }
        // Coarse meshes show what choices change; those that follow must not let tools pass.
        let finer = if self.chosen { self.ratio_for_penetration() } else { None };
        if let Some(finer) = finer {
            (ratio, by_options) = (ratio.max(finer), false);
        }
        match ratio {
            0.0 => Err(SequenceEnd::Reached),
            _ if by_options => Err(SequenceEnd::Options),
            ratio => Ok(ratio.clamp(RATIO_MIN, RATIO_MAX)),
        }
    }

    /// Ratio that brings the penetration of tools into element faces below what is allowed, in proportion to the square of the
    /// element length. `None` where it is below, and where the last mesh has not reduced it: at a sharp edge it stays, and
    /// remains a doubt.
    fn ratio_for_penetration(&self) -> Option<f64> {
        let depth = |k: usize| self.runs[k].record.face_penetration.as_ref().map(|p| p.depth_rel);
        let (&last, before) = self.meshes.split_last()?;
        let found = depth(last)?;
        let falls =
            before.last().is_none_or(|&k| depth(k).is_none_or(|before| found < SHARP * before));
        // A tool that is deeper than the sheet is thick has passed between the nodes: it has no edge that stays in a face.
        let falls = falls || found > 1.0;
        let over = found / FacePenetrationRecord::ALLOWED_IN_SEQUENCE_REL;
        (over > 1.0 && falls).then(|| over.sqrt())
    }

    /// Errors of the last mesh by quantity; empty with one mesh.
    pub(super) fn mesh_errors(&self) -> BTreeMap<String, MeshError> {
        let Some((&last, coarser)) = self.meshes.split_last() else { return BTreeMap::new() };
        let finest = &self.runs[last];
        let ratio = |&k: &usize| finest.model.finer_than(&self.runs[k].model);
        let ratios: Vec<f64> = coarser.iter().map(ratio).collect();
        let error = |quantity: Quantity| {
            let distance = |&k: &usize| {
                let distance = quantity.distance(self.runs[k].results(), finest.results())?;
                let chosen = self.chosen_after.is_some_and(|last| k <= last);
                Some(if chosen { self.without_choices(&quantity, distance) } else { distance })
            };
            let distances: Option<Vec<f64>> = coarser.iter().map(distance).collect();
            let error = MeshError::new(&distances?, &ratios)?;
            Some((quantity.name(), error))
        };
        Quantity::of(finest.results()).into_iter().filter_map(error).collect()
    }

    /// Why the next run would exceed a limit.
    pub(super) fn exceeded(
        &self,
        last: usize,
        next: &Model,
    ) -> Result<Option<SequenceEnd>, AccuracyError> {
        if self.runs.len() >= RUNS_MAX {
            return Ok(Some(SequenceEnd::Runs));
        }
        let set = self.set_of(next)?;
        let plan = read_with(self.scene, &set)?;
        let setup = plan.simulation_setup(self.scene)?;
        let counts = SheetCounts::of_blank(&plan.scene.blank);
        let counts = counts.unwrap_or_else(|| SheetCounts::of_mesh(setup.body.mesh()));
        let cost = estimate(&setup, &counts);
        if memory_limit_megabytes().is_some_and(|limit| cost.memory_mb > limit) {
            return Ok(Some(SequenceEnd::Memory));
        }
        let Some(allowed) = self.limits.wall_s else { return Ok(None) };
        let spent: f64 = self.runs.iter().map(|run| run.record.wall_s).sum();
        let growth = cost.unknowns as f64 / self.runs[last].record.unknowns.max(1) as f64;
        let expected = self.runs[last].record.wall_s * growth.powf(self.time_exponent());
        Ok((spent + expected > allowed).then_some(SequenceEnd::Time))
    }

    /// Exponent of the time over the unknowns, measured on the last two meshes.
    fn time_exponent(&self) -> f64 {
        let [.., a, b] = self.meshes[..] else { return TIME_EXPONENT };
        let (a, b) = (&self.runs[a].record, &self.runs[b].record);
        let unknowns = (b.unknowns as f64 / a.unknowns.max(1) as f64).ln();
        let measured = (b.cpu_s / a.cpu_s.max(0.01)).ln() / unknowns.max(0.1);
        measured.clamp(TIME_EXPONENT_MIN, TIME_EXPONENT_MAX)
    }
}
