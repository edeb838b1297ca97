//! Prescribed value of a tool over a stage: an end value or a curve.

use std::fmt;

use schemars::JsonSchema;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// A travel [mm] or a force [N] over a stage. Either its value at the end, which is reached linearly from the value at
/// the start, or a list of pairs `[fraction of the stage, value]` with linear interpolation. Fractions rise from 0 or
/// above to 1. Without a pair at 0 the curve starts from the value at the start of the stage. Increments end at its
/// corners. Forces are 0 or more, except behind a spring.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Course {
    /// Value at the end of the stage.
    End(f64),
    /// Pairs of a fraction of the stage and a value.
    Curve(Vec<[f64; 2]>),
}

impl Default for Course {
    fn default() -> Self {
        Self::End(0.0)
    }
}

impl Course {
    /// The pairs; for a single value one pair, at the end of the stage.
    #[must_use]
    pub fn pairs(&self) -> Vec<[f64; 2]> {
        match self {
            Self::End(value) => vec![[1.0, *value]],
            Self::Curve(pairs) => pairs.clone(),
        }
    }

    /// Value at the end of the stage.
    #[must_use]
    pub fn end(&self) -> f64 {
        match self {
            Self::End(value) => *value,
            Self::Curve(pairs) => pairs.last().map_or(0.0, |pair| pair[1]),
        }
    }

    /// Value at fraction 0 if given.
    #[must_use]
    pub fn start(&self) -> Option<f64> {
        match self {
            Self::Curve(pairs) => pairs.first().filter(|pair| pair[0] == 0.0).map(|pair| pair[1]),
            Self::End(_) => None,
        }
    }

    /// The first fault: place in the list (as `[2]`; empty for the whole), what was found, what is allowed.
    pub(super) fn fault(&self) -> Option<[String; 3]> {
        const RISING: &str =
            "pairs [fraction of the stage, value], fractions rising from 0 (or above) to 1";
        let Self::Curve(pairs) = self else { return None };
        let fault = |k: usize, found: String, allowed: &str| {
            Some([format!("[{k}]"), found, allowed.to_owned()])
        };
        let mut last = None;
        for (k, &[fraction, value]) in pairs.iter().enumerate() {
            if !value.is_finite() {
                return fault(k, format!("value {value}"), "a number");
            }
            if !(0.0..=1.0).contains(&fraction) || last.is_some_and(|before| fraction <= before) {
                let after = last.map_or_else(String::new, |before| format!(" after {before}"));
                return fault(k, format!("fraction {fraction}{after}"), RISING);
            }
            last = Some(fraction);
        }
        match last {
            None => Some([String::new(), "an empty list".into(), RISING.into()]),
            Some(1.0) => None,
            Some(fraction) => fault(
                pairs.len() - 1,
                format!("fraction {fraction} at the end"),
                "1 as the last fraction: the end of the stage",
            ),
        }
    }
}

/// Largest number of curve points that are listed one by one.
const LISTED_POINTS_MAX: usize = 8;

impl fmt::Display for Course {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::End(value) => write!(f, "{value}"),
            Self::Curve(pairs) if pairs.len() <= LISTED_POINTS_MAX => {
                let values: Vec<String> = pairs.iter().map(|pair| pair[1].to_string()).collect();
                f.write_str(&values.join(", "))
            }
            Self::Curve(pairs) => {
                let values = pairs.iter().map(|pair| pair[1]);
                let low = values.clone().fold(f64::INFINITY, f64::min);
                let high = values.fold(f64::NEG_INFINITY, f64::max);
                write!(f, "{} over {} points from {low} to {high}", self.end(), pairs.len())
            }
        }
    }
}

impl<'de> Deserialize<'de> for Course {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CourseVisitor)
    }
}

/// Written by hand: a derived untagged enum reports only that no variant matches.
struct CourseVisitor;

impl<'de> Visitor<'de> for CourseVisitor {
    type Value = Course;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, or a list of pairs [fraction of the stage, value]")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Course, E> {
        Ok(Course::End(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Course, E> {
        Ok(Course::End(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Course, E> {
        Ok(Course::End(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Course, A::Error> {
        let mut pairs = Vec::new();
        while let Some(pair) = list.next_element()? {
            pairs.push(pair);
        }
        Ok(Course::Curve(pairs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(text: &str) -> Course {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_number_or_pairs_make_a_course() {
        assert_eq!(course("15"), Course::End(15.0));
        assert_eq!(course("-0.5"), Course::End(-0.5));
        let curve = course("[[0, 0], [0.5, 5.0], [1, 3]]");
        assert_eq!((curve.start(), curve.end()), (Some(0.0), 3.0));
        assert_eq!(curve.to_string(), "0, 5, 3");
        let long: Vec<[f64; 2]> = (0..50).map(|k| [f64::from(k), f64::from(k % 7)]).collect();
        assert_eq!(Course::Curve(long).to_string(), "0 over 50 points from 0 to 6");
        assert_eq!(curve.fault(), None);
        assert_eq!(serde_json::to_string(&curve).unwrap(), "[[0.0,0.0],[0.5,5.0],[1.0,3.0]]");
        assert_eq!(course("[[0.5, 2], [1, 0]]").start(), None);
        let text = serde_json::from_str::<Course>(r#""deep""#).unwrap_err().to_string();
        assert!(text.contains("a number, or a list of pairs"), "{text}");
        assert!(serde_json::from_str::<Course>("[[0, 1, 2]]").is_err());
    }

    #[test]
    fn fractions_rise_to_one() {
        let fault = |text: &str| course(text).fault().unwrap();
        assert!(fault("[]")[1].contains("empty"));
        let [place, found, allowed] = fault("[[0, 0], [0.5, 1], [0.5, 2], [1, 3]]");
        assert_eq!((place.as_str(), found.as_str()), ("[2]", "fraction 0.5 after 0.5"));
        assert!(allowed.contains("rising"), "{allowed}");
        assert_eq!(fault("[[-0.1, 0], [1, 3]]")[1], "fraction -0.1");
        assert_eq!(fault("[[0, 0], [1.5, 3]]")[1], "fraction 1.5 after 0");
        assert!(fault("[[0, 0], [0.5, 3]]")[2].contains("1 as the last fraction"));
    }
}
