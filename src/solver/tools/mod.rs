//! Rigid tools: their surfaces, motions and roles.
//!
//! Used by `contact`, `system`, `stage` and all above them.

pub mod motion;
pub(super) mod role;
pub(super) mod stop;
pub mod tool;
pub(super) mod way;
