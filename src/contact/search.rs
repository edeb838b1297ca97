//! One query: what is known of the closest point so far, and what is left to look at.
//!
//! Every piece is either looked into or left because its box, its floor ([`Piece::floor`]) or the gradient of a
//! convex `F` says that no point of it is nearer than the best. Where `F` is not known to be convex (beyond a centre of
//! curvature, at a collapsed or folded corner) the piece is cut up until that is so, or until no part
//! can be nearer by more than [`ToolSurface::tolerance`].

use super::foot::unit_normal;
use super::form::{Chart, LocalDerivs, Shape};
use super::hull::control_net;
use super::piece::{Floor, Piece, floor_about};
use super::project::{Descent, start};
use super::projection::{Location, Outcome};
use super::surface::ToolSurface;
use super::tree::{Probe, Walk};
use super::wide::Wide;
use crate::geometry::{Vec2, Vec3};

/// Parts one query may be cut into; an ordinary one needs none.
const MOST_PARTS: u32 = 20_000;
/// Share of a distance that is rounding in its bounds.
const FAR_ROUNDING: f64 = 5e-14;
/// Parts after so many cuts are points.
const MAX_DEPTH: u32 = 90;

/// The best foot so far.
#[derive(Clone, Copy)]
pub(super) struct Best {
    /// `u32::MAX` before there is any.
    pub(super) patch: u32,
    pub(super) at: Vec2,
    /// Half its squared distance [mm^2].
    pub(super) value: f64,
    /// The same and what may be rounding.
    pub(super) limit: f64,
    /// Share of the distance that lies along the patch's normal; not yet known when NaN.
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

    /// How sure the answer is.
    #[inline(always)]
    pub(super) fn outcome(&self) -> Outcome {
        if self.parts < MOST_PARTS { Outcome::Certified } else { Outcome::WorkSpent }
    }

