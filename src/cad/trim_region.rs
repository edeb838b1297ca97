//! Inside or outside a face's loops in the parameter plane.

use super::model::Face;
use crate::geometry::Vec2;
use crate::geometry::nurbs::Curve2;

/// A Bezier piece of a loop: homogeneous control points, and the box of the plain ones.
#[derive(Debug, Clone)]
struct Piece {
    points: Vec<(Vec2, f64)>,
    low: Vec2,
    high: Vec2,
}

impl Piece {
    fn new(points: Vec<(Vec2, f64)>) -> Self {
        let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
        for (p, w) in &points {
            low = low.inf(&(p / *w));
            high = high.sup(&(p / *w));
        }
        Self { points, low, high }
    }

    fn start(&self) -> Vec2 {
        self.points[0].0 / self.points[0].1
    }

    fn end(&self) -> Vec2 {
        let (p, w) = self.points[self.points.len() - 1];
        p / w
    }

    /// De Casteljau at the middle.
    fn halves(&self) -> [Self; 2] {
        let mut row = self.points.clone();
        let (mut left, mut right) = (vec![row[0]], vec![row[row.len() - 1]]);
        while row.len() > 1 {
            row = row
                .windows(2)
                .map(|w| (0.5 * (w[0].0 + w[1].0), 0.5 * (w[0].1 + w[1].1)))
                .collect();
            left.push(row[0]);
            right.push(row[row.len() - 1]);
        }
        right.reverse();
        [Self::new(left), Self::new(right)]
    }
}

/// The region inside a face's loops.
#[derive(Debug, Clone)]
pub struct TrimRegion {
    pieces: Vec<Piece>,
    /// Smallest parameters of the loops.
    pub low: Vec2,
    /// Largest parameters of the loops.
    pub high: Vec2,
    /// Points this near to a loop count as inside.
    border: f64,
}

/// Halvings of a piece before a point beside it counts as on it.
const DEPTH: u32 = 48;
/// Width of the border as a share of the region's size.
const BORDER: f64 = 1e-10;

impl TrimRegion {
    /// Prepares the loops of a face.
    #[must_use]
    pub fn new(face: &Face) -> Self {
        let uses = face.loops.iter().flat_map(|l| &l.uses);
        let pieces: Vec<Piece> = uses.flat_map(|u| pieces_of(&u.pcurve)).collect();
        let low = pieces.iter().fold(Vec2::repeat(f64::INFINITY), |m, p| m.inf(&p.low));
        let high = pieces.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.high));
        let [u, v] = face.surface.domain();
        let low = Vec2::new(low.x.max(u[0]), low.y.max(v[0]));
        let high = Vec2::new(high.x.min(u[1]), high.y.min(v[1]));
        let border = BORDER * (high - low).norm();
        Self { pieces, low, high, border }
    }

    /// True inside the loops or on them: the winding number by crossings of a ray towards +u.
    #[must_use]
    pub fn contains(&self, uv: Vec2) -> bool {
        let mut winding = 0;
        for piece in &self.pieces {
            match crossings(piece, uv, self.border) {
                Some(n) => winding += n,
                None => return true,
            }
        }
        winding != 0
    }
}

fn pieces_of(curve: &Curve2) -> Vec<Piece> {
    curve
        .bezier_pieces()
        .iter()
        .map(|b| Piece::new(b.points().iter().zip(b.weights()).map(|(p, &w)| (p * w, w)).collect()))
        .collect()
}

/// Signed crossings of the piece with the ray, by its ends when it is clear of the point; `None` on it.
fn crossings(piece: &Piece, uv: Vec2, border: f64) -> Option<i32> {
    let beside = |p: &Piece| {
        uv.y < p.low.y - border
            || uv.y > p.high.y + border
            || uv.x > p.high.x + border
            || uv.x < p.low.x - border
    };
    if beside(piece) {
        return Some(by_ends(piece, uv));
    }
    let mut winding = 0;
    let mut stack = vec![(piece.clone(), 0u32)];
    while let Some((p, depth)) = stack.pop() {
        if beside(&p) {
            winding += by_ends(&p, uv);
        } else if depth >= DEPTH || (p.high - p.low).norm() <= border {
            return None;
        } else {
            let [left, right] = p.halves();
            stack.push((left, depth + 1));
            stack.push((right, depth + 1));
        }
    }
    Some(winding)
}

fn by_ends(piece: &Piece, uv: Vec2) -> i32 {
    if uv.x > piece.high.x {
        return 0;
    }
    let (a, b) = (piece.start().y, piece.end().y);
    i32::from(a <= uv.y && uv.y < b) - i32::from(b <= uv.y && uv.y < a)
}
