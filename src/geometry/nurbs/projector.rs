//! The closest point of curves and surfaces, proved: branch and bound over Bezier cells. A cell is done when F
//! (see `distance_form`) has no negative coefficient, or is convex with a tangent plane that is not negative; else it
//! is halved. Bounded Newton inside cells finds the points themselves.

use nalgebra::Vector4;

use super::bezier::BezierPiece;
use super::distance_form::{Coefficients, DistanceForm};
use super::newton::{Bounds, descend, rounding};
use crate::geometry::box_tree::BoxTree;
use crate::geometry::{Aabb, Vec2, Vec3};

/// Distances are proved up to this share of the size of the whole.
const ACCURACY: f64 = 1e-11;
/// Cells that a search looks at before it ends without a proof. Surfaces that rest along a line need 8,000 to 12,000
/// (`tests/creases.rs`); with fewer, feet on them are not found.
const MOST_CELLS: u32 = 20_000;
/// Halvings of a cell in which Newton is always tried.
const NEWTON_DEPTH: u32 = 8;
/// Halvings after which a cell is a point.
const DEPTH: u32 = 90;

/// A surface prepared for closest points: Bezier pieces and the tree of their boxes.
#[derive(Debug, Clone)]
pub struct SurfaceProjector {
    cells: Pieces,
}

impl SurfaceProjector {
    /// Prepares a surface of these pieces.
    pub(super) fn of_pieces(pieces: Vec<BezierPiece>, degrees: [usize; 2]) -> Self {
        Self { cells: Pieces::new(pieces, degrees) }
    }

    /// Closest point of the untrimmed surface: parameters and squared distance [mm^2]. The distance is the least to
    /// 1e-11 of the surface's size.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        let best = self.cells.closest(p, None);
        (best.uv, best.distance)
    }

    /// The same, quicker where `start` is near the foot.
    #[must_use]
    pub fn closest_from(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let best = self.cells.closest(p, Some(start));
        (best.uv, best.distance)
    }

    /// Closest point (from `start` where it is given) within `cells` cells: parameters, squared distance [mm^2] and the
    /// cells used.
    pub(super) fn closest_in(&self, p: &Vec3, start: Option<Vec2>, cells: u32) -> (Vec2, f64, u32) {
        let best = self.cells.search(p, start, f64::INFINITY, cells.min(MOST_CELLS));
        (best.uv, best.distance, best.cells)
    }

    /// True when the search for `p` ends with a proof (false: it was given up at a work limit, which takes a net
    /// degenerate along a whole curve of feet).
    #[must_use]
    pub fn proves(&self, p: &Vec3) -> bool {
        self.cells.closest(p, None).proved
    }
}

/// A curve prepared for closest points.
#[derive(Debug, Clone)]
pub struct CurveProjector {
    cells: Pieces,
}

impl CurveProjector {
    /// Prepares a curve of these pieces.
    pub(super) fn of_pieces(pieces: Vec<BezierPiece>, degrees: [usize; 2]) -> Self {
        Self { cells: Pieces::new(pieces, degrees) }
    }

    /// Closest point: parameter and squared distance [mm^2]. The distance is the least to 1e-11 of the curve's size.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        let best = self.cells.closest(p, None);
        (best.uv.x, best.distance)
    }

    /// Whether a point of the curve is no farther from `p` than the squared distance `reach` [mm^2], to the accuracy of
    /// [`Self::closest`]: parts that are farther are not searched.
    #[must_use]
    pub fn is_within(&self, p: &Vec3, reach: f64) -> bool {
        let rounding = (4.0 * f64::EPSILON * self.cells.size).powi(2);
        let limit = reach.max(rounding).next_up();
        self.cells.closest_below(p, None, limit).distance < limit
    }
}

#[derive(Debug, Clone)]
struct Pieces {
    pieces: Vec<BezierPiece>,
    tree: BoxTree,
    form: DistanceForm,
    /// Diagonal of the box of all [mm].
    size: f64,
}

/// The best point so far.
#[derive(Debug, Clone, Copy)]
struct Best {
    uv: Vec2,
    distance: f64,
    proved: bool,
    /// Cells examined.
    cells: u32,
}

/// A part of a piece: its net `(w (P - p), w)` over a rectangle of the piece's local parameters.
struct Cell {
    net: Vec<Vector4<f64>>,
    low: Vec2,
    width: Vec2,
    depth: u32,
}

