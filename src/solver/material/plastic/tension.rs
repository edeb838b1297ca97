//! Monotonic tension along the rolling direction. On an anisotropic yield surface a backstress grows along the
//! plastic strain and not along the stress, and the flow direction rotates with it.

use super::Backstress;
use crate::material::hardening::Hardening;
use crate::material::yield_function::YieldFunction;
use crate::numbers::tensor::{self, Mandel};

/// Number of steps to a strain. Their lengths grow linearly, since backstresses saturate early.
const STRAIN_STEPS: usize = 100;

/// State of a point in tension along the rolling direction.
struct Tension<'a> {
    criterion: &'a YieldFunction,
    hardening: &'a Hardening,
    backstresses: &'a [Backstress],
    /// `p`.
    equivalent: f64,
    /// `X_k` [MPa].
    grown: Vec<Mandel>,
}

impl Tension<'_> {
    /// Uniaxial stress along the rolling direction [MPa] with `σ̄(T - X) = σ_y(p)`, and the flow direction there.
    fn at_yield(&self) -> (f64, Mandel) {
        const ITERATIONS: usize = 50;
        let sum: Mandel = std::array::from_fn(|i| self.grown.iter().map(|x| x[i]).sum());
        let flow = self.hardening.flow_stress(self.equivalent).0;
        let mut stress = flow + sum[0] - 0.5 * (sum[1] + sum[2]);
        let mut normal = [0.0; 6];
        for _ in 0..ITERATIONS {
            let mut relative = sum.map(|x| -x);
            relative[0] += stress;
            let found = self.criterion.derivatives(&relative);
            normal = found.gradient;
            let excess = found.value - flow;
            stress -= excess / normal[0];
            if excess.abs() <= 1e-14 * flow {
                break;
            }
        }
        (stress, normal)
    }

    /// Updates the state for flow of `dp = x` along `normal`.
    fn advance(&mut self, x: f64, normal: &Mandel) {
        self.equivalent += x;
        for (one, grown) in self.backstresses.iter().zip(&mut self.grown) {
            let decay = one.decay(x);
            let growth = 2.0 / 3.0 * one.modulus * decay.growth * x;
            (0..6).for_each(|i| grown[i] = decay.remaining * grown[i] + growth * normal[i]);
        }
    }

    /// Advances by a plastic strain along the rolling direction with the flow direction of the midpoint.
    fn step(&mut self, strain: f64) {
        let (before, saved) = (self.equivalent, self.grown.clone());
        let (_, normal) = self.at_yield();
        self.advance(0.5 * strain / normal[0], &normal);
        let (_, normal) = self.at_yield();
        (self.equivalent, self.grown) = (before, saved);
        self.advance(strain / normal[0], &normal);
    }

    /// Tangent modulus `dσ/dε` [MPa] from `n : (dT - dX) = σ_y' dp`.
    fn slope(&self, normal: &Mandel) -> f64 {
        let rise = |(one, grown): (&Backstress, &Mandel)| {
            2.0 / 3.0 * one.modulus * tensor::dot(normal, normal)
                - one.recovery * tensor::dot(normal, grown)
        };
        let kinematic: f64 = self.backstresses.iter().zip(&self.grown).map(rise).sum();
        (self.hardening.flow_stress(self.equivalent).1 + kinematic) / (normal[0] * normal[0])
    }
}

/// Stress and tangent modulus [MPa] in tension along the rolling direction at the plastic strain `strain >= 0`.
pub(in crate::material) fn along_rolling(
    criterion: &YieldFunction,
    hardening: &Hardening,
    backstresses: &[Backstress],
    strain: f64,
) -> (f64, f64) {
    if backstresses.is_empty() {
        return hardening.flow_stress(strain);
    }
    let grown = vec![[0.0; 6]; backstresses.len()];
    let mut point = Tension { criterion, hardening, backstresses, equivalent: 0.0, grown };
    let whole = (STRAIN_STEPS * STRAIN_STEPS) as f64;
    (0..STRAIN_STEPS).for_each(|k| point.step(strain * (2 * k + 1) as f64 / whole));
    let (stress, normal) = point.at_yield();
    (stress, point.slope(&normal))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::tests::{run, sheet};
    use super::super::{BACKSTRESS, EQUIVALENT, Plastic, STRAIN};
    use super::*;
    use crate::material::law::LogResponse;

    /// Stress, state and strains of a point in uniaxial tension along the first axis to `strain[0]`. Solves for the
    /// other strains, starting from the given ones, so that the other stresses vanish.
    pub(in super::super) fn drawn(
        material: &Plastic,
        strain: &Mandel,
        old: &[f64],
    ) -> (f64, Vec<f64>, Mandel) {
        let rest = |out: &LogResponse| out.stress[1..].iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut strain = *strain;
        let (mut out, mut new) = run(material, &strain, old);
        for _ in 0..100 {
            if rest(&out) < 1e-10 * out.stress[0].abs() {
                return (out.stress[0], new, strain);
            }
            let matrix = nalgebra::SMatrix::<f64, 5, 5>::from_fn(|r, c| out.tangent[r + 1][c + 1]);
            let rhs = nalgebra::SVector::<f64, 5>::from_fn(|r, _| -out.stress[r + 1]);
            let step = matrix.lu().solve(&rhs).unwrap();
            // Nearly flat sides of the yield surface make a full Newton step diverge.
            let mut length = 1.0;
            loop {
                let tried = std::array::from_fn(|i| {
                    strain[i] + if i > 0 { length * step[i - 1] } else { 0.0 }
                });
                let next = run(material, &tried, old);
                if rest(&next.0) < rest(&out) || length < 1e-6 {
                    (strain, (out, new)) = (tried, next);
                    break;
                }
                length *= 0.5;
            }
        }
        panic!("tension to {} did not converge", strain[0]);
    }

    /// Comparison with the law itself in 200 increments. Isotropic flow would give another stress, for AA2090-T3 by
    /// more than 1 %.
    #[test]
    fn it_agrees_with_a_point_of_the_law() {
        for name in ["aa2090-t3-barlat2005", "aa6111-t4-barlat2005"] {
            let [_, law] = sheet(name);
            let mut state = vec![0.0; BACKSTRESS + 6 * law.backstresses.len()];
            let (mut stress, mut strain) = (0.0, [0.0; 6]);
            for k in 1..=200 {
                strain[0] = 5e-4 * f64::from(k);
                (stress, state, strain) = drawn(&law, &strain, &state);
            }
            let of =
                |strain| along_rolling(&law.criterion, &law.hardening, &law.backstresses, strain);
            let (found, slope) = of(state[STRAIN]);
            assert!((found / stress - 1.0).abs() < 1e-4, "{name}: {found} {stress}");
            let difference = (of(state[STRAIN] + 1e-4).0 - of(state[STRAIN] - 1e-4).0) / 2e-4;
            assert!((slope / difference - 1.0).abs() < 1e-4, "{name}: {slope} {difference}");
            let p = state[EQUIVALENT];
            let alike = law.hardening.flow_stress(p).0
                + law.backstresses.iter().map(|b| b.modulus * b.decay(p).growth * p).sum::<f64>();
            let anisotropic = name.starts_with("aa2090");
            assert_eq!(
                (alike / stress - 1.0).abs() > 0.01,
                anisotropic,
                "{name}: {alike} {stress}"
            );
        }
    }
}
