//! Bounded Newton for half the squared distance to a point, over a rectangle of parameters.

use super::surface::SurfaceDerivs;
use crate::geometry::{Vec2, Vec3};

/// A rectangle of parameters; a direction without width is held.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub low: Vec2,
    pub high: Vec2,
}

impl Bounds {
    pub const UNIT: Self = Self { low: Vec2::new(0.0, 0.0), high: Vec2::new(1.0, 1.0) };

    fn clamp(&self, x: Vec2) -> Vec2 {
        x.sup(&self.low).inf(&self.high)
    }
}

/// Newton steps at most.
const STEPS: u32 = 50;

/// The local minimum downhill of `start`: parameters and squared distance. Newton where the Hessian is positive
/// definite, Gauss-Newton elsewhere, steps cut at the bounds and halved until the distance does not grow.
pub(super) fn descend(
    derivs: impl Fn(Vec2) -> SurfaceDerivs,
    p: &Vec3,
    start: Vec2,
    bounds: Bounds,
) -> (Vec2, f64) {
    let mut x = bounds.clamp(start);
    let mut d = derivs(x);
    let mut best = (d.s - p).norm_squared();
    for _ in 0..STEPS {
        let mut step = step(&d, p, x, &bounds);
        let allowed = best + rounding(best, p);
        let mut taken = None;
        for _ in 0..40 {
            let next = bounds.clamp(x + step);
            if next == x {
                break;
            }
            let e = derivs(next);
            let distance = (e.s - p).norm_squared();
            if distance <= allowed {
                taken = Some((next, e, distance));
                break;
            }
            step *= 0.5;
        }
        let Some((next, e, distance)) = taken else { break };
        let moved = (next - x).abs().max();
        (x, d, best) = (next, e, distance);
        // Quadratic: the next step would be lost in rounding.
        if moved <= 1e-12 * (bounds.high - bounds.low).max().min(1.0) {
            break;
        }
    }
    (x, best)
}

/// Near the foot the squared distances differ by the rounding of coordinates only.
pub(super) fn rounding(distance_squared: f64, p: &Vec3) -> f64 {
    let distance = distance_squared.sqrt();
    4.0 * f64::EPSILON * distance * (distance + p.abs().max())
}

fn step(d: &SurfaceDerivs, p: &Vec3, x: Vec2, bounds: &Bounds) -> Vec2 {
    let r = d.s - p;
    let g = Vec2::new(r.dot(&d.su), r.dot(&d.sv));
    let gauss = [d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared()];
    let full = [gauss[0] + r.dot(&d.suu), gauss[1] + r.dot(&d.suv), gauss[2] + r.dot(&d.svv)];
    let held = [0, 1].map(|k| {
        bounds.low[k] >= bounds.high[k]
            || (x[k] <= bounds.low[k] && g[k] >= 0.0)
            || (x[k] >= bounds.high[k] && g[k] <= 0.0)
    });
    newton_step(full, g, held)
        .or_else(|| newton_step(gauss, g, held))
        .unwrap_or_else(|| -g / gauss[0].max(gauss[2]).max(f64::MIN_POSITIVE))
}

/// `-H^-1 g` in the parameters not held; `None` unless H is positive definite there.
pub(crate) fn newton_step([a, b, c]: [f64; 3], g: Vec2, held: [bool; 2]) -> Option<Vec2> {
    match held {
        [true, true] => Some(Vec2::zeros()),
        [true, false] => (c > 0.0).then(|| Vec2::new(0.0, -g.y / c)),
        [false, true] => (a > 0.0).then(|| Vec2::new(-g.x / a, 0.0)),
        [false, false] => {
            let det = a * c - b * b;
            let definite = a > 0.0 && det > 1e-14 * a * c;
            definite.then(|| Vec2::new((b * g.y - c * g.x) / det, (b * g.x - a * g.y) / det))
        }
    }
}
