//! Boundary loops in a surface's native parameters: taken from the file's parameter curves where these are
//! good, projected from the curves in space where not; closed across seams and poles.

use std::cell::LazyCell;

use super::native::Native;
use super::raw::{RawEdge, RawLoop, RawSurface};
use crate::geometry::nurbs::{Curve2, Curve3, CurveProjector};
use crate::geometry::{Vec2, Vec3};

/// Parameter curves are fitted to this share of their extent...
const FIT: f64 = 1e-10;
/// ...or of the curve's own distance from the surface, where that is larger.
const FIT_OF_GAP: f64 = 1e-2;
/// However far a curve lies off: never looser than this.
const LOOSEST_FIT: f64 = 1e-7;
/// A parameter curve that the file prefers stands for the curve in space up to this share of the face's size.
const PREFERRED: f64 = 1e-2;

/// Samples of each span of a curve that is projected.
const SAMPLES_A_SPAN: usize = 2;

/// One side of a loop: its curve in native parameters, in the loop's direction.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub path: Curve2,
    /// The file's curve in space, in the same direction.
    pub curve: Option<Curve3>,
    /// The file's own edge.
    pub edge_id: Option<usize>,
}

impl Side {
    pub fn start(&self) -> Vec2 {
        self.path.points()[0]
    }

    pub fn end(&self) -> Vec2 {
        self.path.points()[self.path.points().len() - 1]
    }

    fn straight(from: Vec2, to: Vec2) -> Self {
        Self { path: Curve2::line(from, to), curve: None, edge_id: None }
    }

    fn shifted(&self, by: Vec2) -> Self {
        Self {
            path: self.path.mapped(|p| p + by),
            curve: self.curve.clone(),
            edge_id: self.edge_id,
        }
    }

    pub fn reversed(&self) -> Self {
        Self {
            path: self.path.reversed(),
            curve: self.curve.as_ref().map(Curve3::reversed),
            edge_id: self.edge_id,
        }
    }
}

/// A loop whose sides join end to start; after one turn it has moved by `winding` periods.
#[derive(Debug, Clone)]
pub(super) struct Path {
    pub sides: Vec<Side>,
    pub winding: Vec2,
}

/// What could not be done well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LoopFault {
    /// Neighbouring edges do not meet: the gap in space [mm].
    Gap(f64),
    /// An edge without any curve.
    NoCurve,
}

/// Reads one loop. `size` is the extent of the face [mm], `tolerance` what counts as touching [mm].
pub(super) fn path_of(
    native: &Native<'_>,
    raw: &RawLoop,
    size: f64,
    tolerance: f64,
    faults: &mut Vec<LoopFault>,
) -> Option<Path> {
    let mut sides: Vec<Side> = Vec::with_capacity(raw.edges.len());
    // First side behind the last pole that the loop runs through.
    let mut behind_pole = None;
    let edges = cut_at_poles(native, &raw.edges, tolerance);
    for edge in &edges {
        let after = sides.last().map(Side::end).filter(|&uv| !is_pole(native, uv, tolerance));
        let Some(side) = side_of(native, edge, (size, tolerance), after) else {
            faults.push(LoopFault::NoCurve);
            continue;
        };
        let Some(end) = sides.last().map(Side::end) else {
            sides.push(side);
            continue;
        };
        let at_pole = is_pole(native, end, tolerance);
        let side = match collapsed_direction(native, end, tolerance).filter(|_| at_pole) {
            Some(k) => {
                let mut shift = whole_periods(native, end - side.start());
                shift[k] = 0.0;
                side.shifted(shift)
            }
            None => align(native, &side, end),
        };
        if at_pole && is_pole(native, side.start(), tolerance) {
            // A side in the plane even if it has no length yet: the turn about the pole is settled at the end.
            sides.push(Side::straight(end, side.start()));
            behind_pole = Some(sides.len());
            sides.push(side);
        } else {
            sides.extend(join(native, end, side, tolerance, faults));
        }
    }
    let (first, last) = (sides.first()?.start(), sides.last()?.end());
    let mut winding = whole_periods(native, last - first);
    let ends_at_pole = is_pole(native, first, tolerance) && is_pole(native, last, tolerance);
    if let Some(k) = behind_pole {
        // The way round the pole may be a whole turn off: it winds, or runs back on itself.
        let mut off = winding;
        if ends_at_pole {
            winding = Vec2::zeros();
            off = if runs_back_on_itself(&sides) { one_turn(native, last) } else { winding };
        }
        if off.norm() > 0.0 {
            let (before, after) = sides.split_at_mut(k);
            after.iter_mut().for_each(|s| *s = s.shifted(-off));
            before[k - 1] = Side::straight(before[k - 1].start(), before[k - 1].end() - off);
            winding = Vec2::zeros();
        }
    }
    let last = sides.last()?.end();
    let gap = last - first - winding;
    if gap.norm() > 0.0 {
        close(native, &mut sides, first + winding, tolerance, faults);
    }
    Some(Path { sides, winding })
}

