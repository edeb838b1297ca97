//! Pseudo-transient continuation (Kelley & Keyes 1998): how the viscous stiffness of the next step follows from the last one.
//!
//! A step is an equilibrium with viscous forces about the last state. After one that converged the stiffness falls, the faster
//! the easier it was; after one that did not it rises, and stays above what failed until that is forgotten. When the viscous
//! forces are small against the largest before, equilibrium without any is tried.

/// First stiffness of a node's damper over the mesh's: a step moves the sheet by some thousand times what its forces would.
const FIRST_STIFFNESS: f64 = 1e-3;
/// Factor by which the stiffness falls after a step that went well; after an easy one by its square.
const FALL: f64 = 4.0;
/// Iterations of a step that was easy, and of one that went well.
const EASY_ITERATIONS: usize = 3;
pub(in crate::solver) const GOOD_ITERATIONS: usize = 5;
/// Stiffness that the next step keeps over one that failed.
const MARGIN: f64 = 2.0;
/// Viscous forces over the largest before at which equilibrium without any is tried.
const RELEASE_FORCE_RATIO: f64 = 1e-2;

/// In what the uses of the controller differ.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Rules {
    /// Factor by which the stiffness rises after a step that failed.
    rise: f64,
    /// What is left after a step of the stiffness below which steps failed.
    memory: f64,
    /// Every step that converges counts as easy: those from a cycle are.
    all_easy: bool,
    /// Viscous forces over those where equilibrium without any failed, at which it is tried again; `None`: after every step.
    release_again: Option<f64>,
}

/// Out of active-set cycling: a step that fails cycles again, and one with far more stiffness seldom does.
pub(in crate::solver) const CYCLING: Rules =
    Rules { rise: 8.0, memory: 0.7, all_easy: true, release_again: Some(0.1) };
/// Past a limit point.
pub(in crate::solver) const LIMIT_POINT: Rules =
    Rules { rise: 4.0, memory: 0.5, all_easy: false, release_again: None };

/// Controls the viscous stiffness from step to step.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Continuation {
    rules: Rules,
    /// Stiffness of a node's damper over the mesh's.
    pub(in crate::solver) stiffness: f64,
    /// Stiffness that the next steps do not go below, as less has failed.
    floor: f64,
    /// Least stiffness: of a sheet that is pushed out of an unstable equilibrium.
    least: f64,
    /// Viscous force at the last step, and at which equilibrium without any is tried [N].
    force: f64,
    release: f64,
}

impl Continuation {
    /// Begins; `least`: stiffness that the motion needs at least, where it is known.
    pub(in crate::solver) fn new(rules: Rules, least: Option<f64>) -> Self {
        let stiffness = least.unwrap_or(FIRST_STIFFNESS);
        let least = least.unwrap_or(0.0);
        Self { rules, stiffness, floor: 0.0, least, force: f64::INFINITY, release: 0.0 }
    }

    /// A step did not converge.
    pub(in crate::solver) fn failed(&mut self) {
        self.floor = MARGIN * self.stiffness;
        self.stiffness *= self.rules.rise;
    }

    /// A step converged, with this norm of the viscous forces [N].
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

    /// Whether equilibrium without viscous forces is to be tried.
    pub(in crate::solver) fn may_release(&self) -> bool {
        self.force <= self.release
    }

    /// There was no equilibrium without viscous forces next to the last step.
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
        // Twice what failed remains, and then half of that.
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
