//! Linear solvers behind one trait, and the checked solve that all of them go through.

mod dense;
pub mod direct;
pub mod multifrontal;
pub mod pattern;
pub mod refine;
mod rows;
pub mod update;

pub use direct::{MultifrontalLu, SparseLu};
pub use multifrontal::SparseRow;
pub use refine::CheckedSolver;
pub use rows::NodeRows;
pub use update::ChangedRows;

use crate::cancel::Cancel;
use crate::geometry::Vec3;
use crate::solver::linear::pattern::Pattern;

/// Unknowns that are eliminated together, and where each group stands: the input of nested dissection.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Groups {
    /// Group of each unknown.
    pub of_unknown: Vec<u32>,
    /// Position of each group [mm]; empty where nothing is known of it.
    pub centers: Vec<Vec3>,
}

/// A system that could not be solved.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// The pattern and the groups do not fit together.
    #[error("the matrix pattern cannot be planned: {0}")]
    Pattern(String),
    /// No inverse.
    #[error(
        "the matrix is singular near unknown {unknown}: a part of the sheet is not held by tools, planes or its neighbours"
    )]
    Singular {
        /// Unknown (3 node + direction) where it was noticed.
        unknown: usize,
    },
    /// A tool moved by force or spring meets nothing that its travel could change the force of.
    #[error(
        "the tool that is moved by a force there has nothing to push against: moved along its direction it meets no node of the sheet that it could push (where its edge goes between two rows of nodes it passes both)"
    )]
    Unopposed {
        /// Which tool.
        tool: usize,
    },
    /// A request to stop came while the matrix was factored.
    #[error("stopped while the matrix was factored")]
    Cancelled,
    /// The solution does not satisfy the equations.
    #[error(
        "the linear solution leaves {relative:.3e} of its right-hand side (allowed {allowed:e}): the matrix is nearly singular"
    )]
    Inaccurate {
        /// Residual over right-hand side.
        relative: f64,
        /// Limit.
        allowed: f64,
    },
}

/// A direct solver for matrices of one pattern.
pub trait LinearSolver: Send + Sync {
    /// Plans for `pattern` (structurally symmetric).
    ///
    /// # Errors
    /// [`LinearError::Pattern`].
    fn analyze(&mut self, pattern: &Pattern, groups: &Groups) -> Result<(), LinearError>;

    /// Factors the matrix with these values, in the pattern's order. Of the right-hand sides `rhs`, which
    /// [`LinearSolver::finish`] is to be called for next, a solver may eliminate what it can while it factors.
    ///
    /// # Errors
    /// [`LinearError::Singular`].
    fn factor(&mut self, values: &[f64], rhs: &[&[f64]]) -> Result<(), LinearError>;

    /// Factors a symmetric matrix that should be positive definite, in half the time where the solver can.
    ///
    /// # Errors
    /// [`LinearError::Singular`], also when it is not positive definite.
    fn factor_symmetric(&mut self, values: &[f64]) -> Result<(), LinearError> {
        self.factor(values, &[])
    }

    /// Solves in place for the right-hand sides that the last factorisation was given.
    fn finish(&mut self, rhs: &mut [&mut [f64]]) {
        self.solve(rhs);
    }

    /// Solves in place for every right-hand side with the last factors.
    fn solve(&self, rhs: &mut [&mut [f64]]);

    /// The products of `rows`, the inverse and the unit `columns`, column by column, with the last factors; `None` where
    /// that would cost nearly as much as factors of a changed matrix, or cannot be done.
    fn products_with_inverse(&self, rows: &[SparseRow<'_>], columns: &[usize]) -> Option<Vec<f64>> {
        let _ = (rows, columns);
        None
    }

    /// Gives up factorisations from when the request is made on; they fail with [`LinearError::Cancelled`].
    fn heed(&mut self, cancel: &Cancel) {
        let _ = cancel;
    }

    /// Name for the log.
    fn name(&self) -> &'static str;
}
