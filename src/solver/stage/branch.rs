//! Stable and unstable equilibria, and the search for stable branches in a stage.

use serde::{Deserialize, Serialize};

use crate::geometry::numbers::COUNT_MAX;

/// Properties of an equilibrium: `lasts` is true if it is stable.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Found {
    pub(in crate::solver) lasts: bool,
    /// It was reached continuously from the last one, without snap-through.
    pub(in crate::solver) near: bool,
}

/// Search for a stable branch in a stage. A step from a stable to an unstable equilibrium may have passed a
/// bifurcation, whose stable branch shorter steps find. If neither they nor a perturbation lead to a stable
/// equilibrium, the unstable one is accepted and reported. The perturbation is repeated after 1, 2, 4, ...
/// increments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::solver) struct Doubt {
    /// The last equilibrium is stable.
    pub(in crate::solver) lasted: bool,
    /// Step over the first one of the stage below which it is not cut further to find another branch.
    pub(in crate::solver) shortest: f64,
    /// Unstable equilibria accepted before the next perturbation, and after it.
    left: usize,
    pause: usize,
}

impl Doubt {
    /// Initial state.
    pub(in crate::solver) const NONE: Self =
        Self { lasted: true, shortest: 0.02, left: 0, pause: 1 };

    /// Whether the counts are those of a valid run.
    pub(in crate::solver) fn is_sound(&self) -> bool {
        [self.left, self.pause].into_iter().all(|count| count <= COUNT_MAX)
    }

    /// Factor of [`Self::shortest`] after shorter steps have found no other branch; fewer attempts are then made.
    const RETRY_FACTOR: f64 = 5.0;

    /// Whether shorter steps or a perturbation may lead to a stable equilibrium.
    pub(in crate::solver) fn may_find_another(&self) -> bool {
        self.lasted || self.left == 0
    }

    /// Registers an accepted equilibrium.
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