impl Pieces {
    fn new(pieces: Vec<BezierPiece>, degrees: [usize; 2]) -> Self {
        let boxes: Vec<Aabb> = pieces.iter().map(BezierPiece::bounds).collect();
        let size = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b)).diagonal();
        Self { pieces, tree: BoxTree::build(&boxes), form: DistanceForm::new(degrees), size }
    }

    fn closest(&self, p: &Vec3, start: Option<Vec2>) -> Best {
        self.closest_below(p, start, f64::INFINITY)
    }

    /// As [`Self::closest`] where a point is nearer than the squared distance `limit` [mm^2]; otherwise that distance.
    fn closest_below(&self, p: &Vec3, start: Option<Vec2>, limit: f64) -> Best {
        self.search(p, start, limit, MOST_CELLS)
    }

    /// As [`Self::closest_below`], within `cells` cells.
    fn search(&self, p: &Vec3, start: Option<Vec2>, limit: f64, cells: u32) -> Best {
        let first = self.pieces.first().map_or(Vec2::zeros(), |piece| piece.low);
        let mut best = Best { uv: first, distance: limit, proved: true, cells: 0 };
        if !p.iter().all(|x| x.is_finite()) {
            return best;
        }
        let mut search = Search {
            form: &self.form,
            p,
            size: self.size,
            left: cells,
            f: Coefficients::default(),
            stack: Vec::new(),
        };
        if let Some(start) = start {
            let inside =
                |b: &&BezierPiece| (0..2).all(|k| start[k] >= b.low[k] && start[k] <= b.high[k]);
            if let Some(piece) = self.pieces.iter().find(inside) {
                search.newton(piece, piece.local(start), Bounds::UNIT, &mut best);
            }
        }
        self.tree.nearest(p, best.distance, |k, _| {
            search.visit(&self.pieces[k as usize], &mut best);
            best.distance
        });
        best.cells = cells - search.left;
        best
    }
}

struct Search<'s> {
    form: &'s DistanceForm,
    p: &'s Vec3,
    size: f64,
    left: u32,
    f: Coefficients,
    stack: Vec<Cell>,
}

