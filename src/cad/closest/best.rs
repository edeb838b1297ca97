//! Best candidate of a closest-point search on faces.

use kanagata_geometry::Vec2;

/// The closest point found, by squared distance [mm^2].
pub(super) struct Best {
    pub distance: f64,
    pub foot: Option<(u32, Vec2)>,
    /// Face and parameters of a known foot point, a local minimum of the distance; the search is for closer points.
    pub known: Option<(u32, Vec2)>,
}

impl Best {
    /// Accepts a foot point that is closer, or equally close with the smaller (face, u, v), if it lies inside the
    /// trimming loops.
    pub fn take(&mut self, face: u32, uv: Vec2, distance: f64, inside: impl Fn() -> bool) {
        let first = |(f, at): (u32, Vec2)| (face, uv.x, uv.y) < (f, at.x, at.y);
        let tie = distance == self.distance && self.foot.is_none_or(first);
        if (distance < self.distance || tie) && inside() {
            (self.distance, self.foot) = (distance, Some((face, uv)));
        }
    }
}
