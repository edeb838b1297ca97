//! A face cut along a curve in plan: its loops are cut where they cross the curve, and closed along it.

use super::cells::{CertainPoint, certain_points};
use super::plan::PlanCurve;
use super::trace::{End, Node, Tracer};
use crate::cad::creases::nested_faces;
use crate::cad::loops::{Side, signed_area};
use crate::cad::model::Face;
use crate::cad::trim_region::TrimRegion;
use crate::geometry::{Vec2, Vec3};

/// Points of a grid over a face, each way, from which points above the curve are searched.
const GRID: usize = 16;
/// Points of the plan curve above which the face may have a closed cut.
const SEEDS: usize = 48;
/// Crossings of a side searched for at most.
const SIDE_INTERVALS_MAX: usize = 20_000;
/// Bisections that locate a crossing.
const BISECTIONS: usize = 60;

/// Loops of a face, the outer one first.
type Loops = Vec<Vec<Side>>;

/// A face and the curve.
pub(super) struct Cut<'a> {
    pub face: &'a Face,
    pub curve: &'a PlanCurve,
    /// Distance below which points coincide [mm].
    pub tolerance: f64,
}

/// Result of a cut.
#[derive(Debug)]
pub(super) enum FaceCut {
    /// The curve does not cross the face, which is inside (true) or outside.
    Whole(bool),
    /// Loops of the faces inside and outside, at least one each.
    Parts { inside: Vec<Loops>, outside: Vec<Loops> },
}

/// Sides in a row on one side of the curve.
struct Chain {
    sides: Vec<Side>,
    inside: bool,
    /// The chain that follows in its loop.
    next: usize,
}

