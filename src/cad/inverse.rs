//! Point inversion to native surface parameters: closed forms for planes, quadrics and tori, otherwise bounded Newton
//! iteration from a hint or from the nearest samples.

use std::f64::consts::PI;

use super::native::Native;
use super::raw::RawSurface;
use kanagata_geometry::nurbs::{SurfaceDerivs, newton_step};
use kanagata_geometry::{Vec2, Vec3};

/// Maximum number of cached sample points per surface.
const SAMPLES_MAX: usize = 40_000;
/// Number of nearest samples from which Newton iteration starts without a hint.
const NEWTON_STARTS: usize = 6;

impl Native<'_> {
    /// Native parameters (internal order) of the point of the surface closest to `p`; among equivalent ones those
    /// nearest to `hint`. With a hint the search is local.
    pub fn inverse(&self, p: &Vec3, hint: Option<Vec2>) -> Vec2 {
        let uv = self.closed_form(p, hint).unwrap_or_else(|| match hint {
            Some(h) => self.newton(p, h).0,
            None => self.nearest_to_samples(p),
        });
        hint.map_or(uv, |h| self.equivalent_near(uv, h))
    }

    /// Shifts parameters by whole periods to be nearest to `hint`.
    pub fn equivalent_near(&self, mut uv: Vec2, hint: Vec2) -> Vec2 {
        for (k, period) in self.periods().into_iter().enumerate() {
            if let Some(period) = period {
                uv[k] += period * ((hint[k] - uv[k]) / period).round();
            }
        }
        uv
    }

    /// True for surfaces without closed-form inversion.
    pub fn is_inverted_iteratively(&self) -> bool {
        matches!(
            self.raw(),
            RawSurface::Revolution { .. } | RawSurface::Extrusion { .. } | RawSurface::Nurbs(_)
        )
    }

    /// True at a point of a swept or spline surface where neither derivative vanishes.
    pub fn is_regular(&self, uv: Vec2) -> bool {
        let d = self.derivs(uv);
        let [u, v] = self.natural_range().unwrap_or([[0.0, 1.0]; 2]);
        let (a, b) = (d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0]));
        a.min(b) > 1e-3 * a.max(b)
    }

    fn closed_form(&self, p: &Vec3, hint: Option<Vec2>) -> Option<Vec2> {
        let hint_u = hint.map_or(0.0, |h| h.x);
        // Azimuth about an axis; that of the hint for a point on the axis.
        let turn = |x: f64, y: f64, size: f64| {
            if x.hypot(y) > 1e-9 * size { y.atan2(x) } else { hint_u }
        };
        Some(match self.raw() {
            RawSurface::Plane(f) => {
                let l = f.local(p);
                Vec2::new(l.x, l.y)
            }
            RawSurface::Cylinder { frame, radius } => {
                let l = frame.local(p);
                Vec2::new(turn(l.x, l.y, *radius), l.z)
            }
            RawSurface::Cone { frame, radius, semi_angle } => {
                let l = frame.local(p);
                let t = semi_angle.tan();
                // Both nappes: beyond the apex the radius is negative and the angle opposite.
                let r = l.x.hypot(l.y);
                let off = |r: f64| (r - radius - l.z * t).abs();
                let beyond = off(-r) < off(r) - 1e-9 * (radius.abs() + r);
                let (r, half) = if beyond { (-r, PI) } else { (r, 0.0) };
                // Foot point on the generator in the half plane of the point.
                let v = ((r - radius) * t + l.z) / (1.0 + t * t);
                let on_axis = l.x.hypot(l.y) <= 1e-9 * (radius.abs() + l.z.abs());
                let u = if on_axis { hint_u } else { l.y.atan2(l.x) + half };
                Vec2::new(u, v)
            }
            RawSurface::Sphere { frame, radius } => {
                let l = frame.local(p);
                Vec2::new(turn(l.x, l.y, *radius), l.z.atan2(l.x.hypot(l.y)))
            }
            RawSurface::Torus { frame, major, minor, .. } => {
                torus_inverse(&frame.local(p), *major, *minor, hint)
            }
            _ => return None,
        })
    }

    /// Best foot point from the nearest samples of the entire surface.
    fn nearest_to_samples(&self, p: &Vec3) -> Vec2 {
        let samples = self.samples();
        let mut near: Vec<(f64, Vec2)> = Vec::with_capacity(NEWTON_STARTS + 1);
        for (uv, x) in samples {
            let d = (x - p).norm_squared();
            if near.len() < NEWTON_STARTS || d < near[near.len() - 1].0 {
                let at = near.partition_point(|n| n.0 <= d);
                near.insert(at, (d, *uv));
                near.truncate(NEWTON_STARTS);
            }
        }
        let mut best = (Vec2::zeros(), f64::INFINITY);
        // A foot point at distance zero cannot be improved.
        let there = (1e-9 * (1.0 + p.norm())).powi(2);
        for (_, start) in near {
            let foot = self.newton(p, start);
            if foot.1 < best.1 {
                best = foot;
            }
            if best.1 <= there {
                break;
            }
        }
        best.0
    }

    /// Bounded Newton iteration on half the squared distance: parameters and squared distance. Periodic parameters may
    /// cross the seam, others stop at the ends of their range.
    pub fn newton(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let bounds = self.newton_bounds();
        let clamp = |uv: Vec2| clamped(&bounds, uv);
        let mut uv = clamp(start);
        let mut d = self.derivs(uv);
        let mut best = (d.s - p).norm_squared();
        for _ in 0..40 {
            let r = d.s - p;
            let g = Vec2::new(r.dot(&d.su), r.dot(&d.sv));
            let (mut step, quadratic) = descent(&d, &r, g, held_at_bounds(&bounds, uv, g));
            let length = (d.su * step.x).norm() + (d.sv * step.y).norm();
            if length <= 1e-15 * (1.0 + d.s.norm()) || !length.is_finite() {
                break;
            }
            if quadratic && length <= 3e-8 * (1.0 + d.s.norm()) {
                // The remaining error after this step is close to rounding.
                uv = clamp(uv + step);
                break;
            }
            let mut moved = false;
            for _ in 0..20 {
                let next = clamp(uv + step);
                let e = self.derivs(next);
                let distance = (e.s - p).norm_squared();
                if distance < best {
                    (moved, uv, d, best) = (true, next, e, distance);
                    break;
                }
                step *= 0.5;
            }
            if !moved || length <= 1e-14 * (1.0 + d.s.norm()) {
                break;
            }
        }
        (uv, best)
    }

    /// Parameter ranges of the Newton iteration; `None` for periodic and for straight, unbounded parameters.
    fn newton_bounds(&self) -> [Option<[f64; 2]>; 2] {
        let periods = self.periods();
        let range = self.natural_range();
        let straight = matches!(self.raw(), RawSurface::Extrusion { .. });
        let u = self.curve_range().or(range.map(|r| r[0]));
        let v = if straight { None } else { range.map(|r| r[1]) };
        [u.filter(|_| periods[0].is_none()), v.filter(|_| periods[1].is_none())]
    }

    /// Samples over the natural range, at least `degree + 1` per span, with their points.
    pub(super) fn sampled(&self) -> Vec<(Vec2, Vec3)> {
        let Some(whole) = self.whole() else { return Vec::new() };
        let along = |k: usize, limit: usize| -> Vec<f64> {
            let (knots, p) = (whole.knots()[k], whole.degrees()[k]);
            let inner = &knots[p..knots.len() - p];
            let spans = inner.windows(2).filter(|w| w[0] < w[1]).count().max(1);
            let per_span = (p + 2).min((limit / spans).max(1));
            let spans = inner.windows(2).filter(|w| w[0] < w[1]);
            let mut out: Vec<f64> = spans
                .flat_map(|w| {
                    (0..per_span).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / per_span as f64)
                })
                .collect();
            out.push(inner[inner.len() - 1]);
            out
        };
        let us = along(0, 200);
        let vs = along(1, (SAMPLES_MAX / us.len()).max(8));
        let pairs = us.iter().flat_map(|&u| vs.iter().map(move |&v| Vec2::new(u, v)));
        pairs.zip(whole.grid(&us, &vs)).collect()
    }
}

