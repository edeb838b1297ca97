//! Stable and unstable equilibria, and the search for stable branches in a stage.

use serde::{Deserialize, Serialize};

use kanagata_geometry::numbers::COUNT_MAX;

/// Step over the first one of the stage below which a limit point is assumed, or another branch is no longer searched
/// for by shorter steps. Five step cuts in succession lead there; that many
/// failures of ever shorter steps are due to the sheet, not to the iteration.
pub(crate) const LIMIT_POINT_STEP_RATIO: f64 = 0.02;
/// Factor of that step: of the step by which the next equilibrium is sought beyond a limit point, and of the step at
/// which the next search for another branch ends if one had no success. A step of the size of those that failed
/// would end at the limit point again, and a search that had no success is repeated with two step cuts fewer.
pub(crate) const BRANCH_STEP_FACTOR: f64 = 5.0;

/// Properties of an equilibrium: `lasts` is true if it is stable.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    pub(crate) lasts: bool,
    /// It was reached continuously from the last one, without snap-through.
    pub(crate) near: bool,
}

/// Search for a stable branch in a stage. A step from a stable to an unstable equilibrium may have passed a
/// bifurcation, whose stable branch shorter steps find. If neither they nor a perturbation lead to a stable
/// equilibrium, the unstable one is accepted and reported. The perturbation is repeated after 1, 2, 4, ...
/// increments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Doubt {
    /// The last equilibrium is stable.
    pub(crate) lasted: bool,
    /// Step over the first one of the stage below which it is not cut further to find another branch.
    pub(crate) shortest: f64,
    /// Unstable equilibria accepted before the next perturbation, and after it.
    left: usize,
    pause: usize,
}

impl Doubt {
    /// Initial state.
    pub(crate) const NONE: Self =
        Self { lasted: true, shortest: LIMIT_POINT_STEP_RATIO, left: 0, pause: 1 };

    /// Whether the counts are those of a valid run.
    pub(crate) fn is_sound(&self) -> bool {
        [self.left, self.pause].into_iter().all(|count| count <= COUNT_MAX)
    }

    /// Whether shorter steps or a perturbation may lead to a stable equilibrium.
    pub(crate) fn may_find_another(&self) -> bool {
        self.lasted || self.left == 0
    }

    /// Registers an accepted equilibrium.
    pub(crate) fn took(&mut self, found: Found) {
        if self.lasted && !(found.lasts && found.near) {
            self.shortest *= BRANCH_STEP_FACTOR;
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
