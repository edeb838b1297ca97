//! State of one query: the closest point found and the remaining search.
//!
//! Every piece is either searched or excluded: by its box, by its lower bound ([`Piece::floor`]), or by the gradient of
//! a convex `F`. Where `F` is not known to be convex (beyond a centre of curvature, at a collapsed or folded corner)
//! the piece is subdivided until it is, or until no part can be closer by more than [`ToolSurface::tolerance`].

use super::foot::unit_normal;
use super::form::{Chart, LocalDerivs, Shape};
use super::hull::control_net;
use super::piece::{Floor, Piece, floor_about};
use super::project::{Descent, start};
use super::projection::{Location, Outcome};
use super::surface::ToolSurface;
use super::tree::{Probe, Walk};
use super::wide::Wide;
use kanagata_geometry::{Vec2, Vec3};

/// Maximum number of parts per query; an ordinary query needs none. Doubled: twice the longest query.
const PARTS_MAX: u32 = 20_000;
/// Rounding error of the bounds relative to the distance.
const DISTANCE_ROUNDING_REL: f64 = 5e-14;
/// Subdivision depth at which parts have no extent.
const SUBDIVISION_DEPTH_MAX: u32 = 90;

/// The best foot point found.
#[derive(Clone, Copy)]
pub(super) struct Best {
    /// `u32::MAX` initially.
    pub(super) patch: u32,
    pub(super) at: Vec2,
    /// Half of its squared distance [mm^2].
    pub(super) value: f64,
    /// The same plus rounding.
    pub(super) limit: f64,
    /// Fraction of the distance along the patch normal; NaN if not yet evaluated.
    pub(super) facing: f64,
}

pub(super) struct Search<'a, W> {
    pub(super) wide: W,
    pub(super) surface: &'a ToolSurface,
    pub(super) p: Vec3,
    pub(super) probe: Probe,
    pub(super) best: Best,
    threshold: f32,
    parts: u32,
}

impl<'a, W: Wide> Search<'a, W> {
    #[inline(always)]
    pub(super) fn new(wide: W, surface: &'a ToolSurface, p: &Vec3, reach: f64) -> Self {
        let value = 0.5 * reach * reach;
        let probe = Probe::new(p);
        let best =
            Best { patch: u32::MAX, at: Vec2::zeros(), value, limit: value, facing: f64::NAN };
        let threshold = probe.threshold(reach);
        Self { wide, surface, p: *p, probe, best, threshold, parts: 0 }
    }

    /// Certainty of the result.
    #[inline(always)]
    pub(super) fn outcome(&self) -> Outcome {
        if self.parts < PARTS_MAX { Outcome::Certified } else { Outcome::WorkSpent }
    }

    /// Searches all pieces that may be closer than the best, starting with `first`.
    #[inline(always)]
    pub(super) fn run(&mut self, first: Option<(usize, Option<Vec2>)>) {
        let tree = &self.surface.tree;
        if self.surface.pieces.is_empty() || !self.p.iter().all(|x| x.is_finite()) {
            return;
        }
        let (first, mut x) = match first {
            Some(first) => first,
            None => (tree.descend_to_nearest(self.wide, &self.probe), None),
        };
        let mut walk = Walk::new();
        let mut k = first;
        loop {
            self.search_piece(k, x);
            x = None;
            k = loop {
                match walk.next(self.wide, tree, &self.probe, self.threshold) {
                    None => return,
                    Some(k) if k != first => break k,
                    _ => {}
                }
            };
        }
    }

    #[inline(always)]
    fn search_piece(&mut self, k: usize, x: Option<Vec2>) {
        let surface = self.surface;
        let (piece, chart) = (&surface.pieces[k], &surface.charts[k]);
        let w = self.p - piece.form.centre;
        let floor = piece.floor(self.wide, &w);
        if floor.value > self.best.limit {
            return;
        }
        let x = match x {
            Some(x) => x,
            None => piece.start(&floor),
        };
        let Some(foot) = self.descend(piece, chart, w, floor.min_curvature, x) else { return };
        // For a point on the tool nothing is closer, convex or not.
        let open = !floor.convex && self.relevant_value() > f64::NEG_INFINITY;
        if open && !self.is_proved(k, &w, &floor, foot) {
            self.cut(piece, chart, &floor);
        }
    }

