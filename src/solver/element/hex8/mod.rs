//! The trilinear hexahedron with mean dilatation, in a variational (symmetric) form.
//!
//! | symbol | meaning |
//! |---|---|
//! | `F`, `J`, `C` | deformation gradient, det F, FᵀF at a point |
//! | `J̄` | mean of `J` over the reference volume of the element |
//! | `g` | `(J̄/J)^(2/3) = exp φ` |
//! | `Ē` | assumed strain `½ (g C - 1)` |
//!
//! The stored energy is `∫ W(Ē) dV`; its first and second variations give force and tangent exactly:
//! `dĒ = g (B + ½ C ⊗ dφ)`, `dφ = ⅔ (d ln J̄ - d ln J)`,
//! `S : d²Ē = ½ g (S:C) (dφ ⊗ dφ + d²φ) + g (s ⊗ dφ + dφ ⊗ s) + g S : d²(½C)`, `s = Bᵀ S`.
//!
//! With `d ln J = F⁻ᵀ : dF` all but the terms in `d ln J̄` are local to a point: a nominal stress `P` and its derivative
//! by `F` ([`super::nominal`]). The eight points are worked on side by side, one a SIMD lane.

mod moduli;

use pulp::{Arch, Simd, WithSimd};

use self::moduli::Moduli;
use super::nominal::{self, Nine, Nodal};
use super::shape::PointGeometry;
use super::{ElementInput, ElementMatrices, FailureReason, PointFailure, Want};
use crate::solver::material::log_strain::{self, Responses};
use crate::solver::numbers::lanes::{Eight, Lane, POINTS};
use crate::solver::numbers::tensor::{PAIRS, factor};

const NONE: Eight = [0.0; POINTS];

/// Evaluates the element; `new_state` receives the trial history of all points.
///
/// # Errors
/// [`PointFailure`] when the element is inverted or the material fails.
pub fn evaluate(
    input: &ElementInput<'_>,
    points: &[PointGeometry; 8],
    new_state: &mut [f64],
    out: &mut ElementMatrices,
) -> Result<(), PointFailure> {
    Arch::new().dispatch(Evaluate { input, points, new_state, out })
}

struct Evaluate<'a> {
    input: &'a ElementInput<'a>,
    points: &'a [PointGeometry; 8],
    new_state: &'a mut [f64],
    out: &'a mut ElementMatrices,
}

impl WithSimd for Evaluate<'_> {
    type Output = Result<(), PointFailure>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { input, points, new_state, out } = self;
        let wants_tangent = input.want == Want::ResidualAndTangent;
        let motion = Motion::new(simd, points, input.displacement)?;
        let mean = Mean::new(simd, &motion, points);
        let assumed = motion.assumed(simd, &mean.scale);
        let mut answer = Responses::zero();
        log_strain::update_lanes(
            simd,
            input.material,
            &assumed,
            POINTS,
            (input.old_state, new_state),
            wants_tangent,
            &mut answer,
        )
        .map_err(|(point, error)| PointFailure { point, reason: error.into() })?;
        let weighted = |energy: &Eight| -> f64 {
            points.iter().zip(energy).map(|(point, energy)| point.weight * energy).sum()
        };
        out.elastic_energy = weighted(&answer.elastic_energy);
        out.plastic_work = weighted(&answer.plastic_work);
        out.internal_residual = 0.0;
        let stressed = Stressed::new(simd, &motion, &mean, &assumed, &answer);
        let mut force = nominal::nodal(simd, &stressed.nominal, points);
        let total: f64 = 2.0 / 3.0 * stressed.pressure.iter().sum::<f64>();
        for (force, mean) in force.iter_mut().zip(&mean.rate) {
            force.iter_mut().zip(mean).for_each(|(force, mean)| *force += total * mean);
        }
        out.force = nominal::by_node(&force);
        if wants_tangent {
            let moduli = Moduli::new(simd, &motion, &mean, &stressed, &answer.tangent, total);
            let dyads = moduli.dyads(simd, &mean, points);
            nominal::tangent(simd, &moduli.local, points, &dyads, &mut out.tangent);
        }
        Ok(())
    }
}

/// Deformation of the points.
struct Motion {
    /// `F`.
    gradient: Nine,
    /// `F⁻ᵀ`.
    inverse: Nine,
    /// `J`.
    jacobian: Eight,
    /// Reference volumes.
    weight: Eight,
}

impl Motion {
    #[inline(always)]
    fn new<S: Simd>(
        simd: S,
        points: &[PointGeometry; 8],
        u: &[f64; super::DOFS],
    ) -> Result<Self, PointFailure> {
        let mut out =
            Self { gradient: [NONE; 9], inverse: [NONE; 9], jacobian: NONE, weight: NONE };
        let mut shapes = [[NONE; 8]; 3];
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
        u: &[f64; super::DOFS],
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

    /// Assumed right Cauchy-Green tensors `g C`, `scale` being `g`.
    #[inline(always)]
    fn assumed<S: Simd>(&self, simd: S, scale: &Eight) -> [Eight; 6] {
        let mut out = [NONE; 6];
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

/// The mean dilatation.
struct Mean {
    /// `d ln J̄` by node and direction.
    rate: Nodal,
    /// `g` by point.
    scale: Eight,
    /// Present volume.
    current: f64,
}

impl Mean {
    #[inline(always)]
    fn new<S: Simd>(simd: S, motion: &Motion, points: &[PointGeometry; 8]) -> Self {
        let present: Eight = std::array::from_fn(|p| motion.weight[p] * motion.jacobian[p]);
        let current: f64 = present.iter().sum();
        let mean = current / motion.weight.iter().sum::<f64>();
        let mut share = [NONE; 9];
        for (share, inverse) in share.iter_mut().zip(&motion.inverse) {
            *share = std::array::from_fn(|p| present[p] / current * inverse[p]);
        }
        Self {
            rate: nominal::nodal(simd, &share, points),
            scale: motion.jacobian.map(|jacobian| {
                let root = (mean / jacobian).cbrt();
                root * root
            }),
            current,
        }
    }
}

/// Stresses of the points, with their weights.
struct Stressed {
    /// `w g S` by Mandel component.
    stress: [Eight; 6],
    /// `½ w g S:C`.
    pressure: Eight,
    /// Nominal stress `F w g S - ⅔ p F⁻ᵀ`.
    nominal: Nine,
}

impl Stressed {
    #[inline(always)]
    fn new<S: Simd>(
        simd: S,
        motion: &Motion,
        mean: &Mean,
        assumed: &[Eight; 6],
        answer: &Responses,
    ) -> Self {
        let mut out = Self { stress: [NONE; 6], pressure: NONE, nominal: [NONE; 9] };
        for first in Lane::<S>::groups() {
            let weight = Lane::load(simd, &motion.weight, first);
            let weighted_scale = weight * Lane::load(simd, &mean.scale, first);
            let stress = Lane::load_all(simd, &answer.stress, first);
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
fn times_symmetric<S: Simd>(f: &[Lane<S>; 9], a: &[Lane<S>; 6]) -> [Lane<S>; 9] {
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
