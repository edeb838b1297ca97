//! Forces, tangent and energies of a body.

use crate::solver::element::FailureReason;

/// Forces, tangent and energies of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation {
    /// Internal force by degree of freedom (`3 node + direction`) [N].
    pub internal_force: Vec<f64>,
    /// Tangent values [N/mm] in the order of [`Body::pattern`]; untouched when only the residual is asked.
    pub tangent: Vec<f64>,
    /// Stored elastic energy [N mm].
    pub elastic_energy: f64,
    /// Plastic work since the beginning [N mm].
    pub plastic_work: f64,
    /// Work against what keeps fibres from tilting by turns under pressure, since the beginning [N mm].
    pub artificial_work: f64,
    /// Largest force [N] by which unconverged internal modes of an element disturb its nodal forces; zero for
    /// elements without internal modes. A step is converged only when this is small too.
    pub internal_residual: f64,
}

/// An element that could not be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("element {element}, point {point}: {reason}")]
pub struct ElementFailure {
    /// Element number.
    pub element: usize,
    /// Material point inside it.
    pub point: usize,
    /// Cause.
    pub reason: FailureReason,
}
