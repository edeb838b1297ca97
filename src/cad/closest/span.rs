//! Short pieces of edge curves with point projection.

use super::piece::{CONVEXITY_MIN, polygon_turning};
use kanagata_geometry::nurbs::{Curve3, CurveDerivs};
use kanagata_geometry::{Aabb, Vec3};

/// Largest turning angle of the control polygon of a piece [rad].
const TURNING_MAX_RAD: f64 = 0.4;
/// Number of sub-intervals searched separately where the distance may have several minima.
const SUBINTERVALS: u32 = 8;

/// A piece of an edge within one span of its curve.
pub(super) struct Span {
    pub edge: u32,
    pub curve: Curve3,
    /// Derivatives at the ends and the middle.
    samples: [CurveDerivs<3>; 3],
}

/// Splits an edge curve into pieces.
pub(super) fn spans_of(edge: u32, curve: &Curve3) -> Vec<Span> {
    let mut out = Vec::new();
    for bezier in curve.bezier_pieces() {
        let n = ((polygon_turning(bezier.points()) / TURNING_MAX_RAD).ceil() as usize).clamp(1, 16);
        let [a, b] = bezier.domain();
        let at = |k: usize| if k == n { b } else { a + (b - a) * k as f64 / n as f64 };
        let pieces = (0..n).filter_map(|k| bezier.trimmed(at(k), at(k + 1)).ok());
        out.extend(pieces.map(|curve| {
            let [a, b] = curve.domain();
            let samples = [a, 0.5 * (a + b), b].map(|t| curve.derivs(t));
            Span { edge, curve, samples }
        }));
    }
    out
}

impl Span {
    /// Axis-aligned bounding box of the control points.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.curve.points())
    }

    /// Closest point: parameter and squared distance [mm^2].
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        let [a, b] = self.curve.domain();
        let (mut convex, mut strongly) = (true, true);
        let slopes = self.samples.map(|d| {
            let r = d.c - p;
            let (flat, bend) = (d.d1.norm_squared(), r.dot(&d.d2));
            convex &= flat + bend > 0.0;
            strongly &= (1.0 - CONVEXITY_MIN) * flat + bend > 0.0;
            r.dot(&d.d1)
        });
        // The minimum of a strongly convex distance that rises from the start, or falls to the end, is there.
        let end = |k: usize| (self.samples[k].c - p).norm_squared();
        match slopes {
            [at_start, ..] if strongly && at_start >= 0.0 => return (a, end(0)),
            [.., at_end] if strongly && at_end <= 0.0 => return (b, end(2)),
            _ => {}
        }
        let single = convex || slopes.iter().all(|s| *s > 0.0) || slopes.iter().all(|s| *s < 0.0);
        if single {
            return self.between(p, a, b);
        }
        let at = |k: u32| a + (b - a) * f64::from(k) / f64::from(SUBINTERVALS);
        let parts = (0..SUBINTERVALS).map(|k| self.between(p, at(k), at(k + 1)));
        parts.reduce(|x, y| if y.1 < x.1 { y } else { x }).unwrap_or((a, f64::INFINITY))
    }

    /// Local minimum between two parameters: Newton iteration safeguarded by bisection of the sign change of the slope.
    fn between(&self, p: &Vec3, from: f64, to: f64) -> (f64, f64) {
        let (mut low, mut high) = (from, to);
        let middle = &self.samples[1];
        let [a, b] = self.curve.domain();
        let speed = middle.d1.norm_squared().max(f64::MIN_POSITIVE);
        let mut t = (0.5 * (a + b) - (middle.c - p).dot(&middle.d1) / speed).clamp(low, high);
        for _ in 0..60 {
            let d = self.curve.derivs(t);
            let r = d.c - p;
            let slope = r.dot(&d.d1);
            if slope > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let curvature = d.d1.norm_squared() + r.dot(&d.d2);
            let newton = t - slope / curvature;
            // A Newton step out of the bracket stops at its end: the minimum is there, or the next slope reverses the
            // direction.
            let next = if curvature > 0.0 && newton >= low && newton <= high {
                newton
            } else if curvature > 0.0 && t != from && t != to {
                newton.clamp(low, high)
            } else {
                0.5 * (low + high)
            };
            let step = (next - t).abs();
            t = next;
            if step <= 4.0 * f64::EPSILON * (to - from).abs().max(t.abs()) {
                break;
            }
        }
        let point = |t: f64| match [a, b].iter().position(|end| *end == t) {
            Some(end) => self.samples[2 * end].c,
            None => self.curve.point(t),
        };
        let ends = [t, from, to].map(|t| (t, (point(t) - p).norm_squared()));
        ends.into_iter().reduce(|x, y| if y.1 < x.1 { y } else { x }).unwrap_or((t, f64::INFINITY))
    }
}
