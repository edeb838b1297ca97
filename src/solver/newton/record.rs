//! Record of an iteration.

use crate::numbers::tolerances::{NEAR_EQUILIBRIUM_REL, ROUNDING_REL};

/// Ratio of a residual to its reference above which the iteration makes no progress: to that of an earlier iterate with
/// the same active set, or to the contact forces after several iterations. With half the ratio increments are cut that
/// would have converged: iterations rise by 4 %.
pub(super) const STAGNATION_RATIO: f64 = 0.3;

/// One Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRecord {
    /// Residual force over its reference.
    pub residual: f64,
    /// Largest violation of a gap condition [mm].
    pub gap: f64,
    /// Largest penetration of a node [mm]; with a contact spring it differs from the violation.
    pub penetration: f64,
    /// Norm of the displacement correction of this iteration [mm].
    pub correction: f64,
    /// Nodes in contact.
    pub contacts: usize,
    /// Nodes in contact that slip.
    pub slipping: usize,
    /// Nodes in contact that stick according to the law without transition.
    pub stuck: usize,
    /// Contact states (contact or separation) that changed since the last iteration.
    pub changes: usize,
}

/// Observed order of convergence of an increment, from the last three consecutive residuals that decrease within the
/// basin of convergence. They must be below a hundredth of the contact forces, above rounding, and without changes of
/// contact states (contact or separation, stick or slip). `None` if there are no such three.
#[must_use]
pub fn convergence_order(history: &[IterationRecord]) -> Option<f64> {
    let is_asymptotic = |w: &[IterationRecord]| {
        let states = |r: &IterationRecord| [r.contacts, r.slipping, r.stuck];
        w.iter().all(|r| r.changes == 0 && states(r) == states(&w[0]))
            && w[0].residual < NEAR_EQUILIBRIUM_REL
            && w[2].residual > ROUNDING_REL
    };
    // The first correction uses the predicted law, not the tangent of its iterate.
    let last = history.get(1..)?.windows(3).rev().find(|w| is_asymptotic(w))?;
    let fall = |k: usize| (last[k].residual / last[k + 1].residual).ln();
    // Asymptotic decrease is at least of order 3/2: by the square root of the residual at the border of the basin.
    (fall(0) > -0.5 * NEAR_EQUILIBRIUM_REL.ln() && fall(1) > 0.0).then(|| fall(1) / fall(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(residuals: &[f64]) -> Vec<IterationRecord> {
        let record = |&residual: &f64| IterationRecord {
            residual,
            gap: 0.0,
            penetration: 0.0,
            correction: 0.0,
            contacts: 10,
            slipping: 2,
            stuck: 0,
            changes: 0,
        };
        residuals.iter().map(record).collect()
    }

    #[test]
    fn the_order_is_that_of_the_last_newton_steps() {
        let order = |residuals: &[f64]| convergence_order(&history(residuals));
        assert!((order(&[0.05, 9e-3, 8.1e-5, 6.561e-9]).unwrap() - 2.0).abs() < 1e-12);
        // Elastic increment: the first correction uses the prediction, and one more converges.
        assert_eq!(order(&[1.2e-3, 1.3e-4, 4.6e-9]), None);
        // An intermediate decrease by less than a factor of ten.
        assert_eq!(order(&[0.9, 0.09, 0.08, 1e-6]), None);
    }
}
