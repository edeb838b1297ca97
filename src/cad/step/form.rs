//! Curves in STEP parametrisation, and segments of them as rational B-splines.

use std::f64::consts::TAU;

use crate::iges::join::join;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Affine, Frame, Vec3};

/// An untrimmed curve in STEP parametrisation (angles in rad).
#[derive(Debug, Clone)]
pub enum Form {
    /// `origin + t direction`.
    Line(Vec3, Vec3),
    /// `origin + rx cos t x + ry sin t y`.
    Ellipse(Frame, f64, f64),
    /// `origin + a cosh t x + b sinh t y`.
    Hyperbola(Frame, f64, f64),
    /// `origin + f (t^2 x + 2 t y)`.
    Parabola(Frame, f64),
    /// Rational B-spline.
    Free(Curve3),
}

impl Form {
    /// Point at a parameter.
    #[must_use]
    pub fn point(&self, t: f64) -> Vec3 {
        match self {
            Self::Line(origin, direction) => origin + direction * t,
            Self::Ellipse(f, rx, ry) => f.point(&Vec3::new(rx * t.cos(), ry * t.sin(), 0.0)),
            Self::Hyperbola(f, a, b) => f.point(&Vec3::new(a * t.cosh(), b * t.sinh(), 0.0)),
            Self::Parabola(f, p) => f.point(&Vec3::new(p * t * t, 2.0 * p * t, 0.0)),
            Self::Free(curve) => curve.point(t),
        }
    }

    /// Parameter of the point of the curve closest to `p` (exact for points on it).
    #[must_use]
    pub fn parameter(&self, p: &Vec3) -> f64 {
        match self {
            Self::Line(origin, d) => (p - origin).dot(d) / d.norm_squared(),
            Self::Ellipse(f, rx, ry) => {
                let q = f.local(p);
                (q.y / ry).atan2(q.x / rx)
            }
            Self::Hyperbola(f, _, b) => (f.local(p).y / b).asinh(),
            Self::Parabola(f, focal) => f.local(p).y / (2.0 * focal),
            Self::Free(curve) => curve.closest(p).0,
        }
    }

    /// True for a closed curve.
    #[must_use]
    pub fn closed(&self) -> bool {
        match self {
            Self::Ellipse(..) => true,
            Self::Free(c) => {
                let [low, high] = c.domain();
                let size = extent(c);
                (c.point(low) - c.point(high)).norm() <= 1e-7 * size
            }
            _ => false,
        }
    }

    /// The segment on `from..to`, `from < to`; ellipses at most one turn.
    #[must_use]
    pub fn cut(&self, from: f64, to: f64) -> Option<Curve3> {
        if !(from < to && from.is_finite() && to.is_finite()) {
            return None;
        }
        match self {
            Self::Line(..) => {
                let points = vec![self.point(from), self.point(to)];
                Curve3::try_new(1, vec![from, from, to, to], points, None).ok()
            }
            Self::Ellipse(frame, rx, ry) => {
                Some(Curve3::ellipse_arc(frame, *rx, *ry, from, to.min(from + TAU)))
            }
            Self::Hyperbola(f, a, b) => {
                let middle = |t: f64, h: f64| {
                    let (x, y) = (a * t.cosh() / h.cosh(), b * t.sinh() / h.cosh());
                    (f.point(&Vec3::new(x, y, 0.0)), h.cosh())
                };
                self.quadratic(from, to, 0.5, &middle)
            }
            Self::Parabola(f, p) => {
                let middle = |t: f64, h: f64| {
                    (f.point(&Vec3::new(p * (t * t - h * h), 2.0 * p * t, 0.0)), 1.0)
                };
                self.quadratic(from, to, f64::INFINITY, &middle)
            }
            Self::Free(curve) => {
                let [low, high] = curve.domain();
                let (from, to) = (from.max(low), to.min(high));
                if from <= low && to >= high {
                    return Some(curve.clone());
                }
                curve.trimmed(from, to).ok()
            }
        }
    }

