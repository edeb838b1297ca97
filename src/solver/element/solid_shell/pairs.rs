//! Node pairs of a solid-shell, shape functions of its mid-surface, and its enhanced modes.

use super::stretch::STRETCHES;
use crate::element::modes::Mode;
use kanagata_geometry::Vec3;

/// Number of shapes in ζ of the enhanced thickness strain; each is multiplied by the functions [`PLANE`].
pub(super) const SHAPES: usize = 2;
/// Number of thickness modes.
pub(crate) const THICKNESS_MODES: usize = SHAPES * PLANE.len();
/// Polynomials of the thickness modes over the mid-surface.
pub(super) const PLANE: [Mode; 4] =
    [mode(2, [0, 0, 0]), mode(2, [1, 0, 0]), mode(2, [0, 1, 0]), mode(2, [1, 1, 0])];
pub(crate) const MEMBRANE_MODES: usize = THICKNESS_MODES + STRETCHES;

pub(super) const fn mode(column: usize, powers: [u8; 3]) -> Mode {
    Mode { column, powers }
}

/// Node pairs of one configuration.
#[derive(Clone, Copy)]
pub(super) struct Pairs {
    /// `a_I`.
    pub(crate) mean: [Vec3; 4],
    /// `d_I`.
    pub(crate) half: [Vec3; 4],
}

impl Pairs {
    pub(crate) fn new(x: &[Vec3; 8]) -> Self {
        Self {
            mean: std::array::from_fn(|i| 0.5 * (x[i + 4] + x[i])),
            half: std::array::from_fn(|i| 0.5 * (x[i + 4] - x[i])),
        }
    }
}

/// Bilinear shape functions and their derivatives at a point of the mid-surface.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    pub(crate) value: [f64; 4],
    pub(crate) by_xi: [f64; 4],
    pub(crate) by_eta: [f64; 4],
}

impl Plane {
    pub(crate) fn at(xi: f64, eta: f64) -> Self {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        Self {
            value: corners.map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta)),
            by_xi: corners.map(|(a, b)| 0.25 * a * (1.0 + b * eta)),
            by_eta: corners.map(|(a, b)| 0.25 * b * (1.0 + a * xi)),
        }
    }
}

pub(super) fn blend(weights: &[f64; 4], vectors: &[Vec3; 4]) -> Vec3 {
    vectors[0] * weights[0]
        + vectors[1] * weights[1]
        + vectors[2] * weights[2]
        + vectors[3] * weights[3]
}
