//! Wall time of the parts of a run.

use serde::{Deserialize, Serialize};

/// Wall time by phase [s].
///
/// Tree search and projection onto patches alternate within the query of every node, each taking some tenths of a
/// microsecond. Separate clocks would cost as much as they measure, so both are one figure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Closest points on the tools: global search and projection onto patches.
    pub search: f64,
    /// Element loop and assembly of the matrix.
    pub elements: f64,
    /// Application of the contact conditions to the matrix.
    pub contact: f64,
    /// Factorisation.
    pub factor: f64,
    /// Low-rank updates of the factors after changes of a few rows.
    #[serde(default)]
    pub update: f64,
    /// Substitution and refinement.
    pub solve: f64,
    /// Stability of equilibria: one factorisation each.
    #[serde(default)]
    pub stability: f64,
    /// Penetration of tools into faces of elements, measured once per increment.
    #[serde(default)]
    pub penetration: f64,
    /// Number of factorisations: at least one per iteration, more during active-set iteration.
    pub factorisations: usize,
    /// Number of low-rank updates that replaced a factorisation after a change of the active set.
    #[serde(default)]
    pub updates: usize,
    /// Number of active-set updates with reduced blocks due to cycling.
    #[serde(default)]
    pub cycling: usize,
}

impl Timings {
    /// These times with the counts of `other`.
    pub(crate) fn with_counts_of(self, other: &Self) -> Self {
        let &Self { factorisations, updates, cycling, .. } = other;
        Self { factorisations, updates, cycling, ..self }
    }
}
