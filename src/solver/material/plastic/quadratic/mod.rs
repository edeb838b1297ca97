//! Return mapping of quadratic criteria for eight points in SIMD lanes.
//!
//! The symbols are those of the parent module. One scalar equation for each point is solved by Newton's method
//! safeguarded by a bracket; its coefficients at a value of `x` are computed for all points together. Elastic points
//! have `x = 0`.

mod answers;
mod axes;
mod search;

use pulp::{Simd, WithSimd};

use self::axes::components;
use self::search::{RESIDUAL_ACCEPTED, Search};

use super::{
    BACKSTRESS, Decay, EQUIVALENT, Plastic, RETURN_ITERATIONS_MAX, STRAIN, YIELD_TOLERANCE,
};
use crate::material::hill48::Spectrum;
use crate::material::law::{LogResponses, MaterialError};
use crate::numbers::algebra::rotate;
use crate::numbers::lanes::{Eight, Lane, POINTS};

const ZERO: Eight = [0.0; POINTS];

/// Input and output of an update.
pub(super) struct Update<'a> {
    pub material: &'a Plastic,
    pub spectrum: &'a Spectrum,
    /// Logarithmic strains.
    pub strains: &'a [Eight; 6],
    /// Number of points, at most eight.
    pub count: usize,
    pub old: &'a [f64],
    pub new: &'a mut [f64],
    pub out: &'a mut LogResponses,
}

impl WithSimd for Update<'_> {
    type Output = Result<(), (usize, MaterialError)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { material, spectrum, strains, count, old, new, out } = self;
        let mut step = Step::new(simd, material, spectrum, strains, (count, old));
        step.solve(simd)?;
        step.finish(simd, new, out);
        Ok(())
    }
}

/// State of the return mappings.
struct Step<'a> {
    material: &'a Plastic,
    spectrum: &'a Spectrum,
    count: usize,
    old: &'a [f64],
    /// Elastic trial strain in material axes.
    elastic: [Eight; 6],
    /// Trial stress in the eigenbasis.
    trial: [Eight; 5],
    /// Mean trial stress.
    mean: Eight,
    /// Equivalent trial stress.
    equivalent: Eight,
    /// Backstresses at the start of the increment in the eigenbasis.
    start: Vec<[Eight; 5]>,
    plastic: [bool; POINTS],
    /// Increments of equivalent plastic strain.
    x: Eight,
    /// Flow stress at `x`, and its slope.
    flow_stress: [Eight; 2],
    /// `θ, θ', φ, φ'` of each backstress at `x`.
    decays: Vec<[Eight; 4]>,
    /// Flow stress at the start of the increment.
    before: Eight,
}

/// Coefficients at one value of the increments `x` of a SIMD group.
struct At<S: Simd> {
    lambda: Lane<S>,
    lambda_rate: Lane<S>,
    equivalent: Lane<S>,
    /// `ξ_i`.
    xi: [Lane<S>; 5],
    /// `a_i = 1 / (1 + m λ π_i)`.
    reduction: [Lane<S>; 5],
    /// `dξ_i/dx` at fixed trial stress.
    xi_rate: [Lane<S>; 5],
    /// `Σ π_i ξ_i dξ_i/dx`.
    hardening: Lane<S>,
}

