//! A face cut along a curve in plan: its loops are cut where they cross the curve, and closed along it.

use super::cells::{CertainPoint, certain_points};
use super::plan::PlanCurve;
use super::trace::{End, Node, Tracer};
use crate::creases::nested_faces;
use crate::loops::{Side, signed_area};
use crate::model::Face;
use crate::trim_region::TrimRegion;
use kanagata_geometry::{Vec2, Vec3};

/// Points of a grid over a face, each way, from which points above the curve are searched.
const GRID: usize = 16;
/// Points of the plan curve above which the face may have a closed cut.
const SEEDS: usize = 48;

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

/// What continues a chain along the curve.
#[derive(Clone)]
struct Joint {
    sides: Vec<Side>,
    /// The chain at its end.
    next: usize,
}

/// Reason for a chain without a joint.
const NO_CONTINUATION: &str = "a crossing of its border without continuation";

impl Cut<'_> {
    /// Cuts the face with these loops.
    ///
    /// # Errors
    /// The reason why the face cannot be cut.
    pub(super) fn cut(&self, loops: &[Vec<Side>]) -> Result<FaceCut, String> {
        if self.is_apart() {
            return Ok(FaceCut::Whole(false));
        }
        let region = TrimRegion::new(self.face);
        let certain = certain_points(self.face, &region, self.curve, self.tolerance);
        let middle = certain.points.first().ok_or("it runs along the curve")?.inside;
        if certain.complete && certain.points.iter().all(|c| c.inside == middle) {
            return Ok(FaceCut::Whole(middle));
        }
        let tracer = self.tracer(&region);
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

    /// True when the boxes of face and curve do not meet in plan.
    fn is_apart(&self) -> bool {
        let (bounds, around) = (self.face.bbox(), self.curve.bounds());
        let apart = |k: usize| bounds.max[k] < around.min[k] || bounds.min[k] > around.max[k];
        bounds.is_empty() || apart(0) || apart(1)
    }

    fn tracer<'r>(&'r self, region: &'r TrimRegion) -> Tracer<'r> {
        Tracer {
            surface: &self.face.surface,
            region,
            curve: self.curve,
            tolerance: self.tolerance,
            size: self.face.bbox().diagonal(),
        }
    }

    pub(super) fn point(&self, uv: Vec2) -> Vec3 {
        self.face.surface.point(uv)
    }

    /// Distance of a point of the surface from the curve in plan [mm], positive inside.
    pub(super) fn signed(&self, uv: Vec2) -> f64 {
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
        let start = |k: usize| chains[k].sides.first().map_or_else(Vec2::zeros, Side::start);
        let end = |k: usize| chains[k].sides.last().map_or_else(Vec2::zeros, Side::end);
        let within: Vec<usize> = (0..chains.len()).filter(|&k| chains[k].inside).collect();
        // Where chains inside begin, chains outside end.
        let node = |uv: Vec2| {
            let near = self.curve.near(self.point(uv).xy());
            Node { uv, piece: near.piece, t: near.t, kink: false }
        };
        let entries: Vec<Node> = within.iter().map(|&k| node(start(k))).collect();
        let mut joints = vec![Joint { sides: Vec::new(), next: usize::MAX }; chains.len()];
        let mut paths = Vec::new();
        for &k in &within {
            let (nodes, reached) = tracer.trace(node(end(k)), &entries, false)?;
            let End::At(entry) = reached else { return Err("a cut that does not end".into()) };
            let to = within[entry];
            if joints.iter().any(|joint| joint.next == to) {
                return Err("two cuts end at one crossing of its border".into());
            }
            let sides = tracer.sides(&nodes);
            // The chain outside that ends at the entry continues backwards to where this chain inside ended.
            let from = (0..chains.len()).find(|&o| chains[o].next == to).ok_or(NO_CONTINUATION)?;
            let back = sides.iter().rev().map(Side::reversed).collect();
            joints[from] = Joint { sides: back, next: chains[k].next };
            joints[k] = Joint { sides, next: to };
            paths.push(nodes);
        }
        add_rings(chains, &joints, halves)?;
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

/// Adds the closed loops of chains and joints to their halves.
fn add_rings(
    chains: &[Chain],
    joints: &[Joint],
    halves: &mut [Vec<Vec<Side>>; 2],
) -> Result<(), String> {
    let mut done = vec![false; chains.len()];
    for first in 0..chains.len() {
        let (mut k, mut ring) = (first, Vec::new());
        while done.get(k) == Some(&false) {
            done[k] = true;
            ring.extend(chains[k].sides.iter().chain(&joints[k].sides).cloned());
            k = joints[k].next;
        }
        if k == usize::MAX {
            return Err(NO_CONTINUATION.into());
        }
        if !ring.is_empty() {
            halves[usize::from(chains[first].inside)].push(ring);
        }
    }
    Ok(())
}

/// The region of the face with other loops.
fn region_of(face: &Face, loops: &Loops) -> TrimRegion {
    use crate::model::{EdgeUse, TrimLoop};
    let used = |side: &Side| EdgeUse { pcurve: side.path.clone(), edge: None, reversed: false };
    let trims = loops.iter().map(|l| TrimLoop { uses: l.iter().map(used).collect() });
    TrimRegion::new(&Face { loops: trims.collect(), ..face.clone() })
}
