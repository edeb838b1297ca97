//! Projection of a point onto a piece: bounded Newton iteration on half the squared distance (Eq. 19-23).
//!
//! | symbol | meaning |
//! |---|---|
//! | `q` | `p - S(u, v)` |
//! | `F` | `|q|^2 / 2` |
//! | `g` | its gradient `-q . S_i` (Eq. 19: zero at a foot point) |
//! | `h` | its second derivatives `S_i . S_j - q . S_ij` |
//!
//! Each step minimises the quadratic model over the whole domain including sides and corners; the distance never
//! increases. Where `h` is not positive definite the metric is used instead (Gauss-Newton). Where `F` is convex the
//! gradient provides a lower bound, and the iteration stops when the piece cannot improve the best distance.

use super::form::{Form, Shape, padded};
use super::piece::floor_about;
use super::wide::Wide;
use kanagata_geometry::{Vec2, Vec3};

/// A minimum of `F` over a domain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum {
    pub(super) at: Vec2,
    /// `F` there [mm^2].
    pub(super) value: f64,
}

/// A projection problem.
pub(super) struct Descent<'a, W> {
    pub(super) wide: W,
    pub(super) form: &'a Form,
    pub(super) shape: Shape,
    /// Factor on the corners of the domain.
    pub(super) scale: f64,
    /// From the centre to the point.
    pub(super) w: Vec3,
    /// [`super::piece::Floor::min_curvature`], valid over the whole domain.
    pub(super) min_curvature: [f64; 2],
    /// Upper limit of useful values [mm^2].
    pub(super) limit: f64,
}

/// Quadratic model of `F` at a point.
#[derive(Clone, Copy)]
pub(super) struct Model {
    value: f64,
    gradient: Vec2,
    hessian: [f64; 3],
}

/// Step length whose square is negligible.
const NEGLIGIBLE_STEP: f64 = 1e-8;

