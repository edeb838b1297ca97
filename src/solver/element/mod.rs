//! Finite elements: total Lagrangian, assumed Green-Lagrange strain and second Piola-Kirchhoff stress.
//!
//! An element computes at its points an assumed strain `E` from the nodal displacements, its derivative `B = ∂E/∂u`
//! and an integration weight. The material returns `S` and `dS/dE`. The element returns `f = Σ w Bᵀ S` and
//! `K = Σ w (Bᵀ D B + S : ∂²E/∂u²)`, the exact derivative of `f`.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over components and nodes follow the formulas' indices"
)]

mod compatible;
mod exchange;
pub mod hex8;
pub(crate) mod hex8_enhanced;
mod kernels;
mod kind;
pub(crate) mod modes;
mod nominal;
mod rotation;
mod shape;
pub(crate) mod solid_shell;
mod tilt;

pub use exchange::{DOFS, ElementInput, ElementMatrices, FailureReason, PointFailure, Want};
pub use kind::ElementKind;
pub use shape::{PointGeometry, ReferenceCheck, reference_points};

pub(crate) use rotation::rotation;
pub use shape::natural_coordinates;

impl ElementKind {
    /// Evaluates force, tangent and energies of one element.
    ///
    /// `points` are the undeformed Gauss points of a hexahedron, `rule` the thickness rule of a solid-shell. `states`
    /// receives the new histories of the points, `record` the new [further state variables](Self::record_len).
    ///
    /// # Errors
    /// [`PointFailure`] if an element is inverted, or if the constitutive update or the condensation of the modes
    /// fails.
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
        tilt::stabilise(input, tilt, out);
        Ok(())
    }
}

#[cfg(test)]
mod benchmarks;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
