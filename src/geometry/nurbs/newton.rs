//! Bounded Newton iteration for the point projection `min |S(u, v) - p|^2 / 2` over a parameter rectangle.

use super::derivs::SurfaceDerivs;
use crate::{Vec2, Vec3};

/// A rectangle of parameters; a direction of zero width is fixed.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Smallest parameters.
    pub low: Vec2,
    /// Largest parameters.
    pub high: Vec2,
}

impl Bounds {
    /// The unit square.
    pub const UNIT: Self = Self { low: Vec2::new(0.0, 0.0), high: Vec2::new(1.0, 1.0) };

    pub(super) fn clamp(&self, x: Vec2) -> Vec2 {
        x.sup(&self.low).inf(&self.high)
    }
}

/// Smallest eigenvalue of the modified Hessian relative to the first fundamental form. Doubled: steps in flat
/// directions of half the length.
const MODIFIED_EIGENVALUE_MIN: f64 = 0.05;

/// When an iteration ends.
struct Limits {
    /// Change of the parameters relative to the bounds.
    resolution: f64,
    iterations: u32,
    /// Halvings of one step.
    halvings: u32,
}

/// The next step is below rounding. Twice the iterations: twice the time where the iteration does not converge.
const TO_ROUNDING: Limits = Limits { resolution: 1e-12, iterations: 50, halvings: 40 };
/// Limits of [`descend_coarsely`]. Convergence is quadratic: the error that remains is about the square of the
/// resolution. An iteration that needs more is better replaced by a search.
const COARSE: Limits = Limits { resolution: 1e-6, iterations: 12, halvings: 6 };

/// Local minimum of the distance reached from `start`: parameters and squared distance.
pub fn descend(
    derivs: impl Fn(Vec2) -> SurfaceDerivs,
    p: &Vec3,
    start: Vec2,
    bounds: Bounds,
) -> (Vec2, f64) {
    let (x, _, distance) = descend_to(derivs, p, start, (bounds, TO_ROUNDING));
    (x, distance)
}

/// As [`descend`], with parameters to 1e-6 of the bounds or better. Also returns the derivatives.
pub fn descend_coarsely(
    derivs: impl Fn(Vec2) -> SurfaceDerivs,
    p: &Vec3,
    start: Vec2,
    bounds: Bounds,
) -> (Vec2, SurfaceDerivs) {
    let (x, d, _) = descend_to(derivs, p, start, (bounds, COARSE));
    (x, d)
}

