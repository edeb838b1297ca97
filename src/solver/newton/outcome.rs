//! Results and errors of the Newton iteration.

use crate::assembly::ElementFailure;
use crate::limits::Limits;
use crate::linear::LinearError;

/// Verdict on an iterate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Equilibrium: converged, without penetration and without changes of contact states.
    Converged,
    /// The iteration continues.
    Continue,
    /// The residual is not finite.
    Diverging,
    /// The maximum number of iterations is reached.
    Exhausted,
}

/// Reason why an increment did not converge.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NewtonError {
    /// An element could not be evaluated even with the shortest step.
    #[error("{0}")]
    Element(#[from] ElementFailure),
    /// The linear system could not be solved.
    #[error("{0}")]
    Linear(#[from] LinearError),
    /// The iteration diverged or reached its maximum number of iterations.
    #[error(
        "not converged after {iterations} iterations: residual {residual:.2e} of the contact forces, gap error {gap_mm:.2e} mm, {changes} contact states still changing, largest residual at node {node}"
    )]
    NotConverged {
        /// Number of iterations.
        iterations: usize,
        /// Residual over reference.
        residual: f64,
        /// Violation of the gap conditions [mm].
        gap_mm: f64,
        /// Changes of contact states in the last iteration.
        changes: usize,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// Equilibrium with a tool on the wrong side of the sheet.
    #[error("in one step a tool and node {node} of the sheet went through each other")]
    PassedThrough {
        /// Node that passed through the tool.
        node: usize,
    },
    /// The iteration was cancelled.
    #[error("stopped during the iteration")]
    Cancelled,
    /// The viscous motion of the sheet did not end in an equilibrium.
    #[error("snap-through: no equilibrium after {iterations} iterations of viscous motion")]
    StillMoving {
        /// Iterations of the viscous motion.
        iterations: usize,
    },
}

/// Statistics of a converged increment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewtonStats {
    /// Iterations: element evaluations followed by a correction.
    pub iterations: usize,
    /// Linear solves, including those of the active-set iteration.
    pub solves: usize,
    /// Changes of contact states.
    pub changes: usize,
    /// Active-set cycling occurred and viscous stabilisation was used.
    pub stabilised: bool,
}

impl NewtonStats {
    /// Sum of both.
    #[must_use]
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            iterations: self.iterations + other.iterations,
            solves: self.solves + other.solves,
            changes: self.changes + other.changes,
            stabilised: self.stabilised || other.stabilised,
        }
    }
}

/// Limit of the number of iterations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Patience {
    /// Ends early if the iteration does not converge: a shorter step costs less.
    Hopeful,
    /// Ends after the allowed number of iterations.
    All,
    /// Ends after the given number of iterations.
    UpTo(usize),
}

impl Patience {
    /// Maximum number of iterations.
    pub(crate) fn iterations(self, limits: &Limits) -> usize {
        if let Self::UpTo(iterations) = self { iterations } else { limits.iterations }
    }
}
