//! Assumed in-plane strain of the mid-surface: shear of the element centre, rotated fibres not stretched.
//!
//! A bilinear element bent in its plane has a parasitic shear `E_12`, linear in `ξ` and `η`; so has a warped element.
//! The shear at the centre is free of both. Strains are compared in the base of the centre, so that a uniform strain
//! stays uniform in an element of any shape: with `g_i = A_ik c_k`, `g` and `c` the base vectors at a point and at
//! the centre, `E = A E° Aᵀ`, and `E°_12` is replaced.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use std::ops::{Add, Mul};

use super::pairs::{Pairs, Plane, blend};
use kanagata_geometry::Vec3;

/// Map from the strains (11, 22, √2·12) at a point and the shear at the centre to the assumed in-plane strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InPlane {
    own: [[f64; 3]; 3],
    centre: [f64; 3],
    /// Coefficients of `F_1, F_2` (`fibres`) that are subtracted from the strains at the point.
    pub correction: [f64; 2],
}

/// Base vectors of the mid-surface at the centre.
pub(super) fn tangents(pairs: &Pairs) -> (Vec3, Vec3) {
    let middle = Plane::at(0.0, 0.0);
    (blend(&middle.by_xi, &pairs.mean), blend(&middle.by_eta, &pairs.mean))
}

impl InPlane {
    /// Identity: the strains at the point are not modified.
    pub const IDENTITY: Self = Self {
        own: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        centre: [0.0; 3],
        correction: [0.0; 2],
    };

    /// Map at `(ξ, η)` for an element with these pairs in the reference configuration.
    pub fn assumed_at(reference: &Pairs, xi: f64, eta: f64) -> Self {
        let (c1, c2) = tangents(reference);
        let plane = Plane::at(xi, eta);
        let metric = [c1.norm_squared(), c1.dot(&c2), c2.norm_squared()];
        let det = metric[0] * metric[2] - metric[1] * metric[1];
        // In a warped element, the components in the plane of the centre.
        let over = |by: &[f64; 4]| {
            let g = blend(by, &reference.mean);
            let (p, q) = (g.dot(&c1), g.dot(&c2));
            [(p * metric[2] - q * metric[1]) / det, (q * metric[0] - p * metric[1]) / det]
        };
        let [a, b] = [over(&plane.by_xi), over(&plane.by_eta)];
        let det = a[0] * b[1] - a[1] * b[0];
        let inverse = [[b[1] / det, -a[1] / det], [-b[0] / det, a[0] / det]];
        // E°_12 of the strains at the point, and the strains at the point of a unit E°_12.
        let [p, q] = inverse;
        let shear = [p[0] * q[0], p[1] * q[1], (p[0] * q[1] + p[1] * q[0]) * FRAC_1_SQRT_2];
        let back = [2.0 * a[0] * a[1], 2.0 * b[0] * b[1], (a[0] * b[1] + a[1] * b[0]) * SQRT_2];
        let own = std::array::from_fn(|i| {
            std::array::from_fn(|j| f64::from(u8::from(i == j)) - back[i] * shear[j])
        });
        Self {
            own,
            centre: back.map(|t| t * FRAC_1_SQRT_2),
            correction: [0.5 * eta * eta, 0.5 * xi * xi],
        }
    }

    /// Assumed strains or their derivatives.
    pub fn assumed<T>(&self, own: &[T; 3], centre: T) -> [T; 3]
    where
        T: Copy + Mul<f64, Output = T> + Add<Output = T>,
    {
        std::array::from_fn(|i| {
            let [x, y, z] = self.own[i];
            own[0] * x + own[1] * y + own[2] * z + centre * self.centre[i]
        })
    }

    /// Transpose: stresses conjugate to the strains at the point and to the shear at the centre.
    pub fn work(&self, stress: [f64; 3]) -> ([f64; 3], f64) {
        let own = std::array::from_fn(|j| (0..3).map(|i| self.own[i][j] * stress[i]).sum());
        (own, self.centre.iter().zip(stress).map(|(c, s)| c * s).sum())
    }
}