/// The nearest whole number of periods to a difference of parameters.
pub(super) fn whole_periods(native: &Native<'_>, difference: Vec2) -> Vec2 {
    let mut out = Vec2::zeros();
    for (k, period) in native.periods().into_iter().enumerate() {
        if let Some(p) = period {
            out[k] = p * (difference[k] / p).round();
        }
    }
    out
}

/// The loop encloses nothing: both ways along a seam have the same parameters.
fn runs_back_on_itself(sides: &[Side]) -> bool {
    let extent = sides.iter().fold(0.0, |m: f64, s| m.max((s.end() - s.start()).norm()));
    signed_area(sides).abs() <= 1e-6 * extent * extent
}

/// One period along the direction in which a pole has no extent.
fn one_turn(native: &Native<'_>, pole: Vec2) -> Vec2 {
    let mut turn = Vec2::zeros();
    for (k, period) in native.periods().into_iter().enumerate() {
        let Some(p) = period else { continue };
        let mut other = pole;
        other[k] += 0.5 * p;
        let collapsed = (native.point(pole) - native.point(other)).norm();
        let mut across = pole;
        across[1 - k] += 0.1;
        let size = (native.point(pole) - native.point(across)).norm();
        if turn.norm() == 0.0 && collapsed <= 1e-6 * size.max(f64::MIN_POSITIVE) {
            turn[k] = p;
        }
    }
    turn
}

/// One point in space whatever the periodic parameter is.
fn is_pole(native: &Native<'_>, uv: Vec2, tolerance: f64) -> bool {
    collapsed_direction(native, uv, tolerance).is_some()
}

/// The periodic parameter that does not matter at a pole.
fn collapsed_direction(native: &Native<'_>, uv: Vec2, tolerance: f64) -> Option<usize> {
    (0..2).find(|&k| {
        native.periods()[k].is_some_and(|p| {
            let mut other = uv;
            other[k] += 0.5 * p;
            (native.point(uv) - native.point(other)).norm() <= tolerance
        })
    })
}

/// Edges that run through a pole of the surface are cut there: in the parameter plane they jump.
fn cut_at_poles(native: &Native<'_>, edges: &[RawEdge], tolerance: f64) -> Vec<RawEdge> {
    let poles = native.pole_points();
    let mut out = Vec::with_capacity(edges.len());
    for edge in edges {
        let cuts = edge.curve.as_ref().map_or_else(Vec::new, |c| inner_hits(c, &poles, tolerance));
        let Some(curve) = edge.curve.as_ref().filter(|_| !cuts.is_empty()) else {
            out.push(edge.clone());
            continue;
        };
        let [a, b] = curve.domain();
        let bounds = [vec![a], cuts, vec![b]].concat();
        let parts = bounds.windows(2).filter_map(|w| curve.trimmed(w[0], w[1]).ok());
        out.extend(parts.map(|part| RawEdge { curve: Some(part), ..RawEdge::default() }));
    }
    out
}

/// Parameters at which a curve runs through points other than its ends, rising.
fn inner_hits(curve: &Curve3, points: &[Vec3], tolerance: f64) -> Vec<f64> {
    let [a, b] = curve.domain();
    let (first, last) = (curve.point(a), curve.point(b));
    let far = |p: &&Vec3| (*p - first).norm().min((*p - last).norm()) > 10.0 * tolerance;
    let hit = |p: &Vec3| {
        let (t, d) = curve.closest(p);
        (d.sqrt() <= tolerance && t > a && t < b).then_some(t)
    };
    let mut cuts: Vec<f64> = points.iter().filter(far).filter_map(hit).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|x, y| *x - *y <= 1e-9 * (b - a));
    cuts
}

