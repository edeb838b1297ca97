//! Nominal tangents of the points and the terms in `d ln J̄`, from which the tangent of the element is assembled.

use pulp::Simd;

use super::point::{Mean, Motion, WeightedStress, ZERO, times_symmetric};
use crate::element::nominal::{self, Dyad, Nine};
use crate::element::shape::PointGeometry;
use crate::numbers::lanes::{Eight, Lane};
use crate::numbers::tensor::{PAIRS, factor};

/// Coefficients of the element tangent.
pub(super) struct Moduli {
    /// `A_iJkL` of the points.
    pub local: [Nine; 9],
    /// Coefficients of `d ln J̄` as right factor and as left factor of a dyad.
    left: Nine,
    right: Nine,
    /// Coefficient of `d ln J̄ ⊗ d ln J̄`.
    mean: f64,
}

impl Moduli {
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        motion: &Motion,
        mean: &Mean,
        stress: &WeightedStress,
        tangent: &[[Eight; 6]; 6],
        total: f64,
    ) -> Self {
        let mut out =
            Self { local: [[ZERO; 9]; 9], left: [ZERO; 9], right: [ZERO; 9], mean: -total };
        let mut squared = ZERO;
        for first in Lane::<S>::groups() {
            let at = Local::new(simd, motion, mean, stress, total, first);
            at.add_material(simd, tangent, &mut out, &mut squared);
        }
        out.mean += squared.iter().sum::<f64>();
        out
    }

    /// The dyads in `d ln J̄`.
    #[inline(always)]
    pub(super) fn dyads<S: Simd>(
        &self,
        simd: S,
        mean: &Mean,
        points: &[PointGeometry; 8],
    ) -> [Dyad; 2] {
        let left = nominal::nodal(simd, &self.left, points);
        let mut right = nominal::nodal(simd, &self.right, points);
        for (right, mean) in right.iter_mut().zip(&mean.rate) {
            right.iter_mut().zip(mean).for_each(|(right, mean)| *right += self.mean * mean);
        }
        [Dyad { left, right: mean.rate }, Dyad { left: mean.rate, right }]
    }
}

/// Mandel component of a pair of directions.
const COMPONENT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// Kinematics and stress of one SIMD group of points.
struct Local<S: Simd> {
    first: usize,
    f: [Lane<S>; 9],
    inverse: [Lane<S>; 9],
    stress: [Lane<S>; 6],
    pressure: Lane<S>,
    /// `w g²`.
    scale: Lane<S>,
    /// Coefficient of `d ln J ⊗ d ln J` due to `d² ln J̄`.
    d_ln_j_coefficient: Lane<S>,
}

/// Material tangent `D` of the points, multiplied by weight and scale, and its products with `½ C`.
struct Products<S: Simd> {
    stiffness: [[Lane<S>; 6]; 6],
    /// `S + D ½ C`.
    right: [Lane<S>; 6],
    /// `S + ½ C D`.
    left: [Lane<S>; 6],
    /// `p + ½ C D ½ C`.
    both: Lane<S>,
}

impl<S: Simd> Local<S> {
    #[inline(always)]
    fn new(
        simd: S,
        motion: &Motion,
        mean: &Mean,
        stress: &WeightedStress,
        total: f64,
        first: usize,
    ) -> Self {
        let weight = Lane::load(simd, &motion.weight, first);
        let scale = Lane::load(simd, &mean.scale, first);
        let jacobian = Lane::load(simd, &motion.jacobian, first);
        Self {
            first,
            f: Lane::load_all(simd, &motion.gradient, first),
            inverse: Lane::load_all(simd, &motion.inverse, first),
            stress: Lane::load_all(simd, &stress.stress, first),
            pressure: Lane::load(simd, &stress.pressure, first),
            scale: weight * scale * scale,
            d_ln_j_coefficient: weight * jacobian * (total / mean.current),
        }
    }

    /// `½ C`.
    #[inline(always)]
    fn half_stretch(&self) -> [Lane<S>; 6] {
        let f = &self.f;
        let mut out = self.stress;
        for (pair, out) in out.iter_mut().enumerate() {
            let (a, b) = PAIRS[pair];
            let sum = f[6 + a].mul_add(f[6 + b], f[3 + a].mul_add(f[3 + b], f[a] * f[b]));
            *out = sum * (0.5 * factor(pair));
        }
        out
    }

