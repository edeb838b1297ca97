//! One run of a sequence, and what is recorded of all.

use std::collections::BTreeMap;

use super::distance::Quantity;
use super::error::AccuracyError;
use super::estimate::MeshError;
use super::model::Model;
use super::options::together;
use super::quantities::Results;
use super::runner::{Done, Runner, Sequence};
use kanagata_files::{Input, read};
use kanagata_report::record::{
    AccuracyRecord, QuantityRecord, RunRecord, SequenceEnd, SequenceRunRecord, Verdict,
};
use kanagata_run::build::BUILD;
use kanagata_run::{RunError, RunOptions, WriteReport, inputs_of, run};
use kanagata_scene::Plan;
use kanagata_scene::read::read_with;
use kanagata_scene::set_value::SetValue;
use kanagata_solver::SimulationError;

/// An error before the first run.
pub(super) fn setup_error(cause: SimulationError) -> AccuracyError {
    AccuracyError::Run(RunError::Solver {
        cause: Box::new(cause),
        more: String::new(),
        folder: None,
    })
}

/// The error of a sequence whose last run did not converge.
pub(super) fn not_converged(last: Option<&Done>) -> AccuracyError {
    let message = last.and_then(|run| run.record.message.clone()).unwrap_or_default();
    let path = last.map(|run| run.folder.join("run.json")).unwrap_or_default();
    AccuracyError::NotConverged { path, message }
}

