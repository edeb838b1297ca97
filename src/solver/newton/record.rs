//! What is recorded of an iteration.

/// Residual below which the linearised system is what matters: corrections are taken whole.
pub(in crate::solver) const NEAR: f64 = 1e-2;

/// One Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRecord {
    /// Residual force over its reference.
    pub residual: f64,
    /// Largest violation of a contact condition on the gap [mm].
    pub gap: f64,
    /// Deepest node in a tool [mm]; with a spring between them that is not the violation.
    pub penetration: f64,
    /// Norm of the displacement correction that led here [mm].
    pub correction: f64,
    /// Nodes in contact.
    pub contacts: usize,
    /// Nodes in contact that slip.
    pub slipping: usize,
    /// Nodes in contact that stick, as friction without a transition has it.
    pub stuck: usize,
    /// Contact states that changed since the iteration before (touch or part).
    pub changes: usize,
}

/// Order of convergence shown by the last iterations of an increment: of the last three residuals in a row that
/// follow no change of contact states (touch or part, stick or slip), lie below a hundredth of the contact forces and
/// above rounding, and fall. `None` when an increment has no such three.
#[must_use]
pub fn convergence_order(history: &[IterationRecord]) -> Option<f64> {
    /// Below it corrections are taken whole.
    const BASIN: f64 = super::record::NEAR;
    const ROUNDING: f64 = 1e-9;
    const LEAST: f64 = 2.3;
    let settled = |w: &[IterationRecord]| {
        let states = |r: &IterationRecord| [r.contacts, r.slipping, r.stuck];
        w.iter().all(|r| r.changes == 0 && states(r) == states(&w[0]))
            && w[0].residual < BASIN
            && w[2].residual > ROUNDING
    };
    // The first correction is made with what is foreseen, not with the tangent of where it begins.
    let last = history.get(1..)?.windows(3).rev().find(|w| settled(w))?;
    let fall = |k: usize| (last[k].residual / last[k + 1].residual).ln();
    // A fall by less than ten is no step of an iteration near its end, and says nothing of the next.
    (fall(0) > LEAST && fall(1) > 0.0).then(|| fall(1) / fall(0))
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
    fn the_order_is_of_newton_steps_near_their_end() {
        let order = |residuals: &[f64]| convergence_order(&history(residuals));
        assert!((order(&[0.05, 9e-3, 8.1e-5, 6.561e-9]).unwrap() - 2.0).abs() < 1e-12);
        // An elastic increment: the first correction is made with what is foreseen, and one more ends it.
        assert_eq!(order(&[1.2e-3, 1.3e-4, 4.6e-9]), None);
        // A fall by less than ten on the way.
        assert_eq!(order(&[0.9, 0.09, 0.08, 1e-6]), None);
    }
}
