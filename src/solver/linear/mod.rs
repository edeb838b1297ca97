//! Linear solvers behind a common trait, and the solve with residual check and refinement.

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

use crate::linear::pattern::Pattern;
use kanagata_cancel::Cancel;
use kanagata_geometry::Vec3;

/// Unknowns that are eliminated together and the position of each group: input of nested dissection.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Groups {
    /// Group of each unknown.
    pub of_unknown: Vec<u32>,
    /// Position of each group [mm]; empty if unknown.
    pub centers: Vec<Vec3>,
}

/// Failure of a linear solve.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// Pattern and groups are inconsistent.
    #[error("the matrix pattern cannot be planned: {0}")]
    Pattern(String),
    /// The matrix is singular.
    #[error(
        "the matrix is singular near unknown {unknown}: a part of the sheet is not held by tools, planes or its neighbours"
    )]
    Singular {
        /// Unknown (3 node + direction) of the singular pivot block.
        unknown: usize,
    },
    /// A tool driven by force or spring has no contact whose force depends on its travel.
    #[error(
        "the tool that is moved by a force there has nothing to push against: moved along its direction it meets no node of the sheet that it could push (where its edge goes between two rows of nodes it passes both)"
    )]
    Unopposed {
        /// Index of the tool.
        tool: usize,
    },
    /// The factorisation was cancelled.
    #[error("stopped while the matrix was factored")]
    Cancelled,
    /// The residual of the solution is too large.
    #[error(
        "the linear solution leaves {relative:.3e} of its right-hand side (allowed {allowed:e}): the matrix is nearly singular"
    )]
    Inaccurate {
        /// Norm of the residual over that of the right-hand side.
        relative: f64,
        /// Allowed value.
        allowed: f64,
    },
}

/// Direct solver for matrices with a common pattern.
pub trait LinearSolver: Send + Sync {
    /// Symbolic analysis of `pattern` (structurally symmetric).
    ///
    /// # Errors
    /// [`LinearError::Pattern`].
    fn analyze(&mut self, pattern: &Pattern, groups: &Groups) -> Result<(), LinearError>;

    /// Factors the matrix with the given values, in the order of the pattern. A solver may eliminate the right-hand
    /// sides `rhs` during the factorisation; [`LinearSolver::finish`] must then be called for them next.
    ///
    /// # Errors
    /// [`LinearError::Singular`].
    fn factor(&mut self, values: &[f64], rhs: &[&[f64]]) -> Result<(), LinearError>;

    /// Factors a symmetric positive definite matrix, at half the cost if the solver supports it.
    ///
    /// # Errors
    /// [`LinearError::Singular`], also if the matrix is not positive definite.
    fn factor_symmetric(&mut self, values: &[f64]) -> Result<(), LinearError> {
        self.factor(values, &[])
    }

    /// Solves in place for the right-hand sides passed to the last factorisation.
    fn finish(&mut self, rhs: &mut [&mut [f64]]) {
        self.solve(rhs);
    }

    /// Solves in place for every right-hand side with the last factors.
    fn solve(&self, rhs: &mut [&mut [f64]]);

    /// Products `D A⁻¹ E` of sparse `rows` `D`, the inverse and the unit `columns` `E`, column-major, with the last
    /// factors. `None` if they would cost nearly as much as a new factorisation, or are not supported.
    fn products_with_inverse(&self, rows: &[SparseRow<'_>], columns: &[usize]) -> Option<Vec<f64>> {
        let _ = (rows, columns);
        None
    }

    /// Aborts factorisations once cancellation is requested; they fail with [`LinearError::Cancelled`].
    fn set_cancel(&mut self, cancel: &Cancel) {
        let _ = cancel;
    }

    /// Name in the log.
    fn name(&self) -> &'static str;
}
