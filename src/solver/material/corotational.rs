//! Stretch and Cauchy stress of a state in logarithmic strain space, without the rotation.
//!
//! With the eigenvalues `e_a` and eigenvectors of `E`, the right stretch is `U = exp E` and the Jacobian `J = exp tr E`.
//! The second Piola-Kirchhoff stress is `S_ab = 2 f[λ_a, λ_b] T_ab` in the eigenframe ([`super::log_strain`]), so that
//!
//! `(J Rᵀ σ R)_ab = (U S U)_ab = T_ab d / sinh d`, `d = e_a - e_b`.
//!
//! The quotient is 1 for equal eigenvalues: there, and for stresses with the axes of the strain, `T` is the rotated
//! Kirchhoff stress (Hoger 1987, Int. J. Solids Structures 23, 1645-1656).

use super::law::LogState;
use crate::numbers::tensor;
use kanagata_geometry::Mat3;

/// A state without its rotation `R`: the deformation gradient is `F = R U`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corotational {
    /// Right stretch `U`.
    pub stretch: Mat3,
    /// Logarithmic strain `ln U`.
    pub strain: Mat3,
    /// `Rᵀ σ R` of the Cauchy stress `σ` [MPa].
    pub stress: Mat3,
}

impl Corotational {
    /// The state of a point.
    #[must_use]
    pub fn of(state: &LogState) -> Self {
        let strain = tensor::to_matrix(&state.strain);
        let frame = strain.symmetric_eigen();
        let (axes, values) = (frame.eigenvectors, frame.eigenvalues);
        let conjugate = axes.transpose() * tensor::to_matrix(&state.stress) * axes;
        let over_volume = (-values.sum()).exp();
        let rotated = Mat3::from_fn(|a, b| {
            conjugate[(a, b)] * over_volume * over_sinh(values[a] - values[b])
        });
        let stress = axes * rotated * axes.transpose();
        Self {
            stretch: axes * Mat3::from_diagonal(&values.map(f64::exp)) * axes.transpose(),
            strain,
            stress: 0.5 * (stress + stress.transpose()),
        }
    }
}

/// `d / sinh d`.
fn over_sinh(d: f64) -> f64 {
    if d == 0.0 { 1.0 } else { d / d.sinh() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::log_strain;
    use crate::material::{LogResponse, card};
    use crate::numbers::tensor::{Mandel, from_matrix};

    /// The Cauchy stress `F S Fᵀ / J` of the second Piola-Kirchhoff stress that the elements use, for strains whose
    /// axes are not those of the stress.
    #[test]
    fn stress_is_the_push_forward_of_the_second_piola_kirchhoff_stress() {
        for name in ["mild-steel-neto2012", "aa2090-t3-barlat2005"] {
            let law = card::find(name).unwrap().build(0.4).unwrap();
            let path: [Mandel; 3] = [
                [0.1, -0.02, -0.07, 0.05, 0.01, -0.02],
                [0.3, 0.1, -0.38, -0.1, 0.03, 0.02],
                [0.3, 0.1, -0.38, 0.2, 0.03, 0.02],
            ];
            let mut history = vec![0.0; law.state_len()];
            law.initial_state(&mut history);
            let mut skew = 0.0_f64;
            for strain in path {
                let (old, mut out) = (history.clone(), LogResponse::zero());
                law.update(&strain, &old, &mut history, &mut out).unwrap();
                let state = law.log_state(&history).unwrap();
                assert_eq!(state.strain, strain);
                for (found, expected) in state.stress.iter().zip(out.stress) {
                    assert!((found - expected).abs() < 1e-8, "{found} {expected}");
                }
                let found = Corotational::of(&state);
                let u = found.stretch;
                let c = from_matrix(&(u * u));
                let piola = log_strain::update(law.as_ref(), &c, &old, &mut history, false);
                let piola = tensor::to_matrix(&piola.unwrap().stress);
                let expected = u * piola * u / u.determinant();
                let off = (found.stress - expected).norm() / expected.norm();
                assert!(off < 1e-10, "{name}: {off:e}");
                let e = found.strain;
                skew = skew.max((e * expected - expected * e).norm() / expected.norm());
            }
            assert!(skew > 0.01, "the axes of stress and strain are one: {skew}");
        }
    }
}