    /// True when no point of piece `k` is closer than its foot point or the best, by the precomputed bounds.
    fn is_proved(&self, k: usize, w: &Vec3, floor: &Floor, x: Vec2) -> bool {
        let (piece, hull) = (&self.surface.pieces[k], &self.surface.hulls[k]);
        let d = piece.form.derivs(x.x, x.y);
        self.is_low(piece.shape, w, floor, &x, &d)
            || hull.floor(w, &d) > self.relevant_value()
            || self.is_behind(hull.net(), w, &d.s)
    }

    /// Offers the minimum found by Newton's iteration in a piece from `x`; `None` when none of it is closer.
    #[inline(always)]
    fn descend(
        &mut self,
        piece: &Piece,
        chart: &Chart,
        w: Vec3,
        min_curvature: [f64; 2],
        x: Vec2,
    ) -> Option<Vec2> {
        let limit = self.best.limit;
        let (wide, form, shape) = (self.wide, &piece.form, piece.shape);
        let descent = Descent { wide, form, shape, scale: 1.0, w, min_curvature, limit };
        let found = descent.run(x)?;
        self.offer(piece.patch, chart, found.at, found.value);
        Some(found.at)
    }

    /// True when no point of a piece is closer than its foot point with derivatives `d`, by the second derivatives of
    /// `F`.
    fn is_low(&self, shape: Shape, w: &Vec3, floor: &Floor, x: &Vec2, d: &LocalDerivs) -> bool {
        let q = w - d.s;
        let gradient = Vec2::new(-q.dot(&d.d1), -q.dot(&d.d2));
        floor_about(shape, x, 0.5 * q.norm_squared(), &gradient, floor.min_curvature)
            > self.relevant_value()
    }

    /// True when the piece lies behind the plane through its foot point normal to the distance, as flat and convex
    /// pieces do: then no point is closer, for any parametrisation.
    fn is_behind(&self, net: &[Vec3], w: &Vec3, foot: &Vec3) -> bool {
        let q = w - foot;
        let size = q.norm();
        size > 0.0 && distance_along(net, w, &(q / size)) > self.relevant_distance()
    }

    /// Searches the parts of a piece where `F` may have several minima, recursively.
    #[cold]
    fn cut(&mut self, piece: &Piece, chart: &Chart, floor: &Floor) {
        let mut todo: Vec<(Piece, Chart, Floor, u32)> = Vec::new();
        self.push_parts(&mut todo, piece, chart, floor, 1);
        while let Some((part, chart, floor, depth)) = todo.pop() {
            if floor.value > self.relevant_value() {
                continue;
            }
            let w = self.p - part.form.centre;
            let nearer = 0.5 * w.norm_squared() < self.best.value;
            let mut foot = Vec2::zeros();
            if floor.convex || nearer {
                match self.descend(&part, &chart, w, floor.min_curvature, part.start(&floor)) {
                    Some(x) => foot = x,
                    None => continue,
                }
            }
            let proved = |x: Vec2| {
                let d = part.form.derivs(x.x, x.y);
                self.is_low(part.shape, &w, &floor, &x, &d)
                    || self.is_behind(&control_net(&part), &w, &d.s)
            };
            if !floor.convex && depth < SUBDIVISION_DEPTH_MAX && !proved(foot) {
                self.push_parts(&mut todo, &part, &chart, &floor, depth + 1);
            }
        }
    }

