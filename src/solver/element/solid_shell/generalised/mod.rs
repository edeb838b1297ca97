//! Generalised strains `[m, k, q, E_33, E_23, E_31]` at a point of the mid-surface; in the plane
//! `E = m + ζ k + ζ² q`.

pub(super) mod lanes;

use std::f64::consts::FRAC_1_SQRT_2;

use super::in_plane::{self, InPlane};
use super::pairs::{Pairs, Plane, blend};
use super::shape::Moved;
use crate::element::DOFS;
use kanagata_geometry::Vec3;

/// Number of generalised strains at a point of the mid-surface.
pub(super) const GENERALISED: usize = 12;

/// Sampling points of `E_31` (at η = ∓1) and `E_23` (at ξ = ∓1) with their weights at `(ξ, η)`.
fn shear_samples(xi: f64, eta: f64) -> [(Plane, bool, f64); 4] {
    [
        (Plane::at(0.0, -1.0), true, 0.5 * (1.0 - eta)),
        (Plane::at(0.0, 1.0), true, 0.5 * (1.0 + eta)),
        (Plane::at(-1.0, 0.0), false, 0.5 * (1.0 - xi)),
        (Plane::at(1.0, 0.0), false, 0.5 * (1.0 + xi)),
    ]
}

/// Generalised products `½ g_i·g_j` of one configuration; `correction` is `F_1, F_2` of its rotated fibres.
/// Strains are differences of two configurations.
pub(super) fn products(
    pairs: &Pairs,
    in_plane: &InPlane,
    correction: &[f64; 2],
    (xi, eta): (f64, f64),
) -> [f64; GENERALISED] {
    let plane = Plane::at(xi, eta);
    let (a1, a2) = (blend(&plane.by_xi, &pairs.mean), blend(&plane.by_eta, &pairs.mean));
    let (d1, d2) = (blend(&plane.by_xi, &pairs.half), blend(&plane.by_eta, &pairs.half));
    let r = FRAC_1_SQRT_2;
    let mut p = [0.0; GENERALISED];
    let (c1, c2) = in_plane::tangents(pairs);
    let mut own = [0.5 * a1.dot(&a1), 0.5 * a2.dot(&a2), r * a1.dot(&a2)];
    (0..2).for_each(|f| own[f] -= in_plane.correction[f] * correction[f]);
    p[..3].copy_from_slice(&in_plane.assumed(&own, r * c1.dot(&c2)));
    p[3..6].copy_from_slice(&[a1.dot(&d1), a2.dot(&d2), r * (a1.dot(&d2) + a2.dot(&d1))]);
    p[6..9].copy_from_slice(&[0.5 * d1.dot(&d1), 0.5 * d2.dot(&d2), r * d1.dot(&d2)]);
    p[9] = (0..4).map(|i| 0.5 * plane.value[i] * pairs.half[i].norm_squared()).sum();
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (row, by) = if along_xi { (11, &sample.by_xi) } else { (10, &sample.by_eta) };
        p[row] += weight * r * blend(by, &pairs.mean).dot(&blend(&sample.value, &pairs.half));
    }
    p
}

/// Derivatives of [`products`] with respect to the nodal displacements.
pub(super) fn derivatives(
    moved: &Moved,
    in_plane: &InPlane,
    (xi, eta): (f64, f64),
) -> [[f64; DOFS]; GENERALISED] {
    let Moved { pairs, fibres } = moved;
    let plane = Plane::at(xi, eta);
    let (n1, n2) = (&plane.by_xi, &plane.by_eta);
    let (a1, a2) = (blend(n1, &pairs.mean), blend(n2, &pairs.mean));
    let (d1, d2) = (blend(n1, &pairs.half), blend(n2, &pairs.half));
    let r = FRAC_1_SQRT_2;
    let mut b = [[0.0; DOFS]; GENERALISED];
    let none = Vec3::zeros();
    let ((c1, c2), middle) = (in_plane::tangents(pairs), Plane::at(0.0, 0.0));
    for k in 0..4 {
        let mut own = [a1 * n1[k], a2 * n2[k], (a2 * n1[k] + a1 * n2[k]) * r];
        (0..2).for_each(|f| own[f] -= fibres.gradient[f][k] * in_plane.correction[f]);
        let centre = (c2 * middle.by_xi[k] + c1 * middle.by_eta[k]) * r;
        for (row, by) in in_plane.assumed(&own, centre).into_iter().enumerate() {
            scatter_derivative(&mut b, row, k, by, none);
        }
        scatter_derivative(&mut b, 3, k, d1 * n1[k], a1 * n1[k]);
        scatter_derivative(&mut b, 4, k, d2 * n2[k], a2 * n2[k]);
        scatter_derivative(
            &mut b,
            5,
            k,
            (d2 * n1[k] + d1 * n2[k]) * r,
            (a2 * n1[k] + a1 * n2[k]) * r,
        );
        scatter_derivative(&mut b, 6, k, none, d1 * n1[k]);
        scatter_derivative(&mut b, 7, k, none, d2 * n2[k]);
        scatter_derivative(&mut b, 8, k, none, (d2 * n1[k] + d1 * n2[k]) * r);
        scatter_derivative(&mut b, 9, k, none, pairs.half[k] * plane.value[k]);
    }
    scatter_shear_derivatives(&mut b, pairs, (xi, eta));
    b
}

