//! Errors in the data of a material.

use super::hardening::HardeningError;
use super::yield_function::YieldError;

/// Data that define no valid material.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialDataError {
    /// Elastic constants or backstresses out of range.
    #[error("{field} is {found}, must be {allowed}")]
    Elastic {
        /// Key of the card.
        field: String,
        /// Value found.
        found: f64,
        /// Allowed values.
        allowed: &'static str,
    },
    /// The yield surface is not convex or not closed.
    #[error(transparent)]
    Yield(#[from] YieldError),
    /// The hardening law is invalid.
    #[error(transparent)]
    Hardening(#[from] HardeningError),
}
