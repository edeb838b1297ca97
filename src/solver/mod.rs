//! The implicit forming solver: blank, elements, materials, contact, Newton, stepping.

pub mod assembly;
pub mod blank;
pub mod element;
pub mod linear;
pub mod material;
pub mod pattern;
pub mod tensor;
