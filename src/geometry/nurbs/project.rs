//! Point projection onto curves and surfaces (Piegl/Tiller, section 6.1). The search structure is cached in the curve
//! or surface; to own it separately, build a [`SurfaceProjector`] or [`CurveProjector`].

use super::curve::{Curve2, Curve3};
use super::derivs::SurfaceDerivs;
use super::newton::{Bounds, descend, descend_coarsely};
use super::projector::{CurveProjector, SurfaceProjector};
use super::surface::Surface;
use crate::{Vec2, Vec3};

impl Curve3 {
    /// Closest point, global over the curve: parameter and squared distance [mm^2].
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        self.prepared.get(|| CurveProjector::new(self)).closest(p)
    }

    /// Local minimum of the distance reached from `start`: parameter and squared distance [mm^2], never larger than at
    /// `start`. The iteration stops at the first squared distance not larger than `enough`.
    #[must_use]
    pub fn closest_near(&self, p: &Vec3, start: f64, enough: f64) -> (f64, f64) {
        let [low, high] = self.domain();
        let mut t = start.clamp(low, high);
        let mut d = self.derivs(t);
        let mut best = (d.c - p).norm_squared();
        for _ in 0..30 {
            if best <= enough {
                break;
            }
            let r = d.c - p;
            let (slope, gauss) = (r.dot(&d.d1), d.d1.norm_squared());
            let full = gauss + r.dot(&d.d2);
            let step = -slope / if full > 0.0 { full } else { gauss.max(f64::MIN_POSITIVE) };
            let mut next = (t + step).clamp(low, high);
            let mut e = self.derivs(next);
            let mut distance = (e.c - p).norm_squared();
            let mut halvings = 0;
            while distance > best && halvings < 20 {
                halvings += 1;
                next = (t + step * 0.5f64.powi(halvings)).clamp(low, high);
                e = self.derivs(next);
                distance = (e.c - p).norm_squared();
            }
            if distance > best {
                break;
            }
            let moved = (next - t).abs();
            (t, d, best) = (next, e, distance);
            if moved <= 1e-10 * (high - low) {
                break;
            }
        }
        (t, best)
    }
}

impl Curve2 {
    /// Closest point, global over the curve: parameter and squared distance.
    #[must_use]
    pub fn closest(&self, p: &Vec2) -> (f64, f64) {
        let lifted = || {
            let points = self.points.iter().map(|x| x.push(0.0)).collect();
            let (knots, weights) = (self.knots.clone(), self.weights.clone());
            CurveProjector::new(&Curve3::raw(self.degree, knots, points, weights))
        };
        self.prepared.get(lifted).closest(&p.push(0.0))
    }
}

impl Surface {
    /// The search structure of the surface.
    pub(super) fn projector(&self) -> &SurfaceProjector {
        self.prepared.get(|| SurfaceProjector::new(self))
    }

