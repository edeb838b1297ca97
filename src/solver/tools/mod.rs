//! Rigid tools: their surfaces, motions and roles.
//!
//! Used by `contact`, `system`, `stage` and all above them.

pub mod tool;