impl<'a> Step<'a> {
    #[inline(always)]
    fn new<S: Simd>(
        simd: S,
        material: &'a Plastic,
        spectrum: &'a Spectrum,
        strains: &[Eight; 6],
        (count, old): (usize, &'a [f64]),
    ) -> Self {
        let mut out = Self {
            material,
            spectrum,
            count,
            old,
            elastic: [ZERO; 6],
            trial: [ZERO; 5],
            mean: ZERO,
            equivalent: ZERO,
            start: vec![[ZERO; 5]; material.backstresses.len()],
            plastic: [false; POINTS],
            x: ZERO,
            flow_stress: [[1.0; POINTS], ZERO],
            decays: vec![[[1.0; POINTS], ZERO, [1.0; POINTS], ZERO]; material.backstresses.len()],
            before: ZERO,
        };
        for first in Lane::<S>::groups_of(count) {
            out.set_trial_state(simd, strains, first);
        }
        for point in 0..count {
            let before = out.history(point)[EQUIVALENT];
            let (stress, slope) = material.hardening.flow_stress(before);
            // Ludwik's law starts with an infinite slope; elastic points do not need it and the search starts without
            // it.
            let slope = if slope.is_finite() { slope } else { 0.0 };
            (out.flow_stress[0][point], out.flow_stress[1][point]) = (stress, slope);
            let elastic = out.equivalent[point] <= stress * (1.0 + YIELD_TOLERANCE);
            out.plastic[point] = !elastic;
            out.before[point] = stress;
        }
        out
    }

    fn history(&self, point: usize) -> &'a [f64] {
        let len = BACKSTRESS + 6 * self.material.backstresses.len();
        &self.old[point * len..(point + 1) * len]
    }

    /// Six values of the histories from index `place`.
    #[inline(always)]
    fn load_history<S: Simd>(&self, simd: S, place: usize, first: usize) -> [Lane<S>; 6] {
        let mut values = [ZERO; 6];
        for point in first..(first + S::F64_LANES).min(self.count) {
            let history = self.history(point);
            for (values, value) in values.iter_mut().zip(&history[place..place + 6]) {
                values[point] = *value;
            }
        }
        Lane::load_all(simd, &values, first)
    }

    /// Computes the trial state of the SIMD group at `first`.
    #[inline(always)]
    fn set_trial_state<S: Simd>(&mut self, simd: S, strains: &[Eight; 6], first: usize) {
        let (material, spectrum) = (self.material, self.spectrum);
        let mut strain = Lane::load_all(simd, strains, first);
        if let Some(rotation) = &material.to_material {
            strain = rotate(rotation, false, &strain);
        }
        let plastic = self.load_history(simd, STRAIN, first);
        for ((elastic, strain), plastic) in self.elastic.iter_mut().zip(&mut strain).zip(plastic) {
            *strain = *strain - plastic;
            strain.store(elastic, first);
        }
        let two_mu = 2.0 * material.elastic.shear_modulus();
        let mean = (strain[0] + strain[1] + strain[2]) * material.elastic.bulk_modulus();
        mean.store(&mut self.mean, first);
        let trial = Lane::scaled(components(spectrum, &strain), Lane::splat(simd, two_mu));
        let mut relative = trial;
        for k in 0..material.backstresses.len() {
            let start = components(spectrum, &self.load_history(simd, BACKSTRESS + 6 * k, first));
            for i in 0..5 {
                start[i].store(&mut self.start[k][i], first);
                relative[i] = relative[i] - start[i];
            }
        }
        let mut square = relative[0] * relative[0] * spectrum.values[0];
        for i in 1..5 {
            square =
                (relative[i] * relative[i]).mul_add(Lane::splat(simd, spectrum.values[i]), square);
        }
        square.sqrt().store(&mut self.equivalent, first);
        for (trial, out) in trial.iter().zip(&mut self.trial) {
            trial.store(out, first);
        }
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, first: usize) -> At<S> {
        let material = self.material;
        let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
        let x = Lane::load(simd, &self.x, first);
        let yield_stress = Lane::load(simd, &self.flow_stress[0], first);
        let slope = Lane::load(simd, &self.flow_stress[1], first);
        let inverse = one / yield_stress;
        let lambda = x * inverse;
        let lambda_rate = (one - lambda * slope) * inverse;
        let mut modulus = Lane::splat(simd, 2.0 * material.elastic.shear_modulus());
        let mut modulus_rate = zero;
        let mut b = Lane::load_all(simd, &self.trial, first);
        let mut b_rate = [zero; 5];
        let decays = self.start.iter().zip(&self.decays);
        for (backstress, (start, decay)) in material.backstresses.iter().zip(decays) {
            let [theta, theta_rate, grown, growth_rate] =
                [0, 1, 2, 3].map(|k| Lane::load(simd, &decay[k], first));
            modulus = modulus + grown * (2.0 / 3.0 * backstress.modulus);
            modulus_rate = modulus_rate + growth_rate * (2.0 / 3.0 * backstress.modulus);
            let start = Lane::load_all(simd, start, first);
            for i in 0..5 {
                b[i] = b[i] - theta * start[i];
                b_rate[i] = b_rate[i] - theta_rate * start[i];
            }
        }
        let product = modulus * lambda;
        let product_rate = modulus_rate * lambda + modulus * lambda_rate;
        let (mut xi, mut reduction, mut xi_rate) = (b, b, b);
        let (mut square, mut hardening) = (zero, zero);
        for i in 0..5 {
            let value = self.spectrum.values[i];
            reduction[i] = one / (product * value + one);
            xi[i] = b[i] * reduction[i];
            xi_rate[i] = (b_rate[i] - product_rate * xi[i] * value) * reduction[i];
            square = square + xi[i] * xi[i] * value;
            hardening = hardening + xi[i] * xi_rate[i] * value;
        }
        let equivalent = square.sqrt();
        At { lambda, lambda_rate, equivalent, xi, reduction, xi_rate, hardening }
    }

