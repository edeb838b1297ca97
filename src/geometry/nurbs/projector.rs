//! Global point projection with a verified minimum: branch and bound over Bezier cells.
//!
//! A cell is discarded when F (see `distance_form`) has no negative coefficient, or is convex with a non-negative
//! tangent plane; otherwise it is bisected. Foot points are computed by bounded Newton iteration within cells.

use nalgebra::Vector4;

use super::bezier::BezierPiece;
use super::distance_form::{Coefficients, DistanceForm};
use super::newton::{Bounds, descend, rounding};
use crate::box_tree::BoxTree;
use crate::{Aabb, Vec2, Vec3};

/// Accuracy of the verified distance relative to the size of the geometry. Doubled: fewer cells, twice the error.
const RELATIVE_ACCURACY: f64 = 1e-11;
/// Maximum number of cells examined per query before the search stops without verification. Contact along a line on a
/// surface needs 8,000 to 12,000 cells (`tests/creases.rs`); with fewer, these foot points are not found.
const MAX_CELLS_PER_QUERY: u32 = 20_000;
/// Bisection depth up to which Newton iteration is always started in a cell.
const NEWTON_DEPTH_MAX: u32 = 8;
/// Bisection depth at which a cell has no extent in double precision.
const BISECTION_DEPTH_MAX: u32 = 90;

/// A surface prepared for point projection: Bezier patches and a bounding volume hierarchy.
#[derive(Debug, Clone)]
pub struct SurfaceProjector {
    cells: Pieces,
}

impl SurfaceProjector {
    /// Builds the search structure from Bezier patches.
    pub(super) fn of_pieces(pieces: Vec<BezierPiece>, degrees: [usize; 2]) -> Self {
        Self { cells: Pieces::new(pieces, degrees) }
    }

    /// Closest point of the untrimmed surface: parameters and squared distance [mm^2]. The distance is the global
    /// minimum to within 1e-11 of the size of the surface.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        let best = self.cells.closest(p, None);
        (best.uv, best.distance)
    }

    /// As [`Self::closest`], faster when `start` is near the foot point.
    #[must_use]
    pub fn closest_from(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let best = self.cells.closest(p, Some(start));
        (best.uv, best.distance)
    }

    /// Closest point (from `start` where it is given) within `cells` cells: parameters, squared distance [mm^2] and the
    /// number of cells examined.
    pub(super) fn closest_in(&self, p: &Vec3, start: Option<Vec2>, cells: u32) -> (Vec2, f64, u32) {
        let best = self.cells.search(p, start, f64::INFINITY, cells.min(MAX_CELLS_PER_QUERY));
        (best.uv, best.distance, best.cells)
    }

    /// The patch whose rectangle contains `uv`; at a knot the one after it.
    pub(super) fn piece_at(&self, uv: Vec2) -> Option<&BezierPiece> {
        let Pieces { pieces, across, .. } = &self.cells;
        let start_v = pieces[..(*across).min(pieces.len())].partition_point(|p| p.low.y <= uv.y);
        let rows = pieces.len() / (*across).max(1);
        let (mut first, mut end) = (0, rows);
        while first < end {
            let middle = (first + end) / 2;
            if pieces[middle * across].low.x <= uv.x { first = middle + 1 } else { end = middle }
        }
        pieces.get(first.saturating_sub(1) * across + start_v.saturating_sub(1))
    }

    /// True when the search for `p` ends with a verified minimum. False when the cell limit is reached, which requires
    /// a degenerate net with a whole curve of foot points.
    #[must_use]
    pub fn proves(&self, p: &Vec3) -> bool {
        self.cells.closest(p, None).proved
    }
}

/// A curve prepared for point projection.
#[derive(Debug, Clone)]
pub struct CurveProjector {
    cells: Pieces,
}

impl CurveProjector {
    /// Builds the search structure from Bezier segments.
    pub(super) fn of_pieces(pieces: Vec<BezierPiece>, degrees: [usize; 2]) -> Self {
        Self { cells: Pieces::new(pieces, degrees) }
    }

