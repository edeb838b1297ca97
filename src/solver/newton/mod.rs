//! Newton iteration for the equilibrium at given travels of the tools.
//!
//! Called by `increment`; calls `active_set` and `system`.

pub(super) mod convergence;
pub(super) mod cycling;
pub(super) mod line_search;
pub mod outcome;
pub mod record;
pub(super) mod solve;
