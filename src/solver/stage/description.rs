//! Stages of a process.

use crate::tools::motion::{Curve, Motion};

/// One stage, for example clamping, drawing or release.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name in the history.
    pub name: String,
    /// Duration [s]; only a label in a quasi-static run, > 0.
    pub duration: f64,
    /// Motion of each tool, in the order of the tools.
    pub motions: Vec<Motion>,
    /// Factor of the loads of the model over the stage.
    pub load: Curve,
    /// First increment, as a fraction of the stage in (0, 1].
    pub first_step: f64,
    /// Largest increment, as a fraction of the stage in (0, 1].
    pub largest_step: f64,
    /// Prescribed ends of increments, ascending fractions of the stage in (0, 1]. Behind the last one, without any,
    /// and in a stage that releases all tools, the step size is controlled automatically.
    pub ends: Vec<f64>,
}

impl Stage {
    /// Length of the first step, as a fraction of the stage.
    pub(crate) fn first(&self) -> f64 {
        self.first_step.min(self.largest_step)
    }

    fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.motions.iter().filter_map(Motion::curve).chain([&self.load])
    }

    /// Next corner of a curve of a tool or load after `share`, or the end of the stage; increments end there.
    pub(crate) fn next_corner(&self, share: f64) -> f64 {
        let corners = self.curves().flat_map(Curve::corners);
        corners.filter(|corner| *corner > share).fold(1.0, f64::min)
    }

    /// Whether at `share` the rate of a tool or load changes sign, or by more than a factor of two. The last
    /// increment then does not predict the next one.
    pub(crate) fn turns(&self, share: f64) -> bool {
        self.curves().filter(|curve| curve.corners().contains(&share)).any(|curve| {
            let [before, after] = curve.rates(share);
            !(0.5..=2.0).contains(&(after / before))
        })
    }
}
