//! Splits the loops of a face along an isoparametric line and closes both halves along it.

use crate::loops::{Side, signed_area};
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Extent of a part across the line, relative to the face, below which the split is rejected as a sliver.
const SLIVER_WIDTH_REL: f64 = 1e-3;
/// Distance of a corner from the line, relative to the parameter range, below which it may be moved onto the line (if
/// also within the tolerance in space).
const ON_LINE_TOLERANCE_REL: f64 = 1e-3;
/// Bisections that locate a crossing to machine precision.
const BISECTIONS: usize = 60;

/// An isoparametric line on a surface.
pub(super) struct Line<'a> {
    pub surface: &'a Surface,
    /// Index of the constant parameter: 0 for u, 1 for v.
    pub axis: usize,
    /// Value of the constant parameter.
    pub at: f64,
    /// Distance below which points coincide [mm].
    pub tolerance: f64,
}

/// The two halves of a split face.
#[derive(Debug)]
pub(super) struct Halves {
    /// Faces at smaller parameters.
    pub lower: Vec<Loops>,
    /// Faces at larger parameters.
    pub upper: Vec<Loops>,
    /// Ranges of the free parameter in which the line lies inside the face.
    pub inside: Vec<[f64; 2]>,
}

/// Loops of a face, outer loop first.
pub(crate) type Loops = Vec<Vec<Side>>;

/// A side that does not cross the line, and whether it belongs to the upper half.
type Piece = (Side, bool);

