//! Closest point on a tool: the tree search, the projection on a patch, the friction law.
//!
//! - [`ToolSurface::closest`]: tree of tight boxes, branch and bound on the true distance
//! - `form`: a part of a patch as a polynomial about its centre
//! - `piece`: such a part with what bounds the distance from below and certifies it as convex; its box
//! - `hull`: its control net, and what proves a foot where its parameters do not
//! - `project`: bounded Newton inside a piece (Eq. 19-23)
//! - `query`, `search`: one query; `tree`, `node`: the boxes; `wide`: several numbers at once
//! - [`paper`]: the two searches of the paper; [`SearchKind`] names all three, [`ContactSearch`] is their interface
//! - [`oracle`]: dense sampling, the judge of them all
//! - `topology`: which sides of a patch are free borders; `joints`: between faces divided independently; `facing`: the foot
//!   that is taken there
//! - [`Projection`], `foot`: the closest point, and what its patch has there
//! - [`friction`]: Coulomb's law; sees gap, slip and traction, never geometry

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
pub(crate) mod test_tools;
mod topology;
mod tree;
mod wide;

pub use kind::SearchKind;
pub use projection::{ContactSearch, Location, Outcome, Projection};
pub use surface::ToolSurface;
