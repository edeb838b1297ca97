//! Projection of a point on a piece of a patch: bounded Newton on the squared distance (Eq. 19-23).
//!
//! | symbol | meaning |
//! |---|---|
//! | `q` | `p - S(eta, zeta)` |
//! | `g` | gradient of `|q|^2 / 2`: `-q . S_i` (Eq. 19) |
//! | `h` | its Hessian: `S_i . S_j - q . S_ij` |
//!
//! The iterate never leaves the piece: a step is cut at the first side it meets, a side whose multiplier
//! pushes outward is kept, the distance never grows. Where the Hessian is not positive definite the metric
//! takes its place.

use super::piece::{Domain, Piece};
use crate::geometry::{Vec2, Vec3};
use crate::tool::Patch;

/// Parameters of the nearest point found in the piece and its squared distance [mm^2].
pub(super) fn nearest_in_piece(p: &Vec3, patch: &Patch, piece: &Piece) -> (Vec2, f64) {
    let (mut start, mut best) = (4, f64::INFINITY);
    for (k, s) in piece.samples.iter().enumerate() {
        let d = (p - s).norm_squared();
        if d < best {
            (start, best) = (k, d);
        }
    }
    descend(p, patch, &piece.domain, piece.sample_at(start))
}

/// Local minimum of the squared distance reached from `x` inside `domain`.
pub(super) fn descend(p: &Vec3, patch: &Patch, domain: &Domain, mut x: Vec2) -> (Vec2, f64) {
    const MAX_STEPS: usize = 60;
    let mut model = Quadratic::at(p, patch, x);
    for _ in 0..MAX_STEPS {
        let step = bounded_step(&model, domain, x);
        if step.norm_squared() == 0.0 || model.predicted(&step) <= 1e-28 * model.scale {
            break;
        }
        let Some((next, at)) = backtrack(p, patch, domain, &model, x, step) else { break };
        let moved = (next - x).amax();
        (x, model) = (next, at);
        if moved <= 1e-15 {
            break;
        }
    }
    (x, model.distance_squared)
}

/// The squared distance and its two derivatives at a point of the patch.
struct Quadratic {
    distance_squared: f64,
    gradient: Vec2,
    /// Positive definite: the Hessian, or the metric where that is not.
    hessian: [f64; 3],
    scale: f64,
}

impl Quadratic {
    fn at(p: &Vec3, patch: &Patch, x: Vec2) -> Self {
        let d = patch.derivs(x.x, x.y);
        let q = p - d.s;
        let metric = [d.d1.norm_squared(), d.d1.dot(&d.d2), d.d2.norm_squared()];
        let full =
            [metric[0] - q.dot(&d.d11), metric[1] - q.dot(&d.d12), metric[2] - q.dot(&d.d22)];
        let definite = |h: &[f64; 3], share: f64| {
            h[0] > share * metric[0]
                && h[2] > share * metric[2]
                && h[0] * h[2] - h[1] * h[1] > share * h[0] * h[2]
        };
        let floor = 1e-14 * (metric[0] + metric[2]);
        let hessian = if definite(&full, 1e-8) {
            full
        } else {
            [metric[0] + floor, metric[1], metric[2] + floor]
        };
        Self {
            distance_squared: q.norm_squared(),
            gradient: Vec2::new(-q.dot(&d.d1), -q.dot(&d.d2)),
            hessian,
            scale: metric[0] + metric[2],
        }
    }

    /// `h (a, b)`.
    fn form(&self, a: &Vec2, b: &Vec2) -> f64 {
        let h = &self.hessian;
        h[0] * a.x * b.x + h[1] * (a.x * b.y + a.y * b.x) + h[2] * a.y * b.y
    }

    fn newton(&self) -> Vec2 {
        let [a, b, c] = self.hessian;
        let det = a * c - b * b;
        if det.is_nan() || det <= 0.0 {
            return -self.gradient / self.scale.max(1e-300);
        }
        Vec2::new(
            b * self.gradient.y - c * self.gradient.x,
            b * self.gradient.x - a * self.gradient.y,
        ) / det
    }

    /// Decrease of `|q|^2 / 2` the model promises for `step`.
    fn predicted(&self, step: &Vec2) -> f64 {
        -self.gradient.dot(step) - 0.5 * self.form(step, step)
    }
}

const ON_SIDE: f64 = 1e-14;

/// Newton's step, or the step along the side that holds the iterate; zero at a bounded minimum.
fn bounded_step(model: &Quadratic, domain: &Domain, x: Vec2) -> Vec2 {
    let held = |step: &Vec2| {
        (0..domain.sides()).find(|&k| {
            let (a, b) = domain.side(k);
            a.dot(&x) >= b - ON_SIDE && a.dot(step) > 0.0
        })
    };
    let free = model.newton();
    let Some(first) = held(&free) else { return free };
    let mut choice = Vec2::zeros();
    // A corner may be left along either of its sides: the one that promises more.
    for k in 0..domain.sides() {
        let (a, b) = domain.side(k);
        if a.dot(&x) < b - ON_SIDE && k != first {
            continue;
        }
        let along = Vec2::new(-a.y, a.x);
        let curvature = model.form(&along, &along);
        if curvature.is_nan() || curvature <= 0.0 {
            continue;
        }
        let step = along * (-model.gradient.dot(&along) / curvature);
        let leaves = (0..domain.sides()).any(|j| {
            let (a, b) = domain.side(j);
            j != k && a.dot(&x) >= b - ON_SIDE && a.dot(&step) > 0.0
        });
        if !leaves && model.predicted(&step) > model.predicted(&choice) {
            choice = step;
        }
    }
    choice
}

/// Cuts `step` at the sides, then halves it until the distance falls.
fn backtrack(
    p: &Vec3,
    patch: &Patch,
    domain: &Domain,
    model: &Quadratic,
    x: Vec2,
    step: Vec2,
) -> Option<(Vec2, Quadratic)> {
    let mut t = 1.0_f64;
    let mut met = None;
    for k in 0..domain.sides() {
        let (a, b) = domain.side(k);
        let (rate, room) = (a.dot(&step), b - a.dot(&x));
        if rate > 0.0 && t * rate > room.max(0.0) {
            t = (room / rate).max(0.0);
            met = Some(k);
        }
    }
    // Below this the distance cannot tell better from worse, but the gradient still can.
    let d = model.distance_squared;
    let rounding = 1e-13 * d + 1e-14 * d.sqrt() * p.amax();
    for halving in 0..30 {
        let mut next = x + step * t;
        if let Some(k) = met.filter(|_| halving == 0) {
            let (a, b) = domain.side(k);
            next += a * (b - a.dot(&next));
        }
        let at = Quadratic::at(p, patch, next);
        if at.distance_squared <= model.distance_squared + rounding {
            return Some((next, at));
        }
        t *= 0.5;
    }
    None
}
