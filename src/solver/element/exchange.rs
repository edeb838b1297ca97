//! Input and output of an element evaluation.

use crate::material::{Material, MaterialError};
use kanagata_geometry::Vec3;

/// Degrees of freedom of an element: 8 nodes, 3 displacements each, node by node.
pub const DOFS: usize = 24;

/// Quantities requested from an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Want {
    /// Internal forces and energies only (line search).
    Residual,
    /// Forces, energies and tangent.
    ResidualAndTangent,
}

/// Force, tangent and energies of one element.
#[derive(Debug, Clone)]
pub struct ElementMatrices {
    /// Internal force [N].
    pub force: [f64; DOFS],
    /// Tangent stiffness [N/mm], row by row.
    pub tangent: [[f64; DOFS]; DOFS],
    /// Stored elastic energy [N mm].
    pub elastic_energy: f64,
    /// Plastic work since the start [N mm].
    pub plastic_work: f64,
    /// Artificial (hourglass) energy: work of the stabilisation since the start [N mm].
    pub artificial_work: f64,
    /// Norm of the force [N] due to the residual of the condensed internal modes.
    pub internal_residual: f64,
    /// `∫ S³³ dV` [N/mm], ζ being the thickness direction.
    pub thickness_force: f64,
}

impl ElementMatrices {
    /// All zero.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            force: [0.0; DOFS],
            tangent: [[0.0; DOFS]; DOFS],
            elastic_energy: 0.0,
            plastic_work: 0.0,
            artificial_work: 0.0,
            internal_residual: 0.0,
            thickness_force: 0.0,
        }
    }
}

/// Input of an element evaluation: fixed data and the state at the start of the increment.
#[derive(Debug, Clone, Copy)]
pub struct ElementInput<'a> {
    /// The material.
    pub material: &'a dyn Material,
    /// Reference coordinates of the nodes [mm].
    pub nodes: &'a [Vec3; 8],
    /// Displacements of the nodes [mm].
    pub displacement: &'a [f64; DOFS],
    /// History of all points at the last converged state, `point_count * state_len`.
    pub old_state: &'a [f64],
    /// Further state variables of the element (modes, stabilisation) at the last converged state.
    pub old_record: &'a [f64],
    /// Requested quantities.
    pub want: Want,
}

/// Why an element could not be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("point {point}: {reason}")]
pub struct PointFailure {
    /// Material point inside the element.
    pub point: usize,
    /// Cause.
    pub reason: FailureReason,
}

/// Cause of a failed element evaluation.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FailureReason {
    /// The element is inverted: `det F <= 0`.
    #[error(
        "volume ratio {ratio:.3e}, must be above zero: the element turns inside out, as where a sheet folds or tears"
    )]
    Inverted {
        /// det F at the point.
        ratio: f64,
    },
    /// The stiffness `K_αα` of the internal modes is singular.
    #[error(
        "pivot {pivot:.3e} in the stiffness of the internal modes, must be finite and not zero"
    )]
    SingularModes {
        /// Pivot of the elimination.
        pivot: f64,
    },
    /// The constitutive update failed.
    #[error(transparent)]
    Material(#[from] MaterialError),
}