/// Local minimum reached from `start`: parameters, derivatives there, squared distance.
///
/// Newton steps are used where the Hessian is positive definite, at least along an active bound. Elsewhere the Hessian
/// is modified to be positive definite (Nocedal/Wright, section 3.4). Each step minimises the quadratic model within
/// the bounds and is halved until the distance does not increase.
fn descend_to(
    derivs: impl Fn(Vec2) -> SurfaceDerivs,
    p: &Vec3,
    start: Vec2,
    (bounds, limits): (Bounds, Limits),
) -> (Vec2, SurfaceDerivs, f64) {
    let mut x = bounds.clamp(start);
    let mut d = derivs(x);
    let mut best = (d.s - p).norm_squared();
    for _ in 0..limits.iterations {
        let mut step = step(&d, p, x, &bounds);
        let allowed = best + rounding(best, p);
        let mut taken = None;
        for _ in 0..limits.halvings {
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
        if moved <= limits.resolution * (bounds.high - bounds.low).max().min(1.0) {
            break;
        }
    }
    (x, d, best)
}

/// Rounding error of a squared distance near the foot point, from the rounding of the coordinates.
pub(super) fn rounding(distance_squared: f64, p: &Vec3) -> f64 {
    let distance = distance_squared.sqrt();
    4.0 * f64::EPSILON * distance * (distance + p.abs().max())
}

fn step(d: &SurfaceDerivs, p: &Vec3, x: Vec2, bounds: &Bounds) -> Vec2 {
    let r = d.s - p;
    let g = Vec2::new(r.dot(&d.su), r.dot(&d.sv));
    let gauss = [d.su.norm_squared(), d.su.dot(&d.sv), d.sv.norm_squared()];
    let full = [gauss[0] + r.dot(&d.suu), gauss[1] + r.dot(&d.suv), gauss[2] + r.dot(&d.svv)];
    let room = [bounds.low - x, bounds.high - x];
    // On active bounds the restricted Hessian may be positive definite where the full one is not.
    let along = room.map(|end| {
        let held =
            |k: usize| (room[0][k] >= 0.0 && g[k] >= 0.0) || (room[1][k] <= 0.0 && g[k] <= 0.0);
        Vec2::from_fn(|k, _| if held(k) { 0.0 } else { end[k] })
    });
    bounded_step(full, g, room)
        .or_else(|| bounded_step(full, g, along))
        .or_else(|| bounded_step(positive_definite(full, gauss)?, g, room))
        .or_else(|| bounded_step(gauss, g, room))
        .unwrap_or_else(|| -g / gauss[0].max(gauss[2]).max(f64::MIN_POSITIVE))
}

/// The Hessian with the absolute values of its eigenvalues relative to the first fundamental form `gauss`, bounded
/// below by [`MODIFIED_EIGENVALUE_MIN`]. Large eigenvalues keep their magnitude and thus their step length. `None`
/// where the first fundamental form is singular.
fn positive_definite([a, b, c]: [f64; 3], gauss: [f64; 3]) -> Option<[f64; 3]> {
    let [e, f, g] = gauss;
    let det = e * g - f * f;
    if det.is_nan() || det <= 1e-14 * e * g {
        return None;
    }
    let mean = 0.5 * (e * c - 2.0 * f * b + g * a) / det;
    let spread = (mean * mean - (a * c - b * b) / det).max(0.0).sqrt();
    let [largest, smallest] =
        [mean + spread, mean - spread].map(|x| x.abs().max(MODIFIED_EIGENVALUE_MIN));
    let ratio = if spread > 0.0 { (largest - smallest) / (2.0 * spread) } else { 0.0 };
    let rest = largest - ratio * (mean + spread);
    Some([ratio * a + rest * e, ratio * b + rest * f, ratio * c + rest * g])
}

/// Minimiser of `g . s + s . H s / 2` for steps between `room[0]` and `room[1]`; `None` unless `H = [a, b, c]` is
/// positive definite.
pub fn bounded_step([a, b, c]: [f64; 3], g: Vec2, room: [Vec2; 2]) -> Option<Vec2> {
    let det = a * c - b * b;
    let wide = [0, 1].map(|k| room[0][k] < room[1][k]);
    if wide[0] && wide[1] && a > 0.0 && det > 1e-14 * a * c {
        let step = Vec2::new((b * g.y - c * g.x) / det, (b * g.x - a * g.y) / det);
        if (0..2).all(|k| room[0][k] <= step[k] && step[k] <= room[1][k]) {
            return Some(step);
        }
    } else if wide == [true, true] || (wide[0] && a <= 0.0) || (wide[1] && c <= 0.0) {
        return None;
    }
    // The minimiser lies on a side of the rectangle.
    let value = |s: &Vec2| g.dot(s) + 0.5 * (a * s.x * s.x + c * s.y * s.y) + b * s.x * s.y;
    let side = |k: usize, end: usize| {
        let (other, curvature) = (1 - k, if k == 0 { c } else { a });
        let mut s = Vec2::zeros();
        s[k] = room[end][k];
        let free = -(g[other] + b * s[k]) / curvature;
        s[other] = if free.is_finite() { free } else { 0.0 };
        s.sup(&room[0]).inf(&room[1])
    };
    let sides = [side(0, 0), side(0, 1), side(1, 0), side(1, 1)];
    sides.into_iter().min_by(|x, y| value(x).total_cmp(&value(y)))
}

/// `-H^-1 g` in the free parameters; `None` unless H is positive definite there.
pub fn newton_step([a, b, c]: [f64; 3], g: Vec2, held: [bool; 2]) -> Option<Vec2> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bounded_step_minimises_the_model_over_dense_samples() {
        let room = [Vec2::new(-0.5, -0.2), Vec2::new(1.5, 0.0)];
        let hessians = [[2.0, 0.0, 1.0], [1.0, 0.9, 1.0], [3.0, -1.7, 1.0]];
        for (h, k) in hessians.into_iter().flat_map(|h| (0..16).map(move |k| (h, k))) {
            let g = 2.0 * Vec2::new(f64::from(k % 4) - 1.5, f64::from(k / 4) - 1.5);
            let value = |s: Vec2| {
                let [a, b, c] = h;
                g.dot(&s) + 0.5 * (a * s.x * s.x + c * s.y * s.y) + b * s.x * s.y
            };
            let at = |i: i32, j: i32| {
                room[0]
                    + (room[1] - room[0]).component_mul(&(Vec2::new(i.into(), j.into()) / 400.0))
            };
            let dense = (0..=400).flat_map(|i| (0..=400).map(move |j| value(at(i, j))));
            let dense = dense.fold(f64::INFINITY, f64::min);
            let found = value(bounded_step(h, g, room).unwrap());
            assert!(found <= dense && dense - found < 1e-3, "{h:?} {g:?}: {found} {dense}");
        }
        assert_eq!(bounded_step([1.0, 2.0, 1.0], Vec2::x(), room), None);
    }

    #[test]
    fn a_direction_without_width_is_held() {
        let room = [Vec2::new(0.0, -1.0), Vec2::new(0.0, 1.0)];
        let found = bounded_step([0.0, 0.0, 2.0], Vec2::new(5.0, 1.0), room);
        assert_eq!(found, Some(Vec2::new(0.0, -0.5)));
        assert_eq!(bounded_step([1.0, 0.0, 0.0], Vec2::new(5.0, 1.0), room), None);
    }

    /// A narrow valley oblique to the rectangle: full Newton steps leave the bounds repeatedly.
    #[test]
    fn a_descent_to_a_border_takes_few_points() {
        let evaluated = std::cell::Cell::new(0);
        let derivs = |x: Vec2| {
            evaluated.set(evaluated.get() + 1);
            let across = x.x - 0.6 * x.y;
            SurfaceDerivs {
                s: Vec3::new(x.x, x.y, 40.0 * across * across),
                su: Vec3::new(1.0, 0.0, 80.0 * across),
                sv: Vec3::new(0.0, 1.0, -48.0 * across),
                suu: Vec3::new(0.0, 0.0, 80.0),
                suv: Vec3::new(0.0, 0.0, -48.0),
                svv: Vec3::new(0.0, 0.0, 28.8),
            }
        };
        let bounds = Bounds { low: Vec2::new(0.0, 0.0), high: Vec2::new(1.0, 1.0) };
        let p = Vec3::new(2.0, 3.0, -1.0);
        let (x, squared) = descend(derivs, &p, Vec2::new(1.0, 0.0), bounds);
        let searched = evaluated.get();
        let at = |i: i32, j: i32| derivs(Vec2::new(f64::from(i), f64::from(j)) / 1000.0).s - p;
        let dense = (0..=1000).flat_map(|i| (0..=1000).map(move |j| at(i, j).norm_squared()));
        let dense = dense.fold(f64::INFINITY, f64::min);
        assert!(squared <= dense && dense - squared < 1e-5, "{x:?}: {squared} {dense}");
        assert!(searched <= 30, "{searched}");
    }

    #[test]
    fn the_modified_hessian_is_positive_definite_in_the_metric() {
        // Relative to the metric the eigenvalues are 3 and -2 along (1, 1) and (1, -1).
        let gauss = [4.0, 0.0, 1.0];
        let scaled = |m: [f64; 3]| [4.0 * m[0], 2.0 * m[1], m[2]];
        let found = positive_definite(scaled([0.5, 2.5, 0.5]), gauss).unwrap();
        let expected = scaled([2.5, 0.5, 2.5]);
        assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?}");
        assert_eq!(positive_definite([8.0, 0.0, 1.0], gauss), Some([8.0, 0.0, 1.0]));
        assert_eq!(positive_definite([-8.0, 0.0, -2.0], gauss), Some([8.0, 0.0, 2.0]));
        assert_eq!(positive_definite([1.0, 0.0, 1.0], [0.0, 0.0, 1.0]), None);
    }

    /// Concave across the active side: Newton along that side converges, Gauss-Newton needs many steps.
    #[test]
    fn a_descent_ends_exactly_on_a_side_it_is_pushed_against() {
        let derivs = |x: Vec2| SurfaceDerivs {
            s: Vec3::new(x.x, x.y, 2.0 * x.x * x.x - 3.0 * x.y * x.y),
            su: Vec3::new(1.0, 0.0, 4.0 * x.x),
            sv: Vec3::new(0.0, 1.0, -6.0 * x.y),
            suu: Vec3::new(0.0, 0.0, 4.0),
            suv: Vec3::zeros(),
            svv: Vec3::new(0.0, 0.0, -6.0),
        };
        let bounds = Bounds { low: Vec2::new(-1.0, -1.0), high: Vec2::new(1.0, 0.25) };
        let p = Vec3::new(0.8, 3.0, -8.0);
        let (x, _) = descend(derivs, &p, Vec2::new(-0.3, 0.2), bounds);
        let d = derivs(x);
        let slant = d.su.dot(&(d.s - p)) / (d.su.norm() * (d.s - p).norm());
        assert!(x.y == 0.25 && slant.abs() < 1e-12, "{x:?} {slant:e}");
    }
}
