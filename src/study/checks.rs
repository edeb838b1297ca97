//! What a study is expected to show, held against what its cases did.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// What is expected, in words.
    pub says: String,
    /// Cases it is expected of; all of them when empty.
    #[serde(default)]
    pub cases: Vec<String>,
    /// Case they are compared with; the study's reference when not given.
    #[serde(default)]
    pub against: Option<String>,
    /// What is looked at.
    pub figure: Figure,
    /// Largest value allowed.
    #[serde(default)]
    pub at_most: Option<f64>,
    /// Smallest value allowed.
    #[serde(default)]
    pub at_least: Option<f64>,
    /// Why it does not hold, where that is known: said in the place of a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explained: Option<String>,
}

/// A figure of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// RMS of the difference of force over the travel, over that of the other case.
    ForceRms,
    /// Largest excess of force over the other case in the last third of the stroke, over the largest force of the other
    /// case; said with its travel.
    LateForceExcess,
    /// Largest difference of thickness along dx and dxy from the other case [mm].
    ThicknessMm,
    /// Patches over those of the other case.
    PatchesOverReference,
    /// Processor time over that of the other case.
    SecondsOverReference,
    /// Time of an iteration in factorisations of the same run, over that of the other case: a machine that
    /// is faster for one run than for the other makes no difference.
    IterationInFactorisationsOverReference,
    /// Nodal contact forces against tool forces, as a share of the largest.
    ForceError,
    /// Energy not accounted for, as a share of the work done.
    EnergyError,
    /// Volume that does not balance, as a share of the sheet's; runs of elastic sheets have none.
    VolumeError,
    /// Deepest node in a tool [mm].
    PenetrationMm,
}

/// How a check came out.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// No case it is about is done.
    Open,
    /// It holds for every case that is done; the value nearest to a limit, and its case.
    Holds {
        /// The value.
        value: f64,
        /// The case.
        case: String,
    },
    /// It does not; the value farthest from what is allowed, and its case.
    Fails {
        /// The value.
        value: f64,
        /// The case.
        case: String,
    },
    /// It does not, and why is known.
    Explained {
        /// The value.
        value: f64,
        /// The case.
        case: String,
        /// Why.
        why: String,
    },
}

impl Check {
    /// Judges the values of the cases that have one.
    #[must_use]
    pub fn judge(&self, values: &[(String, f64)]) -> Outcome {
        let room = |v: f64| {
            let above = self.at_most.map_or(f64::INFINITY, |most| most - v);
            above.min(self.at_least.map_or(f64::INFINITY, |least| v - least))
        };
        // A value that is no number has no room.
        let room = |v: f64| if v.is_nan() { f64::NEG_INFINITY } else { room(v) };
        let Some((case, value)) = values.iter().min_by(|a, b| room(a.1).total_cmp(&room(b.1)))
        else {
            return Outcome::Open;
        };
        let (case, value) = (case.clone(), *value);
        if room(value) >= 0.0 {
            Outcome::Holds { value, case }
        } else if let Some(why) = self.explained.clone() {
            Outcome::Explained { value, case, why }
        } else {
            Outcome::Fails { value, case }
        }
    }

    /// What is allowed, in words.
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
    /// In words: state, and the value with its case.
    #[must_use]
    pub fn words(&self) -> [String; 2] {
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
        assert_eq!(check(None, Some(0.05)).judge(&values), holds);
        let fails = Outcome::Fails { value: 0.03, case: "b".into() };
        assert_eq!(check(None, Some(0.02)).judge(&values), fails);
        let known = Check { explained: Some("no b".into()), ..check(None, Some(0.02)) };
        let why = known.judge(&values).words();
        assert_eq!(why, ["does not hold".to_owned(), "3.000e-2 (b): no b".to_owned()]);
        let known = Check { at_most: Some(0.05), ..known };
        assert_eq!(known.judge(&values), Outcome::Holds { value: 0.03, case: "b".into() });
        let fails = Outcome::Fails { value: 0.01, case: "a".into() };
        assert_eq!(check(Some(0.02), Some(0.05)).judge(&values), fails);
        assert_eq!(check(Some(0.02), None).judge(&[]), Outcome::Open);
        let nothing = [("c".to_owned(), f64::NAN)];
        assert!(matches!(check(None, Some(1.0)).judge(&nothing), Outcome::Fails { .. }));
    }
}