/// Adds the derivatives of row `row` with respect to the mean and the half difference of a pair of nodes.
#[inline(always)]
fn scatter_derivative(
    b: &mut [[f64; DOFS]; GENERALISED],
    row: usize,
    pair: usize,
    by_mean: Vec3,
    by_half: Vec3,
) {
    for i in 0..3 {
        b[row][3 * pair + i] += 0.5 * (by_mean[i] - by_half[i]);
        b[row][3 * (pair + 4) + i] += 0.5 * (by_mean[i] + by_half[i]);
    }
}

/// Adds the derivatives of the transverse shear strains, sampled on the edges.
#[inline]
fn scatter_shear_derivatives(
    b: &mut [[f64; DOFS]; GENERALISED],
    pairs: &Pairs,
    (xi, eta): (f64, f64),
) {
    let r = FRAC_1_SQRT_2;
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (row, by) = if along_xi { (11, &sample.by_xi) } else { (10, &sample.by_eta) };
        let (tangent, director) = (blend(by, &pairs.mean), blend(&sample.value, &pairs.half));
        for k in 0..4 {
            let by_mean = director * (weight * r * by[k]);
            scatter_derivative(b, row, k, by_mean, tangent * (weight * r * sample.value[k]));
        }
    }
}

/// Adds the second derivatives of [`products`] times the generalised stress, as scalars between the eight vectors
/// `a_0..a_3, d_0..d_3`. `turning` receives the coefficients of the second derivatives of `F_1, F_2`.
pub(super) fn add_curvature(
    stress: &[f64; GENERALISED],
    in_plane: &InPlane,
    (xi, eta): (f64, f64),
    (sum, turning): (&mut [[f64; 8]; 8], &mut [f64; 2]),
) {
    let (plane, middle) = (Plane::at(xi, eta), Plane::at(0.0, 0.0));
    let r = FRAC_1_SQRT_2;
    let form = |at: &Plane, s: &[f64], i: usize, j: usize| {
        let (n1, n2) = (&at.by_xi, &at.by_eta);
        s[0] * n1[i] * n1[j] + s[1] * n2[i] * n2[j] + s[2] * r * (n1[i] * n2[j] + n2[i] * n1[j])
    };
    let (own, centre) = in_plane.work([stress[0], stress[1], stress[2]]);
    (0..2).for_each(|f| turning[f] -= in_plane.correction[f] * own[f]);
    for i in 0..4 {
        for j in 0..4 {
            sum[i][j] += form(&plane, &own, i, j) + form(&middle, &[0.0, 0.0, centre], i, j);
            let mixed = form(&plane, &stress[3..6], i, j);
            sum[i][j + 4] += mixed;
            sum[i + 4][j] += mixed;
            sum[i + 4][j + 4] += form(&plane, &stress[6..9], i, j);
        }
        sum[i + 4][i + 4] += stress[9] * plane.value[i];
    }
    for (sample, along_xi, weight) in shear_samples(xi, eta) {
        let (value, by) =
            if along_xi { (stress[11], &sample.by_xi) } else { (stress[10], &sample.by_eta) };
        for i in 0..4 {
            for j in 0..4 {
                let mixed = value * weight * r * by[i] * sample.value[j];
                sum[i][j + 4] += mixed;
                sum[j + 4][i] += mixed;
            }
        }
    }
}
