//! Forces, tangent and energies of a body.

use crate::element::FailureReason;

/// Forces, tangent and energies of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation {
    /// Internal force by degree of freedom (`3 node + direction`) [N].
    pub internal_force: Vec<f64>,
    /// Tangent values [N/mm] in the order of [`Body::pattern`]; unchanged if only the residual is requested.
    pub tangent: Vec<f64>,
    /// Stored elastic energy [N mm].
    pub elastic_energy: f64,
    /// Plastic work since the start [N mm].
    pub plastic_work: f64,
    /// Artificial (hourglass) energy since the start [N mm].
    pub artificial_work: f64,
    /// Largest nodal force [N] due to unconverged internal modes of an element; zero for elements without internal
    /// modes. Equilibrium requires that it is small too.
    pub internal_residual: f64,
}

/// An element that could not be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("element {element}, point {point}: {reason}")]
pub struct ElementFailure {
    /// Element number.
    pub element: usize,
    /// Material point inside the element.
    pub point: usize,
    /// Cause.
    pub reason: FailureReason,
}