    /// Quadratic arc with spans of at most `longest`. `middle(t, h)` returns control point and weight of the span
    /// `t - h .. t + h`.
    fn quadratic(
        &self,
        from: f64,
        to: f64,
        longest: f64,
        middle: &dyn Fn(f64, f64) -> (Vec3, f64),
    ) -> Option<Curve3> {
        let spans = ((to - from) / longest).ceil().clamp(1.0, 1000.0) as usize;
        let fraction = |k: usize| from + (to - from) * k as f64 / spans as f64;
        // The last knot is exactly `to`.
        let at = |k: usize| if k == spans { to } else { fraction(k) };
        let (mut knots, mut points, mut weights) =
            (vec![from; 3], vec![self.point(from)], vec![1.0]);
        for k in 0..spans {
            let (a, b) = (at(k), at(k + 1));
            let (point, weight) = middle(0.5 * (a + b), 0.5 * (b - a));
            points.extend([point, self.point(b)]);
            weights.extend([weight, 1.0]);
            knots.extend([b, b]);
        }
        knots.push(to);
        Curve3::try_new(2, knots, points, Some(weights)).ok()
    }

    /// The segment from `from` forward to `to`, across the seam of a closed curve if `to` precedes `from`. An open
    /// curve is trimmed between both in any order.
    #[must_use]
    pub fn cut_wrapped(&self, from: f64, to: f64) -> Option<Curve3> {
        match self {
            Self::Ellipse(..) => {
                let mut turn = (to - from).rem_euclid(TAU);
                if !(1e-12..=TAU - 1e-12).contains(&turn) {
                    turn = TAU;
                }
                self.cut(from, from + turn)
            }
            Self::Free(curve) if from >= to && self.closed() => {
                let [low, high] = curve.domain();
                let tiny = 1e-9 * (high - low);
                if from >= high - tiny {
                    return self.cut(low, to);
                }
                if to <= low + tiny {
                    return self.cut(from, high);
                }
                join(&[self.cut(from, high)?, self.cut(low, to)?]).ok()
            }
            _ if from <= to => self.cut(from, to),
            _ => self.cut(to, from).map(|c| c.reversed()),
        }
    }

    /// The whole curve if it is bounded (an ellipse: one turn).
    #[must_use]
    pub fn whole(&self) -> Option<Curve3> {
        match self {
            Self::Ellipse(..) => self.cut(0.0, TAU),
            Self::Free(curve) => Some(curve.clone()),
            _ => None,
        }
    }

    /// Image under a map; conics without a conic image become B-splines.
    #[must_use]
    pub fn transformed(&self, map: &Affine) -> Option<Self> {
        if let Self::Line(origin, direction) = self {
            return Some(Self::Line(map.point(origin), map.vector(direction)));
        }
        let scale = map.linear.determinant().abs().cbrt();
        let moved = |f: &Frame| {
            let (x, y) = (map.vector(&f.x) / scale, map.vector(&f.y) / scale);
            Frame { origin: map.point(&f.origin), x, y, z: x.cross(&y) }
        };
        Some(match self {
            Self::Line(..) => return None,
            Self::Ellipse(f, a, b) => Self::Ellipse(moved(f), a * scale, b * scale),
            Self::Hyperbola(f, a, b) => Self::Hyperbola(moved(f), a * scale, b * scale),
            Self::Parabola(f, p) => Self::Parabola(moved(f), p * scale),
            Self::Free(curve) => Self::Free(curve.transformed(map)),
        })
    }
}

/// Longest side of the bounding box of the control points [mm].
#[must_use]
pub fn extent(curve: &Curve3) -> f64 {
    let far = |axis: usize| {
        let at = curve.points().iter().map(|p| p[axis]);
        let (low, high) =
            at.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    far(0).max(far(1)).max(far(2))
}
