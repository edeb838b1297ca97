//! Closest points of curves and surfaces: samples in every span, then bounded Newton from every local minimum
//! of the samples.

use super::curve::Curve3;
use super::surface::Surface;
use crate::geometry::{Vec2, Vec3};

/// Parameters of samples: `per_span` to each non-empty span, and the end.
fn sample_parameters(knots: &[f64], degree: usize) -> Vec<f64> {
    let inner = &knots[degree..knots.len() - degree];
    let per_span = 2 * degree + 2;
    let mut out = Vec::new();
    for w in inner.windows(2).filter(|w| w[0] < w[1]) {
        out.extend((0..per_span).map(|k| w[0] + (w[1] - w[0]) * k as f64 / per_span as f64));
    }
    out.push(inner[inner.len() - 1]);
    out
}

impl Curve3 {
    /// Closest point: parameter and squared distance [mm^2], global over the curve.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        let t = sample_parameters(self.knots(), self.degree());
        let d: Vec<f64> = t.iter().map(|&t| (self.point(t) - p).norm_squared()).collect();
        let last = t.len() - 1;
        let mut best = (t[0], f64::INFINITY);
        for k in 0..=last {
            let (low, high) = (k.saturating_sub(1), (k + 1).min(last));
            if d[k] > d[low] || d[k] > d[high] {
                continue;
            }
            let found = self.closest_between(p, t[low], t[k], t[high]);
            if found.1 < best.1 {
                best = found;
            }
        }
        best
    }

    /// Local minimum of the distance in `[low, high]` from `start`: Newton, with bisection of the bracket of the
    /// distance's slope where Newton leaves it.
    fn closest_between(&self, p: &Vec3, mut low: f64, start: f64, mut high: f64) -> (f64, f64) {
        let mut t = start;
        for _ in 0..60 {
            let d = self.derivs(t);
            let r = d.c - p;
            let slope = r.dot(&d.d1);
            if slope > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let curvature = d.d1.norm_squared() + r.dot(&d.d2);
            let newton = t - slope / curvature;
            let inside = curvature > 0.0 && newton >= low && newton <= high;
            let next = if inside { newton } else { 0.5 * (low + high) };
            let step = (next - t).abs();
            t = next;
            if step <= 1e-15 * (1.0 + t.abs()) {
                break;
            }
        }
        let ends = [start, low, high, t].map(|t| (t, (self.point(t) - p).norm_squared()));
        ends.into_iter().reduce(|a, b| if b.1 < a.1 { b } else { a }).unwrap_or((t, f64::INFINITY))
    }
}

