//! Rectangles of the parameter plane of a face, divided adaptively.

use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::Vec2;

/// Ratio of the sides of a cell above which only the longer one is divided.
const ASPECT_MAX: f64 = 1.5;
/// Points along each side of a cell.
const CELL_POINTS: usize = 3;
/// Distance of the points of a cell from its border, relative to its width: curvatures jump at knots.
const INSET_REL: f64 = 1e-9;

/// A rectangle of parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub low: Vec2,
    pub high: Vec2,
    /// Bisections of its knot span, in both directions together.
    pub depth: u32,
}

/// The knot spans of a face that its region touches.
pub(super) fn cells_of(face: &Face, region: &TrimRegion) -> Vec<Cell> {
    let breaks = |k: usize| {
        let [a, b] = [region.low[k], region.high[k]];
        let mut out: Vec<f64> =
            face.surface.knots()[k].iter().copied().filter(|t| *t > a && *t < b).collect();
        out.dedup();
        [vec![a], out, vec![b]].concat()
    };
    let [us, vs] = [breaks(0), breaks(1)];
    let cell = |u: &[f64], v: &[f64]| Cell {
        low: Vec2::new(u[0], v[0]),
        high: Vec2::new(u[1], v[1]),
        depth: 0,
    };
    us.windows(2).flat_map(|u| vs.windows(2).map(move |v| cell(u, v))).collect()
}

impl Cell {
    /// False only for a cell outside the region.
    pub(super) fn is_in(&self, region: &TrimRegion) -> bool {
        region.touches(self.low, self.high) || region.contains(self.middle())
    }

    pub(super) fn middle(&self) -> Vec2 {
        0.5 * (self.low + self.high)
    }

    /// Its four parts.
    pub(super) fn quarters(&self) -> [Self; 4] {
        let middle = self.middle();
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| {
            let (mut low, mut high) = (self.low, self.high);
            for (k, upper) in [i, j].into_iter().enumerate() {
                if upper == 1 { low[k] = middle[k] } else { high[k] = middle[k] }
            }
            Self { low, high, depth: self.depth + 2 }
        })
    }

    /// Its two or four parts, with sides of similar length if its own sides have these lengths.
    pub(super) fn parts(&self, lengths: [f64; 2]) -> Vec<Self> {
        let longer = usize::from(lengths[1] > lengths[0]);
        if lengths[longer] <= ASPECT_MAX * lengths[1 - longer] {
            return self.quarters().to_vec();
        }
        let mut halves = vec![Self { depth: self.depth + 1, ..*self }; 2];
        let middle = self.middle()[longer];
        halves[0].high[longer] = middle;
        halves[1].low[longer] = middle;
        halves
    }

    /// Its points, just inside.
    pub(super) fn points(&self) -> impl Iterator<Item = Vec2> + '_ {
        let last = (CELL_POINTS - 1) as f64;
        let at = move |k: usize| (k as f64 / last).clamp(INSET_REL, 1.0 - INSET_REL);
        let size = self.high - self.low;
        let point = move |i, j| self.low + Vec2::new(size.x * at(i), size.y * at(j));
        (0..CELL_POINTS).flat_map(move |i| (0..CELL_POINTS).map(move |j| point(i, j)))
    }
}
