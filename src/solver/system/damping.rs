//! Pseudo-transient continuation (Kelley & Keyes 1998): control of the viscous stiffness.
//!
//! A step is an equilibrium with viscous forces about the last state. The stiffness is reduced after a converged
//! step, the more the fewer iterations it took. It is raised after a failed step, and stays above the failed value
//! until that is forgotten. When the viscous forces are small compared with their maximum, an equilibrium without
//! them is computed.

use crate::limits::easy_iterations;
use crate::numbers::tolerances::NEAR_EQUILIBRIUM_REL;

/// Initial damper stiffness over that of the mesh: a step moves the sheet by about a thousand times the elastic
/// displacement. With less the first step fails, with more it costs a step for every reduction.
const FIRST_STIFFNESS: f64 = 1e-3;
/// Factor between levels of the stiffness; one level above a stiffness that failed is the lower bound for the next
/// step. A larger factor would step over the range in which steps converge, a smaller one needs more steps.
pub(crate) const STIFFNESS_FACTOR: f64 = 2.0;
/// Levels by which a converged step reduces the stiffness, an easy one by twice as many, and by which a failed step
/// raises it. With one level a motion takes twice as many steps; with three an easy step would reduce it by a factor of 64.
const STEP_LEVELS: i32 = 2;
/// Maximum iterations of a viscous motion, and of an increment with viscous stabilisation or augmentation. Snap-throughs
/// of released sheets take 31 to 45, strips crushed until they buckle 223 to 810; a sheet without equilibrium never
/// converges.
pub(crate) const CONTINUATION_ITERATIONS_MAX: usize = 1000;

/// Use of the controller.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rules {
    /// Active-set cycling: every converged step counts as easy, and a failed one raises the stiffness by one level more,
    /// since it cycles again, but seldom with far more stiffness.
    Cycling,
    /// Past a limit point: an easy step takes at most half the target number of iterations `wanted`.
    LimitPoint {
        /// Target number of iterations of a step.
        wanted: usize,
    },
}

impl Rules {
    /// Factor of the stiffness after a failed step.
    fn rise(self) -> f64 {
        match self {
            Self::Cycling => STIFFNESS_FACTOR.powi(STEP_LEVELS + 1),
            Self::LimitPoint { .. } => STIFFNESS_FACTOR.powi(STEP_LEVELS),
        }
    }

    /// Factor of the stiffness after a step that converged in `iterations`.
    fn fall(self, iterations: usize) -> f64 {
        let levels = match self {
            Self::LimitPoint { wanted } if iterations > easy_iterations(wanted) => 0,
            Self::LimitPoint { wanted } if 2 * iterations > wanted => STEP_LEVELS,
            _ => 2 * STEP_LEVELS,
        };
        STIFFNESS_FACTOR.powi(-levels)
    }
}

/// Controller of the viscous stiffness.
#[derive(Debug, Clone)]
pub(crate) struct Continuation {
    rules: Rules,
    /// Damper stiffness over that of the mesh.
    pub(crate) stiffness: f64,
    /// Lower bound of the next steps, since less stiffness has failed.
    floor: f64,
    /// Minimum stiffness, for a sheet perturbed from an unstable equilibrium.
    least: f64,
    /// Viscous force at the last step, and at which an equilibrium without viscous forces is tried [N].
    force: f64,
    release: f64,
}

impl Continuation {
    /// Initial state; `least` is the minimum stiffness of the motion, if known.
    pub(crate) fn new(rules: Rules, least: Option<f64>) -> Self {
        let stiffness = least.unwrap_or(FIRST_STIFFNESS);
        let least = least.unwrap_or(0.0);
        Self { rules, stiffness, floor: 0.0, least, force: f64::INFINITY, release: 0.0 }
    }

    /// Whether a step at this stiffness hardly moves any node: the stiffness is as far above that of the mesh as the
    /// first one is below it. Failure is then not due to the damping.
    pub(crate) fn is_stiffest(&self) -> bool {
        self.stiffness * FIRST_STIFFNESS > 1.0
    }

    /// Registers a failed step.
    pub(crate) fn failed(&mut self) {
        self.floor = STIFFNESS_FACTOR * self.stiffness;
        self.stiffness *= self.rules.rise();
    }

    /// Registers a converged step with this norm of the viscous forces [N].
    pub(crate) fn converged(&mut self, iterations: usize, force: f64) {
        let less = self.stiffness * self.rules.fall(iterations);
        self.stiffness = less.max(self.floor).max(self.least);
        self.floor /= STIFFNESS_FACTOR;
        self.force = force;
        self.release = self.release.max(NEAR_EQUILIBRIUM_REL * force);
    }

    /// Whether an equilibrium without viscous forces should be tried.
    pub(crate) fn may_release(&self) -> bool {
        self.force <= self.release
    }

    /// Registers that no equilibrium without viscous forces was found.
    pub(crate) fn release_failed(&mut self) {
        // Past a limit point release is tried after every step with a small force. An active set that cycled again needs
        // a force that has fallen by as much as a failed step raises the stiffness.
        if matches!(self.rules, Rules::Cycling) {
            self.release = self.force / self.rules.rise();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_falls_while_steps_converge_and_stays_above_what_failed() {
        let mut control = Continuation::new(Rules::LimitPoint { wanted: 7 }, None);
        control.converged(3, 100.0);
        assert_eq!(control.stiffness, FIRST_STIFFNESS / 16.0);
        control.failed();
        assert_eq!(control.stiffness, FIRST_STIFFNESS / 4.0);
        // Twice the failed value remains, and then half of that.
        control.converged(2, 50.0);
        assert_eq!(control.stiffness, FIRST_STIFFNESS / 8.0);
        control.converged(7, 20.0);
        assert_eq!(control.stiffness, FIRST_STIFFNESS / 8.0);
        assert!(!control.may_release());
        control.converged(3, 1.0);
        assert!(control.may_release());
        control.release_failed();
        assert!(control.may_release());
    }

    #[test]
    fn out_of_cycling_release_is_tried_again_at_an_eighth_of_the_force() {
        let mut control = Continuation::new(Rules::Cycling, None);
        control.failed();
        assert_eq!(control.stiffness, 8.0 * FIRST_STIFFNESS);
        control.converged(20, 100.0);
        assert_eq!(control.stiffness, STIFFNESS_FACTOR * FIRST_STIFFNESS);
        control.converged(20, 1.0);
        assert!(control.may_release());
        control.release_failed();
        assert!(!control.may_release());
        control.converged(3, 0.09);
        assert!(control.may_release());
    }

    #[test]
    fn a_pushed_sheet_keeps_the_stiffness_that_it_needs() {
        let mut control = Continuation::new(Rules::LimitPoint { wanted: 7 }, Some(0.02));
        (0..5).for_each(|_| control.converged(1, 1.0));
        assert_eq!(control.stiffness, 0.02);
    }
}
