//! Stresses, tangents and new histories for the converged increments of the return mapping.

use pulp::Simd;

use super::axes::tensor;
use super::{At, Step, ZERO};
use crate::material::law::LogResponses;
use crate::material::plastic::{BACKSTRESS, EQUIVALENT, STRAIN, WORK};
use crate::numbers::algebra::{rotate, rotate_back};
use crate::numbers::lanes::{Eight, Lane};

/// Plastic strain increments in material axes, and the work of the stress on them.
struct Flows {
    strains: [Eight; 6],
    works: Eight,
}

impl Step<'_> {
    /// Stores responses and new histories.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&self, simd: S, new: &mut [f64], out: &mut LogResponses) {
        let mut flows = Flows { strains: [ZERO; 6], works: ZERO };
        for first in Lane::<S>::groups_of(self.count) {
            self.store_response(simd, first, &mut flows, out);
        }
        let len = BACKSTRESS + 6 * self.material.backstresses.len();
        for (point, new) in new.chunks_exact_mut(len).take(self.count).enumerate() {
            new.copy_from_slice(self.history(point));
            if self.plastic[point] {
                let flow = flows.strains.map(|of| of[point]);
                let harder = self.flow_stress[0][point] - self.before[point];
                let work = flows.works[point] - 0.5 * harder * self.x[point];
                self.store_increment(self.x[point], &flow, work, new);
            }
            out.plastic_work[point] = new[WORK];
            out.plastic[point] = self.plastic[point];
        }
    }

    /// Stress, tangent, elastic energy and flow of the SIMD group at `first`.
    #[inline(always)]
    fn store_response<S: Simd>(
        &self,
        simd: S,
        first: usize,
        flows: &mut Flows,
        out: &mut LogResponses,
    ) {
        let (material, spectrum) = (self.material, self.spectrum);
        let at = self.at(simd, first);
        let mut flow = at.xi;
        for (flow, value) in flow.iter_mut().zip(spectrum.values) {
            *flow = *flow * at.lambda * value;
        }
        let flow = tensor(spectrum, &flow);
        let elastic = Lane::load_all(simd, &self.elastic, first);
        let mean = Lane::load(simd, &self.mean, first);
        let two_mu = Lane::splat(simd, 2.0 * material.elastic.shear_modulus());
        let third = (elastic[0] + elastic[1] + elastic[2]) * (1.0 / 3.0);
        let (mut stress, mut left) = (elastic, elastic);
        for i in 0..6 {
            flow[i].store(&mut flows.strains[i], first);
            left[i] = elastic[i] - flow[i];
            stress[i] =
                if i < 3 { (left[i] - third).mul_add(two_mu, mean) } else { left[i] * two_mu };
        }
        Lane::dot(&stress, &flow).store(&mut flows.works, first);
        (Lane::dot(&stress, &left) * 0.5).store(&mut out.elastic_energy, first);
        let mut tangent = self.tangent(simd, &at, first);
        if let Some(rotation) = &material.to_material {
            stress = rotate(rotation, true, &stress);
            rotate_back(rotation, &mut tangent);
        }
        for i in 0..6 {
            stress[i].store(&mut out.stress[i], first);
            for k in 0..6 {
                tangent[i][k].store(&mut out.tangent[i][k], first);
            }
        }
    }

    /// Adds an increment to the history of its point; `work` is computed with the backstresses at the end of the
    /// increment.
    fn store_increment(&self, x: f64, flow: &[f64; 6], work: f64, new: &mut [f64]) {
        new[EQUIVALENT] += x;
        let mut new_work = new[WORK] + work;
        new[STRAIN..STRAIN + 6].iter_mut().zip(flow).for_each(|(to, flow)| *to += flow);
        for (k, one) in self.material.backstresses.iter().enumerate() {
            let decay = one.decay(x);
            let backstress = &mut new[BACKSTRESS + 6 * k..BACKSTRESS + 6 * k + 6];
            for (to, flow) in backstress.iter_mut().zip(flow) {
                let next = decay.remaining * *to + 2.0 / 3.0 * one.modulus * decay.growth * flow;
                new_work -= 0.5 * (next - *to) * flow;
                *to = next;
            }
        }
        new[WORK] = new_work;
    }

    /// `dT/dE`: bulk part, reduced deviatoric part and, at yielding points, one rank-one term along the flow.
    #[inline(always)]
    fn tangent<S: Simd>(&self, simd: S, at: &At<S>, first: usize) -> [[Lane<S>; 6]; 6] {
        let spectrum = self.spectrum;
        let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
        let two_mu = 2.0 * self.material.elastic.shear_modulus();
        let flows: Eight = self.plastic.map(|plastic| f64::from(u8::from(plastic)));
        let flows = Lane::load(simd, &flows, first);
        let half = Lane::splat(simd, 0.5);
        let yield_stress = Lane::load(simd, &self.flow_stress[0], first);
        let slope = Lane::load(simd, &self.flow_stress[1], first);
        let denominator = yield_stress * slope - at.hardening;
        let inverse = flows / half.if_less(flows, denominator, one);
        let (mut normal, mut flow, mut kept) = (at.xi, at.xi, at.xi);
        for i in 0..5 {
            let stiffness = two_mu * spectrum.values[i];
            normal[i] = at.xi[i] * at.reduction[i] * inverse * stiffness;
            flow[i] = (at.lambda * at.xi_rate[i] + at.lambda_rate * at.xi[i]) * -stiffness;
            kept[i] = (one - at.lambda * at.reduction[i] * stiffness) * two_mu;
        }
        let (normal, flow) = (tensor(spectrum, &normal), tensor(spectrum, &flow));
        let mut out = [[zero; 6]; 6];
        for (row, flow) in out.iter_mut().zip(flow) {
            for (value, normal) in row.iter_mut().zip(normal) {
                *value = flow * normal;
            }
        }
        let bulk = Lane::splat(simd, self.material.elastic.bulk_modulus());
        let [v, w] = &spectrum.normal;
        for i in 0..3 {
            for j in 0..3 {
                out[i][j] = out[i][j] + bulk + kept[0] * (v[i] * v[j]) + kept[1] * (w[i] * w[j]);
            }
            out[i + 3][i + 3] = out[i + 3][i + 3] + kept[i + 2];
        }
        out
    }
}
