//! The implicit forming solver: blank, elements, materials, contact, Newton, stepping.
pub mod linear;
