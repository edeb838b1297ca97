//! The parameter curve of one edge: the file's own where it is good, else the curve in space projected on the surface.

use std::cell::LazyCell;

use super::side::{LoopFault, Side};
use crate::cad::native::Native;
use crate::cad::raw::{RawEdge, RawSurface};
use crate::geometry::nurbs::{Curve2, Curve3, CurveProjector};
use crate::geometry::{Vec2, Vec3};

/// Parameter curves are fitted to this share of their extent...
const FIT: f64 = 1e-10;
/// ...or of the curve's own distance from the surface, where that is larger.
const FIT_OF_GAP: f64 = 1e-2;
/// However far a curve lies off: never looser than this.
const LOOSEST_FIT: f64 = 1e-7;
/// The two curves of an edge that are farther apart than this share of the face's size contradict each other: which of
/// them the file prefers is reported. Twice as much reports fewer.
const CONTRADICTION_REL: f64 = 1e-2;

/// Samples of each span of a curve that is projected.
const SAMPLES_A_SPAN: usize = 2;
/// Most of them where a curve turns fast.
const MOST_SAMPLES: usize = 4096;
/// Cosine of the angle between chords at a sharp turn.
const SHARP: f64 = 0.8;
/// A circle of latitude whose diameter is below this share of the face's size is a pole.
const POLE: f64 = 1e-7;

