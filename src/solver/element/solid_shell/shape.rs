//! Data common to the columns of an element, and sums over the columns.

use super::fibres::{Fibres, Hourglass};
use super::pairs::{MEMBRANE_MODES, Pairs};
use super::stretch::Axes;
use crate::element::ElementInput;
use crate::element::modes::ModeSums;
use crate::numbers::tensor::Mandel66;
use kanagata_geometry::Vec3;

/// Data of the reference configuration.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    /// Node pairs of the reference configuration.
    pub(crate) pairs: &'a Pairs,
    /// Map from natural to Cartesian strain at the element's centre, and det J there.
    pub(crate) centre: &'a (Mandel66, f64),
    /// Axes of the in-plane stretch modes.
    pub(crate) axes: &'a Axes,
    /// Points and weights through the thickness.
    pub(crate) rule: &'a [(f64, f64)],
}

/// Data of the current configuration.
pub(super) struct Moved {
    pub(crate) pairs: Pairs,
    pub(crate) fibres: Fibres,
}

impl Moved {
    pub(crate) fn new<const M: usize>(input: &ElementInput<'_>, reference: &Pairs) -> Self {
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
    pub(crate) modes: ModeSums<M>,
    /// Geometric stiffness between the vectors `a_0..a_3, d_0..d_3`.
    pub(crate) curvature: [[f64; 8]; 8],
    /// Coefficients of the second derivatives of the corrections `F_1, F_2` (`fibres`).
    pub(crate) turning: [f64; 2],
}
