//! Isotropic hardening: flow stress `σ_y` [MPa] over equivalent plastic strain `p`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A hardening law. All laws must not soften; [`Hardening::check`] says whether the numbers allow that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "law", deny_unknown_fields)]
pub enum Hardening {
    /// `K (ε0 + p)^n`.
    Swift {
        /// `K` [MPa].
        k: f64,
        /// `ε0`, above zero.
        eps0: f64,
        /// `n`, in [0, 1].
        n: f64,
    },
    /// `σ0 + Q (1 - exp(-b p))`.
    Voce {
        /// `σ0` [MPa].
        sigma0: f64,
        /// `Q` [MPa], not below zero.
        q: f64,
        /// `b`, not below zero.
        b: f64,
    },
    /// `w K (ε0 + p)^n + (1 - w) (σ0 + Q (1 - exp(-b p)))`.
    SwiftVoce {
        /// Share `w` of the Swift part, in [0, 1].
        weight: f64,
        /// `K` [MPa].
        k: f64,
        /// `ε0`, above zero.
        eps0: f64,
        /// `n`, in [0, 1].
        n: f64,
        /// `σ0` [MPa].
        sigma0: f64,
        /// `Q` [MPa].
        q: f64,
        /// `b`.
        b: f64,
    },
    /// `σ0 + K p^n`.
    Ludwik {
        /// `σ0` [MPa].
        sigma0: f64,
        /// `K` [MPa].
        k: f64,
        /// `n`, in (0, 1].
        n: f64,
    },
    /// Straight lines between points; constant after the last.
    Table {
        /// Equivalent plastic strains, strictly increasing from 0.
        strain: Vec<f64>,
        /// Flow stresses [MPa], not decreasing.
        stress: Vec<f64>,
    },
}

/// Invalid parameter of a hardening law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("hardening.{field} is {found}, must be {allowed}")]
pub struct HardeningError {
    /// Key of the card.
    pub field: String,
    /// Value found.
    pub found: f64,
    /// Allowed values.
    pub allowed: &'static str,
}

impl Hardening {
    /// Flow stress and its slope [MPa] at equivalent plastic strain `p >= 0`. Ludwik's law with `n < 1` has an
    /// infinite slope at 0.
    #[must_use]
    pub fn flow_stress(&self, p: f64) -> (f64, f64) {
        match self {
            Self::Swift { k, eps0, n } => swift(*k, *eps0, *n, p),
            Self::Voce { sigma0, q, b } => voce(*sigma0, *q, *b, p),
            Self::SwiftVoce { weight, k, eps0, n, sigma0, q, b } => {
                let (one, one_slope) = swift(*k, *eps0, *n, p);
                let (two, two_slope) = voce(*sigma0, *q, *b, p);
                let rest = 1.0 - weight;
                (weight * one + rest * two, weight * one_slope + rest * two_slope)
            }
            Self::Ludwik { sigma0, k, n } => {
                let power = k * p.powf(*n);
                let initial_slope = if *n < 1.0 && *k > 0.0 { f64::INFINITY } else { k * n };
                (sigma0 + power, if p > 0.0 { n * power / p } else { initial_slope })
            }
            Self::Table { strain, stress } => table(strain, stress, p),
        }
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`HardeningError`] for the first parameter out of range.
    pub fn check(&self) -> Result<(), HardeningError> {
        match self {
            Self::Swift { k, eps0, n } => check_swift(*k, *eps0, *n),
            Self::Voce { sigma0, q, b } => check_voce(*sigma0, *q, *b),
            Self::SwiftVoce { weight, k, eps0, n, sigma0, q, b } => {
                need((0.0..=1.0).contains(weight), "weight", *weight, "in [0, 1]")?;
                check_swift(*k, *eps0, *n)?;
                check_voce(*sigma0, *q, *b)
            }
            Self::Ludwik { sigma0, k, n } => {
                need(is_positive(*sigma0), "sigma0", *sigma0, "above zero")?;
                need(is_not_negative(*k), "k", *k, "zero or above")?;
                need(*n > 0.0 && *n <= 1.0, "n", *n, "in (0, 1]")
            }
            Self::Table { strain, stress } => check_table(strain, stress),
        }
    }
}

fn need(ok: bool, field: &str, found: f64, allowed: &'static str) -> Result<(), HardeningError> {
    if ok { Ok(()) } else { Err(HardeningError { field: field.into(), found, allowed }) }
}

fn is_positive(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}

fn is_not_negative(x: f64) -> bool {
    x >= 0.0 && x.is_finite()
}