fn align(native: &Native<'_>, side: &Side, end: Vec2) -> Side {
    side.shifted(whole_periods(native, end - side.start()))
}

/// The side that goes on from `end`: snapped to it, or after a straight side that bridges a pole or a gap.
fn join(
    native: &Native<'_>,
    end: Vec2,
    side: Side,
    tolerance: f64,
    faults: &mut Vec<LoopFault>,
) -> Vec<Side> {
    let start = side.start();
    let gap = (native.point(end) - native.point(start)).norm();
    let middle = native.point(0.5 * (end + start));
    let bulge = (middle - native.point(start)).norm().max((middle - native.point(end)).norm());
    if gap <= tolerance && bulge <= 10.0 * tolerance {
        if (end - start).norm() > 1e-6 * (side.end() - start).norm() {
            // A pole: one point in space, a side in the plane.
            return vec![Side::straight(end, start), side];
        }
        return vec![Side { path: side.path.with_start(end), ..side }];
    }
    if gap > 10.0 * tolerance {
        faults.push(LoopFault::Gap(gap));
    }
    vec![Side::straight(end, start), side]
}

fn close(
    native: &Native<'_>,
    sides: &mut Vec<Side>,
    target: Vec2,
    tolerance: f64,
    faults: &mut Vec<LoopFault>,
) {
    let Some(last) = sides.last_mut() else { return };
    let end = last.end();
    let gap = (native.point(end) - native.point(target)).norm();
    let small = (end - target).norm() <= 1e-6 * (end - last.start()).norm();
    if gap <= tolerance && small {
        last.path = last.path.with_end(target);
        return;
    }
    if gap > 10.0 * tolerance {
        faults.push(LoopFault::Gap(gap));
    }
    sides.push(Side::straight(end, target));
}

/// `after` is where the side before it ends.
fn side_of(
    native: &Native<'_>,
    edge: &RawEdge,
    (size, tolerance): (f64, f64),
    after: Option<Vec2>,
) -> Option<Side> {
    let edge_id = edge.edge_id;
    let given = edge.pcurve.as_ref().map(|p| native.normalised(&p.clamped()));
    let Some(curve) = &edge.curve else {
        return given.map(|path| Side { path, curve: None, edge_id });
    };
    let project = |hint: Option<&Curve2>| {
        let path = projected(native, curve, Hints { path: hint, after }, size);
        Some(Side { path, curve: Some(curve.clone()), edge_id })
    };
    let Some(path) = given else { return project(None) };
    // As near as the file's own resolution (`tolerance` is twice that): its parameter curve is what it means.
    let fine = (0.5 * tolerance).max(1e-8 * size);
    let off = deviation(native, &path, curve, fine);
    let keep = off <= fine || (edge.prefer_pcurve && off <= tolerance.max(PREFERRED * size));
    if keep {
        return Some(Side { path, curve: (off <= tolerance).then(|| curve.clone()), edge_id });
    }
    // Good enough to say where, not good enough to stand for the curve.
    project((off <= 1e-2 * size).then_some(&path))
}

/// Largest distance between a parameter curve's image and its curve in space, ends against ends. Up to `fine` it is
/// only said to be no more.
fn deviation(native: &Native<'_>, path: &Curve2, curve: &Curve3, fine: f64) -> f64 {
    let ([a, b], [c, d]) = (path.domain(), curve.domain());
    let ends = (native.point(path.point(a)) - curve.point(c))
        .norm()
        .max((native.point(path.point(b)) - curve.point(d)).norm());
    let search = LazyCell::new(|| CurveProjector::new(curve));
    (1..8).fold(ends, |worst, k| {
        let share = f64::from(k) / 8.0;
        let p = native.point(path.point(a + (b - a) * share));
        let near = curve.closest_near(&p, c + (d - c) * share, fine * fine).1.sqrt();
        worst.max(if near <= fine { near } else { search.closest(&p).1.sqrt() })
    })
}