impl Line<'_> {
    /// Splits the region within `loops`; `None` when the line does not cross it or a part would be a sliver.
    pub fn split(&self, loops: &[Vec<Side>]) -> Option<Halves> {
        let net = || loops.iter().flatten().flat_map(|s| s.path.points());
        let off = |uv: &Vec2| uv[self.axis] - self.at;
        if net().all(|uv| off(uv) >= 0.0) || net().all(|uv| off(uv) <= 0.0) {
            return None;
        }
        let pieces: Vec<Vec<Piece>> = loops.iter().map(|l| self.pieces(l)).collect();
        let (lower, inside) = self.half(&pieces, false)?;
        let (upper, _) = self.half(&pieces, true)?;
        let points = || loops.iter().flatten().flat_map(samples);
        let size =
            Aabb::of_points(&points().map(|uv| self.surface.point(uv)).collect::<Vec<Vec3>>());
        let thin = |face: &Loops| {
            let widest = face[0].iter().flat_map(samples).map(|uv| self.distance(uv));
            widest.fold(0.0, f64::max) <= SLIVER_WIDTH_REL * size.diagonal()
        };
        let whole = !inside.is_empty() && !lower.is_empty() && !upper.is_empty();
        (whole && !lower.iter().chain(&upper).any(thin)).then_some(Halves { lower, upper, inside })
    }

    fn onto(&self, mut uv: Vec2) -> Vec2 {
        uv[self.axis] = self.at;
        uv
    }

    /// Distance from the line [mm], along the parameter across it.
    fn distance(&self, uv: Vec2) -> f64 {
        (self.surface.point(uv) - self.surface.point(self.onto(uv))).norm()
    }

    /// Sides of a loop, cut at their crossings with the line; corners close to it are moved onto it.
    fn pieces(&self, sides: &[Side]) -> Vec<Piece> {
        let [low, high] = self.surface.domain()[self.axis];
        let moved = |uv: Vec2| {
            let near = (uv[self.axis] - self.at).abs() <= ON_LINE_TOLERANCE_REL * (high - low);
            if near && self.distance(uv) <= self.tolerance { self.onto(uv) } else { uv }
        };
        let snapped = sides.iter().map(|s| {
            let path = s.path.with_start(moved(s.start())).with_end(moved(s.end()));
            Side { path, ..s.clone() }
        });
        snapped.flat_map(|side| self.cut(side)).map(|side| self.assigned(side)).collect()
    }

    /// Cuts a side at its crossings with the line.
    fn cut(&self, side: Side) -> Vec<Side> {
        let off = |t: f64| side.path.point(t)[self.axis] - self.at;
        let [low, high] = side.path.domain();
        let count = count(&side);
        let mut cuts = Vec::new();
        let mut before: Option<(f64, bool)> = None;
        for k in 0..=count {
            let t = low + (high - low) * k as f64 / count as f64;
            let end = [(0, side.start()), (count, side.end())].into_iter().find(|e| e.0 == k);
            let value = end.map_or_else(|| off(t), |e| e.1[self.axis] - self.at);
            if value == 0.0 {
                continue;
            }
            if let Some((from, above)) = before.filter(|b| b.1 != (value > 0.0)) {
                cuts.push(crossing(|t| (off(t) > 0.0) == above, from, t));
            }
            before = Some((t, value > 0.0));
        }
        cuts.retain(|t| *t > low && *t < high);
        if cuts.is_empty() {
            return vec![side];
        }
        self.cut_at(&side, &cuts).unwrap_or_else(|| vec![side])
    }

    /// Cuts a side at the parameters `cuts`, its crossings with the line.
    fn cut_at(&self, side: &Side, cuts: &[f64]) -> Option<Vec<Side>> {
        let [low, high] = side.path.domain();
        let bounds = [&[low], cuts, &[high]].concat();
        let mut out = Vec::with_capacity(bounds.len() - 1);
        for (k, w) in bounds.windows(2).enumerate() {
            let mut path = side.path.trimmed(w[0], w[1]).ok()?;
            if k > 0 {
                path = path.with_start(self.onto(path.points()[0]));
            }
            if k + 1 < bounds.len() - 1 {
                path = path.with_end(self.onto(path.points()[path.points().len() - 1]));
            }
            let [a, b] = [path.points()[0], path.points()[path.points().len() - 1]];
            let curve = side.curve.as_ref().and_then(|c| {
                let [a, b] = [a, b].map(|uv| c.closest(&self.surface.point(uv)).0);
                c.trimmed(a, b).ok()
            });
            out.push(Side { path, curve, edge_id: None });
        }
        Some(out)
    }

    /// Assigns a side to its half. A side along the line is made straight and belongs to the half on its left.
    fn assigned(&self, side: Side) -> Piece {
        let off = |uv: &Vec2| uv[self.axis] - self.at;
        let inner = samples(&side).skip(1);
        let widest = inner.max_by(|a, b| off(a).abs().total_cmp(&off(b).abs()));
        let widest = widest.unwrap_or_else(|| side.end());
        let ends = [side.start(), side.end()];
        let along = ends.iter().all(|uv| off(uv) == 0.0) && self.distance(widest) <= self.tolerance;
        if !along || (ends[1] - ends[0]).norm() == 0.0 {
            let upper = off(&widest) > 0.0;
            return (side, upper);
        }
        let forward = ends[1][1 - self.axis] > ends[0][1 - self.axis];
        // Left of +v is -u, left of +u is +v.
        let upper = forward == (self.axis == 1);
        (Side { path: kanagata_geometry::nurbs::Curve2::line(ends[0], ends[1]), ..side }, upper)
    }

    /// Faces of one half, and the ranges of the free parameter in which the line closes them.
    fn half(&self, loops: &[Vec<Piece>], upper: bool) -> Option<(Vec<Loops>, Vec<[f64; 2]>)> {
        let (mut closed, mut chains) = (Vec::new(), Vec::new());
        for pieces in loops {
            let sides = |pieces: &[Piece]| pieces.iter().map(|p| p.0.clone()).collect();
            match pieces.iter().position(|p| p.1 != upper) {
                None => closed.push(sides(pieces)),
                Some(k) => {
                    let rotated = [&pieces[k..], &pieces[..k]].concat();
                    let runs = rotated.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1 == upper);
                    chains.extend(runs.map(|run| -> Vec<Side> { sides(run) }));
                }
            }
        }
        let (next, inside) = self.successors(&chains, upper)?;
        let mut done = vec![false; chains.len()];
        for first in 0..chains.len() {
            let (mut k, mut ring) = (first, Vec::new());
            while !std::mem::replace(&mut done[k], true) {
                self.append(&mut ring, &chains[k]);
                k = next[k];
            }
            if let Some(start) = ring.first().cloned() {
                self.append(&mut ring, &[start]);
                ring.pop();
                closed.push(ring);
            }
        }
        Some((faces(closed)?, inside))
    }

    /// For each chain its successor along the line, with the face on the left, and the ranges between them.
    fn successors(&self, chains: &[Vec<Side>], upper: bool) -> Option<(Vec<usize>, Vec<[f64; 2]>)> {
        // Left of +v is -u, left of +u is +v.
        let sign = if upper == (self.axis == 0) { -1.0 } else { 1.0 };
        let mut ends: Vec<(f64, bool, usize)> = Vec::with_capacity(2 * chains.len());
        for (k, chain) in chains.iter().enumerate() {
            for (uv, starts) in [(chain.first()?.start(), true), (chain.last()?.end(), false)] {
                if uv[self.axis] != self.at {
                    return None;
                }
                ends.push((sign * uv[1 - self.axis], starts, k));
            }
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut next = vec![0; chains.len()];
        let mut inside = Vec::new();
        for pair in ends.chunks(2) {
            let [(from, false, end), (to, true, start)] = *pair else { return None };
            next[end] = start;
            let [low, high] = [sign * from, sign * to];
            if from < to {
                inside.push([low.min(high), low.max(high)]);
            }
        }
        Some((next, inside))
    }

    /// Appends sides to a loop, connected along the line where their ends differ.
    fn append(&self, ring: &mut Vec<Side>, sides: &[Side]) {
        if let (Some(last), Some(first)) = (ring.last_mut(), sides.first()) {
            let (from, to) = (last.end(), first.start());
            if (self.surface.point(from) - self.surface.point(to)).norm() <= self.tolerance {
                last.path = last.path.with_end(to);
            } else {
                ring.push(Side::straight(from, to));
            }
        }
        ring.extend(sides.iter().cloned());
    }
}

