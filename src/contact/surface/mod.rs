//! A tool ready for contact: closest point over all its patches, by branch and bound.

use rayon::prelude::*;

use super::form::{Chart, Form, Shape};
use super::hull::Hull;
use super::piece::{Piece, pieces_of};
use super::project::Descent;
use super::search::{Best, Search};
use super::topology::Borders;
use super::tree::Tree;
use super::wide::{Plain, Wide};
use super::{Location, Outcome, Projection};
use crate::geometry::{Aabb, Mat3, Vec2, Vec3};
use crate::tool::{PatchDerivs, ToolModel};

/// A tool model with its search tree.
pub struct ToolSurface {
    model: ToolModel,
    /// In the order of the tree.
    pub(super) pieces: Vec<Piece>,
    /// From each piece to its patch.
    pub(super) charts: Vec<Chart>,
    /// What else bounds each piece.
    pub(super) hulls: Vec<Hull>,
    /// Pieces of patch k: `by_patch[starts[k]..starts[k + 1]]`.
    by_patch: Vec<u32>,
    starts: Vec<u32>,
    pub(super) tree: Tree,
    pub(super) borders: Borders,
    bounds: Aabb,
    /// A length that is nothing but rounding [mm].
    pub(super) rounding: f64,
    /// How much farther than the closest point an answer may be where the distance is not convex [mm].
    pub(super) tolerance: f64,
}

