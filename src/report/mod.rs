//! Output for people: history, VTU and HTML files. Depends on neither CAD nor solver. Pages and drawings need the
//! feature `pages`.

#[cfg(feature = "pages")]
pub mod bars;
pub mod csv;
pub mod digits;
pub mod doubt;
#[cfg(feature = "pages")]
pub mod drawing;
pub mod foreign;
#[cfg(feature = "pages")]
pub mod page;
#[cfg(feature = "pages")]
pub mod plot;
pub mod pvd;
pub mod record;
#[cfg(feature = "pages")]
pub mod viewer;
pub mod vtu;
pub mod vtu_read;

pub use pvd::{Part, write_pvd};
pub use vtu::{CellKind, DataArray, Vtu};
