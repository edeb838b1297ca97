//! Tangent of a trilinear element from the nominal tangents of its points.
//!
//! | symbol | meaning |
//! |---|---|
//! | `A_iJkL` | derivative of the nominal stress `P_iJ` of a point by `F_kL`, multiplied by its weight |
//! | `N_a,J` | gradient of shape function `a` |
//!
//! `K_(a,i)(b,k) = Σ A_iJkL N_a,J N_b,L` over the points: first `T_(i,kL)(a) = Σ_J A_iJkL N_a,J`, then `Σ_L T N_b,L`.
//! Nodes are SIMD lanes. Degrees of freedom are numbered by node, then by direction.

use pulp::Simd;

use super::shape::PointGeometry;
use super::{DOFS, kernels::Row};
use crate::numbers::lanes::{Eight, Lane};

/// Nine components `iJ` at eight points.
pub(crate) type Nine = [Eight; 9];

/// One value for each direction and node.
pub(crate) type Nodal = [[f64; 8]; 3];

/// Nodal forces `Σ P_iJ N_a,J` of nominal stresses that include the integration weights.
#[inline(always)]
pub(crate) fn nodal<S: Simd>(simd: S, stress: &Nine, points: &[PointGeometry; 8]) -> Nodal {
    let mut out = [[0.0; 8]; 3];
    for first in Lane::<S>::groups() {
        let mut sums = [Lane::splat(simd, 0.0); 3];
        for (p, point) in points.iter().enumerate() {
            let gradient = Lane::load_all(simd, &point.gradient, first);
            for (i, sum) in sums.iter_mut().enumerate() {
                for (j, gradient) in gradient.iter().enumerate() {
                    *sum = Lane::splat(simd, stress[3 * i + j][p]).mul_add(*gradient, *sum);
                }
            }
        }
        for (out, sum) in out.iter_mut().zip(sums) {
            sum.store(out, first);
        }
    }
    out
}

/// Reorders by node, then by direction.
#[inline(always)]
pub(crate) fn by_node(nodal: &Nodal) -> Row {
    std::array::from_fn(|dof| nodal[dof % 3][dof / 3])
}

/// `left ⊗ right`, a term of the tangent that couples all points.
pub(crate) struct Dyad {
    pub left: Nodal,
    pub right: Nodal,
}

/// Sets `tangent` to the sum of `A_iJkL` over the points plus the `dyads`.
#[inline(always)]
pub(crate) fn tangent<S: Simd>(
    simd: S,
    moduli: &[Nine; 9],
    points: &[PointGeometry; 8],
    dyads: &[Dyad],
    tangent: &mut [Row; DOFS],
) {
    let mut half = [[[0.0; 8]; 9]; 8];
    for i in 0..3 {
        for (p, (half, point)) in half.iter_mut().zip(points).enumerate() {
            contract_left(
                simd,
                [&moduli[3 * i], &moduli[3 * i + 1], &moduli[3 * i + 2]],
                p,
                point,
                half,
            );
        }
        for a in (0..8).step_by(2) {
            match S::F64_LANES {
                8 => rows::<S, 1>(simd, [i, a], &half, points, dyads, tangent),
                _ => rows::<S, 2>(simd, [i, a], &half, points, dyads, tangent),
            }
        }
    }
}

/// `T_(i,kL)(a) = Σ_J A_iJkL N_a,J` of point `p` from the rows `A_iJ` of one `i`.
#[inline(always)]
fn contract_left<S: Simd>(
    simd: S,
    moduli: [&Nine; 3],
    p: usize,
    point: &PointGeometry,
    half: &mut [[f64; 8]; 9],
) {
    for first in Lane::<S>::groups() {
        let gradient = Lane::load_all(simd, &point.gradient, first);
        for (kl, out) in half.iter_mut().enumerate() {
            let mut sum = Lane::splat(simd, moduli[0][kl][p]) * gradient[0];
            sum = Lane::splat(simd, moduli[1][kl][p]).mul_add(gradient[1], sum);
            sum = Lane::splat(simd, moduli[2][kl][p]).mul_add(gradient[2], sum);
            sum.store(out, first);
        }
    }
}

/// Rows of the tangent for direction `i` of nodes `a` and `a + 1`, with `V` SIMD vectors for each direction.
#[inline(always)]
fn rows<S: Simd, const V: usize>(
    simd: S,
    [i, a]: [usize; 2],
    half: &[[[f64; 8]; 9]; 8],
    points: &[PointGeometry; 8],
    dyads: &[Dyad],
    tangent: &mut [Row; DOFS],
) {
    for first in (0..8).step_by(V * S::F64_LANES) {
        let mut sums = [[[Lane::splat(simd, 0.0); V]; 3]; 2];
        for dyad in dyads {
            add_dyad(simd, [i, a], dyad, first, &mut sums);
        }
        for (half, point) in half.iter().zip(points) {
            contract_right(simd, a, (half, point), first, &mut sums);
        }
        for (r, sums) in sums.iter().enumerate() {
            let row = &mut tangent[3 * (a + r) + i];
            for (k, sums) in sums.iter().enumerate() {
                let mut values = [0.0; 8];
                for (v, sum) in sums.iter().enumerate() {
                    sum.store(&mut values, first + v * S::F64_LANES);
                }
                for b in first..(first + V * S::F64_LANES).min(8) {
                    row[3 * b + k] = values[b];
                }
            }
        }
    }
}

/// Parts of the rows of two nodes by direction `k`: `V` SIMD vectors of nodes `b`.
type Rows<S, const V: usize> = [[[Lane<S>; V]; 3]; 2];

/// Adds a dyad to the rows of direction `i` of the nodes `a` and `a + 1`.
#[inline(always)]
fn add_dyad<S: Simd, const V: usize>(
    simd: S,
    [i, a]: [usize; 2],
    Dyad { left, right }: &Dyad,
    first: usize,
    sums: &mut Rows<S, V>,
) {
    for (r, sums) in sums.iter_mut().enumerate() {
        let left = Lane::splat(simd, left[i][a + r]);
        for (k, sums) in sums.iter_mut().enumerate() {
            for (v, sum) in sums.iter_mut().enumerate() {
                *sum = left.mul_add(Lane::load(simd, &right[k], first + v * S::F64_LANES), *sum);
            }
        }
    }
}

/// Adds `Σ_L T_(i,kL)(a) N_b,L` of a point to the rows of nodes `a` and `a + 1`.
#[inline(always)]
fn contract_right<S: Simd, const V: usize>(
    simd: S,
    a: usize,
    (half, point): (&[[f64; 8]; 9], &PointGeometry),
    first: usize,
    sums: &mut Rows<S, V>,
) {
    for l in 0..3 {
        let mut gradient = [Lane::splat(simd, 0.0); V];
        for (v, gradient) in gradient.iter_mut().enumerate() {
            *gradient = Lane::load(simd, &point.gradient[l], first + v * S::F64_LANES);
        }
        for (r, sums) in sums.iter_mut().enumerate() {
            for (k, sums) in sums.iter_mut().enumerate() {
                let factor = Lane::splat(simd, half[3 * k + l][a + r]);
                for (sum, gradient) in sums.iter_mut().zip(gradient) {
                    *sum = factor.mul_add(gradient, *sum);
                }
            }
        }
    }
}