impl Surface {
    /// Closest point of the untrimmed surface: parameters and squared distance [mm^2]; global.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        let [us, vs] = [0, 1].map(|k| sample_parameters(self.knots()[k], self.degrees()[k]));
        let (nu, nv) = (us.len(), vs.len());
        let d: Vec<f64> = us
            .iter()
            .flat_map(|&u| vs.iter().map(move |&v| Vec2::new(u, v)))
            .map(|uv| (self.point(uv) - p).norm_squared())
            .collect();
        let mut best = (Vec2::new(us[0], vs[0]), f64::INFINITY);
        for i in 0..nu {
            for j in 0..nv {
                let here = d[i * nv + j];
                let around = (i.saturating_sub(1)..=(i + 1).min(nu - 1))
                    .flat_map(|a| (j.saturating_sub(1)..=(j + 1).min(nv - 1)).map(move |b| (a, b)));
                if around.clone().any(|(a, b)| d[a * nv + b] < here) {
                    continue;
                }
                let found = self.newton(p, Vec2::new(us[i], vs[j]));
                if found.1 < best.1 {
                    best = found;
                }
            }
        }
        best
    }

    /// Closest point by Newton from `start` with bounds and a fallback to [`Surface::closest`]; for
    /// points whose neighbour's foot is known.
    #[must_use]
    pub fn closest_near(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let near = self.newton(p, start);
        let d = self.derivs(near.0);
        let r = p - d.s;
        let size = d.su.norm().max(d.sv.norm());
        let open = r.dot(&d.su).abs().max(r.dot(&d.sv).abs());
        let on_border = self
            .domain()
            .iter()
            .zip([near.0.x, near.0.y])
            .any(|(range, t)| t <= range[0] || t >= range[1]);
        // A foot inside is stationary, or the point lies on the surface.
        if near.1 <= 1e-18 * self.scale2() || (!on_border && open <= 1e-9 * size * r.norm()) {
            near
        } else {
            let global = self.closest(p);
            if global.1 < near.1 { global } else { near }
        }
    }

    fn scale2(&self) -> f64 {
        let first = self.points()[0];
        let last = self.points()[self.points().len() - 1];
        let middle = self.points()[self.points().len() / 2];
        (last - first).norm_squared().max((middle - first).norm_squared())
    }

    /// Bounded Newton on half the squared distance, falling back to Gauss-Newton where the Hessian is not
    /// positive, halved until the distance does not grow.
    fn newton(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let [u, v] = self.domain();
        self.newton_within(p, start, u, v)
    }

    /// Closest point in the rectangle from `low` to `high`, small enough to hold one foot: the best of nine
    /// samples, then bounded Newton.
    #[must_use]
    pub fn closest_within(&self, p: &Vec3, low: Vec2, high: Vec2) -> (Vec2, f64) {
        let mut best = (low, f64::INFINITY);
        for k in 0..9 {
            let share = Vec2::new(f64::from(k % 3) * 0.5, f64::from(k / 3) * 0.5);
            let uv = low + (high - low).component_mul(&share);
            let distance = (self.point(uv) - p).norm_squared();
            if distance < best.1 {
                best = (uv, distance);
            }
        }
        self.newton_within(p, best.0, [low.x, high.x], [low.y, high.y])
    }

    fn newton_within(&self, p: &Vec3, start: Vec2, u: [f64; 2], v: [f64; 2]) -> (Vec2, f64) {
        let clamp = |uv: Vec2| Vec2::new(uv.x.clamp(u[0], u[1]), uv.y.clamp(v[0], v[1]));
        let mut uv = clamp(start);
        let mut d = self.derivs(uv);
        let mut best = (d.s - p).norm_squared();
        for _ in 0..60 {
            let r = d.s - p;
            let g = Vec2::new(r.dot(&d.su), r.dot(&d.sv));
            let (a, b, c) = (d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared());
            let full = (a + r.dot(&d.suu), b + r.dot(&d.suv), c + r.dot(&d.svv));
            // Parameters held at a border they are pushed against.
            let held = [
                (uv.x <= u[0] && g.x > 0.0) || (uv.x >= u[1] && g.x < 0.0),
                (uv.y <= v[0] && g.y > 0.0) || (uv.y >= v[1] && g.y < 0.0),
            ];
            let mut step = descent(full, (a, b, c), g, held);
            let mut moved = false;
            for _ in 0..30 {
                let next = clamp(uv + step);
                let e = self.derivs(next);
                let distance = (e.s - p).norm_squared();
                if distance < best || (next - uv).norm() == 0.0 {
                    moved = distance < best;
                    (uv, d, best) = if moved { (next, e, distance) } else { (uv, d, best) };
                    break;
                }
                step *= 0.5;
            }
            if !moved {
                break;
            }
        }
        (uv, best)
    }
}

/// Newton step where the Hessian is positive definite, Gauss-Newton elsewhere, in the parameters not held.
fn descent(full: (f64, f64, f64), gauss: (f64, f64, f64), g: Vec2, held: [bool; 2]) -> Vec2 {
    let solve = |(a, b, c): (f64, f64, f64)| -> Option<Vec2> {
        match held {
            [true, true] => Some(Vec2::zeros()),
            [true, false] => (c > 0.0).then(|| Vec2::new(0.0, -g.y / c)),
            [false, true] => (a > 0.0).then(|| Vec2::new(-g.x / a, 0.0)),
            [false, false] => {
                let det = a * c - b * b;
                (a > 0.0 && det > 1e-14 * a * c)
                    .then(|| Vec2::new((b * g.y - c * g.x) / det, (b * g.x - a * g.y) / det))
            }
        }
    };
    solve(full).or_else(|| solve(gauss)).unwrap_or_else(|| {
        let scale = gauss.0.max(gauss.2).max(f64::MIN_POSITIVE);
        -g / scale
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Frame;

    #[test]
    fn closest_points_of_a_circle_and_a_torus_are_exact() {
        let circle = Curve3::ellipse_arc(&Frame::world(), 3.0, 3.0, 0.0, 6.0);
        let (t, d2) = circle.closest(&Vec3::new(-4.0, 0.0, 0.5));
        assert!((circle.point(t) - Vec3::new(-3.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((d2 - 1.25).abs() < 1e-12);
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
            let near = torus.closest_near(&p, uv + Vec2::new(0.1, -0.1));
            assert!((near.1.sqrt() - exact).abs() < 1e-10);
        }
    }
}
