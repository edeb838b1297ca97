//! Leaves of the bounding volume hierarchy over faces: an entire plane, quadric or torus, or a small rectangle of a
//! spline surface.

use super::best::Best;
use super::piece::{MemoryBudget, Piece, pieces_of};
use crate::model::{Analytic, Face};
use crate::trim_region::TrimRegion;
use kanagata_geometry::{Aabb, Vec3};

/// A face, or a rectangle of one.
pub(super) enum Leaf {
    /// A face with closed-form point projection.
    Exact(Box<Exact>),
    /// A rectangle of a face without closed-form projection.
    Piece(Box<Piece>),
}

/// A face on a plane, quadric or torus.
pub(super) struct Exact {
    face: u32,
    form: Analytic,
    /// At least one trimming loop lies inside the rectangle of the region.
    trimmed: bool,
    bounds: Aabb,
}

impl Leaf {
    /// Index of the face.
    pub fn face(&self) -> u32 {
        match self {
            Self::Exact(e) => e.face,
            Self::Piece(p) => p.face,
        }
    }

    /// Axis-aligned bounding box of the leaf.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Exact(e) => e.bounds,
            Self::Piece(p) => p.bounds(),
        }
    }

    /// Updates `best` with points inside the trimming loops. Each part examined reduces `left`, the remaining work of
    /// the query.
    pub fn search(
        &self,
        p: &Vec3,
        region: &TrimRegion,
        best: &mut Best,
        (left, memory): (&mut u32, &MemoryBudget),
    ) {
        match self {
            Self::Exact(e) => {
                *left = left.saturating_sub(1);
                e.search(p, region, best);
            }
            Self::Piece(piece) => piece.search(p, region, best, (left, memory)),
        }
    }

    /// Memory of a rectangle [bytes]; 0 for an entire face.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Exact(_) => 0,
            Self::Piece(piece) => piece.bytes(),
        }
    }
}

impl Exact {
    fn search(&self, p: &Vec3, region: &TrimRegion, best: &mut Best) {
        for (distance, uv) in self.form.feet(p, best.distance).into_iter().flatten() {
            let within = (0..2).all(|k| uv[k] >= region.low[k] && uv[k] <= region.high[k]);
            best.take(self.face, uv, distance, || within && (!self.trimmed || region.contains(uv)));
        }
    }
}

/// Leaves of a face: one with closed-form projection, or the rectangles that touch its trimmed region.
pub(super) fn leaves_of(id: u32, face: &Face, region: &TrimRegion) -> Vec<Leaf> {
    let (low, high) = (region.low, region.high);
    let whole = face.surface.trimmed([low.x, high.x], [low.y, high.y]);
    if let (Some(form), Ok(whole)) = (&face.analytic, whole) {
        let margin = (high - low) * 1e-6;
        let trimmed = region.touches(low + margin, high - margin);
        let bounds = Aabb::of_points(whole.points());
        let exact = Exact { face: id, form: form.clone(), trimmed, bounds };
        return vec![Leaf::Exact(Box::new(exact))];
    }
    pieces_of(id, face, region).into_iter().map(|p| Leaf::Piece(Box::new(p))).collect()
}