/// Newton step where the Hessian is positive definite (flag true: quadratic convergence), otherwise Gauss-Newton, in
/// the free parameters.
fn descent(d: &SurfaceDerivs, r: &Vec3, g: Vec2, held: [bool; 2]) -> (Vec2, bool) {
    let gauss = [d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared()];
    let full = [gauss[0] + r.dot(&d.suu), gauss[1] + r.dot(&d.suv), gauss[2] + r.dot(&d.svv)];
    if let Some(step) = newton_step(full, g, held) {
        return (step, true);
    }
    let step = newton_step(gauss, g, held).unwrap_or_else(|| {
        // One derivative vanishes (a pole): step along the other parameter.
        if gauss[0] > gauss[2] {
            Vec2::new(-g.x / gauss[0], 0.0)
        } else {
            Vec2::new(0.0, -g.y / gauss[2].max(f64::MIN_POSITIVE))
        }
    });
    (step, false)
}

/// Closest point of a torus. A spindle torus has foot points on both circles of the meridian plane, and the hint
/// selects one.
fn torus_inverse(l: &Vec3, major: f64, minor: f64, hint: Option<Vec2>) -> Vec2 {
    let r = l.x.hypot(l.y);
    let u = if r > 1e-9 * major.max(minor) { l.y.atan2(l.x) } else { hint.map_or(0.0, |h| h.x) };
    let near = Vec2::new(u, l.z.atan2(r - major));
    if minor <= major {
        return near;
    }
    let far = Vec2::new(u + PI, l.z.atan2(-r - major));
    let distance = |r: f64| ((r - major).hypot(l.z) - minor).abs();
    if distance(-r) < distance(r) - 1e-9 * minor { far } else { near }
}

/// Clamps parameters to their ranges.
fn clamped(bounds: &[Option<[f64; 2]>; 2], uv: Vec2) -> Vec2 {
    let within = |k: usize| bounds[k].map_or(uv[k], |b| uv[k].clamp(b[0], b[1]));
    Vec2::new(within(0), within(1))
}

/// Parameters at an end of their range where descent against the gradient `g` would leave it.
fn held_at_bounds(bounds: &[Option<[f64; 2]>; 2], uv: Vec2, g: Vec2) -> [bool; 2] {
    [0, 1].map(|k| {
        bounds[k].is_some_and(|b| (uv[k] <= b[0] && g[k] > 0.0) || (uv[k] >= b[1] && g[k] < 0.0))
    })
}
