//! Forming limits of sheet metals: the limit curve of a card, and the zones of the forming limit diagram.
//!
//! The diagram has the minor strain as abscissa and the major strain as ordinate: logarithmic principal strains of the
//! mid-surface. A limit curve gives the major strain at which a neck localises. It holds for straight strain paths.

mod curve;
mod laws;
mod zones;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use curve::LimitCurve;
pub use laws::KEELER_THICKNESS_MAX;
pub use zones::{Diagram, RISK_MARGIN, STRETCH_MIN, Zone};

/// Forming limit curve of a sheet, measured or by a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "law", deny_unknown_fields)]
pub enum FormingLimit {
    /// Points of a measured curve, joined by straight lines in the diagram of logarithmic strains.
    Points {
        /// Strain measure of the points.
        strain: StrainMeasure,
        /// Minor and major strain of each point, by strictly increasing minor strain; at least two, ratios and not
        /// per cent.
        points: Vec<[f64; 2]>,
    },
    /// Keeler and Brazier (1977), for steels: plane-strain limit from thickness and strain-hardening exponent.
    KeelerBrazier {
        /// Strain-hardening exponent n, above 0 and at most 1; default: n of the card's hardening law.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        n: Option<f64>,
    },
    /// Abspoel, Scholting and Droog (2013), for steels: four points from elongation after fracture, r value and
    /// thickness.
    AbspoelScholting {
        /// Elongation after fracture A80, across the rolling direction [%], 1 to 100.
        a80_percent: f64,
        /// Smallest A80 of all directions [%], 1 to `a80_percent`; default: `a80_percent`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        a80_min_percent: Option<f64>,
        /// Mean r value `(r0 + 2 r45 + r90) / 4`, 0.1 to 5.
        r: f64,
    },
}

/// Measure of given strains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StrainMeasure {
    /// Change of length over initial length.
    Engineering,
    /// Logarithm of the ratio of lengths.
    Logarithmic,
}

/// Data that define no forming limit curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("forming_limit.{key}: found {found}; allowed: {allowed}")]
pub struct LimitError {
    /// Key below `forming_limit`.
    pub key: String,
    /// What was found.
    pub found: String,
    /// Allowed values.
    pub allowed: &'static str,
}

/// Largest strain of a measured curve: a curve in per cent is above it, curves of sheet metals are below 1.
const STRAIN_MAX: f64 = 3.0;

/// Smallest elongation after fracture of a sheet that is formed [%]; a ratio in place of per cent is below it.
const A80_MIN_PERCENT: f64 = 1.0;
/// Smallest mean r value; sheet metals have 0.3 to 3.
const R_MIN: f64 = 0.1;

impl FormingLimit {
    /// The curve for a sheet of initial `thickness` [mm]. `exponent`: strain-hardening exponent of the hardening law, if
    /// it has one.
    ///
    /// # Errors
    /// [`LimitError`] for the first value out of range, or if no exponent is known.
    pub fn curve(&self, thickness: f64, exponent: Option<f64>) -> Result<LimitCurve, LimitError> {
        match self {
            Self::Points { strain, points } => {
                check_points(*strain, points)?;
                let logarithmic = |e: f64| match strain {
                    StrainMeasure::Engineering => e.ln_1p(),
                    StrainMeasure::Logarithmic => e,
                };
                Ok(LimitCurve::new(points.iter().map(|p| p.map(logarithmic)).collect()))
            }
            Self::KeelerBrazier { n } => {
                let known = n.or(exponent).ok_or_else(|| {
                    error("n", "none", "a number: the hardening law has no exponent of its own")
                })?;
                need(
                    (0.0..=1.0).contains(&known) && known > 0.0,
                    "n",
                    known,
                    "above 0, at most 1",
                )?;
                Ok(laws::keeler_brazier(thickness, known))
            }
            Self::AbspoelScholting { a80_percent, a80_min_percent, r } => {
                let elongation = *a80_percent;
                need(
                    (A80_MIN_PERCENT..=100.0).contains(&elongation),
                    "a80_percent",
                    elongation,
                    "1 to 100, in per cent",
                )?;
                let smallest = a80_min_percent.unwrap_or(elongation);
                let allowed = "1 to a80_percent, in per cent";
                let sound = (A80_MIN_PERCENT..=elongation).contains(&smallest);
                need(sound, "a80_min_percent", smallest, allowed)?;
                need((R_MIN..=5.0).contains(r), "r", *r, "0.1 to 5")?;
                Ok(laws::abspoel_scholting(thickness, [elongation, smallest], *r))
            }
        }
    }
}

