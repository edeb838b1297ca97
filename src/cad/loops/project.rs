//! Parameter curve of an edge: that of the file if it is accurate, otherwise the projection of the space curve onto the
//! surface.

use std::cell::LazyCell;

use super::side::{LoopFault, Side};
use crate::native::Native;
use crate::raw::{RawEdge, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3, CurveProjector};
use kanagata_geometry::{Vec2, Vec3};

/// Accuracy of fitted parameter curves relative to their extent ...
const FIT_TOLERANCE_REL: f64 = 1e-10;
/// ... or relative to the distance of the space curve from the surface, if that is larger.
const FIT_TOLERANCE_PER_GAP: f64 = 1e-2;
/// Upper bound of the fitting accuracy relative to the extent, for any distance of the curve.
const FIT_TOLERANCE_MAX_REL: f64 = 1e-7;
/// Distance between both curves of an edge, relative to the size of the face, above which they are contradictory and
/// the curve used is reported. Doubled: fewer reports.
const CONTRADICTION_REL: f64 = 1e-2;

/// Samples per span of a projected curve.
const SAMPLES_PER_SPAN: usize = 2;
/// Maximum number of samples of a strongly curved curve.
const SAMPLES_MAX: usize = 4096;
/// Cosine of the angle between chords above which a turn is smooth.
const SMOOTH_TURN_COSINE_MIN: f64 = 0.8;
/// Diameter of a circle of latitude relative to the size of the face below which it is a pole.
const POLE_DIAMETER_MAX_REL: f64 = 1e-7;

/// Reads an edge as a side; `after` is the end of the preceding side.
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
    // Within the resolution of the file (half of `tolerance`) the parameter curve is exact.
    let fine = (0.5 * tolerance).max(1e-8 * size);
    let off = deviation(native, &path, curve, fine);
    if off > tolerance.max(CONTRADICTION_REL * size) && edge.edge_id.is_none() {
        faults.push(LoopFault::Contradiction { off, parameter_kept: edge.prefer_pcurve });
    }
    if off <= fine || edge.prefer_pcurve {
        return Some(Side { path, curve: (off <= tolerance).then(|| curve.clone()), edge_id });
    }
    // Accurate enough to start the projection, not to replace it.
    project((off <= CONTRADICTION_REL * size).then_some(&path))
}

/// Largest distance between the image of a parameter curve and its space curve, start to start and end to end. Values
/// below `fine` are upper bounds.
fn deviation(native: &Native<'_>, path: &Curve2, curve: &Curve3, fine: f64) -> f64 {
    let ([a, b], [c, d]) = (path.domain(), curve.domain());
    let ends = (native.point(path.point(a)) - curve.point(c))
        .norm()
        .max((native.point(path.point(b)) - curve.point(d)).norm());
    let search = LazyCell::new(|| CurveProjector::new(curve));
    (1..8).fold(ends, |worst, k| {
        let fraction = f64::from(k) / 8.0;
        let p = native.point(path.point(a + (b - a) * fraction));
        let near = curve.closest_near(&p, c + (d - c) * fraction, fine * fine).1.sqrt();
        worst.max(if near <= fine { near } else { search.closest(&p).1.sqrt() })
    })
}

/// Initial estimates for the projection of a curve.
#[derive(Clone, Copy)]
struct Hints<'h> {
    /// A parameter curve of insufficient accuracy.
    path: Option<&'h Curve2>,
    /// End of the preceding side.
    after: Option<Vec2>,
}