impl<W: Wide> Descent<'_, W> {
    /// A local minimum over the domain from `start`; `None` when `F` is above the limit all over it.
    #[inline(always)]
    pub(super) fn run(&self, start: Vec2) -> Option<Minimum> {
        const ITERATIONS_MAX: usize = 60;
        let mut x = start;
        let (mut model, mut sound) = self.model(x);
        for _ in 0..ITERATIONS_MAX {
            if model.value > self.limit && self.floor(&model, &x) > self.limit {
                return None;
            }
            let step = self.minimiser(&model, &x) - x;
            let size = step.amax();
            let expected = model.change(&step);
            if sound && size <= NEGLIGIBLE_STEP {
                return Some(Minimum { at: x + step, value: (model.value + expected).max(0.0) });
            }
            if size <= 1e-15 || expected >= -1e-30 * model.hessian[0].max(model.hessian[2]) {
                break;
            }
            let Some((next, at, fine)) = self.reduced_step(&model, x, step) else { break };
            (x, model, sound) = (next, at, fine);
        }
        Some(Minimum { at: x, value: model.value })
    }

    /// Model at `x`, and whether its second derivatives are those of `F`.
    #[inline(always)]
    fn model(&self, x: Vec2) -> (Model, bool) {
        if self.form.high.is_none() {
            return self.low_model(x);
        }
        let d = self.form.derivs(x.x, x.y);
        let q = self.w - d.s;
        let metric = [d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared()];
        let full =
            [metric[0] - q.dot(&d.d11), metric[1] - q.dot(&d.d12), metric[2] - q.dot(&d.d22)];
        let (hessian, sound) = definite(full, metric);
        let gradient = Vec2::new(-q.dot(&d.d1), -q.dot(&d.d2));
        (Model { value: 0.5 * q.norm_squared(), gradient, hessian }, sound)
    }

    /// The same for degrees up to two.
    #[inline(always)]
    fn low_model(&self, x: Vec2) -> (Model, bool) {
        let wide = self.wide;
        let (add, mul) = (|a, b| wide.add(a, b), |a, b| wide.mul(a, b));
        let [c01, c02, c10, c11, c12, c20, c21, c22] = self.form.padded.map(|c| wide.four(c));
        let [u, v, u2, v2] = [x.x, x.y, 2.0 * x.x, 2.0 * x.y].map(|t| wide.splat(t));
        let a1 = add(c10, mul(add(c11, mul(c12, v)), v));
        let a2 = add(c20, mul(add(c21, mul(c22, v)), v));
        let b1 = add(c11, mul(c12, v2));
        let b2 = add(c21, mul(c22, v2));
        let s = add(mul(add(c01, mul(c02, v)), v), mul(add(a1, mul(a2, u)), u));
        let d1 = add(a1, mul(a2, u2));
        let d2 = add(add(c01, mul(c02, v2)), mul(add(b1, mul(b2, u)), u));
        let d12 = add(b1, mul(b2, u2));
        let half22 = add(c02, mul(add(c12, mul(c22, u)), u));
        let q = wide.sub(wide.four(padded(&self.w)), s);
        let [e, f, g, g1] = wide.sums([mul(d1, d1), mul(d1, d2), mul(d2, d2), mul(q, d1)]);
        let [q11, q12, q22, g2] = wide.sums([mul(q, a2), mul(q, d12), mul(q, half22), mul(q, d2)]);
        let [size2, _] = wide.two_sums(mul(q, q), q);
        let full = [e - 2.0 * q11, f - q12, g - 2.0 * q22];
        let (hessian, sound) = definite(full, [e, f, g]);
        (Model { value: 0.5 * size2, gradient: Vec2::new(-g1, -g2), hessian }, sound)
    }

    #[inline(always)]
    fn floor(&self, model: &Model, x: &Vec2) -> f64 {
        floor_about(self.shape, x, model.value, &model.gradient, self.min_curvature)
    }

    /// Minimiser of the model at `x` over the domain.
    #[inline(always)]
    fn minimiser(&self, model: &Model, x: &Vec2) -> Vec2 {
        minimiser_of(model, x, self.shape, self.scale)
    }

    /// Halves `step` until the distance decreases.
    #[inline(always)]
    fn reduced_step(&self, model: &Model, x: Vec2, step: Vec2) -> Option<(Vec2, Model, bool)> {
        // Below this difference the distance is rounding, but the gradient is still significant.
        let rounding = 1e-13 * model.value + 1e-15 * self.w.norm_squared();
        let mut fraction = 1.0;
        for _ in 0..30 {
            let next = x + step * fraction;
            let (at, sound) = self.model(next);
            if at.value <= model.value + rounding {
                return Some((next, at, sound));
            }
            fraction *= 0.5;
        }
        None
    }
}

/// `full` where it is safely positive definite, otherwise the metric.
#[inline(always)]
fn definite(full: [f64; 3], metric: [f64; 3]) -> ([f64; 3], bool) {
    const DEFINITENESS_MIN: f64 = 1e-8;
    let sound = full[0] > DEFINITENESS_MIN * metric[0]
        && full[2] > DEFINITENESS_MIN * metric[2]
        && full[0] * full[2] * (1.0 - DEFINITENESS_MIN) > full[1] * full[1];
    if sound {
        return (full, true);
    }
    let floor = 1e-14 * (metric[0] + metric[2]);
    ([metric[0] + floor, metric[1], metric[2] + floor], false)
}

/// Minimiser of the model with these derivatives at the centre of `shape`: a starting point for Newton's iteration.
#[inline(always)]
pub(super) fn start(gradient: Vec2, hessian: [f64; 3], metric: [f64; 3], shape: Shape) -> Vec2 {
    let (hessian, _) = definite(hessian, metric);
    minimiser_of(&Model { value: 0.0, gradient, hessian }, &Vec2::zeros(), shape, 1.0)
}

