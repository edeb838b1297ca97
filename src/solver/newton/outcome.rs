//! What Newton's method ends with.

use crate::solver::assembly::ElementFailure;
use crate::solver::limits::Limits;
use crate::solver::linear::LinearError;

/// What an iterate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Balanced, no penetration, no contact state changed.
    Converged,
    /// Go on.
    Continue,
    /// The residual is not a number, or out of all proportion.
    Diverging,
    /// No iterations left.
    Exhausted,
}

/// Why an increment did not converge.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NewtonError {
    /// An element could not be evaluated, however short the step.
    #[error("{0}")]
    Element(#[from] ElementFailure),
    /// The linear system could not be solved.
    #[error("{0}")]
    Linear(#[from] LinearError),
    /// Iterations used up or diverged.
    #[error(
        "not converged after {iterations} iterations: residual {residual:.2e} of the contact forces, gap error {gap_mm:.2e} mm, {changes} contact states still changing, largest residual at node {node}"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Residual over reference.
        residual: f64,
        /// Violation of the gap conditions [mm].
        gap_mm: f64,
        /// Changes in the last iteration.
        changes: usize,
        /// Node with the largest unbalanced force.
        node: usize,
    },
    /// A balance with a tool on the wrong side of the sheet.
    #[error("in one step a tool and node {node} of the sheet went through each other")]
    PassedThrough {
        /// Node that did not touch the tool on the way.
        node: usize,
    },
    /// A request to stop came during the iteration.
    #[error("stopped during the iteration")]
    Cancelled,
    /// Followed as a slow motion, the sheet did not come to rest.
    #[error("snap-through: no equilibrium after {iterations} iterations of viscous motion")]
    StillMoving {
        /// Iterations it was followed.
        iterations: usize,
    },
}

/// A converged increment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewtonStats {
    /// Iterations: element loops that were followed by a correction.
    pub iterations: usize,
    /// Linear solves, those that settled the active set included.
    pub solves: usize,
    /// Contact states that changed on the way.
    pub changes: usize,
    /// Contact states came round in a circle, and dampers led to the balance.
    pub stabilised: bool,
}

impl NewtonStats {
    /// The sum of both.
    #[must_use]
    pub(in crate::solver) fn and(self, other: Self) -> Self {
        Self {
            iterations: self.iterations + other.iterations,
            solves: self.solves + other.solves,
            changes: self.changes + other.changes,
            stabilised: self.stabilised || other.stabilised,
        }
    }
}

/// When an iteration is ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solver) enum Patience {
    /// When it leads nowhere: a shorter step costs less.
    Hopeful,
    /// After the iterations allowed.
    All,
    /// After so many.
    UpTo(usize),
}

impl Patience {
    /// Iterations allowed.
    pub(in crate::solver) fn iterations(self, limits: &Limits) -> usize {
        if let Self::UpTo(iterations) = self { iterations } else { limits.iterations }
    }
}
