//! Work limit of a refinement, in patches made and audited, and its time limit if there is one. The count does not depend on
//! the number of threads; a result that ends at a time limit depends on the machine.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use kanagata_progress::{Progress, Stage};

/// Work limit of the saving of patches: `SAVING_PATCHES_MAX + SAVING_PATCHES_PER_FACE * faces` evaluated patches. A
/// search beyond it keeps its divisions. With a tenth of this limit, a ball with a hole takes 164 patches instead of
/// 100. Doubled: files that reach the limit take twice as long.
const SAVING_PATCHES_MAX: u64 = 60_000;
/// Allowance for each face of the model, in evaluated patches; see [`SAVING_PATCHES_MAX`].
const SAVING_PATCHES_PER_FACE: u64 = 200;
/// Work at which a search that has not reached the tolerance ends, over the limit of the saving. Doubled: files that
/// never reach it take twice as long to fail (16 s of processor time for 13 faces).
const SEARCH_LIMIT_RATIO: u64 = 2;
/// Fraction of the limit of the saving up to which a search is cheap, so that further searches are made: one twentieth. With
/// an eighth, a pan of 31 faces takes a third longer, with as many patches.
const CHEAP_FRACTION: u64 = 20;
/// Cost of a complete model for each of its patches, in evaluated patches. Its vertex motion compares 81 points of a patch
/// several times; the evaluation of a face compares 25 points once. With 4, a ball with a hole takes 1403 patches at 0.01 mm
/// instead of 367.
const COMPLETE_PATCH_COST: u64 = 10;

/// Counters of the work done, and its limits.
#[derive(Debug)]
pub(super) struct Budget {
    /// Patches evaluated in the current search.
    evaluated: AtomicU64,
    /// Work of earlier searches and of complete models.
    completed: AtomicU64,
    /// Limit of the saving of patches.
    saving: u64,
    /// An earlier search reached it.
    limited: AtomicBool,
    /// Times at which the saving of patches and the search end.
    ends: OnceLock<[Instant; 2]>,
    /// Where the progress of the refinement is reported.
    pub progress: Progress,
    stage: Stage,
}

impl Budget {
    /// Budget of a model with this number of faces.
    pub fn of_faces(faces: usize) -> Self {
        Self::new(SAVING_PATCHES_MAX + SAVING_PATCHES_PER_FACE * faces as u64)
    }

    /// The same budget, whose work is reported to `progress`: a search that ends at its limit of work or time at the latest.
    pub fn watched(self, progress: &Progress) -> Self {
        let limit = SEARCH_LIMIT_RATIO * self.saving;
        let stage = progress.limited_stage("search for the fewest patches", "patches", limit);
        Self { progress: progress.clone(), stage, ..self }
    }

    /// Reports the fraction of the work, or of the time if there is a limit.
    fn report(&self) {
        let Some([half, end]) = self.ends.get() else { return self.stage.raise_to(self.total()) };
        let time = 2.0 * end.duration_since(*half).as_secs_f64();
        let left = end.saturating_duration_since(Instant::now()).as_secs_f64();
        let done = if time > 0.0 { 1.0 - left / time } else { 1.0 };
        self.stage.raise_to((done * (SEARCH_LIMIT_RATIO * self.saving) as f64) as u64);
    }

    /// Budget of one face of a model with this number of faces, where each face is refined alone.
    pub fn of_single_face(faces: usize) -> Self {
        Self::new(SAVING_PATCHES_MAX / faces.max(1) as u64 + 5 * SAVING_PATCHES_PER_FACE)
    }

    /// Budget with this limit of the saving of patches.
    pub fn new(saving: u64) -> Self {
        let (evaluated, completed) = (AtomicU64::new(0), AtomicU64::new(0));
        Self {
            evaluated,
            completed,
            saving,
            limited: AtomicBool::new(false),
            ends: OnceLock::new(),
            progress: Progress::default(),
            stage: Progress::default().stage("", "", 0),
        }
    }

    /// Ends the search after `time`, and the saving of patches after half of it.
    pub fn limit_time(&self, time: Duration) {
        let start = Instant::now();
        let _ = self.ends.set([start + time / 2, start + time]);
    }

    /// The same budget with the time limit of another.
    pub fn in_time_of(self, other: &Self) -> Self {
        Self { ends: other.ends.clone(), ..self }
    }

    /// True when the time of the saving is over.
    pub fn is_late_to_save(&self) -> bool {
        self.is_late(0)
    }

    /// True when the search has a time limit.
    pub fn has_time_limit(&self) -> bool {
        self.ends.get().is_some()
    }

    /// True when the time of the saving (0) or of the search (1) is over.
    fn is_late(&self, end: usize) -> bool {
        self.ends.get().is_some_and(|ends| Instant::now() >= ends[end])
    }

    /// Starts a search. Its limit of the saving counts its own patches only; earlier work counts for the total limit.
    pub fn start_search(&self) {
        self.limited.fetch_or(!self.allows_saving(), Ordering::Relaxed);
        self.completed.fetch_add(self.evaluated.swap(0, Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Adds evaluated patches. The sum after a parallel section does not depend on the order of threads.
    pub fn add_evaluated(&self, patches: u64) {
        self.evaluated.fetch_add(patches, Ordering::Relaxed);
        self.report();
    }

    /// Adds the cost of a complete model with this number of patches.
    pub fn add_complete(&self, patches: u64) {
        self.completed.fetch_add(COMPLETE_PATCH_COST * patches, Ordering::Relaxed);
        self.report();
    }

    /// True when the remaining work covers a complete model with this number of patches.
    pub fn allows_complete(&self, patches: u64) -> bool {
        COMPLETE_PATCH_COST * patches <= self.remaining()
    }

    /// Patches evaluated in the current search.
    pub fn evaluated(&self) -> u64 {
        self.evaluated.load(Ordering::Relaxed)
    }

    /// Total work done, with complete models.
    pub fn total(&self) -> u64 {
        self.evaluated() + self.completed.load(Ordering::Relaxed)
    }

    /// True while divisions may be lowered and exchanged to save patches.
    pub fn allows_saving(&self) -> bool {
        self.evaluated() < self.saving && !self.is_late(0)
    }

    /// True while other models than one found may be made to save patches: the search and the complete models together
    /// are within the limit of the saving.
    pub fn allows_other_models(&self) -> bool {
        self.allows_saving() && self.total() < self.saving
    }

    /// True when no search has reached the limit of the saving.
    pub fn has_saved_all(&self) -> bool {
        self.allows_saving() && !self.limited.load(Ordering::Relaxed)
    }

    /// True while the search has used less than the fraction [`CHEAP_FRACTION`] of the limit of the saving.
    pub fn is_cheap(&self) -> bool {
        self.evaluated() < self.saving / CHEAP_FRACTION
    }

    /// Remaining work until the search ends.
    pub fn remaining(&self) -> u64 {
        if self.is_late(1) {
            return 0;
        }
        (SEARCH_LIMIT_RATIO * self.saving).saturating_sub(self.total())
    }

    /// True when the search must end.
    pub fn is_exhausted(&self) -> bool {
        self.remaining() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_that_an_earlier_search_reached_is_remembered() {
        let budget = Budget::new(10);
        budget.start_search();
        budget.add_evaluated(9);
        budget.start_search();
        assert!(budget.allows_saving() && budget.has_saved_all());
        budget.add_evaluated(10);
        assert!(!budget.allows_saving() && !budget.has_saved_all());
        budget.start_search();
        assert!(budget.allows_saving() && !budget.has_saved_all());
    }
}
