//! Offset surfaces of a file.
//!
//! - [`surface`]: the offset of a surface, exact for planes, quadrics and tori
//! - [`fit`]: its approximation for splines, within the patches that [`budget`] permits
//! - [`restrict`]: the part of a spline that a face uses

mod budget;
mod fit;
mod restrict;
mod surface;
#[cfg(test)]
mod tests;

pub(super) use self::budget::{Fineness, shares};
pub(super) use self::restrict::{Restricted, restricted};
pub(super) use self::surface::{deviation, offset};
