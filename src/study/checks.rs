//! Checks of a study: expected results, compared with those of its cases.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An expected result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// The expectation in words.
    pub says: String,
    /// Cases to check; all if empty.
    #[serde(default)]
    pub cases: Vec<String>,
    /// Case to compare with; default: the reference of the study.
    #[serde(default)]
    pub against: Option<String>,
    /// The quantity to check.
    pub figure: Figure,
    /// Largest value allowed.
    #[serde(default)]
    pub at_most: Option<f64>,
    /// Smallest value allowed.
    #[serde(default)]
    pub at_least: Option<f64>,
    /// Known reason why the check does not hold: reported instead of a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explained: Option<String>,
}

/// A quantity of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// RMS over the travel of the force difference, over the RMS force of the other case.
    ForceRms,
    /// Largest excess of the force over that of the other case in the last third of the stroke, over its largest force.
    /// The travel is reported too.
    LateForceExcess,
    /// Largest difference of thickness from the other case along dx and dxy [mm].
    ThicknessMm,
    /// Number of patches over that of the other case.
    PatchesOverReference,
    /// Processor time over that of the other case.
    SecondsOverReference,
    /// Time of an iteration in units of a factorisation of the same run, over that of the other case. It does not depend
    /// on the speed of the machine during each run.
    IterationInFactorisationsOverReference,
    /// Difference of nodal contact forces and tool forces, over the largest force.
    ForceError,
    /// Unaccounted energy over the work.
    EnergyError,
    /// Volume error over the volume of the sheet; elastic sheets have none.
    VolumeError,
    /// Largest penetration of a node [mm].
    PenetrationMm,
}

/// Outcome of a check.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// No checked case is done.
    Open,
    /// The check holds for every case that is done. Value and case are those closest to a limit.
    Holds {
        /// The value.
        value: f64,
        /// The case.
        case: String,
    },
    /// The check fails. Value and case are those farthest beyond a limit.
    Fails {
        /// The value.
        value: f64,
        /// The case.
        case: String,
    },
    /// The check fails for a known reason.
    Explained {
        /// The value.
        value: f64,
        /// The case.
        case: String,
        /// The reason.
        why: String,
    },
}

impl Check {
    /// Evaluates the check for the values of all cases that have one.
    #[must_use]
    pub fn evaluate(&self, values: &[(String, f64)]) -> Outcome {
        let margin = |v: f64| {
            let above = self.at_most.map_or(f64::INFINITY, |limit| limit - v);
            above.min(self.at_least.map_or(f64::INFINITY, |limit| v - limit))
        };
        // NaN counts as beyond all limits.
        let margin = |v: f64| if v.is_nan() { f64::NEG_INFINITY } else { margin(v) };
        let Some((case, value)) = values.iter().min_by(|a, b| margin(a.1).total_cmp(&margin(b.1)))
        else {
            return Outcome::Open;
        };
        let (case, value) = (case.clone(), *value);
        if margin(value) >= 0.0 {
            Outcome::Holds { value, case }
        } else if let Some(why) = self.explained.clone() {
            Outcome::Explained { value, case, why }
        } else {
            Outcome::Fails { value, case }
        }
    }

    /// The allowed range in words.
    #[must_use]
    pub fn allowed(&self) -> String {
        match (self.at_least, self.at_most) {
            (Some(a), Some(b)) => format!("{a:?} to {b:?}"),
            (Some(a), None) => format!("at least {a:?}"),
            (None, Some(b)) => format!("at most {b:?}"),
            (None, None) => "anything".into(),
        }
    }
}

impl Outcome {
    /// State, and value with its case, in words.
    #[must_use]
    pub fn texts(&self) -> [String; 2] {
        match self {
            Self::Open => ["open".into(), String::new()],
            Self::Holds { value, case } => ["holds".into(), format!("{value:.3e} ({case})")],
            Self::Explained { value, case, why } => {
                ["does not hold".into(), format!("{value:.3e} ({case}): {why}")]
            }
            Self::Fails { value, case } => {
                ["DOES NOT HOLD".into(), format!("{value:.3e} ({case})")]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_case_decides() {
        let check = |at_least: Option<f64>, at_most: Option<f64>| Check {
            says: String::new(),
            cases: vec![],
            against: None,
            figure: Figure::ForceRms,
            at_most,
            at_least,
            explained: None,
        };
        let values = [("a".to_owned(), 0.01), ("b".to_owned(), 0.03)];
        let holds = Outcome::Holds { value: 0.03, case: "b".into() };
        assert_eq!(check(None, Some(0.05)).evaluate(&values), holds);
        let fails = Outcome::Fails { value: 0.03, case: "b".into() };
        assert_eq!(check(None, Some(0.02)).evaluate(&values), fails);
        let known = Check { explained: Some("no b".into()), ..check(None, Some(0.02)) };
        let why = known.evaluate(&values).texts();
        assert_eq!(why, ["does not hold".to_owned(), "3.000e-2 (b): no b".to_owned()]);
        let known = Check { at_most: Some(0.05), ..known };
        assert_eq!(known.evaluate(&values), Outcome::Holds { value: 0.03, case: "b".into() });
        let fails = Outcome::Fails { value: 0.01, case: "a".into() };
        assert_eq!(check(Some(0.02), Some(0.05)).evaluate(&values), fails);
        assert_eq!(check(Some(0.02), None).evaluate(&[]), Outcome::Open);
        let nothing = [("c".to_owned(), f64::NAN)];
        assert!(matches!(check(None, Some(1.0)).evaluate(&nothing), Outcome::Fails { .. }));
    }
}
