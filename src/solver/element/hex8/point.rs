//! Kinematics and stress at the points of a hexahedron, in SIMD lanes.

use pulp::Simd;

use crate::element::nominal::{Nine, Nodal};
use crate::element::shape::PointGeometry;
use crate::element::{FailureReason, PointFailure, nominal};
use crate::material::log_strain::Responses;
use crate::numbers::lanes::{Eight, Lane, POINTS};
use crate::numbers::tensor::{PAIRS, factor};

pub(super) const ZERO: Eight = [0.0; POINTS];

/// Deformation at the points.
pub(super) struct Motion {
    /// `F`.
    pub(crate) gradient: Nine,
    /// `F⁻ᵀ`.
    pub(crate) inverse: Nine,
    /// `J`.
    pub(crate) jacobian: Eight,
    /// Reference volumes of the points.
    pub(crate) weight: Eight,
}

impl Motion {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        points: &[PointGeometry; 8],
        u: &[f64; crate::element::DOFS],
    ) -> Result<Self, PointFailure> {
        let mut out =
            Self { gradient: [ZERO; 9], inverse: [ZERO; 9], jacobian: ZERO, weight: ZERO };
        let mut shapes = [[ZERO; 8]; 3];
        for (p, point) in points.iter().enumerate() {
            out.weight[p] = point.weight;
            for (shapes, gradient) in shapes.iter_mut().zip(&point.gradient) {
                shapes.iter_mut().zip(gradient).for_each(|(to, from)| to[p] = *from);
            }
        }
        for first in Lane::<S>::groups() {
            out.deform(simd, &shapes, u, first);
        }
        match (0..POINTS).find(|&p| !(out.jacobian[p] > 0.0 && out.jacobian[p].is_finite())) {
            None => Ok(out),
            Some(point) => {
                let ratio = out.jacobian[point];
                Err(PointFailure { point, reason: FailureReason::Inverted { ratio } })
            }
        }
    }

    #[inline(always)]
    fn deform<S: Simd>(
        &mut self,
        simd: S,
        shapes: &[[Eight; 8]; 3],
        u: &[f64; crate::element::DOFS],
        first: usize,
    ) {
        let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
        let mut f = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        for a in 0..8 {
            let gradient = [
                Lane::load(simd, &shapes[0][a], first),
                Lane::load(simd, &shapes[1][a], first),
                Lane::load(simd, &shapes[2][a], first),
            ];
            for (i, row) in f.iter_mut().enumerate() {
                let u = Lane::splat(simd, u[3 * a + i]);
                for (value, gradient) in row.iter_mut().zip(gradient) {
                    *value = u.mul_add(gradient, *value);
                }
            }
        }
        let mut cofactors = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
                cofactors[i][j] = f[i1][j1] * f[i2][j2] - f[i1][j2] * f[i2][j1];
            }
        }
        let jacobian = f[0][2]
            .mul_add(cofactors[0][2], f[0][1].mul_add(cofactors[0][1], f[0][0] * cofactors[0][0]));
        jacobian.store(&mut self.jacobian, first);
        let inverse = one / jacobian;
        for i in 0..3 {
            for j in 0..3 {
                f[i][j].store(&mut self.gradient[3 * i + j], first);
                (cofactors[i][j] * inverse).store(&mut self.inverse[3 * i + j], first);
            }
        }
    }

    /// Assumed right Cauchy-Green tensors `g C`; `scale` is `g`.
    #[inline(always)]
    pub(crate) fn assumed<S: Simd>(&self, simd: S, scale: &Eight) -> [Eight; 6] {
        let mut out = [ZERO; 6];
        for first in Lane::<S>::groups() {
            let f = Lane::load_all(simd, &self.gradient, first);
            let scale = Lane::load(simd, scale, first);
            for (pair, out) in out.iter_mut().enumerate() {
                let (a, b) = PAIRS[pair];
                let sum = f[6 + a].mul_add(f[6 + b], f[3 + a].mul_add(f[3 + b], f[a] * f[b]));
                (sum * scale * factor(pair)).store(out, first);
            }
        }
        out
    }
}

/// Mean dilatation of the element.
pub(super) struct Mean {
    /// `d ln J̄` by node and direction.
    pub(crate) rate: Nodal,
    /// `g` by point.
    pub(crate) scale: Eight,
    /// Current volume.
    pub(crate) current: f64,
}

impl Mean {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, motion: &Motion, points: &[PointGeometry; 8]) -> Self {
        let present: Eight = std::array::from_fn(|p| motion.weight[p] * motion.jacobian[p]);
        let current: f64 = present.iter().sum();
        let mean = current / motion.weight.iter().sum::<f64>();
        let mut volume_ratio = [ZERO; 9];
        for (volume_ratio, inverse) in volume_ratio.iter_mut().zip(&motion.inverse) {
            *volume_ratio = std::array::from_fn(|p| present[p] / current * inverse[p]);
        }
        Self {
            rate: nominal::nodal(simd, &volume_ratio, points),
            scale: motion.jacobian.map(|jacobian| {
                let root = (mean / jacobian).cbrt();
                root * root
            }),
            current,
        }
    }
}

/// Stresses of the points, multiplied by their weights.
pub(super) struct WeightedStress {
    /// `w g S` by Mandel component.
    pub(crate) stress: [Eight; 6],
    /// `½ w g S:C`.
    pub(crate) pressure: Eight,
    /// Nominal stress `F w g S - ⅔ p F⁻ᵀ`.
    pub(crate) nominal: Nine,
}

impl WeightedStress {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        motion: &Motion,
        mean: &Mean,
        assumed: &[Eight; 6],
        response: &Responses,
    ) -> Self {
        let mut out = Self { stress: [ZERO; 6], pressure: ZERO, nominal: [ZERO; 9] };
        for first in Lane::<S>::groups() {
            let weight = Lane::load(simd, &motion.weight, first);
            let weighted_scale = weight * Lane::load(simd, &mean.scale, first);
            let stress = Lane::load_all(simd, &response.stress, first);
            let assumed = Lane::load_all(simd, assumed, first);
            let work = Lane::dot(&stress, &assumed);
            let pressure = work * weight * 0.5;
            pressure.store(&mut out.pressure, first);
            let stress = Lane::scaled(stress, weighted_scale);
            for (value, out) in stress.iter().zip(&mut out.stress) {
                value.store(out, first);
            }
            let f = Lane::load_all(simd, &motion.gradient, first);
            let inverse = Lane::load_all(simd, &motion.inverse, first);
            let shared = pressure * (-2.0 / 3.0);
            let nominal = times_symmetric(&f, &stress);
            for k in 0..9 {
                shared.mul_add(inverse[k], nominal[k]).store(&mut out.nominal[k], first);
            }
        }
        out
    }
}

/// `F A` for a symmetric `A` (Mandel components).
#[inline(always)]
pub(super) fn times_symmetric<S: Simd>(f: &[Lane<S>; 9], a: &[Lane<S>; 6]) -> [Lane<S>; 9] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let [xy, yz, zx] = [a[3] * half, a[4] * half, a[5] * half];
    let a = [[a[0], xy, zx], [xy, a[1], yz], [zx, yz, a[2]]];
    let mut out = *f;
    for i in 0..3 {
        let row = [f[3 * i], f[3 * i + 1], f[3 * i + 2]];
        for j in 0..3 {
            out[3 * i + j] = Lane::dot(&row, &a[j]);
        }
    }
    out
}
