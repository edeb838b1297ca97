//! Closest point on a tool: tree search, projection on a patch, friction law.
//!
//! - [`ToolSurface::closest`]: bounding volume hierarchy, branch and bound on the exact distance
//! - `form`: a part of a patch as a polynomial about its centre
//! - `piece`: such a part with lower distance bounds and a convexity test; its bounding box
//! - `hull`: its control net, and bounds for a poor parametrisation
//! - `project`: bounded Newton iteration inside a piece (Eq. 19-23)
//! - `query`, `search`: one query; `tree`, `node`: the hierarchy; `wide`: SIMD operations
//! - [`paper`]: the two searches of the paper; [`SearchKind`] names all three, [`ContactSearch`] is their interface
//! - [`oracle`]: dense sampling, the reference for all searches
//! - `topology`: free borders of patches; `joints`: borders between independently divided faces; `facing`: the foot
//!   point selected there
//! - [`Projection`], `foot`: the closest point, and the local geometry
//! - [`friction`]: Coulomb's law in terms of gap, slip and traction, independent of geometry

mod facing;
mod foot;
mod form;
pub mod friction;
mod hull;
mod joints;
mod kind;
mod node;
pub mod oracle;
pub mod paper;
mod piece;
mod project;
mod projection;
mod query;
mod search;
mod surface;
#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
pub(crate) mod test_tools;
mod topology;
mod tree;
mod wide;

pub use kind::SearchKind;
pub use projection::{ContactSearch, Location, Outcome, Projection};
pub use surface::ToolSurface;
