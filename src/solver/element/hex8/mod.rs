//! Trilinear hexahedron with mean dilatation in a variational (symmetric) form.
//!
//! | symbol | meaning |
//! |---|---|
//! | `F`, `J`, `C` | deformation gradient, det F, FᵀF at a point |
//! | `J̄` | mean of `J` over the reference volume of the element |
//! | `g` | `(J̄/J)^(2/3) = exp φ` |
//! | `Ē` | assumed strain `½ (g C - 1)` |
//!
//! The stored energy is `∫ W(Ē) dV`. Its first and second variations give force and tangent:
//! `dĒ = g (B + ½ C ⊗ dφ)`, `dφ = ⅔ (d ln J̄ - d ln J)`,
//! `S : d²Ē = ½ g (S:C) (dφ ⊗ dφ + d²φ) + g (s ⊗ dφ + dφ ⊗ s) + g S : d²(½C)`, `s = Bᵀ S`.
//!
//! With `d ln J = F⁻ᵀ : dF` all terms except those in `d ln J̄` are local to a point: a nominal stress `P` and its
//! derivative by `F` ([`super::nominal`]). The eight points are processed in parallel, one in each SIMD lane.

mod moduli;
mod point;

use crate::element::hex8::point::{Mean, Motion, WeightedStress};
use pulp::{Arch, Simd, WithSimd};

use self::moduli::Moduli;
use super::nominal::{self};
use super::shape::PointGeometry;
use super::{ElementInput, ElementMatrices, PointFailure, Want};
use crate::material::log_strain::{self, Responses};
use crate::numbers::lanes::{Eight, POINTS};

/// Evaluates the element; `new_state` receives the trial histories of all points.
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
        let mut response = Responses::zero();
        log_strain::update_lanes(
            simd,
            input.material,
            &assumed,
            POINTS,
            (input.old_state, new_state),
            wants_tangent,
            &mut response,
        )
        .map_err(|(point, error)| PointFailure { point, reason: error.into() })?;
        let weighted = |energy: &Eight| -> f64 {
            points.iter().zip(energy).map(|(point, energy)| point.weight * energy).sum()
        };
        out.elastic_energy = weighted(&response.elastic_energy);
        out.plastic_work = weighted(&response.plastic_work);
        out.internal_residual = 0.0;
        let stress = WeightedStress::new(simd, &motion, &mean, &assumed, &response);
        let mut force = nominal::nodal(simd, &stress.nominal, points);
        let total: f64 = 2.0 / 3.0 * stress.pressure.iter().sum::<f64>();
        for (force, mean) in force.iter_mut().zip(&mean.rate) {
            force.iter_mut().zip(mean).for_each(|(force, mean)| *force += total * mean);
        }
        out.force = nominal::by_node(&force);
        if wants_tangent {
            let moduli = Moduli::new(simd, &motion, &mean, &stress, &response.tangent, total);
            let dyads = moduli.dyads(simd, &mean, points);
            nominal::tangent(simd, &moduli.local, points, &dyads, &mut out.tangent);
        }
        Ok(())
    }
}