impl Runner<'_> {
    /// All values that are set for a model.
    pub(super) fn set_of(&self, model: &Model) -> Result<Vec<SetValue>, AccuracyError> {
        let own = model
            .set()
            .map_err(|found| AccuracyError::Results { path: self.scene.into(), found })?;
        let steps = (self.keeps_steps).then(|| SetValue::new("output.vtu_every", "2"));
        let steps = steps.into_iter().flatten();
        Ok(self.set.iter().cloned().chain(own).chain(steps).collect())
    }

    /// Runs a model, or takes its earlier run. Returns the index of the run.
    pub(super) fn run(
        &mut self,
        model: Model,
        purpose: &'static str,
        against: Option<usize>,
    ) -> Result<usize, AccuracyError> {
        let set = self.set_of(&model)?;
        let plan = read_with(self.scene, &set)?;
        let folder = self.folder.join(model.name());
        let known = (!self.limits.overwrite || self.runs.iter().any(|run| run.folder == folder))
            .then(|| ended(&folder, &plan))
            .flatten();
        self.observer.begins(self.runs.len() + 1, purpose, &model, known.is_some());
        let record = match known {
            Some(record) => record,
            None => self.solve(&plan, &folder)?,
        };
        let done = record.verdict.is_complete();
        if !done {
            self.observer.failed(record.message.as_deref().unwrap_or_default());
        }
        let results = done.then(|| Results::read(&folder, &plan, &record, self.scene));
        let results = results.transpose()?;
        self.runs.push(Done {
            model,
            purpose,
            folder,
            set: set.iter().map(SetValue::to_string).collect(),
            record,
            results,
            against,
        });
        Ok(self.runs.len() - 1)
    }

    /// Solves, or continues a run that was stopped. A run that does not converge has a record too.
    fn solve(&mut self, plan: &Plan, folder: &std::path::Path) -> Result<RunRecord, AccuracyError> {
        let fresh = RunOptions {
            overwrite: self.limits.overwrite,
            break_lock: self.limits.break_lock,
            auto: self.limits.auto,
            report: WriteReport::NotConverged,
            stop: self.limits.stop.clone(),
            ..RunOptions::default()
        };
        let mut ended = self.attempt(plan, folder, &fresh);
        if matches!(ended, Err(RunError::Unfinished { .. })) {
            ended = self.attempt(plan, folder, &RunOptions { restart: true, ..fresh });
        }
        match ended {
            Err(RunError::Solver { ref cause, folder: Some(_), .. })
                if !matches!(**cause, SimulationError::Stopped { .. }) =>
            {
                let record = read(&folder.join("run.json"), Input::Description).ok();
                let record = record.and_then(|text| RunRecord::parse(&text).ok());
                record.map_or_else(|| Err(ended.expect_err("matched above").into()), Ok)
            }
            ended => Ok(ended?),
        }
    }

    fn attempt(
        &mut self,
        plan: &Plan,
        folder: &std::path::Path,
        options: &RunOptions<'_>,
    ) -> Result<RunRecord, RunError> {
        run(plan, self.scene, folder, options, &mut |progress| self.observer.progress(progress))
    }

    /// The record of the sequence.
    pub(super) fn outcome(&self, end: SequenceEnd) -> Sequence {
        let best = &self.runs[*self.meshes.last().expect("one at least")];
        let results = best.results.as_ref().expect("it has converged");
        let errors = self.mesh_errors();
        let record = |q: &Quantity| self.quantity(q, results, errors.get(&q.name()));
        let quantities: Vec<QuantityRecord> = Quantity::of(results).iter().map(record).collect();
        let mesh = quantities.iter().any(|q| q.error.is_none()).then(|| "mesh".to_owned());
        let record = AccuracyRecord {
            end,
            quantities,
            runs: self.runs.iter().map(|run| self.run_record(run)).collect(),
            unmeasured: mesh.into_iter().chain(self.unmeasured.iter().cloned()).collect(),
            cpu_s: self.runs.iter().map(|run| run.record.cpu_s).sum(),
            last_cpu_s: best.record.cpu_s,
        };
        Sequence { record, best: best.folder.clone() }
    }

    fn quantity(
        &self,
        quantity: &Quantity,
        results: &Results,
        mesh: Option<&MeshError>,
    ) -> QuantityRecord {
        let options = self.parts.of(quantity);
        let mut parts: BTreeMap<String, f64> =
            options.iter().map(|(name, part)| ((*name).to_owned(), *part)).collect();
        parts.extend(mesh.map(|mesh| ("mesh".to_owned(), mesh.error)));
        QuantityRecord {
            name: quantity.name(),
            unit: quantity.unit().into(),
            value: quantity.value(results).unwrap_or_default(),
            error: mesh.map(|_| together(parts.values().copied())),
            allowed: quantity.allowed(&self.asked, results),
            parts,
            order: mesh.and_then(|mesh| mesh.order),
        }
    }

    fn run_record(&self, run: &Done) -> SequenceRunRecord {
        let quantities = run.results.as_ref().map_or_else(Vec::new, Quantity::of);
        let value = |q: &Quantity| Some((q.name(), q.value(run.results.as_ref()?)?));
        let other = run.against.and_then(|k| self.runs[k].results.as_ref());
        let change = |q: &Quantity| Some((q.name(), q.distance(run.results.as_ref()?, other?)?));
        let folder = run.folder.file_name().unwrap_or_default().to_string_lossy();
        SequenceRunRecord {
            folder: format!("{}/{folder}", super::publish::RUNS),
            purpose: run.purpose.into(),
            model: run.model.to_string(),
            set: run.set.clone(),
            unknowns: run.record.unknowns,
            increments: run.record.increments,
            cpu_s: run.record.cpu_s,
            values: quantities.iter().filter_map(value).collect(),
            changes: quantities.iter().filter_map(change).collect(),
        }
    }
}

/// The record of a run of the same inputs by this build that has ended, converged or not.
fn ended(folder: &std::path::Path, plan: &Plan) -> Option<RunRecord> {
    let text = read(&folder.join("run.json"), Input::Description).ok()?;
    let record = RunRecord::parse(&text).ok()?;
    let same = record.build == BUILD && record.inputs == inputs_of(plan);
    let ended = record.verdict.is_complete() || record.verdict == Verdict::NotConverged;
    (same && ended).then_some(record)
}
