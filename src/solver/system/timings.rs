//! Times of the parts of a run.

use serde::{Deserialize, Serialize};

/// Wall time by phase [s].
///
/// Searching the tree and projecting on patches alternate within every node's query, some tenths of a microsecond each:
/// clocks between them would cost as much as they measure, so they are one figure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Closest points on the tools: the global search and the projection on patches.
    pub search: f64,
    /// Element loop and assembly of the matrix.
    pub elements: f64,
    /// Contact conditions put into the matrix.
    pub contact: f64,
    /// Factorisation.
    pub factor: f64,
    /// Factors brought up to date where few rows have changed.
    #[serde(default)]
    pub update: f64,
    /// Substitution and refinement.
    pub solve: f64,
    /// Whether balances last: a factorisation for each.
    #[serde(default)]
    pub stability: f64,
    /// Penetration of tools into faces of elements, measured once an increment.
    #[serde(default)]
    pub penetration: f64,
    /// Factorisations counted by `factor`: at least one an iteration, more where the active set is settled.
    pub factorisations: usize,
    /// Times factors were brought up to date for a changed active set instead.
    #[serde(default)]
    pub updates: usize,
    /// Times blocks of contact states went back and forth, so that only a part of them was changed.
    #[serde(default)]
    pub cycling: usize,
}
