//! Contact of a node of the sheet with a tool: candidates, and the conditions of gap and friction that replace
//! equilibrium.
//!
//! Used by `system` and `active_set`; independent of iterations and stages.

pub(super) mod candidate;
pub(super) mod condition;
pub mod face_penetration;
pub(super) mod frame;
pub(super) mod held_friction;
