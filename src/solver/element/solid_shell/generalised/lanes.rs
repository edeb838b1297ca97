//! Generalised strains and stresses of points in SIMD lanes.

use pulp::Simd;

use super::GENERALISED;
use crate::numbers::lanes::Lane;

/// In-plane natural components, each with its first generalised component; then the transverse components.
const IN_PLANE: [(usize, usize); 3] = [(0, 0), (1, 1), (3, 2)];
const ACROSS: [(usize, usize); 3] = [(2, 9), (4, 10), (5, 11)];

/// Powers `ζ` to `ζ⁴`.
pub(in super::super) struct Powers<S: Simd>([Lane<S>; 4]);

impl<S: Simd> Powers<S> {
    #[inline(always)]
    pub fn new(zeta: Lane<S>) -> Self {
        let square = zeta * zeta;
        Self([zeta, square, square * zeta, square * square])
    }

    /// Sums over the points of `value` and of its products with the powers of ζ.
    #[inline(always)]
    fn moments<const N: usize>(&self, value: Lane<S>) -> [f64; N] {
        let mut out = [value.sum(); N];
        for (out, power) in out[1..].iter_mut().zip(&self.0) {
            *out = (value * *power).sum();
        }
        out
    }
}

/// Natural strain at heights `zeta` from the generalised strain, in Mandel order.
#[inline(always)]
pub(in super::super) fn natural<S: Simd>(
    simd: S,
    e: &[f64; GENERALISED],
    zeta: Lane<S>,
) -> [Lane<S>; 6] {
    let mut out = [zeta; 6];
    for (natural, first) in IN_PLANE {
        let (m, k) = (Lane::splat(simd, e[first]), Lane::splat(simd, e[first + 3]));
        let q = Lane::splat(simd, e[first + 6]);
        out[natural] = q.mul_add(zeta, k).mul_add(zeta, m);
    }
    for (natural, own) in ACROSS {
        out[natural] = Lane::splat(simd, e[own]);
    }
    out
}

/// Transpose of [`natural`]: adds natural stresses to the generalised stress.
#[inline(always)]
pub(in super::super) fn add_generalised<S: Simd>(
    s: &[Lane<S>; 6],
    powers: &Powers<S>,
    sum: &mut [f64; GENERALISED],
) {
    for (natural, first) in IN_PLANE {
        for (k, moment) in powers.moments::<3>(s[natural]).into_iter().enumerate() {
            sum[first + 3 * k] += moment;
        }
    }
    for (natural, own) in ACROSS {
        sum[own] += s[natural].sum();
    }
}

/// Adds `Φᵀ D Φ` of the points; `Φ` is [`natural`].
#[inline(always)]
pub(in super::super) fn add_generalised_stiffness<S: Simd>(
    d: &[[Lane<S>; 6]; 6],
    powers: &Powers<S>,
    sum: &mut [[f64; GENERALISED]; GENERALISED],
) {
    for (i, row) in IN_PLANE {
        for (j, column) in IN_PLANE {
            let moments = powers.moments::<5>(d[i][j]);
            for k in 0..3 {
                for l in 0..3 {
                    sum[row + 3 * k][column + 3 * l] += moments[k + l];
                }
            }
        }
        for (j, column) in ACROSS {
            let [there, back] = [powers.moments::<3>(d[i][j]), powers.moments::<3>(d[j][i])];
            for k in 0..3 {
                sum[row + 3 * k][column] += there[k];
                sum[column][row + 3 * k] += back[k];
            }
        }
    }
    for (i, row) in ACROSS {
        for (j, column) in ACROSS {
            sum[row][column] += d[i][j].sum();
        }
    }
}