    /// Closest point of the untrimmed surface, global: parameters and squared distance [mm^2].
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        self.projector().closest(p)
    }

    /// As [`Surface::closest`], faster when `start` is near the foot point. The local result is verified as the global
    /// minimum, or replaced.
    #[must_use]
    pub fn closest_from(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        self.projector().closest_from(p, start)
    }

    /// Closest point (from `start` where it is given) within `cells` cells: parameters, squared distance and cells used.
    pub(super) fn closest_in(&self, p: &Vec3, start: Option<Vec2>, cells: u32) -> (Vec2, f64, u32) {
        self.projector().closest_in(p, start, cells)
    }

    /// Closest point by bounded Newton from `start`, for points with the foot point of a neighbour known. Falls back to
    /// [`Surface::closest`] when the iteration does not end at a stationary point or within the squared distance
    /// `enough` [mm^2].
    #[must_use]
    pub fn closest_near(&self, p: &Vec3, start: Vec2, enough: f64) -> (Vec2, f64) {
        self.closest_near_or(p, start, enough, || self.closest(p))
    }

    /// [`Surface::closest_near`] with the search of the whole surface as `closest` does it.
    pub(super) fn closest_near_or(
        &self,
        p: &Vec3,
        start: Vec2,
        enough: f64,
        closest: impl FnOnce() -> (Vec2, f64),
    ) -> (Vec2, f64) {
        let near = self.descent(p, start);
        if near.1 <= enough {
            return near;
        }
        let d = self.derivs(near.0);
        let r = p - d.s;
        let size = d.su.norm().max(d.sv.norm());
        let open = r.dot(&d.su).abs().max(r.dot(&d.sv).abs());
        let on_border = self
            .domain()
            .iter()
            .zip([near.0.x, near.0.y])
            .any(|(range, t)| t <= range[0] || t >= range[1]);
        // An interior foot point is stationary, or the point lies on the surface.
        if near.1 <= 1e-18 * self.scale2() || (!on_border && open <= 1e-9 * size * r.norm()) {
            near
        } else {
            let global = closest();
            if global.1 < near.1 { global } else { near }
        }
    }

    fn scale2(&self) -> f64 {
        let first = self.points()[0];
        let last = self.points()[self.points().len() - 1];
        let middle = self.points()[self.points().len() / 2];
        (last - first).norm_squared().max((middle - first).norm_squared())
    }

    /// Local minimum of the distance reached from `start`, to rounding: parameters and squared distance [mm^2].
    #[must_use]
    pub fn descent(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        descend(|uv| self.derivs(uv), p, start, self.bounds())
    }

    /// Local minimum of the distance reached from `start`, with parameters to 1e-6 of the domain or better, and the
    /// derivatives there.
    #[must_use]
    pub fn closest_locally(&self, p: &Vec3, start: Vec2) -> (Vec2, SurfaceDerivs) {
        descend_coarsely(|uv| self.derivs(uv), p, start, self.bounds())
    }

    /// Closest point in the rectangle from `low` to `high`, which should contain a single foot point: the best of 3 x 3
    /// samples, then bounded Newton.
    #[must_use]
    pub fn closest_within(&self, p: &Vec3, low: Vec2, high: Vec2) -> (Vec2, f64) {
        let mut best = (low, f64::INFINITY);
        for k in 0..9 {
            let fraction = Vec2::new(f64::from(k % 3) * 0.5, f64::from(k / 3) * 0.5);
            let uv = low + (high - low).component_mul(&fraction);
            let distance = (self.point(uv) - p).norm_squared();
            if distance < best.1 {
                best = (uv, distance);
            }
        }
        descend(|uv| self.derivs(uv), p, best.0, Bounds { low, high })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Frame;

    #[test]
    fn closest_points_of_a_circle_and_a_torus_are_exact() {
        let circle = Curve3::ellipse_arc(&Frame::world(), 3.0, 3.0, 0.0, 6.0);
        let (t, d2) = circle.closest(&Vec3::new(-4.0, 0.0, 0.5));
        assert!((circle.point(t) - Vec3::new(-3.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((d2 - 1.25).abs() < 1e-12);
        let near = circle.closest_near(&Vec3::new(-4.0, 0.0, 0.5), t + 0.4, 0.0);
        assert!((near.0 - t).abs() < 1e-7 && (near.1 - d2).abs() < 1e-12);
        // A modified copy does not use the cached search structure.
        let moved = circle.mapped(|x| x + Vec3::new(10.0, 0.0, 0.0));
        assert!((moved.closest(&Vec3::new(6.0, 0.0, 0.5)).1 - 1.25).abs() < 1e-12);
        let early = circle.closest_near(&Vec3::new(-4.0, 0.0, 0.5), t + 0.4, 10.0);
        assert_eq!(early.0, t + 0.4);
        let tube = Frame { origin: Vec3::x() * 40.0, x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
        let arc = Curve3::ellipse_arc(&tube, 7.0, 7.0, 0.0, std::f64::consts::TAU);
        let torus =
            Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.0, std::f64::consts::TAU]);
        for k in 0..200 {
            let a = f64::from(k) * 0.7;
            let p = Vec3::new(60.0 * a.cos(), 55.0 * a.sin(), 20.0 * (1.3 * a).sin());
            let ring = Vec3::new(p.x, p.y, 0.0).normalize() * 40.0;
            let exact = ((p - ring).norm() - 7.0).abs();
            let (uv, d2) = torus.closest(&p);
            assert!((d2.sqrt() - exact).abs() < 1e-10, "{k}: {} {exact}", d2.sqrt());
            let near = torus.closest_near(&p, uv + Vec2::new(0.1, -0.1), 0.0);
            assert!((near.1.sqrt() - exact).abs() < 1e-10);
        }
    }
}
