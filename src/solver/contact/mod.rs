//! A node of the sheet and a tool: the candidate, and the equations of gap and friction that it puts in the place of equilibrium.
//!
//! Called by `system` and `active_set`; knows nothing of iterations or stages.

pub(super) mod candidate;
pub(super) mod condition;
pub mod face_penetration;
pub(super) mod frame;
pub(super) mod held_friction;