/// Parameter at which a predicate changes from true to false, by bisection.
fn crossing(test: impl Fn(f64) -> bool, mut from: f64, mut to: f64) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (from + to);
        if test(middle) {
            from = middle;
        } else {
            to = middle;
        }
    }
    to
}

/// Groups loops to faces: each outer loop with the holes inside it.
pub(crate) fn faces(loops: Vec<Vec<Side>>) -> Option<Vec<Loops>> {
    let (outer, holes): (Vec<_>, Vec<_>) = loops.into_iter().partition(|l| signed_area(l) > 0.0);
    let mut faces: Vec<Loops> = outer.into_iter().map(|l| vec![l]).collect();
    for hole in holes {
        let start = hole.first()?.start();
        let around =
            if faces.len() == 1 { 0 } else { faces.iter().position(|f| encloses(&f[0], start))? };
        faces.get_mut(around)?.push(hole);
    }
    Some(faces)
}

/// True when a loop encloses the point `p`, which is not on it.
fn encloses(sides: &[Side], p: Vec2) -> bool {
    let ring: Vec<Vec2> = sides.iter().flat_map(|s| samples(s).skip(1)).collect();
    let mut inside = false;
    for (k, b) in ring.iter().enumerate() {
        let a = ring[(k + ring.len() - 1) % ring.len()];
        if (a.y > p.y) != (b.y > p.y) {
            inside ^= p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y);
        }
    }
    inside
}

fn count(side: &Side) -> usize {
    let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
    8 * spans.max(2)
}

/// Points along a side, including both ends.
fn samples(side: &Side) -> impl Iterator<Item = Vec2> + '_ {
    let [low, high] = side.path.domain();
    let count = count(side);
    (0..=count).map(move |k| side.path.point(low + (high - low) * k as f64 / count as f64))
}