    /// Products of the material `tangent` with `½ C`, multiplied by weight and scale.
    #[inline(always)]
    fn products(&self, simd: S, tangent: &[[Eight; 6]; 6]) -> Products<S> {
        let zero = Lane::splat(simd, 0.0);
        let half = self.half_stretch();
        let mut stiffness = [[zero; 6]; 6];
        let (mut right, mut left) = (self.stress, self.stress);
        let mut both = self.pressure;
        for (i, row) in stiffness.iter_mut().enumerate() {
            *row = Lane::scaled(Lane::load_all(simd, &tangent[i], self.first), self.scale);
            let product = Lane::dot(row, &half);
            right[i] = right[i] + product;
            both = half[i].mul_add(product, both);
            for (left, value) in left.iter_mut().zip(row) {
                *left = half[i].mul_add(*value, *left);
            }
        }
        Products { stiffness, right, left, both }
    }

    /// Adds the moduli of the material `tangent`; `squared` receives 4/9 of the stiffness of `dφ`.
    #[inline(always)]
    fn add_material(
        &self,
        simd: S,
        tangent: &[[Eight; 6]; 6],
        out: &mut Moduli,
        squared: &mut Eight,
    ) {
        let first = self.first;
        let Products { stiffness, right, left, both } = self.products(simd, tangent);
        let (right, left) = (times_symmetric(&self.f, &right), times_symmetric(&self.f, &left));
        let both = both * (4.0 / 9.0);
        both.store(squared, first);
        for k in 0..9 {
            let shared = both * self.inverse[k];
            (right[k] * (2.0 / 3.0) - shared).store(&mut out.left[k], first);
            (left[k] * (2.0 / 3.0) - shared).store(&mut out.right[k], first);
        }
        let third = Lane::splat(simd, -2.0 / 3.0);
        let (right, mut left) = (Lane::scaled(right, third), Lane::scaled(left, third));
        let remainder = both + self.d_ln_j_coefficient;
        for (left, inverse) in left.iter_mut().zip(self.inverse) {
            *left = remainder.mul_add(inverse, *left);
        }
        for j in 0..3 {
            for l in 0..3 {
                let block = self.block([j, l], &stiffness, &right, &left);
                for (i, row) in block.iter().enumerate() {
                    for (k, value) in row.iter().enumerate() {
                        value.store(&mut out.local[3 * i + j][3 * k + l], first);
                    }
                }
            }
        }
    }

    /// `A_iJkL` for given `J` and `L`, by `i` and `k`: `F C_JL Fᵀ + S_JL 1` plus the terms in `F⁻ᵀ`, with
    /// coefficients `right` and `left`.
    #[inline(always)]
    fn block(
        &self,
        [j, l]: [usize; 2],
        stiffness: &[[Lane<S>; 6]; 6],
        right: &[Lane<S>; 9],
        left: &[Lane<S>; 9],
    ) -> [[Lane<S>; 3]; 3] {
        let (f, inverse) = (&self.f, &self.inverse);
        // Indices: b, then a.
        let mut c = [[self.scale; 3]; 3];
        for b in 0..3 {
            for a in 0..3 {
                let (row, column) = (COMPONENT[a][j], COMPONENT[b][l]);
                c[b][a] = stiffness[row][column] * (1.0 / (factor(row) * factor(column)));
            }
        }
        let stress = self.stress[COMPONENT[j][l]] * (1.0 / factor(COMPONENT[j][l]));
        // Coefficient of the derivative of F⁻ᵀ: ⅔ p minus the part of the mean dilatation.
        let swap = self.pressure * (2.0 / 3.0) - self.d_ln_j_coefficient;
        let mut out = [[stress; 3]; 3];
        for (i, out) in out.iter_mut().enumerate() {
            let row = [f[3 * i], f[3 * i + 1], f[3 * i + 2]];
            let half = [Lane::dot(&row, &c[0]), Lane::dot(&row, &c[1]), Lane::dot(&row, &c[2])];
            for (k, out) in out.iter_mut().enumerate() {
                let mut sum = right[3 * i + j] * inverse[3 * k + l];
                sum = inverse[3 * i + j].mul_add(left[3 * k + l], sum);
                sum = (swap * inverse[3 * k + j]).mul_add(inverse[3 * i + l], sum);
                for b in 0..3 {
                    sum = half[b].mul_add(f[3 * k + b], sum);
                }
                *out = if i == k { sum + *out } else { sum };
            }
        }
        out
    }
}
