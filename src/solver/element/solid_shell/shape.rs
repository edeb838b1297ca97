//! Data common to the columns of an element, and sums over the columns.

use super::fibres::{Fibres, Hourglass};
use super::pairs::{MEMBRANE_MODES, Pairs};
use super::stretch::Axes;
use crate::geometry::Vec3;
use crate::solver::element::ElementInput;
use crate::solver::element::modes::ModeSums;
use crate::solver::numbers::tensor::Mandel66;

/// Data of the reference configuration.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    /// Node pairs of the reference configuration.
    pub(in crate::solver) pairs: &'a Pairs,
    /// Map from natural to Cartesian strain at the element's centre, and det J there.
    pub(in crate::solver) centre: &'a (Mandel66, f64),
    /// Axes of the in-plane stretch modes.
    pub(in crate::solver) axes: &'a Axes,
    /// Points and weights through the thickness.
    pub(in crate::solver) rule: &'a [(f64, f64)],
}

/// Data of the current configuration.
pub(super) struct Moved {
    pub(in crate::solver) pairs: Pairs,
    pub(in crate::solver) fibres: Fibres,
}

impl Moved {
    pub(in crate::solver) fn new<const M: usize>(
        input: &ElementInput<'_>,
        reference: &Pairs,
    ) -> Self {
        let u = input.displacement;
        let pairs = Pairs::new(&std::array::from_fn(|a| {
            input.nodes[a] + Vec3::new(u[3 * a], u[3 * a + 1], u[3 * a + 2])
        }));
        let fibres = match M {
            MEMBRANE_MODES => Hourglass::new(reference).fibres(&pairs),
            _ => Fibres::ZERO,
        };
        Self { pairs, fibres }
    }
}

/// Sums over the columns, in addition to force and tangent.
pub(super) struct Sums<const M: usize> {
    pub(in crate::solver) modes: ModeSums<M>,
    /// Geometric stiffness between the vectors `a_0..a_3, d_0..d_3`.
    pub(in crate::solver) curvature: [[f64; 8]; 8],
    /// Coefficients of the second derivatives of the corrections `F_1, F_2` (`fibres`).
    pub(in crate::solver) turning: [f64; 2],
}