impl Search<'_> {
    /// Searches one piece; afterwards no point of it is nearer than `best` by more than the accuracy.
    fn visit(&mut self, piece: &BezierPiece, best: &mut Best) {
        // On the surface to the last digits: nothing is nearer.
        if best.distance <= (2.0 * f64::EPSILON * self.size).powi(2) {
            return;
        }
        let relative = |h: &Vector4<f64>| (h.xyz() - self.p * h.w).push(h.w);
        let net: Vec<_> = piece.net.iter().map(relative).collect();
        let least_weight = net.iter().fold(f64::INFINITY, |m, h| m.min(h.w));
        if best.distance == f64::INFINITY {
            let corner = net[0].xyz() / net[0].w;
            (best.uv, best.distance) = (piece.low, corner.norm_squared());
        }
        let whole = Cell { net, low: Vec2::zeros(), width: Vec2::repeat(1.0), depth: 0 };
        self.stack.push(whole);
        while let Some(cell) = self.stack.pop() {
            if self.left == 0 {
                best.proved = false;
                self.stack.clear();
                return;
            }
            self.left -= 1;
            if let Some(halves) = self.examine(piece, &cell, least_weight, best) {
                self.stack.extend(halves);
            }
        }
    }

    /// Looks at one cell: `None` when it is done, else its halves, the more promising one last.
    fn examine(
        &mut self,
        piece: &BezierPiece,
        cell: &Cell,
        weight: f64,
        best: &mut Best,
    ) -> Option<[Cell; 2]> {
        let (least, at, enough) = self.fill(cell, weight, best.distance);
        if least >= 0.0 {
            return None;
        }
        let mut curvature = self.form.curvature(&self.f);
        let corner = self.form.least_corner(&self.f);
        let mut foot = None;
        // Also where nothing much is to be gained: a foot just past the border of two pieces is found to the digit.
        if cell.depth < NEWTON_DEPTH || least >= enough || corner < 0.0 || curvature.convex() {
            let before = best.distance;
            let st = self.newton_in(piece, cell, at, best);
            foot = Some((st - cell.low).component_div(&cell.width).map(|t| t.clamp(0.0, 1.0)));
            if best.distance < before && least < enough {
                let (least, _, enough) = self.fill(cell, weight, best.distance);
                if least >= enough {
                    return None;
                }
                curvature = self.form.curvature(&self.f);
            }
        }
        let convex = curvature.convex();
        let bounded = |x: Vec2| self.form.tangent_bound(&self.f, x) >= enough;
        if least >= enough || (convex && foot.is_some_and(bounded)) || cell.depth >= DEPTH {
            return None;
        }
        // The direction in which F bends most.
        let axis = usize::from(curvature.largest[1] > curvature.largest[0]);
        Some(cell.halves(piece.degrees, axis))
    }

    /// Coefficients of F over the cell for the squared distance `m`: the least of them, where it acts, and the
    /// (negative) value from which on it is as good as none.
    fn fill(&mut self, cell: &Cell, weight: f64, m: f64) -> (f64, Vec2, f64) {
        let rounding = self.form.fill(&cell.net, m, &mut self.f);
        let (least, at) = self.form.least(&self.f);
        (least, at, -rounding.max(self.tolerance(m) * weight * weight))
    }

    /// Newton in a cell from the share `at` of its width.
    fn newton_in(&self, piece: &BezierPiece, cell: &Cell, at: Vec2, best: &mut Best) -> Vec2 {
        let bounds = Bounds { low: cell.low, high: cell.low + cell.width };
        let st = self.newton(piece, cell.low + cell.width.component_mul(&at), bounds, best);
        if !collapsed(piece, st) {
            return st;
        }
        // Along a collapsed side nothing moves; from the middle the way is open, and an end off that side is the
        // better one of equals.
        let middle = cell.low + 0.5 * cell.width;
        let (st, distance) = descend(|st| piece.derivs(st), self.p, middle, bounds);
        let allowed = best.distance + rounding(best.distance, self.p);
        if distance <= allowed && !collapsed(piece, st) || distance < best.distance {
            (best.uv, best.distance) = (piece.parameters(st), distance);
        }
        st
    }

    /// Change of the squared distance `m` that is not looked for.
    fn tolerance(&self, m: f64) -> f64 {
        let by = ACCURACY * self.size;
        by * (2.0 * m.sqrt() + by)
    }

    /// Newton from `start`; takes its end into `best` and returns it.
    fn newton(&self, piece: &BezierPiece, start: Vec2, bounds: Bounds, best: &mut Best) -> Vec2 {
        let (st, distance) = descend(|st| piece.derivs(st), self.p, start, bounds);
        if distance < best.distance {
            (best.uv, best.distance) = (piece.parameters(st), distance);
        }
        st
    }
}

/// One of the parameters does not move the point.
fn collapsed(piece: &BezierPiece, st: Vec2) -> bool {
    let d = piece.derivs(st);
    let (a, b) = (d.su.norm_squared(), d.sv.norm_squared());
    piece.degrees[1] > 0 && a.min(b) <= 1e-12 * a.max(b)
}

impl Cell {
    /// Halves across `axis`, the one with the smaller |H| sum (nearer to p) last.
    fn halves(&self, degrees: [usize; 2], axis: usize) -> [Self; 2] {
        let width_v = degrees[1] + 1;
        let degree = degrees[axis];
        let (step, lines, line_step) =
            if axis == 0 { (width_v, width_v, 1) } else { (1, degrees[0] + 1, width_v) };
        let (mut a, mut b) = (self.net.clone(), self.net.clone());
        for line in 0..lines {
            let at = |k: usize| line * line_step + k * step;
            // De Casteljau in place: b ends as the upper half, a collects the lower one.
            for r in 1..=degree {
                for k in 0..=degree - r {
                    b[at(k)] = (b[at(k)] + b[at(k + 1)]) * 0.5;
                }
                a[at(r)] = b[at(0)];
            }
        }
        let mut width = self.width;
        width[axis] *= 0.5;
        let mut upper = self.low;
        upper[axis] += width[axis];
        let lower = Self { net: a, low: self.low, width, depth: self.depth + 1 };
        let upper = Self { net: b, low: upper, width, depth: self.depth + 1 };
        let reach = |c: &Self| -> f64 { c.net.iter().map(|h| h.xyz().norm_squared()).sum() };
        if reach(&lower) <= reach(&upper) { [upper, lower] } else { [lower, upper] }
    }
}