/// Minimiser of a convex quadratic over the domain: unconstrained, or on one of the violated sides.
#[inline(always)]
fn minimiser_of(model: &Model, x: &Vec2, shape: Shape, scale: f64) -> Vec2 {
    let free = x + model.newton();
    match shape {
        Shape::Square if free.amax() <= scale => free,
        Shape::Square => {
            let mut best = (f64::INFINITY, *x);
            for axis in 0..2 {
                if free[axis].abs() > scale {
                    let (a, b) = (model.hessian[2 * axis], model.hessian[2 - 2 * axis]);
                    debug_assert!(a > 0.0);
                    let mut step = Vec2::zeros();
                    step[axis] = scale.copysign(free[axis]) - x[axis];
                    let other = 1 - axis;
                    let pull = model.gradient[other] + model.hessian[1] * step[axis];
                    let to = (x[other] - pull / b).clamp(-scale, scale);
                    step[other] = to - x[other];
                    let value = model.change(&step);
                    if value < best.0 {
                        let mut at = *x;
                        at[axis] = scale.copysign(free[axis]);
                        at[other] = to;
                        best = (value, at);
                    }
                }
            }
            best.1
        }
        Shape::Triangle => minimiser_in_triangle(model, x, free, scale),
    }
}

fn minimiser_in_triangle(model: &Model, x: &Vec2, free: Vec2, scale: f64) -> Vec2 {
    let third = scale / 3.0;
    let out = [-third - free.y, free.x + free.y - third, -third - free.x];
    if out.iter().all(|o| *o <= 0.0) {
        return free;
    }
    let c = shape_corners(scale);
    let mut best = (f64::INFINITY, *x);
    for k in (0..3).filter(|&k| out[k] > 0.0) {
        let (a, b) = (c[k], c[(k + 1) % 3]);
        let (along, from) = (b - a, a - x);
        let slope = model.gradient.dot(&along) + model.form(&along, &from);
        let t = (-slope / model.form(&along, &along)).clamp(0.0, 1.0);
        let at = if t == 1.0 { b } else { a + along * t };
        let value = model.change(&(at - x));
        if value < best.0 {
            best = (value, at);
        }
    }
    best.1
}

fn shape_corners(scale: f64) -> [Vec2; 3] {
    let [a, b, c, _] = Shape::Triangle.corners();
    [a * scale, b * scale, c * scale]
}

impl Model {
    #[inline(always)]
    fn newton(&self) -> Vec2 {
        let ([a, b, c], g) = (self.hessian, self.gradient);
        Vec2::new(b * g.y - c * g.x, b * g.x - a * g.y) / (a * c - b * b)
    }

    /// `a h b`.
    #[inline(always)]
    fn form(&self, a: &Vec2, b: &Vec2) -> f64 {
        let h = &self.hessian;
        h[0] * a.x * b.x + h[1] * (a.x * b.y + a.y * b.x) + h[2] * a.y * b.y
    }

    /// Change of the model over `step`.
    #[inline(always)]
    fn change(&self, step: &Vec2) -> f64 {
        self.gradient.dot(step) + 0.5 * self.form(step, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with a fine grid of the domain.
    #[test]
    fn the_lowest_point_of_a_quadratic_over_the_domain() {
        let mut seed = 3u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((seed >> 33) as f64) / (1u64 << 31) as f64 - 0.5
        };
        for shape in [Shape::Square, Shape::Triangle] {
            for _ in 0..200 {
                let gradient = Vec2::new(random(), random()) * 4.0;
                let (a, b) = (random() + 0.6, random() + 0.6);
                let hessian = [a, 1.9 * random() * (a * b).sqrt(), b];
                let x = Vec2::new(random(), random()) * 0.2;
                let model = Model { value: 0.0, gradient, hessian };
                let found = minimiser_of(&model, &x, shape, 1.1);
                assert!(shape.holds(&(found / 1.1)));
                let c = shape.corners();
                let mut minimum = f64::INFINITY;
                for i in 0..=60 {
                    for j in 0..=60 {
                        let (s, t) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                        let (a, b) = (c[0] + (c[1] - c[0]) * s, c[3] + (c[2] - c[3]) * s);
                        let y = (a + (b - a) * t) * 1.1;
                        minimum = minimum.min(model.change(&(y - x)));
                    }
                }
                let value = model.change(&(found - x));
                assert!(value <= minimum + 1e-12 && value >= minimum - 0.01, "{value} {minimum}");
            }
        }
    }
}
