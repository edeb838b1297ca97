//! Stages of a process and what an increment reports.

use crate::solver::tools::motion::{Curve, Motion};

/// One stage: clamp, draw, release, ...
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name in the history.
    pub name: String,
    /// Duration [s]; only a label in a quasi-static run, > 0.
    pub duration: f64,
    /// What each tool does, in the order of the tools.
    pub motions: Vec<Motion>,
    /// Share of the set-up's loads over the stage.
    pub load: Curve,
    /// First increment, a share of the stage in (0, 1].
    pub first_step: f64,
    /// Largest increment, a share of the stage in (0, 1].
    pub largest_step: f64,
    /// Ends of increments, ascending shares of the stage in (0, 1]; empty: the run finds its own, as it does behind the
    /// last and where all tools are taken away.
    pub ends: Vec<f64>,
}

impl Stage {
    /// Length of the first step, as a share.
    pub(in crate::solver) fn first(&self) -> f64 {
        self.first_step.min(self.largest_step)
    }

    fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.motions.iter().filter_map(Motion::curve).chain([&self.load])
    }

    /// Share behind `share` at which a curve of a tool or the loads next turns, or the stage ends: increments end there.
    pub(in crate::solver) fn next_corner(&self, share: f64) -> f64 {
        let corners = self.curves().flat_map(Curve::corners);
        corners.filter(|corner| *corner > share).fold(1.0, f64::min)
    }

    /// Whether a tool or the loads turn back at `share`, or go on at less than half or more than twice the speed: then the next
    /// increment is not like the last.
    pub(in crate::solver) fn turns(&self, share: f64) -> bool {
        self.curves().filter(|curve| curve.corners().contains(&share)).any(|curve| {
            let [before, after] = curve.rates(share);
            !(0.5..=2.0).contains(&(after / before))
        })
    }
}
