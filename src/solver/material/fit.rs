//! Least-squares fit of hardening laws to a measured flow curve, which is noisy and may decrease.

use super::hardening::Hardening;
use kanagata_geometry::golden::minimize;

/// A hardening law and its deviation from the curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The law.
    pub law: Hardening,
    /// Root mean square deviation [MPa].
    pub rms_mpa: f64,
    /// Largest deviation [MPa].
    pub largest_mpa: f64,
    /// Plastic strain at the largest deviation.
    pub at: f64,
}

/// Why a curve cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few points, or numbers of strains and stresses differ.
    #[error(
        "{strains} strains and {stresses} stresses; allowed: at least {POINTS_MIN} of each, as many of both"
    )]
    Count {
        /// Strains given.
        strains: usize,
        /// Stresses given.
        stresses: usize,
    },
    /// A value that no tension curve has.
    #[error(
        "point {index} is ({strain}, {stress} MPa); allowed: strains from 0 to 10, stresses above zero, both finite"
    )]
    Value {
        /// Index of the point, from 0.
        index: usize,
        /// Plastic strain of the point.
        strain: f64,
        /// Stress of the point [MPa].
        stress: f64,
    },
    /// All strains are equal, or only a softening law would fit.
    #[error(
        "no law that hardens fits these points; give the plastic strain and the true stress up to uniform elongation"
    )]
    None,
}

/// Minimum number of points: one more than the parameters of a law.
const POINTS_MIN: usize = 4;
/// Maximum plastic strain of a measured curve.
const STRAIN_MAX: f64 = 10.0;
/// Grid points for each nonlinear parameter, equidistant in its logarithm.
const GRID_POINTS: usize = 48;
/// Golden-section steps in the best grid interval; they reduce it to 1e-9.
const GOLDEN_SECTION_STEPS: usize = 44;

/// Fits Swift's, Voce's and the mixed law to plastic strains and true stresses [MPa] in any order; best fit first.
///
/// # Errors
/// [`FitError`] if the points do not form a tension curve.
pub fn fit(strain: &[f64], stress: &[f64]) -> Result<Vec<Fitted>, FitError> {
    if strain.len() < POINTS_MIN || strain.len() != stress.len() {
        return Err(FitError::Count { strains: strain.len(), stresses: stress.len() });
    }
    let points: Vec<(f64, f64)> = strain.iter().copied().zip(stress.iter().copied()).collect();
    let sound = |(p, s): (f64, f64)| (0.0..=STRAIN_MAX).contains(&p) && s > 0.0 && s.is_finite();
    if let Some(index) = points.iter().position(|&point| !sound(point)) {
        return Err(FitError::Value { index, strain: strain[index], stress: stress[index] });
    }
    let swift = swift(&points);
    let voce = voce(&points);
    let mixed = swift.as_ref().zip(voce.as_ref()).and_then(|(one, two)| mixed(&points, one, two));
    let found = [swift, voce, mixed].into_iter().flatten().filter(|law| law.check().is_ok());
    let mut fitted: Vec<Fitted> = found.map(|law| assessed(law, &points)).collect();
    // The sort is stable: among equal fits the law with fewer parameters comes first.
    fitted.sort_by(|a, b| a.rms_mpa.total_cmp(&b.rms_mpa));
    if fitted.is_empty() { Err(FitError::None) } else { Ok(fitted) }
}

fn assessed(law: Hardening, points: &[(f64, f64)]) -> Fitted {
    let deviation = |&(p, s): &(f64, f64)| (law.flow_stress(p).0 - s).abs();
    let sum: f64 = points.iter().map(|point| deviation(point).powi(2)).sum();
    let worst = points
        .iter()
        .max_by(|a, b| deviation(a).total_cmp(&deviation(b)))
        .copied()
        .unwrap_or_default();
    let (largest_mpa, at) = (deviation(&worst), worst.0);
    Fitted { law, rms_mpa: (sum / points.len() as f64).sqrt(), largest_mpa, at }
}

fn largest_strain(points: &[(f64, f64)]) -> Option<f64> {
    Some(points.iter().map(|x| x.0).fold(0.0, f64::max)).filter(|p| *p > 0.0)
}

/// Swift: `K (ε0 + p)^n`. `K` is optimal for given `ε0` and `n`, `n` for given `ε0`.
fn swift(points: &[(f64, f64)]) -> Option<Hardening> {
    let largest_strain = largest_strain(points)?;
    let of = |eps0: f64, n: f64| {
        let (mut fs, mut ff, mut ss) = (0.0, 0.0, 0.0);
        for &(p, s) in points {
            let f = (eps0 + p).powf(n);
            (fs, ff, ss) = (fs + f * s, ff + f * f, ss + s * s);
        }
        (fs / ff, ss - fs * fs / ff)
    };
    let best_n = |eps0: f64| minimize(|n| of(eps0, n).1, [0.0, 1.0], GOLDEN_SECTION_STEPS);
    let range = [(1e-6 * largest_strain).ln(), largest_strain.ln()];
    let (log, _) = minimise_on_grid(|log| best_n(log.exp()).1, range)?;
    let eps0 = log.exp();
    let n = best_n(eps0).0;
    Some(Hardening::Swift { k: of(eps0, n).0, eps0, n })
}