/// What is known of where a curve lies on a surface.
#[derive(Clone, Copy)]
struct Hints<'h> {
    /// A parameter curve not good enough to stand for it.
    path: Option<&'h Curve2>,
    /// Where the side before it ends.
    after: Option<Vec2>,
}

/// Parameter curve of a curve in space by projection.
fn projected(native: &Native<'_>, curve: &Curve3, hints: Hints, size: f64) -> Curve2 {
    if let RawSurface::Plane(frame) = native.raw() {
        // Exact: a projection along the normal is an affine map.
        let points = curve.points().iter().map(|p| frame.local(p).xy()).collect();
        let (knots, weights) = (curve.knots().to_vec(), curve.weights().to_vec());
        if let Ok(path) = Curve2::try_new(curve.degree(), knots, points, Some(weights)) {
            return path;
        }
    }
    let [a, b] = curve.domain();
    let spans = curve.knots().windows(2).filter(|w| w[0] < w[1]).count();
    let n = (SAMPLES_A_SPAN * spans).clamp(16, 400);
    let at = |k: usize| a + (b - a) * k as f64 / n as f64;
    let points: Vec<Vec3> = (0..=n).map(|k| curve.point(at(k))).collect();
    let feet = projected_samples(native, &points, hints, size);
    let samples = &feet;
    let gap = samples[1..n].iter().map(|s| s.miss).fold(0.0, f64::max);
    let allowed = (FIT_OF_GAP * gap).clamp(FIT * size, LOOSEST_FIT * size);
    if let Some(line) = along_one_parameter(native, samples, allowed) {
        return line;
    }
    // The cubic through the four samples about t.
    let near = |t: f64| {
        let x = ((t - a) / (b - a) * n as f64).clamp(0.0, n as f64);
        let k = (x as usize).clamp(1, n - 2) - 1;
        let x = x - k as f64;
        let shares = [
            (1.0 - x) * (2.0 - x) * (3.0 - x) / 6.0,
            x * (2.0 - x) * (3.0 - x) / 2.0,
            x * (x - 1.0) * (3.0 - x) / 2.0,
            x * (x - 1.0) * (x - 2.0) / 6.0,
        ];
        (0..4).map(|i| samples[k + i].uv * shares[i]).sum()
    };
    let first = samples[0].uv;
    let extent = samples.iter().fold(Vec2::zeros(), |m: Vec2, s| m.sup(&(s.uv - first).abs()));
    let extent = extent.norm().max(1e-12 * size);
    let mut breaks: Vec<f64> =
        curve.knots().iter().copied().filter(|t| *t >= a && *t <= b).collect();
    breaks.dedup();
    let reach = points.iter().map(|p| (p - points[0]).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let tolerance = (FIT_OF_GAP * gap / reach).clamp(FIT, LOOSEST_FIT) * extent;
    let f = |t: f64, about: Option<Vec2>| {
        // Ends keep the sample: at a pole the parameter comes from the neighbours.
        if t <= a {
            first
        } else if t >= b {
            samples[n].uv
        } else {
            native.inverse(&curve.point(t), Some(about.unwrap_or_else(|| near(t))))
        }
    };
    Curve2::fitted_near(f, &breaks, tolerance)
}

/// A point's parameters on a surface, the point there, and how far that is off [mm].
#[derive(Debug, Clone, Copy)]
struct Sample {
    uv: Vec2,
    foot: Vec3,
    miss: f64,
}

/// The straight line between the ends where one parameter of all samples is the same, to `allowed` [mm], and the other
/// runs one way.
fn along_one_parameter(native: &Native<'_>, samples: &[Sample], allowed: f64) -> Option<Curve2> {
    let (first, last) = (samples.first()?, samples.last()?);
    (0..2).find_map(|k| {
        let other = 1 - k;
        let rises = last.uv[other] > first.uv[other];
        let one_way = samples.windows(2).all(|w| (w[1].uv[other] > w[0].uv[other]) == rises);
        let scale = (last.uv[other] - first.uv[other]).abs();
        if !one_way || scale == 0.0 {
            return None;
        }
        let level = 0.5 * (first.uv[k] + last.uv[k]);
        let on_line = |s: &Sample| {
            let mut uv = s.uv;
            uv[k] = level;
            (native.point(uv) - s.foot).norm() <= allowed
        };
        let (mut start, mut end) = (first.uv, last.uv);
        (start[k], end[k]) = (level, level);
        samples.iter().all(on_line).then(|| Curve2::line(start, end))
    })
}

/// Feet of points of a curve, each searched from where its neighbours lead; where that foot is far, the whole
/// surface is searched, as long as this finds nearer ones.
fn projected_samples(native: &Native<'_>, points: &[Vec3], hints: Hints, size: f64) -> Vec<Sample> {
    let n = points.len() - 1;
    let sample = |k: usize, uv: Vec2| {
        let foot = native.point(uv);
        Sample { uv, foot, miss: (foot - points[k]).norm() }
    };
    let near = |k: usize, uv: Vec2| sample(k, native.inverse(&points[k], Some(uv)));
    let fine = 1e-6 * size;
    let after = hints.after.filter(|&uv| native.searches() && native.regular(uv));
    let after = after.map(|uv| near(0, uv)).filter(|s| s.miss <= fine);
    // From the middle outwards where nothing is known of the start: an end may be a pole, where one parameter is
    // anybody's.
    let begin = if after.is_some() { 0 } else { n / 2 };
    let from_path = hints.path.map(|h| {
        let [c, d] = h.domain();
        near(begin, h.point(c + (d - c) * begin as f64 / n as f64))
    });
    let first = after.or(from_path.filter(|s| s.miss <= fine)).unwrap_or_else(|| {
        let global = sample(begin, native.inverse(&points[begin], None));
        match from_path {
            Some(s) if s.miss <= 2.0 * global.miss => s,
            Some(s) => sample(begin, native.equivalent_near(global.uv, s.uv)),
            None => global,
        }
    });
    let mut samples = vec![first; n + 1];
    let step = (points[begin + 1] - points[begin]).norm();
    let mut allowed = (3.0 * first.miss).max(1e-3 * step);
    let mut searches = 4;
    for k in (0..begin).rev().chain(begin + 1..=n) {
        let expected = extrapolate(&samples, k, if k < begin { 1 } else { -1 }, begin);
        let mut found = near(k, expected);
        if found.miss > allowed && searches > 0 {
            searches -= 1;
            let other = native.inverse(&points[k], None);
            let other = sample(k, native.equivalent_near(other, expected));
            if other.miss < 0.5 * found.miss {
                found = other;
            }
            allowed = allowed.max(2.0 * found.miss);
        }
        samples[k] = found;
    }
    samples
}

/// Where the next sample is expected, from its two neighbours on the side already known, which begins at `begin`.
fn extrapolate(samples: &[Sample], k: usize, towards: isize, begin: usize) -> Vec2 {
    let one = k.wrapping_add_signed(towards);
    if one == begin {
        return samples[one].uv;
    }
    let two = one.wrapping_add_signed(towards);
    2.0 * samples[one].uv - samples[two].uv
}

/// Twice the signed area that a loop encloses in the parameter plane.
pub(super) fn signed_area(sides: &[Side]) -> f64 {
    let mut sum = 0.0;
    for side in sides {
        let [a, b] = side.path.domain();
        let spans = side.path.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let n = 8 * spans;
        let mut last = side.start();
        for k in 1..=n {
            let next = side.path.point(a + (b - a) * k as f64 / n as f64);
            sum += last.x * next.y - last.y * next.x;
            last = next;
        }
    }
    // The way back to the start, for loops that are not closed yet.
    if let (Some(first), Some(last)) = (sides.first(), sides.last()) {
        let (start, end) = (first.start(), last.end());
        sum += end.x * start.y - end.y * start.x;
    }
    sum
}

/// Loops of a face that close in the parameter plane: windings are cut open along a seam and joined in pairs
/// or through a pole; a face without loops gets the border of its natural range. The outer one comes first.
pub(super) fn closed_loops(
    native: &Native<'_>,
    paths: Vec<Path>,
    left_is_inside: bool,
) -> Option<Vec<Vec<Side>>> {
    let (mut winding, plain): (Vec<Path>, Vec<Path>) =
        paths.into_iter().partition(|p| p.winding.norm() > 0.0);
    let mut loops: Vec<Vec<Side>> = plain.into_iter().map(|p| p.sides).collect();
    while let Some(first) = winding.pop() {
        let partner = winding.iter().position(|p| (p.winding + first.winding).norm() < 1e-9);
        loops.push(match partner {
            Some(k) => bridge(native, first, winding.swap_remove(k)),
            None => through_pole(native, first, left_is_inside)?,
        });
    }
    if loops.is_empty() {
        loops.push(natural_border(native)?);
    }
    sort_and_orient(native, &mut loops);
    Some(loops)
}

/// Two windings of opposite sense become one loop with a seam there and back.
fn bridge(native: &Native<'_>, first: Path, second: Path) -> Vec<Side> {
    let (Some(end), Some(start)) = (first.sides.last(), second.sides.first()) else {
        return first.sides;
    };
    let shift = whole_periods(native, end.end() - start.start());
    let second: Vec<Side> = second.sides.iter().map(|s| s.shifted(shift)).collect();
    let there = Side::straight(end.end(), second[0].start());
    let back = Side::straight(second[second.len() - 1].end(), first.sides[0].start());
    let mut sides = first.sides;
    sides.push(there);
    sides.extend(second);
    sides.push(back);
    sides
}

/// A single winding is closed through the pole on its inner side.
fn through_pole(native: &Native<'_>, path: Path, left_is_inside: bool) -> Option<Vec<Side>> {
    let around = usize::from(path.winding.x == 0.0);
    let across = 1 - around;
    let level = path.sides.first()?.start()[across];
    let poles: Vec<f64> =
        native.poles().into_iter().filter(|p| p.0 == across).map(|p| p.1).collect();
    // Left of a side that runs along +u is +v; left of one that runs along +v is -u.
    let mut up = path.winding[around] > 0.0;
    if across == 0 {
        up = !up;
    }
    if !left_is_inside {
        up = !up;
    }
    let beyond = |p: &&f64| if up { **p > level } else { **p < level };
    let nearest = |a: &&f64, b: &&f64| (*a - level).abs().total_cmp(&(*b - level).abs());
    let pole = poles.iter().filter(beyond).min_by(nearest).or(poles.iter().min_by(nearest))?;
    let (end, start) = (path.sides.last()?.end(), path.sides.first()?.start());
    let at = |uv: Vec2| {
        let mut out = uv;
        out[across] = *pole;
        out
    };
    let mut sides = path.sides;
    sides.push(Side::straight(end, at(end)));
    sides.push(Side::straight(at(end), at(start)));
    sides.push(Side::straight(at(start), start));
    Some(sides)
}

fn natural_border(native: &Native<'_>) -> Option<Vec<Side>> {
    let [u, v] = native.natural_range()?;
    let corners =
        [(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])].map(|(x, y)| Vec2::new(x, y));
    Some((0..4).map(|k| Side::straight(corners[k], corners[(k + 1) % 4])).collect())
}

/// Largest loop first and counter-clockwise, the others clockwise and moved into its window of periods.
fn sort_and_orient(native: &Native<'_>, loops: &mut [Vec<Side>]) {
    let mut areas: Vec<f64> = loops.iter().map(|l| signed_area(l)).collect();
    let outer = (0..loops.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()));
    if let Some(outer) = outer {
        loops.swap(0, outer);
        areas.swap(0, outer);
    }
    for (k, sides) in loops.iter_mut().enumerate() {
        if (areas[k] > 0.0) != (k == 0) {
            sides.reverse();
            sides.iter_mut().for_each(|s| *s = s.reversed());
        }
    }
    let middle = |sides: &[Side]| {
        let points = sides.iter().flat_map(|s| s.path.points());
        let (low, high) = points.fold(
            (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)),
            |(low, high), p| (low.inf(p), high.sup(p)),
        );
        0.5 * (low + high)
    };
    let Some((outer, holes)) = loops.split_first_mut() else { return };
    for hole in holes {
        let shift = whole_periods(native, middle(outer) - middle(hole));
        hole.iter_mut().for_each(|s| *s = s.shifted(shift));
    }
}
