//! Progress of long operations: stages that count what is done, and a receiver that a program gives.
//!
//! The library knows no terminal. An operation opens a [`Stage`] with the number of things it will do and counts them; the
//! receiver is called when a stage begins and at most [`REPORTS_MAX`] times on its way, from whatever thread counts. Without a
//! receiver a count is one comparison.
//!
//! ```
//! use std::sync::{Arc, Mutex};
//! use kanagata_progress::Progress;
//!
//! let seen = Arc::new(Mutex::new(Vec::new()));
//! let kept = Arc::clone(&seen);
//! let progress = Progress::new(move |report| kept.lock().unwrap().push(report.done));
//! let stage = progress.stage("mesh", "faces", 2);
//! stage.add(1);
//! stage.add(1);
//! assert_eq!(*seen.lock().unwrap(), [0, 1, 2]);
//! ```

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Calls of the receiver within a stage at most, besides its begin. Doubled: bars move in steps of 0.05 % instead of 0.1 %.
pub const REPORTS_MAX: u64 = 1000;

/// How far a stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Report {
    /// Name of the stage, as `mesh`, `search` or `audit`.
    pub stage: &'static str,
    /// What is counted, as `faces`.
    pub unit: &'static str,
    /// Number of these that are done.
    pub done: u64,
    /// Number at the end of the stage; 0 where it is unknown.
    pub total: u64,
    /// True where `total` is a limit that most operations do not reach: what is left is at most the difference.
    pub is_limit: bool,
}

impl Report {
    /// Fraction of the stage that is done, 0 to 1; `None` where the end is unknown.
    #[must_use]
    pub fn fraction(&self) -> Option<f64> {
        (self.total > 0).then(|| (self.done as f64 / self.total as f64).min(1.0))
    }
}

type Receiver = dyn Fn(&Report) + Send + Sync;

/// Where an operation reports its progress: a receiver, or by default nothing. Clones have the same receiver.
#[derive(Clone, Default)]
pub struct Progress(Option<Arc<Receiver>>);

impl Progress {
    /// Reports to `receiver`, which may be called from several threads at a time and should return soon.
    pub fn new(receiver: impl Fn(&Report) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(receiver)))
    }

    /// Begins a stage of `total` things of the kind `unit`; 0 where the number is unknown.
    #[must_use]
    pub fn stage(&self, stage: &'static str, unit: &'static str, total: u64) -> Stage {
        Stage::begun(self.0.clone(), Report { stage, unit, done: 0, total, is_limit: false })
    }

    /// As [`Self::stage`], for a search that ends at `limit` things at the latest.
    #[must_use]
    pub fn limited_stage(&self, stage: &'static str, unit: &'static str, limit: u64) -> Stage {
        Stage::begun(self.0.clone(), Report { stage, unit, done: 0, total: limit, is_limit: true })
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Progress(receiver)" } else { "Progress(none)" })
    }
}

/// Options that differ only in who watches are the same: the receiver changes no result.
impl PartialEq for Progress {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A part of an operation, with its count.
pub struct Stage {
    receiver: Option<Arc<Receiver>>,
    begin: Report,
    done: AtomicU64,
}

impl Stage {
    fn begun(receiver: Option<Arc<Receiver>>, begin: Report) -> Self {
        if let Some(receiver) = &receiver {
            receiver(&begin);
        }
        Self { receiver, begin, done: AtomicU64::new(0) }
    }

    /// Counts `more` things as done.
    pub fn add(&self, more: u64) {
        if let Some(receiver) = &self.receiver {
            let before = self.done.fetch_add(more, Ordering::Relaxed);
            self.report(receiver, before, before + more);
        }
    }

    /// Raises the count to `done` in all; a smaller number changes nothing.
    pub fn raise_to(&self, done: u64) {
        if let Some(receiver) = &self.receiver {
            let before = self.done.fetch_max(done, Ordering::Relaxed);
            self.report(receiver, before, done);
        }
    }

    /// Calls the receiver where the count passes one of [`REPORTS_MAX`] equal steps.
    fn report(&self, receiver: &Arc<Receiver>, before: u64, done: u64) {
        let total = self.begin.total;
        let step = |count: u64| u128::from(count) * u128::from(REPORTS_MAX) / u128::from(total);
        if total > 0 && done > before && step(before.min(total)) < step(done.min(total)) {
            receiver(&Report { done: done.min(total), ..self.begin });
        }
    }
}

impl fmt::Debug for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Stage").field(&self.begin).field(&self.done).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    fn recorder() -> (Progress, Arc<Mutex<Vec<Report>>>) {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&seen);
        (Progress::new(move |report| kept.lock().unwrap().push(*report)), seen)
    }

    #[test]
    fn counts_of_many_threads_make_at_most_a_thousand_reports_and_reach_the_end() {
        let (progress, seen) = recorder();
        let stage = progress.stage("audit", "patches", 80_000);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..20_000).for_each(|_| stage.add(1)));
            }
        });
        let seen = seen.lock().unwrap();
        assert_eq!(seen.len() as u64, 1 + REPORTS_MAX);
        assert!(seen.iter().any(|r| r.fraction() == Some(1.0)));
    }

    #[test]
    fn a_count_never_falls_and_stays_within_its_limit() {
        let (progress, seen) = recorder();
        let stage = progress.limited_stage("search", "patches", 10);
        [4, 2, 30].into_iter().for_each(|n| stage.raise_to(n));
        let done: Vec<u64> = seen.lock().unwrap().iter().map(|r| r.done).collect();
        assert_eq!(done, [0, 4, 10]);
        assert!(seen.lock().unwrap().iter().all(|r| r.is_limit));
    }

    #[test]
    fn a_stage_of_unknown_length_reports_its_begin_only() {
        let (progress, seen) = recorder();
        progress.stage("read", "", 0).add(5);
        assert_eq!(seen.lock().unwrap().len(), 1);
        assert_eq!(seen.lock().unwrap()[0].fraction(), None);
    }
}
