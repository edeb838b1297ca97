//! The work that a refinement may do, counted in patches that are made and audited: the same for any number of threads.

use std::sync::atomic::{AtomicU64, Ordering};

/// Patches judged from which on a search takes the divisions that it has and saves no more patches: so many, and
/// [`SAVING_PER_FACE`] for each face. pan_144 (31 faces) has 108 patches with and without it. Doubled, files in which saving
/// does not end take twice as long.
const SAVING: u64 = 4_000;
/// Patches judged for each face of the model.
const SAVING_PER_FACE: u64 = 200;
/// Times this work after which a search that has not come to the tolerance ends: a tolerance that needs more than some
/// thousand patches is reached within it, one that a fault of the CAD stands in the way of never is.
const GROWTH: u64 = 8;
/// Patches that the balance and the audit of a finished model cost for each of its patches: they compare 81 points of a
/// patch several times, the judge 25 once.
pub(super) const FINISHED: u64 = 8;

/// Work done, and its limits.
#[derive(Debug)]
pub(super) struct Budget {
    spent: AtomicU64,
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
        Self { spent: AtomicU64::new(0), saving }
    }

    /// Adds work. What is read between parallel parts does not depend on their order.
    pub fn add(&self, patches: u64) {
        self.spent.fetch_add(patches, Ordering::Relaxed);
    }

    /// Work done.
    pub fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Whether divisions are still lowered and exchanged to save patches.
    pub fn saves(&self) -> bool {
        self.spent() < self.saving
    }

    /// The same while an eighth of that work is not done.
    pub fn is_easy(&self) -> bool {
        self.spent() < self.saving / 8
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
