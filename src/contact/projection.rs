//! Closest point of a tool, its certainty, and the interface of the searches.

use kanagata_geometry::{Mat3, Vec3};

/// Location of a foot point on its patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// Inside the patch.
    Inside,
    /// On side k.
    Edge(u8),
    /// At corner k.
    Vertex(u8),
}

/// Certainty of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// No point of the tool is closer, proved by bounds: to rounding, and to 1e-12 of the tool's size (2e-10 mm at
    /// most) where the distance is not convex. At a border between independently divided faces another foot point may
    /// be returned, farther by at most the gap there ([`kanagata_tool::ToolModel::border_gap_mm`]).
    Certified,
    /// The best point found within the work limit; not verified.
    WorkSpent,
    /// A foot point on one patch, as requested ([`super::ToolSurface::extended_projection`]) or from a search without
    /// verification.
    Local,
    /// A search without verification found no foot point.
    Failed,
}

/// The closest point of a tool, in the frame of the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Patch of the foot point.
    pub patch: u32,
    /// Parameter eta.
    pub eta: f64,
    /// Parameter zeta.
    pub zeta: f64,
    /// Inside, on a side, or at a corner.
    pub location: Location,
    /// The foot point is on the border of the tool and the query point lies past it: no contact there.
    pub past_border: bool,
    /// Foot point [mm].
    pub point: Vec3,
    /// Unit normal of the patch at the foot point, out of the tool.
    pub normal: Vec3,
    /// Signed distance along the normal, `(p - point) . normal` [mm], positive = separated.
    pub gap: f64,
    /// Symmetric curvature tensor [1/mm] of the tangent plane: `dn = -curvature dx` for dx along the surface
    /// (Weingarten; positive towards the normal).
    pub curvature: Mat3,
    /// Certainty of the result.
    pub outcome: Outcome,
}

impl Projection {
    /// Result for a tool without patches: at infinite distance, past every border.
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
            outcome: Outcome::Certified,
        }
    }

    /// Principal curvatures [1/mm] and their unit directions, the larger one first; positive towards the normal.
    #[must_use]
    pub fn principal_curvatures(&self) -> [(f64, Vec3); 2] {
        let n = self.normal;
        let axis = Vec3::ith(n.iamin(), 1.0);
        let a = n.cross(&axis).normalize();
        let b = n.cross(&a);
        let form = |x: &Vec3, y: &Vec3| x.dot(&(self.curvature * y));
        let (l, m, r) = (form(&a, &a), form(&a, &b), form(&b, &b));
        let (mean, half) = (0.5 * (l + r), 0.5 * (l - r));
        let spread = half.hypot(m);
        let angle = 0.5 * m.atan2(half);
        let first = a * angle.cos() + b * angle.sin();
        [(mean + spread, first), (mean - spread, n.cross(&first))]
    }
}

/// A closest-point search on one tool, in the frame of the tool.
pub trait ContactSearch: Send + Sync {
    /// The closest point found by this search; [`Projection::nowhere`] with [`Outcome::Failed`] if none is found.
    /// `last` is an earlier result for the point.
    fn find(&self, p: &Vec3, last: Option<&Projection>) -> Projection;
}
