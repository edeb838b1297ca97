//! Equilibria that last and those that do not, and what a stage makes of them.

use serde::{Deserialize, Serialize};

use crate::geometry::numbers::COUNT_MAX;

/// A balance.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Found {
    pub(in crate::solver) lasts: bool,
    /// It follows from the last one; the sheet has not jumped to it.
    pub(in crate::solver) near: bool,
}

/// What a stage makes of balances that do not last. A step from one that lasts to one that does not may have passed by the
/// branch that the sheet takes, which shorter steps find; where neither they nor a push do it is taken, and told, and the sheet
/// pushed again later, after twice as many increments each time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::solver) struct Doubt {
    /// The last balance lasts.
    pub(in crate::solver) lasted: bool,
    /// Steps over the stage's first that are not made shorter to find another branch.
    pub(in crate::solver) shortest: f64,
    /// Balances that do not last and are taken as they are before the sheet is pushed again, and the same after that.
    left: usize,
    pause: usize,
}

impl Doubt {
    /// None yet.
    pub(in crate::solver) const NONE: Self =
        Self { lasted: true, shortest: 0.02, left: 0, pause: 1 };

    /// Whether its counts can be those of a run.
    pub(in crate::solver) fn is_sound(&self) -> bool {
        [self.left, self.pause].into_iter().all(|count| count <= COUNT_MAX)
    }

    /// Factor by which less is tried in a stage after shorter steps have found no other branch.
    const RETRY_FACTOR: f64 = 5.0;

    /// Whether shorter steps than one to a balance that does not last, or a push, may lead to one that does.
    pub(in crate::solver) fn may_find_another(&self) -> bool {
        self.lasted || self.left == 0
    }

    /// A balance has been taken.
    pub(in crate::solver) fn took(&mut self, found: Found) {
        if self.lasted && !(found.lasts && found.near) {
            self.shortest *= Self::RETRY_FACTOR;
        }
        self.lasted = found.lasts;
        if found.lasts {
            return;
        }
        if self.left == 0 {
            (self.left, self.pause) = (self.pause, 2 * self.pause);
        } else {
            self.left -= 1;
        }
    }
}
