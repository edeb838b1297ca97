//! The best point of a search on the faces so far.

use crate::geometry::Vec2;

/// The best point found so far, by squared distance.
pub(super) struct Best {
    pub distance: f64,
    pub foot: Option<(u32, Vec2)>,
}

impl Best {
    /// Takes a foot that is nearer, or the first of equals.
    pub fn take(&mut self, face: u32, uv: Vec2, distance: f64, inside: impl Fn() -> bool) {
        let first = |(f, at): (u32, Vec2)| (face, uv.x, uv.y) < (f, at.x, at.y);
        let tie = distance == self.distance && self.foot.is_none_or(first);
        if (distance < self.distance || tie) && inside() {
            *self = Self { distance, foot: Some((face, uv)) };
        }
    }
}
