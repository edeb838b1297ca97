//! Pseudo-transient continuation (Kelley & Keyes 1998): control of the viscous stiffness.
//!
//! A step is an equilibrium with viscous forces about the last state. The stiffness is reduced after a converged
//! step, the more the fewer iterations it took. It is raised after a failed step, and stays above the failed value
//! until that is forgotten. When the viscous forces are small compared with their maximum, an equilibrium without
//! them is computed.

/// Initial damper stiffness over that of the mesh: a step moves the sheet by about a thousand times the elastic
/// displacement.
const FIRST_STIFFNESS: f64 = 1e-3;
/// Reduction factor of the stiffness after a converged step; squared after an easy one.
const FALL: f64 = 4.0;
/// Maximum iterations of an easy step, and of one after which the stiffness is reduced.
const EASY_ITERATIONS: usize = 3;
pub(in crate::solver) const GOOD_ITERATIONS: usize = 5;
/// Minimum ratio of the next stiffness to the one that failed.
const MARGIN: f64 = 2.0;
/// Viscous force over its maximum at which an equilibrium without viscous forces is tried.
const RELEASE_FORCE_RATIO: f64 = 1e-2;

/// Parameters of the controller, by use.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Rules {
    /// Factor of the stiffness after a failed step.
    rise: f64,
    /// Factor, in each step, of the lower bound due to failed steps.
    memory: f64,
    /// Every converged step counts as easy, as after active-set cycling.
    all_easy: bool,
    /// Ratio of the viscous force to that at the last failed release, at which release is tried again; `None`: after
    /// every step.
    release_again: Option<f64>,
}

/// Active-set cycling: a step that fails cycles again, but seldom with far more stiffness.
pub(in crate::solver) const CYCLING: Rules =
    Rules { rise: 8.0, memory: 0.7, all_easy: true, release_again: Some(0.1) };
/// Past a limit point.
pub(in crate::solver) const LIMIT_POINT: Rules =
    Rules { rise: 4.0, memory: 0.5, all_easy: false, release_again: None };

/// Controller of the viscous stiffness.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Continuation {
    rules: Rules,
    /// Damper stiffness over that of the mesh.
    pub(in crate::solver) stiffness: f64,
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
    pub(in crate::solver) fn new(rules: Rules, least: Option<f64>) -> Self {
        let stiffness = least.unwrap_or(FIRST_STIFFNESS);
        let least = least.unwrap_or(0.0);
        Self { rules, stiffness, floor: 0.0, least, force: f64::INFINITY, release: 0.0 }
    }

    /// Registers a failed step.
    pub(in crate::solver) fn failed(&mut self) {
        self.floor = MARGIN * self.stiffness;
        self.stiffness *= self.rules.rise;
    }

    /// Registers a converged step with this norm of the viscous forces [N].
    pub(in crate::solver) fn converged(&mut self, iterations: usize, force: f64) {
        let less = match iterations {
            n if n <= EASY_ITERATIONS || self.rules.all_easy => FALL * FALL,
            n if n <= GOOD_ITERATIONS => FALL,
            _ => 1.0,
        };
        self.stiffness = (self.stiffness / less).max(self.floor).max(self.least);
        self.floor *= self.rules.memory;
        self.force = force;
        self.release = self.release.max(RELEASE_FORCE_RATIO * force);
    }

    /// Whether an equilibrium without viscous forces should be tried.
    pub(in crate::solver) fn may_release(&self) -> bool {
        self.force <= self.release
    }

    /// Registers that no equilibrium without viscous forces was found.
    pub(in crate::solver) fn release_failed(&mut self) {
        if let Some(ratio) = self.rules.release_again {
            self.release = ratio * self.force;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_falls_while_steps_converge_and_stays_above_what_failed() {
        let mut control = Continuation::new(LIMIT_POINT, None);
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
    fn out_of_cycling_release_is_tried_again_at_a_tenth_of_the_force() {
        let mut control = Continuation::new(CYCLING, None);
        control.failed();
        assert_eq!(control.stiffness, 8.0 * FIRST_STIFFNESS);
        control.converged(20, 100.0);
        assert_eq!(control.stiffness, MARGIN * FIRST_STIFFNESS);
        control.converged(20, 1.0);
        assert!(control.may_release());
        control.release_failed();
        assert!(!control.may_release());
        control.converged(3, 0.09);
        assert!(control.may_release());
    }

    #[test]
    fn a_pushed_sheet_keeps_the_stiffness_that_it_needs() {
        let mut control = Continuation::new(LIMIT_POINT, Some(0.02));
        (0..5).for_each(|_| control.converged(1, 1.0));
        assert_eq!(control.stiffness, 0.02);
    }
}
