//! Tool models of Nagata (Eq. 7-12) and Bezier (Eq. 1-6) patches, and the tool file. Independent of CAD.

pub mod bezier;
pub mod build;
pub mod edge;
pub mod error;
pub mod exchange;
pub mod file;
pub mod model;
pub mod patch;
mod provenance;
pub mod selection;
pub mod side;

pub use model::{GivenCurve, ToolKind, ToolModel};
pub use patch::{Patch, PatchDerivs};
