//! What people look at: history, VTU, HTML.

pub mod vtu;

pub use vtu::{CellKind, DataArray, Vtu};