/// Voce: `σ0 + Q (1 - exp(-b p))`. `σ0` and `Q` are optimal for given `b`.
fn voce(points: &[(f64, f64)]) -> Option<Hardening> {
    let largest_strain = largest_strain(points)?;
    let count = points.len() as f64;
    let of = |b: f64| {
        let (mut f, mut ff, mut s, mut fs) = (0.0, 0.0, 0.0, 0.0);
        for &(p, stress) in points {
            let x = -(-b * p).exp_m1();
            (f, ff, s, fs) = (f + x, ff + x * x, s + stress, fs + x * stress);
        }
        let q = ((count * fs - f * s) / (count * ff - f * f)).max(0.0);
        ((s - q * f) / count, q)
    };
    let error = |log: f64| {
        let b = log.exp();
        let (sigma0, q) = of(b);
        let deviation = |&(p, s): &(f64, f64)| (sigma0 - q * (-b * p).exp_m1() - s).powi(2);
        points.iter().map(deviation).sum()
    };
    let (log, _) =
        minimise_on_grid(error, [(0.01 / largest_strain).ln(), (1000.0 / largest_strain).ln()])?;
    let (sigma0, q) = of(log.exp());
    Some(Hardening::Voce { sigma0, q, b: log.exp() })
}

/// Swift-Voce: optimal weight of the two laws, each with the parameters of its own fit.
fn mixed(points: &[(f64, f64)], one: &Hardening, two: &Hardening) -> Option<Hardening> {
    let (mut above, mut below) = (0.0, 0.0);
    for &(p, s) in points {
        let (a, b) = (one.flow_stress(p).0, two.flow_stress(p).0);
        (above, below) = (above + (a - b) * (s - b), below + (a - b).powi(2));
    }
    let weight = above / below;
    let (&Hardening::Swift { k, eps0, n }, &Hardening::Voce { sigma0, q, b }) = (one, two) else {
        return None;
    };
    (weight > 0.0 && weight < 1.0).then_some(Hardening::SwiftVoce {
        weight,
        k,
        eps0,
        n,
        sigma0,
        q,
        b,
    })
}

/// Minimiser and minimum of `f` in a range: best point of a grid, then golden sections around it.
fn minimise_on_grid(f: impl Fn(f64) -> f64, [low, high]: [f64; 2]) -> Option<(f64, f64)> {
    let at = |k: usize| low + (high - low) * k as f64 / GRID_POINTS as f64;
    let values = (0..=GRID_POINTS).map(|k| (k, f(at(k)))).filter(|v| v.1.is_finite());
    let (k, _) = values.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(minimize(f, [at(k.saturating_sub(1)), at((k + 1).min(GRID_POINTS))], GOLDEN_SECTION_STEPS))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(law: &Hardening, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / (1_u64 << 30) as f64 - 1.0
        };
        let strain: Vec<f64> = (0..=200).map(|k| 0.001 * f64::from(k)).collect();
        let stress = strain.iter().map(|&p| law.flow_stress(p).0 + noise * random()).collect();
        (strain, stress)
    }

    #[test]
    fn a_law_without_noise_is_found_again() {
        let laws = [
            Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 },
            Hardening::Voce { sigma0: 120.0, q: 200.0, b: 12.0 },
        ];
        for law in laws {
            let (strain, stress) = of(&law, 0.0);
            let found = fit(&strain, &stress).unwrap();
            assert!(found[0].rms_mpa < 1e-4, "{:?}", found[0]);
            for p in [0.0, 0.05, 0.2] {
                let (one, two) = (law.flow_stress(p), found[0].law.flow_stress(p));
                assert!((one.0 - two.0).abs() < 1e-3 && (one.1 / two.1 - 1.0).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn noise_is_left_as_the_difference() {
        let law = Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 };
        let (strain, stress) = of(&law, 1.0);
        assert!(
            Hardening::Table { strain: strain.clone(), stress: stress.clone() }.check().is_err()
        );
        let found = &fit(&strain, &stress).unwrap()[0];
        // Uniform deviations within 2 MPa have a root mean square of 0.577 MPa.
        assert!((found.rms_mpa - 0.577).abs() < 0.05 && found.largest_mpa < 1.5, "{found:?}");
        let middle = strain.iter().map(|&p| law.flow_stress(p).0 - found.law.flow_stress(p).0);
        assert!(middle.fold(0.0, |m: f64, d| m.max(d.abs())) < 0.6);
    }

    #[test]
    fn points_that_form_no_curve_are_rejected() {
        assert!(matches!(fit(&[0.0, 0.1], &[1.0, 2.0]), Err(FitError::Count { .. })));
        let bad = fit(&[0.0, 0.1, f64::NAN, 0.2], &[1.0; 4]).unwrap_err();
        assert!(matches!(bad, FitError::Value { index: 2, .. }), "{bad}");
        assert_eq!(fit(&[0.0; 4], &[1.0; 4]), Err(FitError::None));
        // For a decreasing curve the best law without softening is constant.
        let found = fit(&[0.0, 0.1, 0.2, 0.3], &[400.0, 300.0, 200.0, 100.0]).unwrap();
        assert!(found[0].largest_mpa >= 149.0, "{found:?}");
    }
}