/// `after` is where the side before it ends.
pub(super) fn side_of(
    native: &Native<'_>,
    edge: &RawEdge,
    (size, tolerance): (f64, f64),
    after: Option<Vec2>,
    faults: &mut Vec<LoopFault>,
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
    if off > tolerance.max(CONTRADICTION_REL * size) && edge.edge_id.is_none() {
        faults.push(LoopFault::Contradiction { off, parameter_kept: edge.prefer_pcurve });
    }
    if off <= fine || edge.prefer_pcurve {
        return Some(Side { path, curve: (off <= tolerance).then(|| curve.clone()), edge_id });
    }
    // Good enough to say where, not good enough to stand for the curve.
    project((off <= CONTRADICTION_REL * size).then_some(&path))
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
    if let Some(path) = along_normal(native, curve) {
        return path;
    }
    let [a, b] = curve.domain();
    let spans = curve.knots().windows(2).filter(|w| w[0] < w[1]).count();
    let points = points_of(curve, (SAMPLES_A_SPAN * spans).clamp(16, 400));
    let n = points.len() - 1;
    let feet = projected_samples(native, &points, hints, size);
    let samples = &feet;
    let gap = samples[1..n].iter().map(|s| s.miss).fold(0.0, f64::max);
    let allowed = (FIT_OF_GAP * gap).clamp(FIT * size, LOOSEST_FIT * size);
    if let Some(line) = along_one_parameter(native, samples, allowed) {
        return line;
    }
    let near = |t: f64| cubic(samples, (t - a) / (b - a) * n as f64);
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

/// On a plane: exact, as a projection along the normal is an affine map.
fn along_normal(native: &Native<'_>, curve: &Curve3) -> Option<Curve2> {
    let RawSurface::Plane(frame) = native.raw() else { return None };
    let points = curve.points().iter().map(|p| frame.local(p).xy()).collect();
    let (knots, weights) = (curve.knots().to_vec(), curve.weights().to_vec());
    Curve2::try_new(curve.degree(), knots, points, Some(weights)).ok()
}

/// The cubic through the four samples about `x`, which counts samples.
fn cubic(samples: &[Sample], x: f64) -> Vec2 {
    let n = samples.len() - 1;
    let x = x.clamp(0.0, n as f64);
    let k = (x as usize).clamp(1, n - 2) - 1;
    let x = x - k as f64;
    let shares = [
        (1.0 - x) * (2.0 - x) * (3.0 - x) / 6.0,
        x * (2.0 - x) * (3.0 - x) / 2.0,
        x * (x - 1.0) * (3.0 - x) / 2.0,
        x * (x - 1.0) * (x - 2.0) / 6.0,
    ];
    (0..4).map(|i| samples[k + i].uv * shares[i]).sum()
}

/// `n + 1` points of a curve, or more where it turns too fast between them (a helix may be one span).
fn points_of(curve: &Curve3, mut n: usize) -> Vec<Vec3> {
    let [a, b] = curve.domain();
    loop {
        let at = |k: usize| a + (b - a) * k as f64 / n as f64;
        let points: Vec<Vec3> = (0..=n).map(|k| curve.point(at(k))).collect();
        let sharp = points.windows(3).filter(|w| {
            let (before, after) = (w[1] - w[0], w[2] - w[1]);
            before.dot(&after) < SHARP * before.norm() * after.norm()
        });
        // Corners stay however many points there are.
        if 4 * sharp.count() <= n || n >= MOST_SAMPLES {
            return points;
        }
        n *= 2;
    }
}

/// A point's parameters on a surface, the point there, and how far that is off [mm].
#[derive(Debug, Clone, Copy)]
struct Sample {
    uv: Vec2,
    foot: Vec3,
    miss: f64,
}

impl Sample {
    /// The sample at `uv`, compared with the point `p`.
    fn at(native: &Native<'_>, p: &Vec3, uv: Vec2) -> Self {
        let foot = native.point(uv);
        Self { uv, foot, miss: (foot - p).norm() }
    }

    /// The foot of `p`, searched from `uv`.
    fn near(native: &Native<'_>, p: &Vec3, uv: Vec2) -> Self {
        Self::at(native, p, native.inverse(p, Some(uv)))
    }
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
    let (begin, first) = first_sample(native, points, hints, size);
    let mut samples = vec![first; n + 1];
    let step = (points[begin + 1] - points[begin]).norm();
    let mut allowed = (3.0 * first.miss).max(1e-3 * step);
    let mut searches = 4;
    for k in (0..begin).rev().chain(begin + 1..=n) {
        let expected = extrapolate(&samples, k, if k < begin { 1 } else { -1 }, begin);
        let mut found = Sample::near(native, &points[k], expected);
        if found.miss > allowed && searches > 0 {
            searches -= 1;
            let other = native.inverse(&points[k], None);
            let other = Sample::at(native, &points[k], native.equivalent_near(other, expected));
            if other.miss < 0.5 * found.miss {
                found = other;
            }
            allowed = allowed.max(2.0 * found.miss);
        }
        if k == 0 || k == n {
            found = beside_pole(native, found, expected, size);
        }
        samples[k] = found;
    }
    samples
}

/// Number and foot of the point that the others are searched from: the first one where the side before it leads there,
/// else the one in the middle.
fn first_sample(native: &Native<'_>, points: &[Vec3], hints: Hints, size: f64) -> (usize, Sample) {
    let n = points.len() - 1;
    let fine = 1e-6 * size;
    let after = hints.after.filter(|&uv| native.searches() && native.regular(uv));
    let after = after.map(|uv| Sample::near(native, &points[0], uv)).filter(|s| s.miss <= fine);
    // From the middle outwards where nothing is known of the start: an end may be a pole, where one parameter is
    // anybody's.
    let begin = if after.is_some() { 0 } else { n / 2 };
    let from_path = hints.path.map(|h| {
        let [c, d] = h.domain();
        let uv = h.point(c + (d - c) * begin as f64 / n as f64);
        Sample::near(native, &points[begin], uv)
    });
    let first = after.or(from_path.filter(|s| s.miss <= fine)).unwrap_or_else(|| {
        let point = &points[begin];
        let global = Sample::at(native, point, native.inverse(point, None));
        match from_path {
            Some(s) if s.miss <= 2.0 * global.miss => s,
            Some(s) => Sample::at(native, point, native.equivalent_near(global.uv, s.uv)),
            None => global,
        }
    });
    (begin, first)
}

/// At a pole the angle is anybody's: there it is the one expected.
fn beside_pole(native: &Native<'_>, mut found: Sample, expected: Vec2, size: f64) -> Sample {
    for (k, period) in native.periods().into_iter().enumerate() {
        let Some(p) = period else { continue };
        let mut opposite = found.uv;
        opposite[k] += 0.5 * p;
        if (native.point(opposite) - found.foot).norm() <= POLE * size {
            found.uv[k] = expected[k];
        }
    }
    found
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
