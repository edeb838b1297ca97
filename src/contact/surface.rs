//! A tool ready for contact: closest point over all its patches, by branch and bound.

use super::piece::{Domain, Piece, pieces_of};
use super::project::{descend, nearest_in_piece};
use super::topology::Borders;
use super::tree::Tree;
use super::{Location, Projection};
use crate::geometry::{Aabb, Mat3, Vec2, Vec3};
use crate::tool::{PatchDerivs, ToolModel};

/// A tool model with its search tree.
pub struct ToolSurface {
    model: ToolModel,
    pieces: Vec<Piece>,
    /// Pieces of patch k: `by_patch[starts[k]..starts[k + 1]]`.
    by_patch: Vec<u32>,
    starts: Vec<u32>,
    tree: Tree,
    borders: Borders,
    bounds: Aabb,
}

/// The best foot so far.
#[derive(Clone, Copy)]
struct Best {
    patch: u32,
    at: Vec2,
    distance_squared: f64,
    /// Share of the distance that lies along the patch's normal.
    facing: f64,
}

impl ToolSurface {
    /// Cuts the patches into pieces and builds the tree.
    #[must_use]
    pub fn new(model: ToolModel) -> Self {
        let mut pieces: Vec<Piece> = model
            .patches
            .iter()
            .enumerate()
            .flat_map(|(id, patch)| pieces_of(id as u32, patch))
            .collect();
        let tree = Tree::build(&mut pieces);
        let mut by_patch: Vec<u32> = (0..pieces.len() as u32).collect();
        by_patch.sort_by_key(|&k| pieces[k as usize].patch);
        let mut starts = vec![0; model.patches.len() + 1];
        for piece in &pieces {
            starts[piece.patch as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let bounds = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(&p.bounds));
        let borders = Borders::of(&model);
        Self { model, pieces, by_patch, starts, tree, borders, bounds }
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
    /// wins, then the lowest id: beside a crease the sign of the gap is then that of the solid's outside.
    /// A model without patches is infinitely far.
    #[must_use]
    pub fn closest(&self, p: &Vec3, hint: Option<u32>) -> Projection {
        self.within(p, hint, f64::INFINITY)
    }

    /// The same, but no farther than `reach` [mm]: beyond it the answer is [`Projection::nowhere`]. Points
    /// far from a tool then cost next to nothing.
    #[must_use]
    pub fn within(&self, p: &Vec3, hint: Option<u32>, reach: f64) -> Projection {
        let mut best = Best {
            patch: u32::MAX,
            at: Vec2::zeros(),
            distance_squared: reach * reach,
            facing: 0.0,
        };
        if let Some(patch) = hint.filter(|&h| (h as usize) < self.model.patches.len()) {
            let (first, last) = (self.starts[patch as usize], self.starts[patch as usize + 1]);
            for &k in &self.by_patch[first as usize..last as usize] {
                self.try_piece(p, &self.pieces[k as usize], &mut best, 0);
            }
        }
        let slack = |best: &Best| best.distance_squared * (1.0 + 1e-12) + self.rounding().powi(2);
        let start = slack(&best);
        self.tree.nearest(p, start, |k| {
            let piece = &self.pieces[k];
            let seen = hint == Some(piece.patch);
            if !seen && piece.bounds.distance_squared(p) <= slack(&best) {
                self.try_piece(p, piece, &mut best, 0);
            }
            slack(&best)
        });
        self.finish(p, &best)
    }

    /// Projection on one patch carried on smoothly a little past its sides (5 % of its parameters), from a
    /// known foot: what a node that swings between two patches is held to. `None` when it leaves that.
    #[must_use]
    pub fn carried_on(&self, p: &Vec3, from: &Projection) -> Option<Projection> {
        const PAST: f64 = 0.05;
        let patch = self.model.patches.get(from.patch as usize)?;
        let domain = Domain::whole(patch).widened(PAST);
        let (at, _) = descend(p, patch, &domain, Vec2::new(from.eta, from.zeta));
        let near_side = (0..domain.sides()).any(|k| {
            let (outward, offset) = domain.side(k);
            outward.dot(&at) > offset - 0.2 * PAST
        });
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d).filter(|_| !near_side)?;
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
        })
    }

    /// Improves `best` by the nearest point of `piece`; where the distance is not known to be convex there,
    /// by the nearest points of its quarters as well.
    // Depth is bounded by MAX_CUTS.
    fn try_piece(&self, p: &Vec3, piece: &Piece, best: &mut Best, cuts: u32) {
        const MAX_CUTS: u32 = 5;
        let patch = &self.model.patches[piece.patch as usize];
        let (at, distance_squared) = nearest_in_piece(p, patch, piece);
        self.offer(p, best, piece.patch, at, distance_squared);
        // Only points nearer than the best matter, and a piece turns too little to come back to them.
        let certain = best.distance_squared.sqrt() <= piece.convex_within
            || (piece.planar && piece.domain.holds(&at));
        if certain || cuts >= MAX_CUTS {
            return;
        }
        for quarter in piece.quarters(patch) {
            if quarter.bounds.distance_squared(p) < best.distance_squared * (1.0 - 1e-9) {
                self.try_piece(p, &quarter, best, cuts + 1);
            }
        }
    }

    /// A length that is nothing but rounding [mm].
    fn rounding(&self) -> f64 {
        1e-14 * self.bounds.diagonal()
    }

    fn offer(&self, p: &Vec3, best: &mut Best, patch: u32, at: Vec2, distance_squared: f64) {
        let tie = 1e-12 * best.distance_squared.min(distance_squared) + self.rounding().powi(2);
        if distance_squared > best.distance_squared + tie {
            return;
        }
        let d = self.model.patches[patch as usize].derivs(at.x, at.y);
        let facing = unit_normal(&d).map_or(0.0, |n| {
            let q = p - d.s;
            n.dot(&q).abs() / q.norm().max(self.rounding())
        });
        let tied = distance_squared >= best.distance_squared - tie;
        let better = !tied
            || facing > best.facing + 1e-9
            || (facing >= best.facing - 1e-9 && patch < best.patch);
        if better {
            *best = Best { patch, at, distance_squared, facing };
        }
    }

    fn finish(&self, p: &Vec3, best: &Best) -> Projection {
        let Some(patch) = self.model.patches.get(best.patch as usize) else {
            return Projection::nowhere();
        };
        let (location, at) = locate(patch.sides(), best.at);
        let d = patch.derivs(at.x, at.y);
        let normal = unit_normal(&d).unwrap_or_else(|| {
            // A collapsed corner: the limit from inside the patch.
            let centre = Domain::whole(patch).centre();
            let inner = at + 1e-6 * (centre - at);
            patch.normal(inner.x, inner.y).unwrap_or_else(Vec3::z)
        });
        let q = p - d.s;
        let gap = q.dot(&normal);
        let sideways = (q - normal * gap).norm();
        let on_border = match location {
            Location::Inside => false,
            Location::Edge(k) => self.borders.side_is_free(best.patch, k),
            Location::Vertex(k) => self.borders.corner_is_free(best.patch, k),
        };
        Projection {
            patch: best.patch,
            eta: at.x,
            zeta: at.y,
            location,
            past_border: on_border && sideways > 1e-6 * self.bounds.diagonal(),
            point: d.s,
            normal,
            gap,
            curvature: weingarten(&d, &normal),
        }
    }
}

fn unit_normal(d: &PatchDerivs) -> Option<Vec3> {
    let n = d.d1.cross(&d.d2);
    let size = n.norm();
    (size > 1e-12 * d.d1.norm() * d.d2.norm() && size > 0.0).then(|| n / size)
}

/// Side or corner of the domain within rounding of `at`, and `at` set onto it.
fn locate(sides: usize, at: Vec2) -> (Location, Vec2) {
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
fn weingarten(d: &PatchDerivs, n: &Vec3) -> Mat3 {
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

#[cfg(test)]
mod tests;
