//! What a tool model is compared with: the trimmed CAD, or any surface that knows its closest points.

use crate::cad::Model;
use crate::cad::model::ClosestPoint;
use crate::geometry::Vec3;

/// The closest point of a reference surface, as Eq. 24 uses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceFoot {
    /// Closest point `P_CAD` [mm].
    pub point: Vec3,
    /// Outward unit normal `n_CAD` there; zero where the surface has none (pole, apex).
    pub normal: Vec3,
    /// When `face` is not the patch's own CAD face: the normal of the own face where it comes nearest. Beside a
    /// crease a point of one side may have its foot on the other; its normal is then right if it is either's.
    pub own_normal: Option<Vec3>,
    /// Face the foot is on.
    pub face: u32,
}

/// A surface that knows its closest points. Queried from many threads.
pub trait ReferenceSurface: Sync {
    /// The closest point of the whole trimmed surface to `p`; `face` is the CAD face of the patch that `p` is
    /// on. Where several faces are equally near (an edge, a vertex) the patch's own face gives the normal, so
    /// that the sign of the error does not jump with the order of the faces. `None` when there is no surface.
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot>;
}

/// A trimmed CAD model as the reference.
pub struct CadReference<'m> {
    index: ClosestPoint<'m>,
    faces: usize,
    /// Distances that differ by less are equal [mm]: faces that meet at an edge meet to within this.
    tie: f64,
}

impl<'m> CadReference<'m> {
    /// Builds the index over all faces.
    #[must_use]
    pub fn new(model: &'m Model) -> Self {
        Self {
            index: ClosestPoint::new(model),
            faces: model.faces.len(),
            tie: 1e-9 + model.join_tolerance.max(0.0),
        }
    }
}

impl ReferenceSurface for CadReference<'_> {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let foot = self.index.closest(p)?;
        let global = ReferenceFoot {
            point: foot.point,
            normal: foot.normal,
            own_normal: None,
            face: foot.face as u32,
        };
        if foot.face == face as usize || face as usize >= self.faces {
            return Some(global);
        }
        let Some(own) = self.index.closest_on_face(face as usize, p) else {
            return Some(global);
        };
        if own.distance <= foot.distance + self.tie {
            return Some(ReferenceFoot {
                point: own.point,
                normal: own.normal,
                own_normal: None,
                face,
            });
        }
        Some(ReferenceFoot { own_normal: Some(own.normal), ..global })
    }
}
