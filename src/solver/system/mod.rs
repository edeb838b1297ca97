//! The sheet and its tools at an iterate: residual, matrix, correction, and stability of an equilibrium.
//!
//! Called by `newton` and `increment`; calls `assembly`, `contact`, `tools` and `linear`.

pub(super) mod correction;
pub(super) mod damper;
pub(super) mod damping;
pub(super) mod face_penetration;
pub(super) mod forces;
pub(super) mod free_motions;
pub(super) mod matrix;
pub(super) mod regime;
pub(super) mod search;
pub(super) mod softest_motion;
pub(super) mod stability;
pub(super) mod system;
pub mod timings;
