//! Small tensors, and numbers in the lanes of vector instructions.
//!
//! Used by `element`, `material` and `assembly`.

pub(crate) mod algebra;
pub(crate) mod lanes;
pub mod tensor;