fn check_swift(k: f64, eps0: f64, n: f64) -> Result<(), HardeningError> {
    need(is_positive(k), "k", k, "above zero")?;
    need(is_positive(eps0), "eps0", eps0, "above zero")?;
    need((0.0..=1.0).contains(&n), "n", n, "in [0, 1]")
}

fn check_voce(sigma0: f64, q: f64, b: f64) -> Result<(), HardeningError> {
    need(is_positive(sigma0), "sigma0", sigma0, "above zero")?;
    need(is_not_negative(q), "q", q, "zero or above")?;
    need(is_not_negative(b), "b", b, "zero or above")
}

fn check_table(strain: &[f64], stress: &[f64]) -> Result<(), HardeningError> {
    need(!strain.is_empty(), "strain: the number of points", 0.0, "at least one")?;
    need(
        strain.len() == stress.len(),
        "stress: the number of points",
        stress.len() as f64,
        "as many stresses as strains",
    )?;
    need(strain[0] == 0.0, "strain[0]", strain[0], "zero")?;
    need(is_positive(stress[0]), "stress[0]", stress[0], "above zero")?;
    for (k, pair) in strain.windows(2).enumerate() {
        let rises = pair[1] > pair[0] && pair[1].is_finite();
        need(rises, &format!("strain[{}]", k + 1), pair[1], "above the one before")?;
    }
    for (k, pair) in stress.windows(2).enumerate() {
        let does_not_fall = pair[1] >= pair[0] && pair[1].is_finite();
        let allowed = "not below the one before; fit a law to a measured curve";
        need(does_not_fall, &format!("stress[{}]", k + 1), pair[1], allowed)?;
    }
    Ok(())
}

fn swift(k: f64, eps0: f64, n: f64, p: f64) -> (f64, f64) {
    let stress = k * (eps0 + p).powf(n);
    (stress, n * stress / (eps0 + p))
}

fn voce(sigma0: f64, q: f64, b: f64, p: f64) -> (f64, f64) {
    let decay = q * (-b * p).exp();
    (sigma0 + q - decay, b * decay)
}

fn table(strain: &[f64], stress: &[f64], p: f64) -> (f64, f64) {
    let next = strain.partition_point(|&known| known <= p);
    match (next, strain.len()) {
        (_, 0) => (0.0, 0.0),
        (0, _) => (stress[0], 0.0),
        (next, len) if next == len => (stress[len - 1], 0.0),
        (next, _) => {
            let slope = (stress[next] - stress[next - 1]) / (strain[next] - strain[next - 1]);
            (stress[next - 1] + slope * (p - strain[next - 1]), slope)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> Vec<Hardening> {
        vec![
            Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 },
            Hardening::Voce { sigma0: 120.0, q: 200.0, b: 12.0 },
            Hardening::SwiftVoce {
                weight: 0.4,
                k: 529.5,
                eps0: 0.00439,
                n: 0.268,
                sigma0: 120.0,
                q: 200.0,
                b: 12.0,
            },
            Hardening::Ludwik { sigma0: 120.0, k: 400.0, n: 0.5 },
            Hardening::Table { strain: vec![0.0, 0.1, 0.5], stress: vec![100.0, 200.0, 250.0] },
        ]
    }

    #[test]
    fn slope_is_the_derivative() {
        for law in laws() {
            law.check().unwrap();
            for p in [0.01, 0.07, 0.3, 0.9] {
                let h = 1e-6;
                let difference = (law.flow_stress(p + h).0 - law.flow_stress(p - h).0) / (2.0 * h);
                let slope = law.flow_stress(p).1;
                assert!(
                    (slope - difference).abs() < 1e-6 * (1.0 + slope),
                    "{law:?} {p}: {slope} {difference}"
                );
            }
        }
    }

    #[test]
    fn the_paper_yields_at_123_6() {
        assert!((laws()[0].flow_stress(0.0).0 - 123.6).abs() < 0.2);
    }

    #[test]
    fn softening_and_empty_tables_are_refused() {
        for (law, field) in [
            (Hardening::Table { strain: vec![], stress: vec![] }, "strain: the number of points"),
            (Hardening::Table { strain: vec![0.0, 0.1], stress: vec![100.0, 90.0] }, "stress[1]"),
            (Hardening::Swift { k: 500.0, eps0: 0.0, n: 0.2 }, "eps0"),
            (Hardening::Voce { sigma0: 100.0, q: f64::NAN, b: 1.0 }, "q"),
        ] {
            assert_eq!(law.check().unwrap_err().field, field);
        }
    }
}
