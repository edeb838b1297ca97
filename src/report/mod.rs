//! What people look at: history, VTU, HTML. Knows neither CAD nor solver.

pub mod bars;
pub mod charts;
pub mod csv;
pub mod doubt;
pub mod drawing;
pub mod foreign;
pub mod page;
pub mod record;
pub mod vtu;
pub mod vtu_read;

pub use vtu::{CellKind, DataArray, Vtu, write_pvd};
