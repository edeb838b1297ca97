//! How long the steps of a stage are.

use serde::{Deserialize, Serialize};

use crate::geometry::numbers::COUNT_MAX;
use crate::solver::newton::outcome::Patience;

/// Iterations of a viscous motion, first and least: snap-throughs of released sheets take 31 to 45, strips crushed until they
/// buckle 223 to 810; a sheet without equilibrium never ends.
const MAX_FOLLOWING_ITERATIONS: usize = 1000;
const MIN_FOLLOWING_ITERATIONS: usize = 125;

/// How large the next step is (share of the stage).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::solver) struct Pace {
    pub(in crate::solver) step: f64,
    largest: f64,
    wanted_iterations: usize,
    /// Failures since the last increment that went well.
    failures: usize,
    /// Steps above this failed not long ago.
    ceiling: Option<f64>,
}

impl Pace {
    /// Whether its steps are shares of a stage, and its counts those of a run.
    pub(in crate::solver) fn is_sound(&self) -> bool {
        let share = |step: f64| step > 0.0 && step <= 1.0;
        let counts = [self.wanted_iterations, self.failures];
        share(self.step)
            && share(self.largest)
            && self.ceiling.is_none_or(|c| c > 0.0)
            && counts.into_iter().all(|count| count <= COUNT_MAX)
    }

    pub(in crate::solver) fn new(first: f64, largest: f64, wanted_iterations: usize) -> Self {
        let step = first.min(largest);
        Self { step, largest, wanted_iterations, failures: 0, ceiling: None }
    }

    /// After repeated failures an increment may take its time.
    pub(in crate::solver) fn patience(&self) -> Patience {
        if self.failures >= 4 { Patience::All } else { Patience::Hopeful }
    }

    /// Whether the increment under way has been cut.
    pub(in crate::solver) fn has_failed(&self) -> bool {
        self.failures > 0
    }

    /// Larger after easy increments, smaller after hard ones; a step that failed is approached slowly.
    pub(in crate::solver) fn went_well(&mut self, iterations: usize) {
        let (n, wanted) = (iterations, self.wanted_iterations);
        let factor = match n {
            n if 4 * n <= 3 * wanted => 1.5,
            n if 4 * n <= 5 * wanted => 1.2,
            n if 2 * n <= 3 * wanted => 1.1,
            n if n <= 3 * wanted => 1.0,
            _ => 0.7,
        };
        self.failures = 0;
        let ceiling = self.ceiling.unwrap_or(f64::INFINITY);
        self.step = (factor * self.step).min(ceiling).min(self.largest);
        self.ceiling = self.ceiling.map(|c| 1.15 * c);
    }

    pub(in crate::solver) fn failed(&mut self, step: f64) {
        self.failures += 1;
        self.ceiling = Some(0.7 * step);
        self.step = 0.4 * step;
    }
}

/// How long the sheet is followed in a stage: half as long after each time that it has come to no rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::solver) struct Endurance {
    pub(in crate::solver) iterations: usize,
}

impl Endurance {
    /// All the way.
    pub(in crate::solver) const FULL: Self = Self { iterations: MAX_FOLLOWING_ITERATIONS };

    /// Whether it is no longer than all the way.
    pub(in crate::solver) fn is_sound(&self) -> bool {
        self.iterations <= MAX_FOLLOWING_ITERATIONS
    }

    /// What is left of it after a sheet has come to rest, or has not.
    pub(in crate::solver) fn after(&self, rest: bool) -> Self {
        let less = Self { iterations: (self.iterations / 2).max(MIN_FOLLOWING_ITERATIONS) };
        if rest { Self::FULL } else { less }
    }
}