/// Parameter curve of a space curve by projection.
fn projected(native: &Native<'_>, curve: &Curve3, hints: Hints, size: f64) -> Curve2 {
    if let Some(path) = along_normal(native, curve) {
        return path;
    }
    let [a, b] = curve.domain();
    let spans = curve.knots().windows(2).filter(|w| w[0] < w[1]).count();
    let points = points_of(curve, (SAMPLES_PER_SPAN * spans).clamp(16, 400));
    let n = points.len() - 1;
    let feet = projected_samples(native, &points, hints, size);
    let samples = &feet;
    let gap = samples[1..n].iter().map(|s| s.distance).fold(0.0, f64::max);
    let allowed =
        (FIT_TOLERANCE_PER_GAP * gap).clamp(FIT_TOLERANCE_REL * size, FIT_TOLERANCE_MAX_REL * size);
    if let Some(line) = isoparametric_line(native, samples, allowed) {
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
    let tolerance = (FIT_TOLERANCE_PER_GAP * gap / reach)
        .clamp(FIT_TOLERANCE_REL, FIT_TOLERANCE_MAX_REL)
        * extent;
    let f = |t: f64, about: Option<Vec2>| {
        // The ends keep their samples: at a pole the free parameter comes from the neighbours.
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

/// On a plane the projection along the normal is an affine map and exact.
fn along_normal(native: &Native<'_>, curve: &Curve3) -> Option<Curve2> {
    let RawSurface::Plane(frame) = native.raw() else { return None };
    let points = curve.points().iter().map(|p| frame.local(p).xy()).collect();
    let (knots, weights) = (curve.knots().to_vec(), curve.weights().to_vec());
    Curve2::try_new(curve.degree(), knots, points, Some(weights)).ok()
}

/// Cubic through the four samples around `x`, measured in samples.
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

/// At least `n + 1` points of a curve, more where it turns fast between them (a helix may be a single span).
fn points_of(curve: &Curve3, mut n: usize) -> Vec<Vec3> {
    let [a, b] = curve.domain();
    loop {
        let at = |k: usize| a + (b - a) * k as f64 / n as f64;
        let points: Vec<Vec3> = (0..=n).map(|k| curve.point(at(k))).collect();
        let sharp = points.windows(3).filter(|w| {
            let (before, after) = (w[1] - w[0], w[2] - w[1]);
            before.dot(&after) < SMOOTH_TURN_COSINE_MIN * before.norm() * after.norm()
        });
        // Corners remain sharp for any number of points.
        if 4 * sharp.count() <= n || n >= SAMPLES_MAX {
            return points;
        }
        n *= 2;
    }
}

/// Parameters of a point on a surface, its foot point, and their distance [mm].
#[derive(Debug, Clone, Copy)]
struct Sample {
    uv: Vec2,
    foot: Vec3,
    distance: f64,
}

impl Sample {
    /// The sample at `uv` for the point `p`.
    fn at(native: &Native<'_>, p: &Vec3, uv: Vec2) -> Self {
        let foot = native.point(uv);
        Self { uv, foot, distance: (foot - p).norm() }
    }

    /// The foot point of `p` by local search from `uv`.
    fn near(native: &Native<'_>, p: &Vec3, uv: Vec2) -> Self {
        Self::at(native, p, native.inverse(p, Some(uv)))
    }
}

/// The straight line between the ends, if one parameter of all samples is constant to within `allowed` [mm] and the
/// other is monotonic.
fn isoparametric_line(native: &Native<'_>, samples: &[Sample], allowed: f64) -> Option<Curve2> {
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

/// Foot points of the points of a curve, by local search from extrapolated neighbours. Where a foot point is far away
/// the entire surface is searched, as long as this finds closer ones.
fn projected_samples(native: &Native<'_>, points: &[Vec3], hints: Hints, size: f64) -> Vec<Sample> {
    let n = points.len() - 1;
    let (begin, first) = first_sample(native, points, hints, size);
    let mut samples = vec![first; n + 1];
    let step = (points[begin + 1] - points[begin]).norm();
    let mut allowed = (3.0 * first.distance).max(1e-3 * step);
    let mut searches = 4;
    for k in (0..begin).rev().chain(begin + 1..=n) {
        let expected = extrapolate(&samples, k, if k < begin { 1 } else { -1 }, begin);
        let mut found = Sample::near(native, &points[k], expected);
        if found.distance > allowed && searches > 0 {
            searches -= 1;
            let other = native.inverse(&points[k], None);
            let other = Sample::at(native, &points[k], native.equivalent_near(other, expected));
            if other.distance < 0.5 * found.distance {
                found = other;
            }
            allowed = allowed.max(2.0 * found.distance);
        }
        if k == 0 || k == n {
            found = with_expected_azimuth(native, found, expected, size);
        }
        samples[k] = found;
    }
    samples
}

/// Index and foot point of the first sample: the first point where the preceding side leads there, otherwise the middle
/// one.
fn first_sample(native: &Native<'_>, points: &[Vec3], hints: Hints, size: f64) -> (usize, Sample) {
    let n = points.len() - 1;
    let fine = 1e-6 * size;
    let after = hints.after.filter(|&uv| native.is_inverted_iteratively() && native.is_regular(uv));
    let after = after.map(|uv| Sample::near(native, &points[0], uv)).filter(|s| s.distance <= fine);
    // Without knowledge of the start, begin in the middle: an end may be a pole, where one parameter is arbitrary.
    let begin = if after.is_some() { 0 } else { n / 2 };
    let from_path = hints.path.map(|h| {
        let [c, d] = h.domain();
        let uv = h.point(c + (d - c) * begin as f64 / n as f64);
        Sample::near(native, &points[begin], uv)
    });
    let first = after.or(from_path.filter(|s| s.distance <= fine)).unwrap_or_else(|| {
        let point = &points[begin];
        let global = Sample::at(native, point, native.inverse(point, None));
        match from_path {
            Some(s) if s.distance <= 2.0 * global.distance => s,
            Some(s) => Sample::at(native, point, native.equivalent_near(global.uv, s.uv)),
            None => global,
        }
    });
    (begin, first)
}

/// At a pole the azimuth is arbitrary and is set to the expected value.
fn with_expected_azimuth(
    native: &Native<'_>,
    mut found: Sample,
    expected: Vec2,
    size: f64,
) -> Sample {
    for (k, period) in native.periods().into_iter().enumerate() {
        let Some(p) = period else { continue };
        let mut opposite = found.uv;
        opposite[k] += 0.5 * p;
        if (native.point(opposite) - found.foot).norm() <= POLE_DIAMETER_MAX_REL * size {
            found.uv[k] = expected[k];
        }
    }
    found
}

/// Expected parameters of the next sample, extrapolated from its two known neighbours; the known range begins at
/// `begin`.
fn extrapolate(samples: &[Sample], k: usize, towards: isize, begin: usize) -> Vec2 {
    let one = k.wrapping_add_signed(towards);
    if one == begin {
        return samples[one].uv;
    }
    let two = one.wrapping_add_signed(towards);
    2.0 * samples[one].uv - samples[two].uv
}