impl ToolSurface {
    /// Cuts the patches into pieces and builds the tree.
    #[must_use]
    pub fn new(model: ToolModel) -> Self {
        let cut: Vec<Vec<(Piece, Chart)>> = model
            .patches
            .par_iter()
            .enumerate()
            .map(|(id, patch)| pieces_of(id as u32, patch))
            .collect();
        let cut: Vec<(Piece, Chart)> = cut.into_iter().flatten().collect();
        let hulls: Vec<Hull> = cut.par_iter().map(|(piece, _)| Hull::of(piece)).collect();
        let boxes: Vec<Aabb> =
            cut.iter().zip(&hulls).map(|((piece, _), hull)| bounds_of(piece, hull)).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        let mut order: Vec<u32> = (0..cut.len() as u32).collect();
        let tree = Tree::build(&boxes, &mut order);
        let (pieces, charts): (Vec<Piece>, Vec<Chart>) =
            order.iter().map(|&k| cut[k as usize].clone()).unzip();
        let hulls = order.iter().map(|&k| hulls[k as usize].clone()).collect();
        let (by_patch, starts) = group(&pieces, model.patches.len());
        let size = bounds.diagonal() + bounds.center().amax();
        let borders = Borders::of(&model);
        Self {
            model,
            pieces,
            charts,
            hulls,
            by_patch,
            starts,
            tree,
            borders,
            bounds,
            rounding: 4e-16 * if size.is_finite() { size } else { 0.0 },
            tolerance: 2e-10_f64.min(1e-12 * bounds.diagonal()),
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &ToolModel {
        &self.model
    }

    /// A box around every patch [mm].
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Globally closest point to `p` (tool frame); `hint` is the patch of the last answer for this point.
    ///
    /// Between feet at the same distance (on a shared side or corner) the patch that faces the point most
    /// wins, then one that has the foot inside, then the lowest id: beside a crease the sign of the gap is then that
    /// of the solid's outside. A model without patches, or a point that is none, is infinitely far.
    #[must_use]
    pub fn closest(&self, p: &Vec3, hint: Option<u32>) -> Projection {
        self.within(p, hint, f64::INFINITY)
    }

    /// The same, but no farther than `reach` [mm]: beyond it the answer is [`Projection::nowhere`]. Points
    /// far from a tool then cost next to nothing.
    #[must_use]
    pub fn within(&self, p: &Vec3, hint: Option<u32>, reach: f64) -> Projection {
        let first = hint.and_then(|patch| self.nearest_piece(patch, p)).map(|k| (k, None));
        Query { surface: self, p, first, reach }.run()
    }

    /// The same from the last answer for this point, or for one close by: Newton starts there, and the bound over all
    /// other patches is that much lower from the beginning. The answer does not depend on where it starts, but for
    /// feet at the same distance.
    #[must_use]
    pub fn from_last(&self, p: &Vec3, last: &Projection, reach: f64) -> Projection {
        let at = Vec2::new(last.eta, last.zeta);
        let first = self.pieces_of(last.patch).iter().find_map(|&k| {
            let x = self.charts[k as usize].inverse(&at);
            self.pieces[k as usize].shape.holds(&x).then_some((k as usize, Some(x)))
        });
        Query { surface: self, p, first, reach }.run()
    }

    /// Closest points to all `points`, on all threads; `last` holds answers for the same points earlier, or is empty.
    #[must_use]
    pub fn closest_of_all(&self, points: &[Vec3], last: &[Projection]) -> Vec<Projection> {
        let one = |(k, p): (usize, &Vec3)| match last.get(k) {
            Some(last) => self.from_last(p, last, f64::INFINITY),
            None => self.closest(p, None),
        };
        points.par_iter().enumerate().with_min_len(64).map(one).collect()
    }

    /// Projection on one patch carried on smoothly a little past its sides (5 % of its parameters), from a
    /// known foot: what a node that swings between two patches is held to. `None` when it leaves that.
    #[must_use]
    pub fn carried_on(&self, p: &Vec3, from: &Projection) -> Option<Projection> {
        const PAST: f64 = 0.05;
        let patch = self.model.patches.get(from.patch as usize)?;
        let shape = if patch.sides() == 3 { Shape::Triangle } else { Shape::Square };
        let chart = Chart::whole(shape);
        let form = Form::of(patch, &chart);
        let descent = Descent {
            wide: Plain,
            form: &form,
            shape,
            scale: 1.0 + 2.0 * PAST,
            w: p - form.centre,
            least: [0.0; 2],
            limit: f64::INFINITY,
        };
        let found = descent.run(chart.inverse(&Vec2::new(from.eta, from.zeta)))?;
        if !shape.holds(&(found.at / (1.0 + 1.6 * PAST))) {
            return None;
        }
        let at = chart.at(&found.at);
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d)?;
        Some(Projection {
            patch: from.patch,
            eta: at.x,
            zeta: at.y,
            location: Location::Inside,
            past_border: false,
            point: d.s,
            normal,
            gap: (p - d.s).dot(&normal),
            curvature: weingarten(&d, &normal),
            outcome: Outcome::Local,
        })
    }

    /// The piece of a patch whose centre is nearest.
    fn nearest_piece(&self, patch: u32, p: &Vec3) -> Option<usize> {
        let pieces = self.pieces_of(patch).iter().map(|&k| k as usize);
        let far = |k: &usize| (p - self.pieces[*k].form.centre).norm_squared();
        pieces.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Positions of the pieces of a patch; none of a patch that is not there.
    #[inline(always)]
    fn pieces_of(&self, patch: u32) -> &[u32] {
        let k = patch as usize;
        match (self.starts.get(k), self.starts.get(k.wrapping_add(1))) {
            (Some(&a), Some(&b)) => &self.by_patch[a as usize..b as usize],
            _ => &[],
        }
    }

    /// Location at `at` on a patch with so many sides.
    pub(super) fn location(&self, patch: u32, at: Vec2) -> Location {
        locate(self.model.patches[patch as usize].sides(), at).0
    }

    #[inline(always)]
    fn finish(&self, p: &Vec3, best: &Best, outcome: Outcome) -> Projection {
        let Some(patch) = self.model.patches.get(best.patch as usize) else {
            return Projection { outcome, ..Projection::nowhere() };
        };
        let (location, at) = locate(patch.sides(), best.at);
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d).or_else(|| d.normal(at.x, at.y)).unwrap_or_else(|| {
            // A collapsed corner: the limit from inside the patch.
            let centre = Vec2::new(0.6, 0.4);
            let inner = at + 1e-6 * (centre - at);
            patch.normal(inner.x, inner.y).unwrap_or_else(Vec3::z)
        });
        let q = p - d.s;
        let gap = q.dot(&normal);
        let on_border = self.borders.is_free(best.patch, location);
        let past = || (q - normal * gap).norm() > 1e-6 * self.bounds.diagonal();
        Projection {
            patch: best.patch,
            eta: at.x,
            zeta: at.y,
            location,
            past_border: on_border && past(),
            point: d.s,
            normal,
            gap,
            curvature: weingarten(&d, &normal),
            outcome,
        }
    }
}

/// One query, compiled for the widest vectors of the machine.
struct Query<'a> {
    surface: &'a ToolSurface,
    p: &'a Vec3,
    /// The piece to look into first and the parameters to start from there.
    first: Option<(usize, Option<Vec2>)>,
    reach: f64,
}