    /// Closest point: parameter and squared distance [mm^2]. The distance is the global minimum to within 1e-11 of the
    /// size of the curve.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        let best = self.cells.closest(p, None);
        (best.uv.x, best.distance)
    }

    /// True when a point of the curve is within the squared distance `reach` [mm^2] of `p`, to the accuracy of
    /// [`Self::closest`]. Parts at larger distance are not searched.
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
    /// Number of patches along v; those of equal u are consecutive.
    across: usize,
    tree: BoxTree,
    form: DistanceForm,
    /// Diagonal of the bounding box [mm].
    size: f64,
}

/// The best candidate found.
#[derive(Debug, Clone, Copy)]
struct Best {
    uv: Vec2,
    distance: f64,
    proved: bool,
    /// Cells examined.
    cells: u32,
}

/// A cell of a patch: its net `(w (P - p), w)` over a rectangle of local parameters.
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
        let first = pieces.first().map(|piece| piece.low.x);
        let across = pieces.iter().take_while(|piece| Some(piece.low.x) == first).count();
        let (tree, form) = (BoxTree::build(&boxes), DistanceForm::new(degrees));
        Self { pieces, across, tree, form, size }
    }

    fn closest(&self, p: &Vec3, start: Option<Vec2>) -> Best {
        self.closest_below(p, start, f64::INFINITY)
    }

    /// As [`Self::closest`], restricted to squared distances below `limit` [mm^2]; returns `limit` as distance when
    /// there is no such point.
    fn closest_below(&self, p: &Vec3, start: Option<Vec2>, limit: f64) -> Best {
        self.search(p, start, limit, MAX_CELLS_PER_QUERY)
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
            cells_left: cells,
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
        best.cells = cells - search.cells_left;
        best
    }
}

struct Search<'s> {
    form: &'s DistanceForm,
    p: &'s Vec3,
    size: f64,
    cells_left: u32,
    f: Coefficients,
    stack: Vec<Cell>,
}

