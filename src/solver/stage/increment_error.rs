//! Error of the forces from the length of an increment, and the step that keeps it small.
//!
//! Plastic flow and sliding friction act along the mean direction of their increment (backward Euler). The work that they
//! lack where this direction turns, over the work of the increment, estimates the relative error of the forces.

use super::state::Simulation;
use crate::assembly::WorkError;
use crate::contact::candidate::Force;
use kanagata_geometry::Vec3;

/// Allowed relative error of an increment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AllowedError(pub(crate) f64);

impl AllowedError {
    /// Whether the step after an increment with this error would be at most half as long: the increment is repeated with it.
    /// For a smaller error it costs less to shorten the next step only.
    pub(crate) fn is_far_exceeded(self, error: f64) -> bool {
        error > 2.0 * self.0
    }

    /// Length of the next step after one of length `step` with this error, > 0. Errors grow with the square of the step.
    /// Half of the allowed error is aimed at, since true errors are up to twice the estimates.
    pub(crate) fn next_step(self, step: f64, error: f64) -> f64 {
        if error > 0.0 { step * (0.5 * self.0 / error).sqrt() } else { f64::INFINITY }
    }
}

/// Error of the increment before it is committed, of the complete process; `forces` are the current forces of the tools on
/// the nodes.
pub(crate) fn increment_error(sim: &Simulation, forces: &[Force]) -> WorkError {
    sim.sys.body.flow_direction_error().plus(sliding_error(sim, forces)).times(sim.share)
}

/// Error of nodes that slide on one tool throughout the increment.
fn sliding_error(sim: &Simulation, forces: &[Force]) -> WorkError {
    let sys = &sim.sys;
    let ends = sys.contact.before().zip(forces);
    let slides = sys
        .contact
        .candidates
        .iter()
        .zip(ends)
        .filter(|(c, ((touched, _), _))| c.active && *touched);
    slides.fold(WorkError::default(), |sum, (c, ((_, before), now))| {
        let slip: Vec3 = sys.position(c.node) - sys.tools[c.tool].shift() - c.start;
        let (old, new) = (before.tangential(), now.tangential());
        let products = [old.norm_squared(), new.norm_squared(), old.dot(&new)];
        sum.plus(WorkError::of(-new.dot(&slip), products, 0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_the_square_root_of_the_error() {
        let allowed = AllowedError(0.01);
        assert!((allowed.next_step(0.1, 0.02) - 0.05).abs() < 1e-15);
        assert!((allowed.next_step(0.1, 0.00125) - 0.2).abs() < 1e-15);
        assert_eq!(allowed.next_step(0.1, 0.0), f64::INFINITY);
        assert!(!allowed.is_far_exceeded(0.0199) && allowed.is_far_exceeded(0.0201));
    }
}