    /// Pushes the parts that may be closer onto the stack, the lowest bound on top.
    fn push_parts(
        &mut self,
        todo: &mut Vec<(Piece, Chart, Floor, u32)>,
        piece: &Piece,
        chart: &Chart,
        floor: &Floor,
        depth: u32,
    ) {
        if self.parts >= PARTS_MAX {
            return;
        }
        let first = todo.len();
        let w = self.p - piece.form.centre;
        for cut in piece.cuts() {
            self.parts += 1;
            if piece.floor_of_part(&w, floor.min_curvature, &cut) > self.relevant_value() {
                continue;
            }
            let part = piece.part(&cut);
            let floor = part.sharp_floor(&(self.p - part.form.centre));
            if floor.value <= self.relevant_value() {
                todo.push((part, chart.after(&cut), floor, depth));
            }
        }
        todo[first..].sort_by(|a, b| b.2.value.total_cmp(&a.2.value));
    }

    /// Distance [mm] above which a part cannot improve the best by more than the tolerance, or by more than the
    /// rounding of bounds at large distance, where subdivision would not end.
    #[inline(always)]
    fn relevant_distance(&self) -> f64 {
        let best = (2.0 * self.best.value).sqrt();
        (best - self.surface.tolerance).min(best * (1.0 - DISTANCE_ROUNDING_REL))
    }

    /// The same as half a squared distance [mm^2].
    #[inline(always)]
    fn relevant_value(&self) -> f64 {
        let distance = self.relevant_distance();
        if distance > 0.0 { 0.5 * distance * distance } else { f64::NEG_INFINITY }
    }

    /// Accepts a foot point that is closer than the best, or equally close and preferred.
    #[inline(always)]
    fn offer(&mut self, patch: u32, chart: &Chart, x: Vec2, value: f64) {
        if value > self.best.limit {
            return;
        }
        let at = chart.at(&x);
        let mut new = Best { patch, at, value, limit: 0.0, facing: f64::NAN };
        let rounding = self.surface.rounding;
        let tie = 1e-12 * value + rounding * ((2.0 * value).sqrt() + rounding);
        if self.best.patch != u32::MAX && value >= self.best.value - tie {
            let mut old = self.best;
            for foot in [&mut old, &mut new] {
                if foot.facing.is_nan() {
                    foot.facing = self.facing(foot);
                }
            }
            self.best.facing = old.facing;
            if !self.prefers(&new, &old) {
                return;
            }
        }
        new.limit = value + tie;
        self.threshold = self.probe.threshold((2.0 * new.limit).sqrt());
        self.best = new;
    }

    /// Preference among two foot points at equal distance: the more facing patch, the interior foot point, the lower
    /// id.
    fn prefers(&self, new: &Best, old: &Best) -> bool {
        const FACING_TOLERANCE: f64 = 1e-9;
        if (new.facing - old.facing).abs() > FACING_TOLERANCE {
            return new.facing > old.facing;
        }
        let inside = |b: &Best| self.surface.location(b.patch, b.at) == Location::Inside;
        match (inside(new), inside(old)) {
            (true, false) => true,
            (false, true) => false,
            _ => new.patch < old.patch,
        }
    }

    pub(super) fn facing(&self, foot: &Best) -> f64 {
        let d = self.surface.model().patches[foot.patch as usize].derivs(foot.at.x, foot.at.y);
        unit_normal(&d).map_or(0.0, |n| {
            let q = self.p - d.s;
            n.dot(&q).abs() / q.norm().max(self.surface.rounding)
        })
    }
}

/// Lower bound of the distance [mm] from `w` to a net along the unit vector `direction`: the net lies on one side of a
/// plane.
fn distance_along(net: &[Vec3], w: &Vec3, direction: &Vec3) -> f64 {
    let reach = net.iter().map(|p| direction.dot(p));
    w.dot(direction) - reach.fold(f64::NEG_INFINITY, f64::max)
}

impl Piece {
    /// Starting point of Newton's iteration without other information.
    #[inline(always)]
    pub(super) fn start(&self, floor: &Floor) -> Vec2 {
        start(floor.gradient, floor.hessian, self.metric(), self.shape)
    }
}