    /// Sets the increment of equivalent plastic strain of a point, its flow stress and recovery factors.
    #[inline(always)]
    fn set_increment(&mut self, point: usize, x: f64) {
        self.x[point] = x;
        let before = self.history(point)[EQUIVALENT];
        let (stress, slope) = self.material.hardening.flow_stress(before + x);
        (self.flow_stress[0][point], self.flow_stress[1][point]) = (stress, slope);
        self.set_decays(point);
    }

    /// Sets the recovery factors of the backstresses of a point.
    fn set_decays(&mut self, point: usize) {
        for (one, decays) in self.material.backstresses.iter().zip(&mut self.decays) {
            let Decay { remaining, remaining_rate, growth, growth_rate } = one.decay(self.x[point]);
            for (to, value) in
                decays.iter_mut().zip([remaining, remaining_rate, growth, growth_rate])
            {
                to[point] = value;
            }
        }
    }

    /// Solves for the increments of equivalent plastic strain.
    #[inline(always)]
    fn solve<S: Simd>(&mut self, simd: S) -> Result<(), (usize, MaterialError)> {
        let mut search = [Search::new(); POINTS];
        let mut active = self.plastic;
        let (mut equivalent, mut hardening) = (ZERO, ZERO);
        for _ in 0..=RETURN_ITERATIONS_MAX {
            if active == [false; POINTS] {
                break;
            }
            for first in Lane::<S>::groups_of(self.count) {
                let at = self.at(simd, first);
                at.equivalent.store(&mut equivalent, first);
                at.hardening.store(&mut hardening, first);
            }
            for point in 0..self.count {
                if !active[point] {
                    continue;
                }
                let at = [equivalent[point], hardening[point]];
                let shear = self.material.elastic.shear_modulus();
                let increment_min = 1e-9 * self.equivalent[point] / (2.0 * shear);
                let stress = [self.flow_stress[0][point], self.flow_stress[1][point]];
                match search[point].next(self.x[point], at, stress, increment_min) {
                    Some(x) => self.set_increment(point, x),
                    None => active[point] = false,
                }
            }
        }
        let failed = |residual: f64| residual.is_nan() || residual.abs() > RESIDUAL_ACCEPTED;
        match (0..self.count).find(|&point| failed(search[point].residual)) {
            None => Ok(()),
            Some(point) => {
                let residual = search[point].residual.abs();
                let iterations = RETURN_ITERATIONS_MAX;
                Err((point, MaterialError::ReturnMapping { residual, iterations }))
            }
        }
    }
}