impl Cut<'_> {
    /// Cuts the face with these loops.
    ///
    /// # Errors
    /// The reason why the face cannot be cut.
    pub(super) fn cut(&self, loops: &[Vec<Side>]) -> Result<FaceCut, String> {
        let bounds = self.face.bbox();
        let around = self.curve.bounds();
        let apart = |k: usize| bounds.max[k] < around.min[k] || bounds.min[k] > around.max[k];
        if bounds.is_empty() || apart(0) || apart(1) {
            return Ok(FaceCut::Whole(false));
        }
        let region = TrimRegion::new(self.face);
        let tracer = Tracer {
            surface: &self.face.surface,
            region: &region,
            curve: self.curve,
            tolerance: self.tolerance,
            size: bounds.diagonal(),
        };
        let certain = certain_points(self.face, &region, self.curve, self.tolerance);
        let middle = certain.points.first().ok_or("it runs along the curve")?.inside;
        if certain.complete && certain.points.iter().all(|c| c.inside == middle) {
            return Ok(FaceCut::Whole(middle));
        }
        let grid = self.grid(&region);
        let middle = self.deepest(&grid, loops);
        let (mut whole, mut chains) = (Vec::new(), Vec::new());
        for sides in loops {
            let mut pieces = Vec::new();
            for side in sides {
                pieces.extend(self.pieces(side)?);
            }
            self.sort(pieces, middle, &mut whole, &mut chains);
        }
        let mut halves = [Vec::new(), Vec::new()];
        for (sides, inside) in whole {
            halves[usize::from(inside)].push(sides);
        }
        let mut paths = self.close(&chains, &tracer, &mut halves)?;
        self.add_closed(&tracer, &grid, &mut paths, &mut halves)?;
        let [outside, inside] = halves;
        if paths.is_empty() {
            self.check_whole(&certain.points, middle)?;
            return Ok(FaceCut::Whole(middle));
        }
        let nest = |loops: Vec<Vec<Side>>| {
            let faces = nested_faces(loops).filter(|faces| !faces.is_empty());
            faces.ok_or_else(|| "its parts have no outer loop".to_owned())
        };
        let (inside, outside) = (nest(inside)?, nest(outside)?);
        self.check_parts(&certain.points, &inside, &outside)?;
        Ok(FaceCut::Parts { inside, outside })
    }

    fn point(&self, uv: Vec2) -> Vec3 {
        self.face.surface.point(uv)
    }

    /// Distance of a point of the surface from the curve in plan [mm], positive inside.
    fn signed(&self, uv: Vec2) -> f64 {
        self.curve.near(self.point(uv).xy()).signed
    }

    /// Points of a grid inside the face, with their distances from the curve.
    fn grid(&self, region: &TrimRegion) -> Vec<(Vec2, f64)> {
        let at = |i: usize, j: usize| {
            let step = |k: usize| (k as f64 + 0.5) / GRID as f64;
            let size = region.high - region.low;
            region.low + Vec2::new(size.x * step(i), size.y * step(j))
        };
        let all = (0..GRID).flat_map(|i| (0..GRID).map(move |j| (i, j)));
        let inside = all.map(|(i, j)| at(i, j)).filter(|uv| region.contains(*uv));
        inside.map(|uv| (uv, self.signed(uv))).collect()
    }

    /// Whether the point of the face farthest from the curve is inside.
    fn deepest(&self, grid: &[(Vec2, f64)], loops: &[Vec<Side>]) -> bool {
        let ends = loops.iter().flatten().map(|side| (side.start(), self.signed(side.start())));
        let all = grid.iter().copied().chain(ends);
        all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).is_some_and(|(_, signed)| signed > 0.0)
    }

    /// A side cut at its crossings with the curve, each piece with its place: inside, outside or along the curve.
    fn pieces(&self, side: &Side) -> Result<Vec<(Side, Option<bool>)>, String> {
        let [low, high] = side.path.domain();
        let at = |t: f64| self.point(side.path.point(t));
        let signed = |t: f64| self.curve.near(at(t).xy()).signed;
        let snap = 2.0 * self.tolerance;
        let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let n = 8 * spans.max(2);
        if (0..=32).all(|k| signed(low + (high - low) * f64::from(k) / 32.0).abs() <= snap) {
            return Ok(vec![(side.clone(), None)]);
        }
        let first: Vec<f64> = (0..=n).map(|k| low + (high - low) * k as f64 / n as f64).collect();
        let mut open: Vec<[f64; 2]> = first.windows(2).rev().map(|w| [w[0], w[1]]).collect();
        let mut before: Option<(f64, f64)> = None;
        let (mut cuts, mut done) = (Vec::new(), 0);
        while let Some([a, b]) = open.pop() {
            done += 1;
            if done > SIDE_INTERVALS_MAX {
                return Err("a side of it runs along the curve or crosses it too often".into());
            }
            let (fa, fb) = (signed(a), signed(b));
            let middle = 0.5 * (a + b);
            // The distance changes by at most the length: a short interval has no further crossing.
            let length = 1.2 * ((at(middle) - at(a)).norm() + (at(b) - at(middle)).norm());
            let is_short = length <= fa.abs() + fb.abs() + 2.0 * snap;
            if !is_short && middle > a && middle < b {
                open.extend([[middle, b], [a, middle]]);
                continue;
            }
            for (t, f) in [(a, fa), (b, fb)].into_iter().filter(|(_, f)| f.abs() > snap) {
                if let Some((from, _)) = before.filter(|(_, g)| (*g > 0.0) != (f > 0.0)) {
                    cuts.push(root(&signed, from, t));
                }
                before = Some((t, f));
            }
        }
        let near = |t: &f64, end: f64| (at(*t) - at(end)).norm() <= snap;
        cuts.retain(|t| !near(t, low) && !near(t, high));
        cuts.dedup_by(|b, a| (at(*b) - at(*a)).norm() <= snap);
        let placed = |piece: Side| {
            let place = self.place(&piece);
            (piece, place)
        };
        Ok(self.cut_at(side, &cuts).into_iter().map(placed).collect())
    }

    fn cut_at(&self, side: &Side, cuts: &[f64]) -> Vec<Side> {
        let [low, high] = side.path.domain();
        if cuts.is_empty() {
            return vec![side.clone()];
        }
        let bounds = [&[low], cuts, &[high]].concat();
        let part = |w: &[f64]| {
            let path = side.path.trimmed(w[0], w[1]).ok()?;
            let ends = [path.points()[0], path.points()[path.points().len() - 1]];
            let curve = side.curve.as_ref().and_then(|c| {
                let [a, b] = ends.map(|uv| c.closest(&self.point(uv)).0);
                c.trimmed(a, b).ok()
            });
            Some(Side { path, curve, edge_id: None })
        };
        bounds.windows(2).filter_map(part).collect()
    }

    /// Whether a side is inside, by its point farthest from the curve; `None` along the curve.
    fn place(&self, side: &Side) -> Option<bool> {
        const SAMPLES: u32 = 16;
        let [low, high] = side.path.domain();
        let at = |k: u32| low + (high - low) * f64::from(k) / f64::from(SAMPLES);
        let all = (0..=SAMPLES).map(|k| self.signed(side.path.point(at(k))));
        let widest = all.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        (widest.abs() > 2.0 * self.tolerance).then_some(widest > 0.0)
    }

    /// Sorts the pieces of a loop to loops on one side of the curve, and chains of loops that cross it.
    fn sort(
        &self,
        pieces: Vec<(Side, Option<bool>)>,
        middle: bool,
        whole: &mut Vec<(Vec<Side>, bool)>,
        chains: &mut Vec<Chain>,
    ) {
        let known = pieces.iter().find_map(|p| p.1).unwrap_or(middle);
        let last_known = pieces.iter().rev().find_map(|p| p.1).unwrap_or(known);
        let mut place = last_known;
        let placed: Vec<(Side, bool)> = pieces
            .into_iter()
            .map(|(side, own)| {
                place = own.unwrap_or(place);
                (side, place)
            })
            .collect();
        let change = (0..placed.len())
            .find(|&k| placed[k].1 != placed[(k + placed.len() - 1) % placed.len()].1);
        let Some(first) = change else {
            whole.push((placed.into_iter().map(|p| p.0).collect(), known));
            return;
        };
        let rotated = [&placed[first..], &placed[..first]].concat();
        let from = chains.len();
        for run in rotated.chunk_by(|a, b| a.1 == b.1) {
            let sides = run.iter().map(|p| p.0.clone()).collect();
            chains.push(Chain { sides, inside: run[0].1, next: chains.len() + 1 });
        }
        if let Some(last) = chains.last_mut() {
            last.next = from;
        }
    }

    /// Closes the chains of both halves along the curve; returns the curves on the face.
    fn close(
        &self,
        chains: &[Chain],
        tracer: &Tracer<'_>,
        halves: &mut [Vec<Vec<Side>>; 2],
    ) -> Result<Vec<Vec<Node>>, String> {
        let of = |inside: bool| (0..chains.len()).filter(move |&k| chains[k].inside == inside);
        let start = |k: usize| chains[k].sides.first().map_or_else(Vec2::zeros, Side::start);
        let end = |k: usize| chains[k].sides.last().map_or_else(Vec2::zeros, Side::end);
        let within: Vec<usize> = of(true).collect();
        // Where chains inside begin, chains outside end.
        let node = |uv: Vec2| {
            let near = self.curve.near(self.point(uv).xy());
            Node { uv, piece: near.piece, t: near.t, kink: false }
        };
        let entries: Vec<Node> = within.iter().map(|&k| node(start(k))).collect();
        let mut next = vec![usize::MAX; chains.len()];
        let mut joints: Vec<Vec<Side>> = vec![Vec::new(); chains.len()];
        let mut paths = Vec::new();
        for &k in &within {
            let (nodes, reached) = tracer.trace(node(end(k)), &entries, false)?;
            let End::At(entry) = reached else { return Err("a cut that does not end".into()) };
            let to = within[entry];
            if next.contains(&to) {
                return Err("two cuts end at one crossing of its border".into());
            }
            let sides = tracer.sides(&nodes);
            // The chain outside that ends at the entry continues backwards to where this chain inside ended.
            let then = chains[k].next;
            let Some(from) = (0..chains.len()).find(|&o| chains[o].next == to) else {
                return Err("a crossing of its border without continuation".into());
            };
            joints[from] = sides.iter().rev().map(Side::reversed).collect();
            next[from] = then;
            joints[k] = sides;
            next[k] = to;
            paths.push(nodes);
        }
        let mut done = vec![false; chains.len()];
        for first in 0..chains.len() {
            let (mut k, mut ring) = (first, Vec::new());
            while done.get(k) == Some(&false) {
                done[k] = true;
                ring.extend(chains[k].sides.iter().chain(&joints[k]).cloned());
                k = next[k];
            }
            if k == usize::MAX {
                return Err("a crossing of its border without continuation".into());
            }
            if !ring.is_empty() {
                halves[usize::from(chains[first].inside)].push(ring);
            }
        }
        Ok(paths)
    }

    /// Adds cuts that do not meet the border of the face: closed curves above the plan curve.
    fn add_closed(
        &self,
        tracer: &Tracer<'_>,
        grid: &[(Vec2, f64)],
        paths: &mut Vec<Vec<Node>>,
        halves: &mut [Vec<Vec<Side>>; 2],
    ) -> Result<(), String> {
        for seed in self.seeds(tracer, grid) {
            if paths.iter().any(|nodes| tracer.passes(nodes, &seed)) {
                continue;
            }
            let (nodes, reached) = tracer.trace(seed, &[], true)?;
            let End::Closed = reached else { return Err("a cut that does not close".into()) };
            let sides = tracer.sides(&nodes);
            let reversed: Vec<Side> = sides.iter().rev().map(Side::reversed).collect();
            if signed_area(&sides) == 0.0 {
                return Err("a closed cut without area".into());
            }
            halves[1].push(sides);
            halves[0].push(reversed);
            paths.push(nodes);
        }
        Ok(())
    }

    /// Points of the face above the plan curve, away from the border.
    fn seeds(&self, tracer: &Tracer<'_>, grid: &[(Vec2, f64)]) -> Vec<Node> {
        let pieces = self.curve.pieces();
        let each = (SEEDS / pieces.len()).max(2);
        let stride = (pieces.len() / SEEDS).max(1);
        let plan: Vec<(Vec2, Vec2)> =
            grid.iter().map(|(uv, _)| (*uv, self.point(*uv).xy())).collect();
        let mut found = Vec::new();
        for (piece, c) in pieces.iter().enumerate().step_by(stride) {
            let [low, high] = c.domain();
            for k in 0..each {
                let t = low + (high - low) * (k as f64 + 0.5) / each as f64;
                let p = c.point(t);
                let distance = |a: &Vec2| (a - p).norm_squared();
                let near = plan.iter().min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
                let node = near.and_then(|(uv, _)| tracer.above(*uv, piece, t));
                found.extend(node.filter(|node| self.is_well_inside(tracer, node.uv)));
            }
        }
        found
    }

    /// Whether a point is inside the face with some distance from its border.
    fn is_well_inside(&self, tracer: &Tracer<'_>, uv: Vec2) -> bool {
        let d = self.face.surface.derivs(uv);
        let by = |n: f64| 8.0 * self.tolerance / n.max(f64::MIN_POSITIVE);
        let (du, dv) = (Vec2::new(by(d.su.norm()), 0.0), Vec2::new(0.0, by(d.sv.norm())));
        [uv, uv + du, uv - du, uv + dv, uv - dv].iter().all(|p| tracer.region.contains(*p))
    }

    /// Checks that every certain point is on one side.
    fn check_whole(&self, points: &[CertainPoint], inside: bool) -> Result<(), String> {
        let other = points.iter().find(|c| c.inside != inside);
        other.map_or(Ok(()), |c| Err(self.incomplete(c.uv)))
    }

    /// Checks that every certain point is in one part, and on its side.
    fn check_parts(
        &self,
        points: &[CertainPoint],
        inside: &[Loops],
        outside: &[Loops],
    ) -> Result<(), String> {
        let regions = |faces: &[Loops]| -> Vec<TrimRegion> {
            faces.iter().map(|loops| region_of(self.face, loops)).collect()
        };
        let (inside, outside) = (regions(inside), regions(outside));
        let held = |regions: &[TrimRegion], uv| regions.iter().filter(|r| r.contains(uv)).count();
        for c in points {
            let counts = [held(&inside, c.uv), held(&outside, c.uv)];
            if counts != [usize::from(c.inside), usize::from(!c.inside)] {
                return Err(self.incomplete(c.uv));
            }
        }
        Ok(())
    }

    fn incomplete(&self, uv: Vec2) -> String {
        let p = self.point(uv);
        format!("the search for cuts is incomplete near ({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z)
    }
}

/// The region of the face with other loops.
fn region_of(face: &Face, loops: &Loops) -> TrimRegion {
    use crate::cad::model::{EdgeUse, TrimLoop};
    let used = |side: &Side| EdgeUse { pcurve: side.path.clone(), edge: None, reversed: false };
    let trims = loops.iter().map(|l| TrimLoop { uses: l.iter().map(used).collect() });
    TrimRegion::new(&Face { loops: trims.collect(), ..face.clone() })
}

/// Parameter at which a function changes its sign between `from` and `to`.
fn root(f: &impl Fn(f64) -> f64, mut from: f64, mut to: f64) -> f64 {
    let positive = f(from) > 0.0;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (from + to);
        if (f(middle) > 0.0) == positive {
            from = middle;
        } else {
            to = middle;
        }
    }
    0.5 * (from + to)
}