impl Query<'_> {
    #[inline(always)]
    fn answer(self, wide: impl Wide) -> Projection {
        let mut search = Search::new(wide, self.surface, self.p, self.reach);
        search.run(self.first);
        search.over_joints(self.reach);
        self.surface.finish(self.p, &search.best, search.outcome())
    }

    fn run(self) -> Projection {
        #[cfg(target_arch = "x86_64")]
        if let Some(v3) = pulp::x86::V3::try_new() {
            return pulp::Simd::vectorize(v3, OnV3(self, v3));
        }
        self.answer(Plain)
    }
}

#[cfg(target_arch = "x86_64")]
struct OnV3<'a>(Query<'a>, pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
impl pulp::WithSimd for OnV3<'_> {
    type Output = Projection;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Projection {
        self.0.answer(self.1)
    }
}

/// Box of a piece's control net, with room for rounding.
fn bounds_of(piece: &Piece, hull: &Hull) -> Aabb {
    let mut b = Aabb::EMPTY;
    hull.net().iter().for_each(|p| b.grow(&(p + piece.form.centre)));
    b.widened(1e-14 * (1.0 + b.diagonal() + b.center().amax()))
}

/// Positions of the pieces by patch, and where each patch's begin.
fn group(pieces: &[Piece], patches: usize) -> (Vec<u32>, Vec<u32>) {
    let mut by_patch: Vec<u32> = (0..pieces.len() as u32).collect();
    by_patch.sort_by_key(|&k| pieces[k as usize].patch);
    let mut starts = vec![0; patches + 1];
    for piece in pieces {
        starts[piece.patch as usize + 1] += 1;
    }
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    (by_patch, starts)
}

#[inline(always)]
pub(super) fn unit_normal(d: &PatchDerivs) -> Option<Vec3> {
    let n = d.d1.cross(&d.d2);
    let size = n.norm();
    (size > 1e-12 * d.d1.norm() * d.d2.norm() && size > 0.0).then(|| n / size)
}

/// Side or corner of the domain within rounding of `at`, and `at` set onto it.
#[inline(always)]
pub(super) fn locate(sides: usize, at: Vec2) -> (Location, Vec2) {
    const ON: f64 = 1e-12;
    let corners: &[(f64, f64)] = &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][..sides];
    for (k, &(eta, zeta)) in corners.iter().enumerate() {
        if (at.x - eta).abs() < ON && (at.y - zeta).abs() < ON {
            return (Location::Vertex(k as u8), Vec2::new(eta, zeta));
        }
    }
    if at.y < ON {
        return (Location::Edge(0), Vec2::new(at.x, 0.0));
    }
    if at.x > 1.0 - ON {
        return (Location::Edge(1), Vec2::new(1.0, at.y));
    }
    if sides == 3 {
        let mean = 0.5 * (at.x + at.y);
        return if at.x - at.y < ON {
            (Location::Edge(2), Vec2::new(mean, mean))
        } else {
            (Location::Inside, at)
        };
    }
    if at.y > 1.0 - ON {
        return (Location::Edge(2), Vec2::new(at.x, 1.0));
    }
    if at.x < ON { (Location::Edge(3), Vec2::new(0.0, at.y)) } else { (Location::Inside, at) }
}

/// Curvature tensor `b_ij S^i (x) S^j` from the two fundamental forms; zero where the patch is degenerate.
#[inline(always)]
pub(super) fn weingarten(d: &PatchDerivs, n: &Vec3) -> Mat3 {
    let (e, f, g) = (d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared());
    let det = e * g - f * f;
    if det.is_nan() || det <= 1e-20 * e * g {
        return Mat3::zeros();
    }
    let s1 = (d.d1 * g - d.d2 * f) / det;
    let s2 = (d.d2 * e - d.d1 * f) / det;
    let (b11, b12, b22) = (n.dot(&d.d11), n.dot(&d.d12), n.dot(&d.d22));
    let cross = s1 * s2.transpose();
    s1 * s1.transpose() * b11 + (cross + cross.transpose()) * b12 + s2 * s2.transpose() * b22
}

mod keeping;
#[cfg(test)]
mod tests;
