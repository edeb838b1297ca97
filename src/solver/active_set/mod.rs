//! Which conditions hold: nodes that touch, tools that are driven or stand at their stops.
//!
//! Called by `newton` at every iterate, and by `increment` for tools that would pass through the sheet within a step.

pub(super) mod active_set;
pub(super) mod approach;
pub(super) mod crossing;
pub(super) mod driven_tools;
pub mod over_edge;
pub(super) mod stops;
pub(super) mod update;
