//! Step size control of a stage.

use serde::{Deserialize, Serialize};

use crate::limits::easy_iterations;
use crate::newton::outcome::Patience;
use crate::system::damping::CONTINUATION_ITERATIONS_MAX;
use kanagata_geometry::numbers::COUNT_MAX;

/// Controls the size of the next step (fraction of the stage).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pace {
    pub(crate) step: f64,
    largest: f64,
    wanted_iterations: usize,
    /// Failures since the last successful increment.
    failures: usize,
    /// Upper limit due to a recent failure.
    ceiling: Option<f64>,
}

impl Pace {
    /// Whether steps are fractions of a stage, and counts those of a valid run.
    pub(crate) fn is_sound(&self) -> bool {
        let share = |step: f64| step > 0.0 && step <= 1.0;
        let counts = [self.wanted_iterations, self.failures];
        share(self.step)
            && share(self.largest)
            && self.ceiling.is_none_or(|c| c > 0.0)
            && counts.into_iter().all(|count| count <= COUNT_MAX)
    }

    pub(crate) fn new(first: f64, largest: f64, wanted_iterations: usize) -> Self {
        let step = first.min(largest);
        Self { step, largest, wanted_iterations, failures: 0, ceiling: None }
    }

    /// After repeated failures an increment may use all its iterations.
    pub(crate) fn patience(&self) -> Patience {
        if self.failures >= 4 { Patience::All } else { Patience::Hopeful }
    }

    /// Whether the current increment has been cut.
    pub(crate) fn has_failed(&self) -> bool {
        self.failures > 0
    }

    /// Increases the step after easy increments and reduces it after hard ones; a size that failed is approached
    /// slowly.
    pub(crate) fn went_well(&mut self, iterations: usize) {
        let (n, wanted) = (iterations, self.wanted_iterations);
        let factor = match n {
            n if n <= easy_iterations(wanted) => 1.5,
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

    /// Limits the next step by the error of the increment.
    pub(crate) fn limit(&mut self, step: f64) {
        self.step = self.step.min(step);
    }

    pub(crate) fn failed(&mut self, step: f64) {
        self.failures += 1;
        self.ceiling = Some(0.7 * step);
        self.step = 0.4 * step;
    }
}

/// Maximum iterations of viscous motions in a stage; halved after each motion that did not converge, but not below the
/// limit of a normal increment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Endurance {
    pub(crate) iterations: usize,
}

impl Endurance {
    /// Initial value.
    pub(crate) const FULL: Self = Self { iterations: CONTINUATION_ITERATIONS_MAX };

    /// Whether it does not exceed the initial value.
    pub(crate) fn is_sound(&self) -> bool {
        self.iterations <= CONTINUATION_ITERATIONS_MAX
    }

    /// Value after a viscous motion that has ended in equilibrium (`rest`) or not; `least` is the maximum number of
    /// iterations of an increment.
    pub(crate) fn after(&self, rest: bool, least: usize) -> Self {
        let halved = (self.iterations / 2).max(least.min(self.iterations));
        if rest { Self::FULL } else { Self { iterations: halved } }
    }
}