impl Search<'_> {
    /// Searches one patch. On return no point of it is closer than `best` by more than the accuracy, unless the cell
    /// limit was reached.
    fn visit(&mut self, piece: &BezierPiece, best: &mut Best) {
        // `p` lies on the surface to within rounding.
        if best.distance <= (2.0 * f64::EPSILON * self.size).powi(2) {
            return;
        }
        let relative = |h: &Vector4<f64>| (h.xyz() - self.p * h.w).push(h.w);
        let net: Vec<_> = piece.net.iter().map(relative).collect();
        let min_weight = net.iter().fold(f64::INFINITY, |m, h| m.min(h.w));
        if best.distance == f64::INFINITY {
            let corner = net[0].xyz() / net[0].w;
            (best.uv, best.distance) = (piece.low, corner.norm_squared());
        }
        let whole = Cell { net, low: Vec2::zeros(), width: Vec2::repeat(1.0), depth: 0 };
        self.stack.push(whole);
        while let Some(cell) = self.stack.pop() {
            if self.cells_left == 0 {
                best.proved = false;
                self.stack.clear();
                return;
            }
            self.cells_left -= 1;
            if let Some(halves) = self.examine(piece, &cell, min_weight, best) {
                self.stack.extend(halves);
            }
        }
    }

    /// Examines one cell: `None` when it is discarded, otherwise its halves, the more promising one last.
    fn examine(
        &mut self,
        piece: &BezierPiece,
        cell: &Cell,
        weight: f64,
        best: &mut Best,
    ) -> Option<[Cell; 2]> {
        let (smallest, at, threshold) = self.fill(cell, weight, best.distance);
        if smallest >= 0.0 {
            return None;
        }
        let mut curvature = self.form.curvature(&self.f);
        let corner = self.form.min_corner(&self.f);
        let mut foot = None;
        // Newton is also started with little to gain: a foot point just across the edge of two patches becomes exact.
        let likely = smallest >= threshold || corner < 0.0 || curvature.convex();
        if cell.depth < NEWTON_DEPTH_MAX || likely {
            let before = best.distance;
            let st = self.newton_in(piece, cell, at, best);
            foot = Some((st - cell.low).component_div(&cell.width).map(|t| t.clamp(0.0, 1.0)));
            if best.distance < before && smallest < threshold {
                let (smallest, _, threshold) = self.fill(cell, weight, best.distance);
                if smallest >= threshold {
                    return None;
                }
                curvature = self.form.curvature(&self.f);
            }
        }
        let convex = curvature.convex();
        let bounded = |x: Vec2| self.form.tangent_bound(&self.f, x) >= threshold;
        let proved = smallest >= threshold || (convex && foot.is_some_and(bounded));
        if proved || cell.depth >= BISECTION_DEPTH_MAX {
            return None;
        }
        // Bisect along the direction of the largest second derivative.
        let axis = usize::from(curvature.max_abs[1] > curvature.max_abs[0]);
        Some(cell.halves(piece.degrees, axis))
    }

    /// Coefficients of F over the cell for the squared distance `m`: the smallest coefficient, its Greville point, and
    /// the negative threshold above which a coefficient counts as zero.
    fn fill(&mut self, cell: &Cell, weight: f64, m: f64) -> (f64, Vec2, f64) {
        let rounding = self.form.fill(&cell.net, m, &mut self.f);
        let (smallest, at) = self.form.min_coefficient(&self.f);
        (smallest, at, -rounding.max(self.tolerance(m) * weight * weight))
    }

    /// Newton iteration within a cell, starting at the fraction `at` of its width.
    fn newton_in(&self, piece: &BezierPiece, cell: &Cell, at: Vec2, best: &mut Best) -> Vec2 {
        let bounds = Bounds { low: cell.low, high: cell.low + cell.width };
        let st = self.newton(piece, cell.low + cell.width.component_mul(&at), bounds, best);
        if !collapsed(piece, st) {
            return st;
        }
        // On a collapsed edge the iteration cannot leave the edge. Restart at the middle of the cell; among equal
        // distances the foot point off that edge is preferred.
        let middle = cell.low + 0.5 * cell.width;
        let (st, distance) = descend(|st| piece.derivs(st), self.p, middle, bounds);
        let allowed = best.distance + rounding(best.distance, self.p);
        if distance <= allowed && !collapsed(piece, st) || distance < best.distance {
            (best.uv, best.distance) = (piece.parameters(st), distance);
        }
        st
    }

    /// Change of the squared distance `m` that corresponds to [`RELATIVE_ACCURACY`].
    fn tolerance(&self, m: f64) -> f64 {
        let by = RELATIVE_ACCURACY * self.size;
        by * (2.0 * m.sqrt() + by)
    }

    /// Newton iteration from `start`; updates `best` and returns the end point.
    fn newton(&self, piece: &BezierPiece, start: Vec2, bounds: Bounds, best: &mut Best) -> Vec2 {
        let (st, distance) = descend(|st| piece.derivs(st), self.p, start, bounds);
        if distance < best.distance {
            (best.uv, best.distance) = (piece.parameters(st), distance);
        }
        st
    }
}

/// True where the derivative with respect to one parameter vanishes.
fn collapsed(piece: &BezierPiece, st: Vec2) -> bool {
    let d = piece.derivs(st);
    let (a, b) = (d.su.norm_squared(), d.sv.norm_squared());
    piece.degrees[1] > 0 && a.min(b) <= 1e-12 * a.max(b)
}

impl Cell {
    /// Both halves across `axis`; the half with the smaller sum of squared control vectors (closer to p) last.
    fn halves(&self, degrees: [usize; 2], axis: usize) -> [Self; 2] {
        let width_v = degrees[1] + 1;
        let degree = degrees[axis];
        let (step, lines, line_step) =
            if axis == 0 { (width_v, width_v, 1) } else { (1, degrees[0] + 1, width_v) };
        let (mut a, mut b) = (self.net.clone(), self.net.clone());
        for line in 0..lines {
            let at = |k: usize| line * line_step + k * step;
            // De Casteljau's algorithm in place: b becomes the upper half, a the lower half.
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
