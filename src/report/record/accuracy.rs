//! Estimated errors of a run that is the last of a sequence, and the runs of that sequence.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::doubt::{Doubt, DoubtCode};

/// Estimated errors and the sequence of runs that they come from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccuracyRecord {
    /// Why the sequence ended.
    pub end: SequenceEnd,
    /// The quantities with their estimated errors.
    pub quantities: Vec<QuantityRecord>,
    /// `mesh`, `layers` or `points` whose error is not known: there was no time or memory for the finer run, or it did not
    /// converge.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unmeasured: Vec<String>,
    /// The runs, in order.
    pub runs: Vec<SequenceRunRecord>,
    /// Processor time of all runs [s].
    pub cpu_s: f64,
    /// Processor time of the last run [s].
    pub last_cpu_s: f64,
}

/// Why a sequence of runs ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SequenceEnd {
    /// All estimated errors are as small as asked.
    #[default]
    Reached,
    /// The next run would exceed the time allowed.
    Time,
    /// The next run would need more memory than the machine has.
    Memory,
    /// A finer run did not converge.
    NotConverged,
    /// Finer meshes no longer reduce the error: what remains is that of layers, points and increments.
    Options,
    /// The largest number of runs.
    Runs,
}

/// A quantity with its estimated error.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct QuantityRecord {
    /// `force.TOOL`, `thickness`, `draw_in` or `springback`.
    pub name: String,
    /// Unit of the following values: `N` or `mm`.
    pub unit: String,
    /// Largest force, minimum thickness, largest displacement of the border in plan, largest displacement in springback.
    pub value: f64,
    /// Estimated error; absent if that of the mesh is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Error allowed; absent if none was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allowed: Option<f64>,
    /// Part of the error by source: `mesh`, `layers`, `points`, `increments`.
    pub parts: BTreeMap<String, f64>,
    /// Observed order of convergence in the element length; absent with fewer than three meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
}

/// A run of a sequence.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SequenceRunRecord {
    /// Folder, relative to that of the last run's results.
    pub folder: String,
    /// What it is for: `mesh`, `pattern`, `layers` or `points`.
    pub purpose: String,
    /// Elements in plan, layers, points and increments in words.
    pub model: String,
    /// Values of the scene that were set, `PATH=VALUE`.
    pub set: Vec<String>,
    /// Unknowns.
    pub unknowns: usize,
    /// Increments.
    pub increments: usize,
    /// Processor time [s].
    pub cpu_s: f64,
    /// Values of the quantities by name; empty for a run that did not converge.
    pub values: BTreeMap<String, f64>,
    /// Distance to the run that it is compared with, by name of the quantity, in the quantity's unit.
    pub changes: BTreeMap<String, f64>,
}

impl AccuracyRecord {
    /// The doubt about errors that are larger than asked, or that are not known.
    #[must_use]
    pub fn doubt(&self) -> Option<Doubt> {
        let over = |q: &QuantityRecord| {
            q.allowed.map_or(0.0, |allowed| q.error.map_or(f64::INFINITY, |error| error / allowed))
        };
        let asked: Vec<&QuantityRecord> =
            self.quantities.iter().filter(|q| q.allowed.is_some()).collect();
        let missed = asked.iter().filter(|q| over(q) > 1.0).count();
        let worst = asked.iter().max_by(|a, b| over(a).total_cmp(&over(b)))?;
        if missed == 0 && self.unmeasured.is_empty() {
            return None;
        }
        let (why, remedy) = self.end.in_words();
        let unknown = match self.unmeasured.as_slice() {
            [] => String::new(),
            names => format!(" The error of {} is not known.", names.join(", ")),
        };
        let error = worst.error.map_or("not known".into(), |e| format!("{e:.4} {}", worst.unit));
        Some(Doubt {
            code: DoubtCode::AccuracyNotReached,
            place: worst.name.clone(),
            value: worst.error,
            limit: worst.allowed,
            text: format!(
                "The estimated error of {} is {error}, {:.4} {} allowed ({missed} of {} quantities are above what was asked): {why}. {remedy}{unknown}",
                worst.name,
                worst.allowed.unwrap_or_default(),
                worst.unit,
                asked.len(),
            ),
        })
    }
}

impl SequenceEnd {
    /// Why the sequence ended, and what to do.
    #[must_use]
    pub fn in_words(self) -> (&'static str, &'static str) {
        match self {
            Self::Reached => ("all errors are as small as asked", "Nothing is needed."),
            Self::Time => ("the next run would exceed the time allowed", "Allow more time."),
            Self::Memory => (
                "the next run would need more memory than this machine has",
                "Use symmetry, or a machine with more memory.",
            ),
            Self::NotConverged => (
                "a finer run did not converge",
                "Its folder says why; results of the finest run that converged are given.",
            ),
            Self::Options => (
                "finer elements no longer reduce the error, which is that of layers, points or increments",
                "Ask for a larger error, or look at the parts of the error.",
            ),
            Self::Runs => ("the largest number of runs is done", "Ask for a larger error."),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(error: Option<f64>, unmeasured: &[&str]) -> AccuracyRecord {
        let quantity = QuantityRecord {
            name: "thickness".into(),
            unit: "mm".into(),
            error,
            allowed: Some(0.01),
            ..QuantityRecord::default()
        };
        AccuracyRecord {
            quantities: vec![quantity],
            unmeasured: unmeasured.iter().map(|name| (*name).into()).collect(),
            ..AccuracyRecord::default()
        }
    }

    #[test]
    fn errors_that_are_too_large_or_not_known_are_doubts() {
        assert_eq!(record(Some(0.009), &[]).doubt(), None);
        let large = record(Some(0.02), &[]).doubt().unwrap();
        assert_eq!((large.value, large.limit), (Some(0.02), Some(0.01)));
        assert!(
            record(None, &["mesh"])
                .doubt()
                .unwrap()
                .text
                .contains("is not known, 0.0100 mm allowed")
        );
        let unmeasured = record(Some(0.009), &["layers"]).doubt().unwrap();
        assert!(unmeasured.text.contains("The error of layers is not known."));
    }
}
