//! Finite elements: total Lagrangian, assumed Green-Lagrange strain in, second Piola-Kirchhoff stress out.
//!
//! An element turns the displacements of its nodes into points with an assumed strain `E`, its derivative
//! `B = ∂E/∂u` and a weight; the material answers with `S` and `dS/dE`; the element returns
//! `f = Σ w Bᵀ S` and `K = Σ w (Bᵀ D B + S : ∂²E/∂u²)`, the exact derivative of `f`.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over components and nodes follow the formulas' indices"
)]

mod compatible;
pub mod hex8;
pub(crate) mod hex8_enhanced;
mod kernels;
mod kind;
pub(crate) mod modes;
mod nominal;
mod shape;
pub(crate) mod solid_shell;
mod tilt;

pub use kind::ElementKind;
pub use shape::{PointGeometry, ReferenceCheck, reference_points};

pub(crate) use shape::natural_coordinates;

use crate::geometry::Vec3;
use crate::solver::material::{Material, MaterialError};

/// Degrees of freedom of an element: 8 nodes, 3 displacements each, node by node.
pub const DOFS: usize = 24;

impl ElementKind {
    /// Evaluates one element: its undeformed Gauss points or points through the thickness, whichever it has; its points'
    /// new histories and the [record](Self::record_len) of what it keeps besides.
    ///
    /// # Errors
    /// [`PointFailure`] where the material, the shape or the modes fail.
    pub(crate) fn evaluate(
        self,
        input: &ElementInput<'_>,
        (points, rule): (&[PointGeometry; 8], &[(f64, f64)]),
        (states, record): (&mut [f64], &mut [f64]),
        out: &mut ElementMatrices,
    ) -> Result<(), PointFailure> {
        let (modes, tilt) = record.split_at_mut(modes::record_len(self.mode_count()));
        match self {
            Self::Hex8 => return hex8::evaluate(input, points, states, out),
            Self::Hex8Enhanced => hex8_enhanced::evaluate(input, points, states, modes, out),
            Self::SolidShell { membrane: false, .. } => {
                solid_shell::evaluate::<{ solid_shell::pairs::THICKNESS_MODES }>(
                    input, rule, states, modes, out,
                )
            }
            Self::SolidShell { membrane: true, .. } => {
                solid_shell::evaluate::<{ solid_shell::pairs::MEMBRANE_MODES }>(
                    input, rule, states, modes, out,
                )
            }
        }?;
        tilt::steady(input, tilt, out);
        Ok(())
    }
}

/// What is asked of an evaluation.
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
    /// Plastic work since the beginning [N mm].
    pub plastic_work: f64,
    /// Work against what keeps fibres from tilting by turns, since the beginning [N mm].
    pub artificial_work: f64,
    /// Norm of the forces [N] that the not yet converged internal modes of the element still cause.
    pub internal_residual: f64,
    /// `∫ S³³ dV` [N/mm] of an element whose fibres go along ζ.
    pub through: f64,
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
            through: 0.0,
        }
    }
}

/// What an element is given: fixed data and the state at the beginning of the increment.
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
    /// What the element kept besides at the last converged state.
    pub old_record: &'a [f64],
    /// What is asked.
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
    /// The element is turned inside out.
    #[error(
        "volume ratio {ratio}, must be above zero: the element turns inside out, as where a sheet folds or tears"
    )]
    Inverted {
        /// det F at the point.
        ratio: f64,
    },
    /// The internal modes of the element have no stiffness.
    #[error("pivot {pivot} in the stiffness of the internal modes, must be finite and not zero")]
    SingularModes {
        /// The pivot found.
        pivot: f64,
    },
    /// The material failed.
    #[error(transparent)]
    Material(#[from] MaterialError),
}

#[cfg(test)]
mod benchmarks;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
