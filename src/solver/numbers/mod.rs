//! Small tensors, and values in SIMD lanes.
//!
//! Used by `element`, `material` and `assembly`.

pub(crate) mod algebra;
pub(crate) mod lanes;
pub mod tensor;
