//! The work that a refinement may do, counted in patches that are made and audited: the same for any number of threads.

use std::sync::atomic::{AtomicU64, Ordering};

/// Patches judged from which on a search takes the divisions that it has and saves no more patches: so many, and
/// [`SAVING_PER_FACE`] for each face. With a tenth of them a ball with a hole takes 164 patches instead of 100. Doubled, files in
/// which saving does not end take twice as long.
const SAVING: u64 = 60_000;
/// Patches judged for each face of the model.
const SAVING_PER_FACE: u64 = 200;
/// Times this work after which a search that has not come to the tolerance ends. Doubled, files that never come to it take
/// twice as long to say so: 16 s of the processor for 13 faces.
const GROWTH: u64 = 2;
/// Patches that the balance and the audit of a finished model cost for each of its patches: they compare 81 points of a
/// patch several times, the judge 25 once.
const FINISHED: u64 = 8;

/// Work done, and its limits.
#[derive(Debug)]
pub(super) struct Budget {
    /// Of the search under way.
    judged: AtomicU64,
    /// Of searches before it, and of finished models.
    finished: AtomicU64,
    saving: u64,
}

impl Budget {
    /// For a model of so many faces.
    pub fn of_faces(faces: usize) -> Self {
        Self::new(SAVING + SAVING_PER_FACE * faces as u64)
    }

    /// For one of so many faces that are searched one by one.
    pub fn of_one(faces: usize) -> Self {
        Self::new(SAVING / faces.max(1) as u64 + 5 * SAVING_PER_FACE)
    }

    /// With this work until no more patches are saved.
    pub const fn new(saving: u64) -> Self {
        Self { judged: AtomicU64::new(0), finished: AtomicU64::new(0), saving }
    }

    /// A new search begins: its own patches alone decide how long it saves; those before it stay part of the work.
    pub fn begin(&self) {
        self.finished.fetch_add(self.judged.swap(0, Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Adds patches judged. What is read between parallel parts does not depend on their order.
    pub fn add(&self, patches: u64) {
        self.judged.fetch_add(patches, Ordering::Relaxed);
    }

    /// Adds a finished model of so many patches, each of which costs [`FINISHED`].
    pub fn add_finished(&self, patches: u64) {
        self.finished.fetch_add(FINISHED * patches, Ordering::Relaxed);
    }

    /// Whether so much work is left as a finished model of so many patches costs.
    pub fn allows_finished(&self, patches: u64) -> bool {
        FINISHED * patches <= self.left()
    }

    /// Patches judged.
    fn judged(&self) -> u64 {
        self.judged.load(Ordering::Relaxed)
    }

    /// Work done, finished models among it.
    pub fn spent(&self) -> u64 {
        self.judged() + self.finished.load(Ordering::Relaxed)
    }

    /// Whether divisions are still lowered and exchanged to save patches.
    pub fn saves(&self) -> bool {
        self.judged() < self.saving
    }

    /// The same while an eighth of that work is not done.
    pub fn is_easy(&self) -> bool {
        self.judged() < self.saving / 8
    }

    /// Work that is left before the search ends.
    pub fn left(&self) -> u64 {
        (GROWTH * self.saving).saturating_sub(self.spent())
    }

    /// Whether the search ends, whatever it has found.
    pub fn is_spent(&self) -> bool {
        self.left() == 0
    }
}
