//! The closest point of a tool, how sure it is, and the interface of the searches that find it.

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

/// How sure an answer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// No point of the tool is nearer: proved by bounds, to rounding, and to 1e-12 of the tool's size (2e-10 mm at
    /// most) where the distance is not convex. Over the border between faces that were divided independently another
    /// foot may be given, no farther than the nearest by more than the gap there ([`crate::tool::ToolModel::border_gap_mm`]).
    Certified,
    /// The best found when the work allowed was spent; no bound.
    WorkSpent,
    /// A foot on one patch, asked for as such ([`super::ToolSurface::carried_on`]) or found by a search that proves nothing.
    Local,
    /// A search that proves nothing found no foot.
    Failed,
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
    /// How sure this is.
    pub outcome: Outcome,
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

/// A way to the closest point of one tool, in the tool's frame.
pub trait ContactSearch: Send + Sync {
    /// The closest point as this search finds it; [`Projection::nowhere`] with [`Outcome::Failed`] when it
    /// finds none. `last`: an earlier answer for the point.
    fn find(&self, p: &Vec3, last: Option<&Projection>) -> Projection;
}
