//! A sequence of runs to an accuracy.

use std::path::Path;

use super::error::Error;
use super::run::{Run, RunProgress};
use super::scene::Scene;
use crate::accuracy::{Limits, Model, Observer, run_into};
use crate::run::Progress;
use crate::run::folder::row;
use crate::scene::accuracy::Accuracy;

/// Progress of a sequence: the run that is made, and its last increment.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceProgress {
    /// Number of the run, from 1.
    pub run: usize,
    /// What the run is for: `mesh`, `increments`, `points` or `layers`.
    pub purpose: String,
    /// Mesh, layers, points and increments of the run, in words.
    pub model: String,
    /// Whether an earlier run of the same inputs is used.
    pub is_known: bool,
    /// Why the run did not converge, if it did not.
    pub failure: Option<String>,
    /// The last increment; `None` where the run begins and where it fails.
    pub increment: Option<RunProgress>,
}

impl Scene {
    /// Runs the scene from coarse to fine until the estimated errors are below `accuracy`, or below that of the scene for
    /// `None`. The best run is in `folder`, with the errors in [`crate::report::record::RunRecord::accuracy`]; all runs are in
    /// `folder/accuracy`. The same call continues a sequence that was stopped.
    ///
    /// ```no_run
    /// use kanagata::prelude::{Accuracy, Scene, SequenceLimits};
    ///
    /// let scene = Scene::read("fixtures/u-draw/u-draw.scene.json")?;
    /// let limits = SequenceLimits { wall_s: Some(600.0), ..SequenceLimits::default() };
    /// let run = scene.run_to_accuracy("out/u-draw", Some(Accuracy::of_all(0.01)), &limits, &mut |now| {
    ///     println!("run {} ({}): {}", now.run, now.purpose, now.model);
    /// })?;
    /// for quantity in &run.record().accuracy.as_ref().unwrap().quantities {
    ///     println!("{} {} +- {:?} {}", quantity.name, quantity.value, quantity.error, quantity.unit);
    /// }
    /// # Ok::<(), kanagata::prelude::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Scene::run`]; [`super::ErrorKind::Input`] also for a scene from memory, an accuracy out of range and a quantity
    /// that the scene does not have.
    pub fn run_to_accuracy(
        &self,
        folder: impl AsRef<Path>,
        accuracy: Option<Accuracy>,
        limits: &Limits,
        watch: &mut dyn FnMut(&SequenceProgress),
    ) -> Result<Run, Error> {
        let folder = folder.as_ref();
        let path = self.file()?;
        let in_range = accuracy.map_or(Ok(()), |accuracy| accuracy.check());
        in_range.map_err(|(key, found, allowed)| {
            Error::input(format!("{key}: found {found}; allowed: {allowed}"))
        })?;
        let mut watcher = Watcher { watch, now: None };
        run_into(path, self.set(), accuracy, folder, limits, &mut watcher)?;
        #[cfg(feature = "pages")]
        crate::run::report::write_from_files(folder).map_err(Error::input)?;
        Run::open(folder)
    }
}

/// Calls `watch` for the run that is made.
struct Watcher<'w> {
    watch: &'w mut dyn FnMut(&SequenceProgress),
    now: Option<SequenceProgress>,
}

impl Watcher<'_> {
    fn report(&mut self, failure: Option<String>, increment: Option<RunProgress>) {
        if let Some(now) = &mut self.now {
            (now.failure, now.increment) = (failure, increment);
            (self.watch)(now);
        }
    }
}

impl Observer for Watcher<'_> {
    fn begins(&mut self, number: usize, purpose: &str, model: &Model, known: bool) {
        self.now = Some(SequenceProgress {
            run: number,
            purpose: purpose.to_owned(),
            model: model.to_string(),
            is_known: known,
            failure: None,
            increment: None,
        });
        self.report(None, None);
    }

    fn progress(&mut self, progress: &Progress<'_>) {
        let increment = RunProgress {
            row: row(progress.report),
            done: progress.done,
            elapsed_s: progress.elapsed_s,
        };
        self.report(None, Some(increment));
    }

    fn failed(&mut self, why: &str) {
        self.report(Some(why.to_owned()), None);
    }
}
