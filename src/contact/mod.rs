//! Closest point on a tool: the tree search, the projection on a patch, the friction law.
//!
//! - [`ToolSurface::closest`]: tree of tight boxes, branch and bound on the true distance
//! - `piece`: a part of a patch small enough for Newton; its box and its convexity bound
//! - `project`: bounded Newton inside a piece (Eq. 19-23)
//! - `topology`: which sides of a patch are free borders
//! - [`friction`]: Coulomb's law; sees gap, slip and traction, never geometry

pub mod friction;
mod piece;
mod project;
mod surface;
#[cfg(test)]
pub(crate) mod test_tools;
mod topology;
mod tree;

pub use surface::ToolSurface;

use crate::geometry::{Mat3, Vec3};

/// Where on its patch a foot lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// Inside the patch.
    Inside,
    /// On side k.
    Edge(u8),
    /// At corner k.
    Vertex(u8),
}

/// The closest point of a tool, in the tool's own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Patch of the foot.
    pub patch: u32,
    /// Parameter eta.
    pub eta: f64,
    /// Parameter zeta.
    pub zeta: f64,
    /// Inside, on a side, at a corner.
    pub location: Location,
    /// The foot is on the border of the tool and the query point lies past it: no contact there.
    pub past_border: bool,
    /// Foot [mm].
    pub point: Vec3,
    /// Unit normal of that patch at the foot, out of the tool.
    pub normal: Vec3,
    /// Signed distance along the normal, `(p - point) . normal` [mm], positive = apart.
    pub gap: f64,
    /// Symmetric curvature tensor [1/mm] acting in the tangent plane: `dn = -curvature dx` for dx along the
    /// surface (Weingarten; positive towards the normal).
    pub curvature: Mat3,
}

impl Projection {
    /// The answer of a tool without patches: infinitely far, past every border.
    #[must_use]
    pub fn nowhere() -> Self {
        Self {
            patch: u32::MAX,
            eta: 0.0,
            zeta: 0.0,
            location: Location::Inside,
            past_border: true,
            point: Vec3::zeros(),
            normal: Vec3::z(),
            gap: f64::INFINITY,
            curvature: Mat3::zeros(),
        }
    }
}
