//! The state of a sequence of runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::model::Model;
use super::options::{Choice, Parts};
use super::pattern::Pattern;
use super::quantities::Results;
use kanagata_cancel::Cancel;
use kanagata_report::record::{AccuracyRecord, RunRecord};
use kanagata_run::Progress;
use kanagata_scene::accuracy::Accuracy;
use kanagata_scene::set_value::SetValue;

/// Limits and permissions of a sequence.
#[derive(Debug, Clone, Default)]
pub struct Limits {
    /// Wall time of all runs [s].
    pub wall_s: Option<f64>,
    /// Discard earlier runs.
    pub overwrite: bool,
    /// Exclude tool patches that the sheet cannot touch, which does not change results.
    pub auto: bool,
    /// Take folders from runs that are not known to be alive on this host.
    pub break_lock: bool,
    /// Stop request: the run is stopped with a checkpoint; the same call continues it.
    pub stop: Cancel,
}

/// Receives what a sequence does.
pub trait Observer {
    /// Run `number` (from 1) of the model begins; `purpose` as in its record. `known`: an earlier run is used.
    fn begins(&mut self, number: usize, purpose: &str, model: &Model, known: bool);
    /// Progress of the run.
    fn progress(&mut self, progress: &Progress<'_>);
    /// A run did not converge: `why`.
    fn failed(&mut self, why: &str);
}

/// The outcome of a sequence.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Estimated errors and runs.
    pub record: AccuracyRecord,
    /// Folder of the run with the smallest errors.
    pub best: PathBuf,
}

/// A run that is done.
#[derive(Debug, Clone)]
pub(super) struct Done {
    pub(super) model: Model,
    pub(super) purpose: &'static str,
    pub(super) folder: PathBuf,
    pub(super) set: Vec<String>,
    pub(super) record: RunRecord,
    /// `None`: it did not converge.
    pub(super) results: Option<Results>,
    /// Index of the run that it is compared with.
    pub(super) against: Option<usize>,
}

impl Done {
    /// Results of a run that has converged.
    pub(super) fn results(&self) -> &Results {
        self.results.as_ref().expect("only runs that converged are compared")
    }
}

/// A sequence in progress.
pub(super) struct Runner<'a> {
    pub(super) scene: &'a Path,
    pub(super) set: &'a [SetValue],
    pub(super) asked: Accuracy,
    pub(super) folder: &'a Path,
    pub(super) limits: &'a Limits,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) runs: Vec<Done>,
    /// Errors of the choices of the runs in `meshes`.
    pub(super) parts: Parts,
    /// Runs that differ in their meshes only, from coarse to fine.
    pub(super) meshes: Vec<usize>,
    /// The last of `meshes` with the first choices, once others are chosen.
    pub(super) chosen_after: Option<usize>,
    /// Sum of the squares of the changes that the choices make, by quantity.
    pub(super) changes: BTreeMap<String, f64>,
    /// Where meshes are refined, once a coarser run has shown it.
    pub(super) pattern: Option<Pattern>,
    /// Whether the next run writes files of many steps, from which the pattern is made.
    pub(super) keeps_steps: bool,
    /// Choices whose parts were measured again, with the run on whose mesh.
    pub(super) measured_again: Vec<(Choice, usize)>,
    /// Whether points and layers are chosen.
    pub(super) chosen: bool,
    /// Choices whose error could not be measured.
    pub(super) unmeasured: Vec<String>,
}