    /// Looks at all pieces that may be nearer than the best, at `first` before all others.
    #[inline(always)]
    pub(super) fn run(&mut self, first: Option<(usize, Option<Vec2>)>) {
        let tree = &self.surface.tree;
        if self.surface.pieces.is_empty() || !self.p.iter().all(|x| x.is_finite()) {
            return;
        }
        let (first, mut x) = match first {
            Some(first) => first,
            None => (tree.dive(self.wide, &self.probe), None),
        };
        let mut walk = Walk::new();
        let mut k = first;
        loop {
            self.look(k, x);
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
    fn look(&mut self, k: usize, x: Option<Vec2>) {
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
        let Some(foot) = self.descend(piece, chart, w, floor.least, x) else { return };
        // Of a point on the tool nothing is nearer, convex or not.
        let open = !floor.convex && self.worth() > f64::NEG_INFINITY;
        if open && !self.is_proved(k, &w, &floor, foot) {
            self.cut(piece, chart, &floor);
        }
    }

    /// No point of piece `k` is nearer than its foot or the best, says what was found out about it beforehand.
    fn is_proved(&self, k: usize, w: &Vec3, floor: &Floor, x: Vec2) -> bool {
        let (piece, hull) = (&self.surface.pieces[k], &self.surface.hulls[k]);
        let d = piece.form.derivs(x.x, x.y);
        self.is_low(piece.shape, w, floor, &x, &d)
            || hull.floor(w, &d) > self.worth()
            || self.is_behind(hull.net(), w, &d.s)
    }

    /// Offers the minimum Newton finds in a piece from `x`; `None` when nothing of it is nearer.
    #[inline(always)]
    fn descend(
        &mut self,
        piece: &Piece,
        chart: &Chart,
        w: Vec3,
        least: [f64; 2],
        x: Vec2,
    ) -> Option<Vec2> {
        let limit = self.best.limit;
        let (wide, form, shape) = (self.wide, &piece.form, piece.shape);
        let descent = Descent { wide, form, shape, scale: 1.0, w, least, limit };
        let found = descent.run(x)?;
        self.offer(piece.patch, chart, found.at, found.value);
        Some(found.at)
    }

    /// No point of a piece is nearer than its foot with derivatives `d`, say the second derivatives of `F`.
    fn is_low(&self, shape: Shape, w: &Vec3, floor: &Floor, x: &Vec2, d: &LocalDerivs) -> bool {
        let q = w - d.s;
        let gradient = Vec2::new(-q.dot(&d.d1), -q.dot(&d.d2));
        floor_about(shape, x, 0.5 * q.norm_squared(), &gradient, floor.least) > self.worth()
    }

    /// The piece lies behind the plane through its foot across the distance, as flat and outward curved pieces do:
    /// however their parameters are stretched, no point of them is nearer.
    fn is_behind(&self, net: &[Vec3], w: &Vec3, foot: &Vec3) -> bool {
        let q = w - foot;
        let size = q.norm();
        size > 0.0 && distance_along(net, w, &(q / size)) > self.distance_of_note()
    }

    /// Looks into the parts of a piece where `F` may have several minima, theirs, and so on.
    #[cold]
    fn cut(&mut self, piece: &Piece, chart: &Chart, floor: &Floor) {
        let mut todo: Vec<(Piece, Chart, Floor, u32)> = Vec::new();
        self.push_parts(&mut todo, piece, chart, floor, 1);
        while let Some((part, chart, floor, depth)) = todo.pop() {
            if floor.value > self.worth() {
                continue;
            }
            let w = self.p - part.form.centre;
            let nearer = 0.5 * w.norm_squared() < self.best.value;
            let mut foot = Vec2::zeros();
            if floor.convex || nearer {
                match self.descend(&part, &chart, w, floor.least, part.start(&floor)) {
                    Some(x) => foot = x,
                    None => continue,
                }
            }
            let proved = |x: Vec2| {
                let d = part.form.derivs(x.x, x.y);
                self.is_low(part.shape, &w, &floor, &x, &d)
                    || self.is_behind(&control_net(&part), &w, &d.s)
            };
            if !floor.convex && depth < MAX_DEPTH && !proved(foot) {
                self.push_parts(&mut todo, &part, &chart, &floor, depth + 1);
            }
        }
    }

    /// Puts the parts that may be nearer on the stack, the lowest on top.
    fn push_parts(
        &mut self,
        todo: &mut Vec<(Piece, Chart, Floor, u32)>,
        piece: &Piece,
        chart: &Chart,
        floor: &Floor,
        depth: u32,
    ) {
        if self.parts >= MOST_PARTS {
            return;
        }
        let first = todo.len();
        let w = self.p - piece.form.centre;
        for cut in piece.cuts() {
            self.parts += 1;
            if piece.floor_of_part(&w, floor.least, &cut) > self.worth() {
                continue;
            }
            let part = piece.part(&cut);
            let floor = part.sharp_floor(&(self.p - part.form.centre));
            if floor.value <= self.worth() {
                todo.push((part, chart.after(&cut), floor, depth));
            }
        }
        todo[first..].sort_by(|a, b| b.2.value.total_cmp(&a.2.value));
    }

    /// What is not nearer than this [mm] is not nearer than the best by more than the tolerance, or than rounding makes of bounds
    /// from afar, where cutting would never end.
    #[inline(always)]
    fn distance_of_note(&self) -> f64 {
        let best = (2.0 * self.best.value).sqrt();
        (best - self.surface.tolerance).min(best * (1.0 - FAR_ROUNDING))
    }

    /// Parts above this are not nearer by more than that.
    #[inline(always)]
    fn worth(&self) -> f64 {
        let distance = self.distance_of_note();
        if distance > 0.0 { 0.5 * distance * distance } else { f64::NEG_INFINITY }
    }

    /// Takes a foot if it is nearer than the best, or as near and better.
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

    /// Which of two feet at the same distance: the patch that faces the point more, the foot inside, the lower id.
    fn prefers(&self, new: &Best, old: &Best) -> bool {
        const SAME: f64 = 1e-9;
        if (new.facing - old.facing).abs() > SAME {
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

/// No point of a net is nearer to `w` than this [mm], seen along `direction` (of length one): it lies on one side of a
/// plane.
fn distance_along(net: &[Vec3], w: &Vec3, direction: &Vec3) -> f64 {
    let reach = net.iter().map(|p| direction.dot(p));
    w.dot(direction) - reach.fold(f64::NEG_INFINITY, f64::max)
}

impl Piece {
    /// Where Newton starts that knows nothing better.
    #[inline(always)]
    pub(super) fn start(&self, floor: &Floor) -> Vec2 {
        start(floor.gradient, floor.hessian, self.metric(), self.shape)
    }
}
