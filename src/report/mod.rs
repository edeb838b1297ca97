//! Output for people: history, VTU and HTML files. Depends on neither CAD nor solver. Pages and drawings need the
//! feature `pages`.

#[cfg(feature = "pages")]
pub mod bars;
#[cfg(feature = "pages")]
pub mod charts;
pub mod csv;
pub mod digits;
pub mod doubt;
#[cfg(feature = "pages")]
pub mod drawing;
pub mod foreign;
#[cfg(feature = "pages")]
pub mod page;
pub mod record;
pub mod vtu;
pub mod vtu_read;

pub use vtu::{CellKind, DataArray, Vtu, write_pvd};
