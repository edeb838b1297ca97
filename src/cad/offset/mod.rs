//! Offset surfaces: those of a file, and the offset of a model.
//!
//! Of a file:
//! - [`surface`]: the offset of a surface, exact for planes, quadrics and tori
//! - [`fit`]: its approximation for splines, within the patches that [`budget`] permits
//! - [`restrict`]: the part of a spline that a face uses
//!
//! Of a model:
//! - [`model`]: all faces moved, with [`face`] for one and [`joints`] for edges and vertices
//! - [`sharp`], [`curvature`], [`overlaps`]: places where the offset is not defined, folds, or intersects itself,
//!   searched on the rectangles of [`cell`]

mod budget;
mod cell;
mod curvature;
mod error;
mod face;
mod fit;
mod joints;
mod model;
#[cfg(test)]
mod model_tests;
mod overlaps;
mod restrict;
mod sharp;
mod surface;
#[cfg(test)]
mod tests;

pub(super) use self::budget::{Fineness, shares};
pub use self::error::{FoldPlace, OffsetError, OverlapPlace, SharpPlace};
pub use self::joints::OffsetGap;
pub use self::model::{
    OffsetModel, OffsetReport, offset_model, offset_model_again, offset_model_watched,
};
pub(super) use self::restrict::{Restricted, restricted};
pub(super) use self::surface::{deviation, offset};
