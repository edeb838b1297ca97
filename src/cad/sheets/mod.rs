//! Selection of the profile part for faces of revolution. A profile that reaches the axis inside its range (such as a
//! full circle centred on the axis) generates a self-overlapping surface. Its parts between points on the axis do not
//! overlap, and a face uses one of them.

use super::iges::join::join;
use super::native::Native;
use super::raw::{RawEdge, RawLoop, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Distance from the axis relative to the profile's size below which a point lies on the axis.
const ON_AXIS_REL: f64 = 1e-9;
/// Distance between the ends of a profile relative to its size below which it is closed.
const CLOSED_TOLERANCE_REL: f64 = 1e-7;
/// Difference of parameters relative to the profile's range below which they coincide.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-9;
/// Number of points per edge used to select a part.
const POINTS_PER_EDGE: u32 = 5;

/// Surface of revolution of a part of a profile, and the face's loops with the parameter curves that lie on it.
pub(super) struct Sheet {
    pub surface: RawSurface,
    pub loops: Vec<RawLoop>,
    /// Number of edges whose parameter curves lie on another part.
    off_part: usize,
}

/// Sheets of a surface of revolution on which all edges of a face lie within `tolerance` [mm]; those of the parameter
/// curves first. Empty for other surfaces, for profiles on one side of the axis, and for faces on no single part. A
/// face without edges covers the part with the start of the profile.
pub(super) fn of_face(surface: &RawSurface, loops: &[RawLoop], tolerance: f64) -> Vec<Sheet> {
    let RawSurface::Revolution { generatrix, origin, axis, angles, curve_first } = surface else {
        return Vec::new();
    };
    let profiles = parts_of(generatrix, *origin, *axis);
    if profiles.is_empty() {
        return Vec::new();
    }
    let turned = |generatrix: Curve3| RawSurface::Revolution {
        generatrix,
        origin: *origin,
        axis: *axis,
        angles: *angles,
        curve_first: *curve_first,
    };
    let [low, high] = generatrix.domain();
    let along = if *curve_first { 0 } else { 1 };
    let sheet = |part| Sheet::new(part, loops, along, high - low);
    let mut parts: Vec<RawSurface> = profiles.into_iter().map(turned).collect();
    let points = points_of(surface, loops);
    if points.is_empty() {
        // The full surface between poles: the part with the start of the profile.
        parts.truncate(1);
        return parts.into_iter().map(sheet).collect();
    }
    let distances: Vec<Vec<f64>> = parts.iter().map(|part| distances(part, &points)).collect();
    // The smallest distance over all parts is the distance from the entire surface.
    let smallest = |k: usize| distances.iter().map(|m| m[k]).fold(f64::INFINITY, f64::min);
    let whole = (0..points.len()).map(smallest).fold(0.0, f64::max);
    let allowed = tolerance.max(2.0 * whole);
    let fitting =
        parts.into_iter().zip(&distances).filter(|(_, m)| m.iter().all(|d| *d <= allowed));
    let mut sheets: Vec<Sheet> = fitting.map(|(part, _)| sheet(part)).collect();
    sheets.sort_by_key(|s| s.off_part);
    sheets
}

impl Sheet {
    /// `along` is the index of the file's parameter along the profile, `period` its period for a closed profile.
    fn new(surface: RawSurface, loops: &[RawLoop], along: usize, period: f64) -> Self {
        let RawSurface::Revolution { generatrix, .. } = &surface else {
            return Self { surface, loops: loops.to_vec(), off_part: 0 };
        };
        let [low, high] = generatrix.domain();
        let mut off_part = 0;
        let mut edge = |e: &RawEdge| {
            let pcurve = e.pcurve.as_ref().and_then(|p| moved_into(p, [low, high], along, period));
            off_part += usize::from(e.pcurve.is_some() && pcurve.is_none());
            // Without a space curve the parameter curve is the only geometry.
            let kept = if e.curve.is_none() { e.pcurve.clone() } else { None };
            RawEdge { pcurve: pcurve.or(kept), ..e.clone() }
        };
        let ring = |l: &RawLoop| RawLoop {
            outer: l.outer,
            edges: l.edges.iter().map(&mut edge).collect(),
            vertex: l.vertex,
        };
        let loops = loops.iter().map(ring).collect();
        Self { surface, loops, off_part }
    }
}

/// A parameter curve shifted by whole periods so that its middle lies in a range; `None` if impossible.
fn moved_into(path: &Curve2, range: [f64; 2], along: usize, period: f64) -> Option<Curve2> {
    let [a, b] = path.domain();
    let middle = path.point(0.5 * (a + b))[along];
    let slack = COINCIDENCE_TOLERANCE_REL * period;
    let inside = |t: f64| t >= range[0] - slack && t <= range[1] + slack;
    let by = [0.0, period, -period].into_iter().find(|by| inside(middle + by))?;
    let mut shift = Vec2::zeros();
    shift[along] = by;
    Some(if by == 0.0 { path.clone() } else { path.mapped(|uv| uv + shift) })
}

/// Sample points of a face's edges.
fn points_of(surface: &RawSurface, loops: &[RawLoop]) -> Vec<Vec3> {
    let native = Native::new(surface);
    let fraction = |k: u32| (f64::from(k) + 0.5) / f64::from(POINTS_PER_EDGE);
    let of_edge = |e: &RawEdge| -> Vec<Vec3> {
        let at = |[a, b]: [f64; 2], k: u32| a + (b - a) * fraction(k);
        match (&e.curve, &e.pcurve) {
            (Some(c), _) => (0..POINTS_PER_EDGE).map(|k| c.point(at(c.domain(), k))).collect(),
            (None, Some(p)) => {
                let on = |k: u32| native.point(native.order(p.point(at(p.domain(), k))));
                (0..POINTS_PER_EDGE).map(on).collect()
            }
            (None, None) => Vec::new(),
        }
    };
    loops.iter().flat_map(|l| &l.edges).flat_map(of_edge).collect()
}

/// Distances of points from a surface [mm].
fn distances(surface: &RawSurface, points: &[Vec3]) -> Vec<f64> {
    let native = Native::new(surface);
    points.iter().map(|p| (native.point(native.inverse(p, None)) - p).norm()).collect()
}

/// Parts of a profile between its points on the axis, with unchanged parametrisation; the part with the start first.
/// For a closed profile a part may continue past the seam by one period. Empty when only the ends lie on the axis.
fn parts_of(profile: &Curve3, origin: Vec3, axis: Vec3) -> Vec<Curve3> {
    let [low, high] = profile.domain();
    let tiny = COINCIDENCE_TOLERANCE_REL * (high - low);
    let hits = on_axis(profile, origin, axis);
    let inner: Vec<f64> =
        hits.iter().copied().filter(|t| *t > low + tiny && *t < high - tiny).collect();
    let (Some(&first), Some(&last)) = (inner.first(), inner.last()) else { return Vec::new() };
    let size = Aabb::of_points(profile.points()).diagonal();
    let closed = (profile.point(low) - profile.point(high)).norm() <= CLOSED_TOLERANCE_REL * size;
    let begins_on_axis = hits.iter().any(|t| *t <= low + tiny);
    let piece = |w: &[f64]| profile.trimmed(w[0], w[1]).ok();
    if closed && !begins_on_axis {
        let ends = [profile.trimmed(last, high), profile.trimmed(low, first)];
        let [Ok(before), Ok(behind)] = ends else { return Vec::new() };
        let over = join(&[before, behind]).ok();
        let over = over.map(|c| c.on_domain(last, first + (high - low)));
        return over.into_iter().chain(inner.windows(2).filter_map(piece)).collect();
    }
    let bounds = [vec![low], inner, vec![high]].concat();
    bounds.windows(2).filter_map(piece).collect()
}

/// Parameters of the points of a profile on the axis, increasing: local minima of the distance that vanish to within
/// rounding.
fn on_axis(profile: &Curve3, origin: Vec3, axis: Vec3) -> Vec<f64> {
    let across = |x: Vec3| x - axis * axis.dot(&x);
    let radius = |t: f64| across(profile.point(t) - origin).norm();
    // Half the derivative of the squared distance.
    let slope = |t: f64| {
        let d = profile.derivs(t);
        across(d.c - origin).dot(&across(d.d1))
    };
    let size = Aabb::of_points(profile.points()).diagonal();
    let ts = samples_of(profile);
    let radii: Vec<f64> = ts.iter().map(|t| radius(*t)).collect();
    let last = ts.len() - 1;
    let mut hits: Vec<f64> = Vec::new();
    for k in 0..=last {
        let (before, behind) = (k.saturating_sub(1), (k + 1).min(last));
        if radii[k] > radii[before] || radii[k] > radii[behind] {
            continue;
        }
        let t = lowest(&slope, [ts[before], ts[behind]]);
        let t = if radius(t) <= radii[k] { t } else { ts[k] };
        if radius(t) <= ON_AXIS_REL * size {
            hits.push(t);
        }
    }
    hits.dedup_by(|b, a| *b - *a <= COINCIDENCE_TOLERANCE_REL * (ts[last] - ts[0]));
    hits
}

/// Sample parameters of a curve, several per span.
fn samples_of(curve: &Curve3) -> Vec<f64> {
    let [low, high] = curve.domain();
    let steps = 4 * (curve.degree() + 1);
    let mut breaks: Vec<f64> =
        curve.knots().iter().copied().filter(|t| *t > low && *t < high).collect();
    breaks.dedup();
    let bounds = [vec![low], breaks, vec![high]].concat();
    let span = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        (0..steps).map(move |k| a + (b - a) * k as f64 / steps as f64).collect::<Vec<f64>>()
    };
    let mut out: Vec<f64> = bounds.windows(2).flat_map(span).collect();
    out.push(high);
    out
}

/// Zero of an increasing slope by bisection; an end of the interval if there is none.
fn lowest(slope: &dyn Fn(f64) -> f64, [mut a, mut b]: [f64; 2]) -> f64 {
    if slope(a) >= 0.0 {
        return a;
    }
    if slope(b) <= 0.0 {
        return b;
    }
    for _ in 0..100 {
        let middle = 0.5 * (a + b);
        if middle <= a || middle >= b {
            break;
        }
        if slope(middle) < 0.0 {
            a = middle;
        } else {
            b = middle;
        }
    }
    b
}

#[cfg(test)]
mod tests;
