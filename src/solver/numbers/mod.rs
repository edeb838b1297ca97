//! Small tensors, values in SIMD lanes, and the tolerances that several rooms share.
//!
//! Tensors and lanes are used by `element`, `material` and `assembly`, tolerances by all rooms.

pub(crate) mod algebra;
pub(crate) mod lanes;
pub mod tensor;
pub(crate) mod tolerances;
