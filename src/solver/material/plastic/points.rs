//! Update of up to eight points with a criterion that is not quadratic.
//!
//! The principal values of all trial stresses are computed in SIMD lanes; only points that yield are then returned
//! individually.

use super::{
    BACKSTRESS, EQUIVALENT, LogResponse, LogResponses, MaterialError, Plastic, STRAIN, WORK,
    YIELD_TOLERANCE, general,
};
use crate::material::yld2004::{Principal, Yld2004};
use crate::numbers::lanes::{Eight, POINTS};
use crate::numbers::tensor::{self, Mandel};

/// Elastic trial state of a point in material axes.
struct Trial<'a> {
    elastic_strain: Mandel,
    stress: Mandel,
    old: &'a [f64],
    /// Principal values of the stress minus the backstresses.
    principal: &'a Principal,
}

impl Plastic {
    /// [`Material::update_points`](super::Material::update_points) without storing the strain in the history.
    pub(super) fn update_general(
        &self,
        law: &Yld2004,
        (strains, count): (&[Eight; 6], usize),
        (old, new): (&[f64], &mut [f64]),
        out: &mut LogResponses,
    ) -> Result<(), (usize, MaterialError)> {
        let len = BACKSTRESS + 6 * self.backstresses.len();
        let mut elastic = [([0.0; 6], [0.0; 6]); POINTS];
        let mut relative_stress = [[0.0; POINTS]; 6];
        for (point, (strain, stress)) in elastic.iter_mut().enumerate().take(count) {
            let old = &old[point * len..][..len];
            let own = strains.map(|of| of[point]);
            let own =
                self.to_material.as_ref().map_or(own, |rotation| tensor::apply(rotation, &own));
            *strain = std::array::from_fn(|i| own[i] - old[STRAIN + i]);
            *stress = self.elastic.stress(strain);
            let all = relative_stress.iter_mut().zip(self.relative_stress(stress, old));
            all.for_each(|(to, value)| to[point] = value);
        }
        let principal = law.principal(&relative_stress, count);
        let mut response = LogResponse::zero();
        for (point, (elastic_strain, stress)) in elastic.into_iter().enumerate().take(count) {
            let range = point * len..(point + 1) * len;
            let trial = Trial {
                elastic_strain,
                stress,
                old: &old[range.clone()],
                principal: &principal[point],
            };
            self.return_to_surface(law, &trial, &mut new[range], &mut response)
                .map_err(|e| (point, e))?;
            self.rotate_from_material(&mut response);
            out.set_point(point, &response);
        }
        Ok(())
    }

    /// Rotates stress and tangent from material axes to those of the element.
    #[inline]
    fn rotate_from_material(&self, response: &mut LogResponse) {
        let Some(rotation) = &self.to_material else { return };
        let back = tensor::transpose(rotation);
        response.stress = tensor::apply(&back, &response.stress);
        let half = tensor::product(&back, &response.tangent);
        response.tangent = tensor::product(&half, rotation);
    }

    /// Stress, tangent and new history of one point in material axes.
    ///
    /// # Errors
    /// [`MaterialError::ReturnMapping`] for a stress that is NaN, or if the return mapping does not converge.
    fn return_to_surface(
        &self,
        law: &Yld2004,
        trial: &Trial<'_>,
        new: &mut [f64],
        out: &mut LogResponse,
    ) -> Result<(), MaterialError> {
        let &Trial { ref elastic_strain, ref stress, old, principal } = trial;
        new.copy_from_slice(old);
        let flow_stress = self.hardening.flow_stress(old[EQUIVALENT]).0;
        let equivalent = law.equivalent_of(principal);
        if equivalent.is_nan() {
            return Err(MaterialError::ReturnMapping { residual: equivalent, iterations: 0 });
        }
        if equivalent <= flow_stress * (1.0 + YIELD_TOLERANCE) {
            self.set_elastic(trial, out);
            return Ok(());
        }
        let step = general::General::new(self, stress, old, Some(principal));
        let returned = step.solve()?;
        out.tangent = step.tangent(&returned);
        let (increment, flow) = (returned.increment, returned.flow);
        let two_mu = 2.0 * self.elastic.shear_modulus();
        out.stress = std::array::from_fn(|i| stress[i] - two_mu * flow[i]);
        for i in 0..6 {
            new[STRAIN + i] += flow[i];
        }
        new[EQUIVALENT] += increment;
        let harder = self.hardening.flow_stress(new[EQUIVALENT]).0 - flow_stress;
        let work = tensor::dot(&out.stress, &flow) - 0.5 * harder * increment;
        new[WORK] += work - self.update_backstresses(increment, &flow, new);
        let elastic: Mandel = std::array::from_fn(|i| elastic_strain[i] - flow[i]);
        out.elastic_energy = 0.5 * tensor::dot(&out.stress, &elastic);
        out.plastic_work = new[WORK];
        out.plastic = true;
        Ok(())
    }

    /// The response of a point that stays elastic.
    #[inline]
    fn set_elastic(&self, trial: &Trial<'_>, out: &mut LogResponse) {
        out.stress = trial.stress;
        out.tangent = self.elastic.stiffness();
        out.elastic_energy = 0.5 * tensor::dot(&trial.stress, &trial.elastic_strain);
        out.plastic_work = trial.old[WORK];
        out.plastic = false;
    }

    /// Updates the backstresses; returns the work they store.
    fn update_backstresses(&self, increment: f64, flow: &Mandel, new: &mut [f64]) -> f64 {
        let mut stored = 0.0;
        for (k, one) in self.backstresses.iter().enumerate() {
            let decay = one.decay(increment);
            for (i, value) in flow.iter().enumerate() {
                let x = &mut new[BACKSTRESS + 6 * k + i];
                let next = decay.remaining * *x + 2.0 / 3.0 * one.modulus * decay.growth * value;
                stored += 0.5 * (next - *x) * value;
                *x = next;
            }
        }
        stored
    }

    /// Stress minus the backstresses of `old`.
    fn relative_stress(&self, stress: &Mandel, old: &[f64]) -> Mandel {
        let mut relative_stress = *stress;
        for k in 0..self.backstresses.len() {
            for (i, value) in relative_stress.iter_mut().enumerate() {
                *value -= old[BACKSTRESS + 6 * k + i];
            }
        }
        relative_stress
    }
}