fn error(key: impl Into<String>, found: impl Into<String>, allowed: &'static str) -> LimitError {
    LimitError { key: key.into(), found: found.into(), allowed }
}

fn need(ok: bool, key: &str, found: f64, allowed: &'static str) -> Result<(), LimitError> {
    if ok { Ok(()) } else { Err(error(key, found.to_string(), allowed)) }
}

/// Checks the points of a measured curve. Engineering minor strains are above -1.
fn check_points(strain: StrainMeasure, points: &[[f64; 2]]) -> Result<(), LimitError> {
    if points.len() < 2 {
        return Err(error("points", points.len().to_string(), "at least two points"));
    }
    let least = match strain {
        StrainMeasure::Engineering => -0.9,
        StrainMeasure::Logarithmic => -STRAIN_MAX,
    };
    for (k, &[minor, major]) in points.iter().enumerate() {
        let found = format!("[{minor}, {major}]");
        let key = format!("points[{k}]");
        let sound = (least..=STRAIN_MAX).contains(&minor) && major > 0.0 && major <= STRAIN_MAX;
        if !sound {
            let allowed = "minor and major strain as ratios, not per cent: the major one above 0, both at most 3";
            return Err(error(key, found, allowed));
        }
        if k > 0 && minor <= points[k - 1][0] {
            return Err(error(key, found, "a minor strain above that of the point before"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(strain: StrainMeasure, points: &[[f64; 2]]) -> FormingLimit {
        FormingLimit::Points { strain, points: points.to_vec() }
    }

    #[test]
    fn engineering_points_become_logarithmic() {
        let given = [[-0.2, 0.5], [0.0, 0.3], [0.25, 0.4]];
        let curve = points(StrainMeasure::Engineering, &given).curve(1.0, None).unwrap();
        for [minor, major] in given {
            let found = curve.major_at(minor.ln_1p());
            assert!((found - major.ln_1p()).abs() < 1e-15, "{found}");
        }
        let curve = points(StrainMeasure::Logarithmic, &given).curve(1.0, None).unwrap();
        assert_eq!(curve.points(), given);
    }

    #[test]
    fn data_that_define_no_curve_are_refused_with_their_key() {
        let of = |limit: FormingLimit| limit.curve(1.0, None).unwrap_err().to_string();
        let log = StrainMeasure::Logarithmic;
        let found = of(points(log, &[[0.0, 0.3]]));
        assert_eq!(found, "forming_limit.points: found 1; allowed: at least two points");
        let found = of(points(log, &[[0.0, 0.3], [0.0, 0.4]]));
        assert!(
            found.contains("points[1]: found [0, 0.4]; allowed: a minor strain above"),
            "{found}"
        );
        for wrong in [[0.0, 30.0], [0.0, 0.0], [f64::NAN, 0.3], [0.1, f64::INFINITY]] {
            let found = of(points(log, &[[-0.1, 0.4], wrong]));
            assert!(found.contains("points[1]") && found.contains("not per cent"), "{found}");
        }
        assert!(of(points(StrainMeasure::Engineering, &[[-1.0, 0.4], [0.0, 0.3]])).contains("[-1"));
        assert!(of(FormingLimit::KeelerBrazier { n: None }).contains("n: found none"));
        assert!(of(FormingLimit::KeelerBrazier { n: Some(0.0) }).contains("above 0"));
        let law = |a80_percent, smallest, r| FormingLimit::AbspoelScholting {
            a80_percent,
            a80_min_percent: smallest,
            r,
        };
        assert!(of(law(0.0, None, 1.0)).contains("a80_percent: found 0"));
        assert!(of(law(30.0, Some(31.0), 1.0)).contains("a80_min_percent: found 31"));
        assert!(of(law(30.0, None, f64::NAN)).contains("r: found NaN"));
    }

    #[test]
    fn a_limit_is_read_as_written_in_a_card() {
        let text =
            r#"{"law": "points", "strain": "engineering", "points": [[-0.1, 0.4], [0.0, 0.3]]}"#;
        let limit: FormingLimit = serde_json::from_str(text).unwrap();
        assert_eq!(limit, points(StrainMeasure::Engineering, &[[-0.1, 0.4], [0.0, 0.3]]));
        let text = r#"{"law": "keeler-brazier"}"#;
        let limit: FormingLimit = serde_json::from_str(text).unwrap();
        assert_eq!(limit, FormingLimit::KeelerBrazier { n: None });
        assert_eq!(serde_json::to_string(&limit).unwrap(), r#"{"law":"keeler-brazier"}"#);
        assert!(
            serde_json::from_str::<FormingLimit>(r#"{"law": "keeler-brazier", "m": 1}"#).is_err()
        );
    }
}
