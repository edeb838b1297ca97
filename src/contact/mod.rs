//! Closest point on a tool: the tree search, the projection on a patch, the friction law.

use crate::geometry::{Mat3, Vec3};
use crate::tool::ToolModel;

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
    /// Signed distance [mm], positive = apart.
    pub gap: f64,
    /// Symmetric curvature tensor [1/mm] acting in the tangent plane: `dn = -curvature dx` for dx along the
    /// surface (Weingarten; positive towards the normal).
    pub curvature: Mat3,
}

/// A tool model with its search tree.
pub struct ToolSurface {
    model: ToolModel,
}

impl ToolSurface {
    /// Builds the tree.
    #[must_use]
    pub fn new(model: ToolModel) -> Self {
        Self { model }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &ToolModel {
        &self.model
    }

    /// Globally closest point to `p` (tool frame); `hint` is the patch of the last answer for this point.
    #[must_use]
    pub fn closest(&self, p: &Vec3, hint: Option<u32>) -> Projection {
        let _ = (p, hint);
        unimplemented!("contact: search")
    }
}
