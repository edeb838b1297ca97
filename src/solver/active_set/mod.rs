//! Active set: nodes in contact, and driven tools at their stops.
//!
//! Used by `newton` at every iterate, and by `increment` to detect tools that cross the sheet within a step.

pub(super) mod active_set;
pub(super) mod approach;
pub(super) mod crossing;
pub(super) mod driven_tools;
pub mod over_edge;
pub(super) mod stops;
pub(super) mod update;
