//! Why the data of a material cannot be used.

use super::hardening::HardeningError;
use super::yield_function::YieldError;

/// Numbers that are no material.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialDataError {
    /// Elastic constants or backstresses out of range.
    #[error("{field} is {found}, must be {allowed}")]
    Elastic {
        /// Which number, as a card calls it.
        field: String,
        /// What was found.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The yield surface is not convex or not closed.
    #[error(transparent)]
    Yield(#[from] YieldError),
    /// The hardening law cannot be used.
    #[error(transparent)]
    Hardening(#[from] HardeningError),
}
