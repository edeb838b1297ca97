//! Area and centroid of trimmed faces, and the volume enclosed by closed shells.

use std::cell::Cell;

use super::model::{Face, Model};
use super::trim_region::TrimRegion;
use kanagata_geometry::nurbs::{Curve2, FirstDerivs, Surface};
use kanagata_geometry::{Aabb, Vec2, Vec3};

/// Nodes and weights of the 15-point Kronrod rule on [-1, 1] (positive half, centre last) and the weights of the
/// embedded 7-point Gauss rule.
const KRONROD: [(f64, f64, f64); 8] = [
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_22, 0.0),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_55, 0.129_484_966_168_869_7),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_2, 0.0),
    (0.741_531_185_599_394_4, 0.140_653_259_715_525_9, 0.279_705_391_489_276_7),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_4, 0.381_830_050_505_118_9),
    (0.207_784_955_007_898_5, 0.204_432_940_075_298_9, 0.0),
    (0.0, 0.209_482_141_084_727_8, 0.417_959_183_673_469_4),
];

/// Area [mm^2] and first moment [mm^3].
type Moments = (f64, Vec3);
/// Integrand per unit area of the parameter plane.
type Density<'a> = &'a dyn Fn(&FirstDerivs) -> Moments;

fn add(a: Moments, b: Moments, by: f64) -> Moments {
    (a.0 + b.0 * by, a.1 + b.1 * by)
}

/// Kronrod and embedded Gauss integrals of `f` over `[a, b]`.
fn rule(f: &mut dyn FnMut(f64) -> Moments, a: f64, b: f64) -> (Moments, Moments) {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let zero = (0.0, Vec3::zeros());
    let (mut fine, mut coarse) = (zero, zero);
    for &(x, wk, wg) in &KRONROD {
        let mut value = f(middle + half * x);
        if x > 0.0 {
            value = add(value, f(middle - half * x), 1.0);
        }
        fine = add(fine, value, wk * half);
        coarse = add(coarse, value, wg * half);
    }
    (fine, coarse)
}

/// Maximum number of bisections per interval between breaks, on average: round-off noise must not be refined. Doubled:
/// twice the longest time of an integrand that does not converge.
const MEAN_BISECTIONS_MAX: usize = 60;
/// Difference of both rules, relative to the integral, that is attributed to rounding.
const ROUNDING_REL: f64 = 1e-13;

/// Surface evaluations allowed per control point of a face and its boundary. Of 8500 faces of 60 files the most
/// expensive needs 920 per point. Doubled: faces whose area does not converge take twice as long, 0.1 ms per point.
pub(super) const EVALUATIONS_PER_POINT: usize = 4_000;
const EVALUATIONS_BASE: usize = 200_000;
/// Multiple of the evaluation budget beyond which no further interval is integrated. Beyond the single budget no
/// interval is bisected.
const BUDGET_FACTOR_MAX: usize = 4;

/// Surface evaluations spent and allowed.
struct EvaluationBudget {
    used: Cell<usize>,
    allowed: usize,
}

impl EvaluationBudget {
    fn of(face: &Face) -> Self {
        let uses = face.loops.iter().flat_map(|l| &l.uses);
        let points: usize = uses.map(|u| u.pcurve.points().len()).sum();
        let points = face.surface.points().len() + points;
        Self { used: Cell::new(0), allowed: EVALUATIONS_BASE + EVALUATIONS_PER_POINT * points }
    }

    fn count(&self) {
        self.used.set(self.used.get() + 1);
    }

    fn is_exhausted(&self) -> bool {
        self.used.get() > self.allowed
    }

    fn is_exceeded(&self) -> bool {
        self.used.get() > BUDGET_FACTOR_MAX * self.allowed
    }
}

/// Adaptive Gauss-Kronrod quadrature over consecutive intervals. An interval is bisected while its two rules differ by
/// more than `tolerance` (absolute, on the area), at most 20 levels deep and within the evaluation budget.
fn integrate(
    f: &mut dyn FnMut(f64) -> Moments,
    breaks: &[f64],
    (tolerance, budget): (f64, &EvaluationBudget),
) -> Moments {
    let mut sum = (0.0, Vec3::zeros());
    let mut halvings = 0;
    let mut stack: Vec<(f64, f64, u32)> =
        breaks.windows(2).rev().map(|w| (w[0], w[1], 0)).collect();
    while let Some((a, b, depth)) = stack.pop() {
        if budget.is_exceeded() {
            break;
        }
        let (fine, coarse) = rule(f, a, b);
        let off = (fine.0 - coarse.0).abs();
        let enough = off <= tolerance || off <= ROUNDING_REL * fine.0.abs();
        let last =
            depth >= 20 || halvings >= MEAN_BISECTIONS_MAX * breaks.len() || budget.is_exhausted();
        if enough || last {
            sum = add(sum, fine, 1.0);
        } else {
            halvings += 1;
            let middle = 0.5 * (a + b);
            stack.push((middle, b, depth + 1));
            stack.push((a, middle, depth + 1));
        }
    }
    sum
}

/// Knots of one direction strictly between two parameters, with both ends, in increasing order.
fn breaks_between(knots: &[f64], a: f64, b: f64) -> Vec<f64> {
    let mut out = vec![a];
    out.extend(knots.iter().copied().filter(|&k| k > a && k < b));
    out.push(b);
    out.dedup();
    out
}

/// Area and first moment of a face with the density |su x sv|, and whether the evaluation budget sufficed.
fn moments(face: &Face, relative: f64) -> (Moments, bool) {
    let size = Aabb::of_points(face.surface.points()).diagonal();
    let density = |d: &FirstDerivs| {
        let da = d.su.cross(&d.sv).norm();
        (da, d.s * da)
    };
    surface_integral(face, relative * size * size, &density)
}

/// Surface integral of `density` by Green's theorem: the integral of `F dv` along the loops, where `F(u, v)` is the
/// integral of the density along u from the lowest parameter. `tolerance` is absolute, on the first component. The flag
/// is true when the evaluation budget sufficed.
fn surface_integral(face: &Face, tolerance: f64, density: Density<'_>) -> (Moments, bool) {
    let budget = EvaluationBudget::of(face);
    let surface = &face.surface;
    let region = TrimRegion::new(face);
    let [ku, kv] = surface.knots();
    // The tolerance of the inner integral applies per unit of v.
    let along_u = 1e-2 * tolerance / (region.high.y - region.low.y).max(f64::MIN_POSITIVE);
    let mut sum = (0.0, Vec3::zeros());
    for used in face.loops.iter().flat_map(|l| &l.uses) {
        let curve = &used.pcurve;
        let points = curve.points();
        if points.iter().all(|p| p.y == points[0].y) {
            continue;
        }
        let [a, b] = curve.domain();
        let mut breaks = breaks_between(curve.knots(), a, b);
        split_at_knots(&mut breaks, curve, kv);
        let mut along = |t: f64| {
            let d = curve.derivs(t);
            let inner = strip(surface, ku, region.low.x, d.c, (density, along_u, &budget));
            (inner.0 * d.d1.y, inner.1 * d.d1.y)
        };
        sum = add(sum, integrate(&mut along, &breaks, (1e-2 * tolerance, &budget)), 1.0);
    }
    (sum, !budget.is_exhausted())
}

/// Integral of the density along u from `low` to `uv.x` at constant v = `uv.y`.
fn strip(
    surface: &Surface,
    knots: &[f64],
    low: f64,
    uv: Vec2,
    (density, tolerance, budget): (Density<'_>, f64, &EvaluationBudget),
) -> Moments {
    let (from, to, sign) = if uv.x >= low { (low, uv.x, 1.0) } else { (uv.x, low, -1.0) };
    if to <= from {
        return (0.0, Vec3::zeros());
    }
    let line = surface.isoline(uv.y, [from, to]);
    let mut along = |u: f64| {
        budget.count();
        density(&line.derivs(u))
    };
    let found = integrate(&mut along, &breaks_between(knots, from, to), (tolerance, budget));
    (sign * found.0, found.1 * sign)
}

/// Adds the parameters at which a curve crosses a v knot line of the surface: the integrand has a kink there.
fn split_at_knots(breaks: &mut Vec<f64>, curve: &Curve2, knots: &[f64]) {
    let mut extra = Vec::new();
    for w in breaks.windows(2) {
        const STEPS: u32 = 16;
        let at = |k: u32| w[0] + (w[1] - w[0]) * f64::from(k) / f64::from(STEPS);
        for k in 0..STEPS {
            let (mut a, mut b) = (at(k), at(k + 1));
            let (ya, yb) = (curve.point(a).y, curve.point(b).y);
            for &knot in knots.iter().filter(|&&t| (t - ya) * (t - yb) < 0.0) {
                for _ in 0..60 {
                    let middle = 0.5 * (a + b);
                    if (curve.point(middle).y - knot) * (ya - knot) > 0.0 {
                        a = middle;
                    } else {
                        b = middle;
                    }
                }
                extra.push(0.5 * (a + b));
            }
        }
    }
    breaks.extend(extra);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|x, y| *x - *y <= 0.0);
}

/// Area and centroid of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Area [mm^2].
    pub area_mm2: f64,
    /// Centroid [mm]; zero for a face of zero area.
    pub centroid: Vec3,
    /// True when the area is within its tolerance; false when the quadrature did not converge within the evaluation
    /// budget.
    pub is_within: bool,
}

impl Face {
    /// Area [mm^2] by adaptive quadrature, with an error of about `relative` (for example 1e-9) times the squared size
    /// of the face.
    #[must_use]
    pub fn area(&self, relative: f64) -> f64 {
        moments(self, relative).0.0.abs()
    }

    /// Integral of the outward unit normal over the face [mm^2], with an error of about `relative` times the squared
    /// size of the face.
    #[must_use]
    pub fn vector_area(&self, relative: f64) -> Vec3 {
        let size = Aabb::of_points(self.surface.points()).diagonal();
        let density = |d: &FirstDerivs| {
            let normal = d.su.cross(&d.sv);
            (normal.norm(), normal)
        };
        let sum = surface_integral(self, relative * size * size, &density).0.1;
        if self.flipped { -sum } else { sum }
    }

    /// Area and centroid, with an error of about `relative` times the squared size of the face.
    #[must_use]
    pub fn measured(&self, relative: f64) -> Measured {
        let ((area, moment), is_within) = moments(self, relative);
        let centroid = if area == 0.0 { Vec3::zeros() } else { moment / area };
        Measured { area_mm2: area.abs(), centroid, is_within }
    }
}

impl Model {
    /// Total area of all faces [mm^2], with a relative error of about 1e-9.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.measured_area().0
    }

    /// As [`Self::area`], with the faces whose area did not converge within the evaluation budget.
    #[must_use]
    pub fn measured_area(&self) -> (f64, Vec<usize>) {
        use rayon::prelude::*;
        let all: Vec<Measured> = self.faces.par_iter().map(|f| f.measured(1e-10)).collect();
        let sum = all.iter().fold(0.0, |sum, m| sum + m.area_mm2);
        (sum, (0..all.len()).filter(|&f| !all[f].is_within).collect())
    }

    /// Volume enclosed by closed faces [mm^3] by the divergence theorem, with the normals of the faces and the origin
    /// at the middle of the first face.
    pub(super) fn volume_of(&self, faces: &[usize]) -> f64 {
        use rayon::prelude::*;
        let Some(first) = faces.first() else { return 0.0 };
        let origin = Aabb::of_points(self.faces[*first].surface.points()).center();
        let flux = |&f: &usize| {
            let face = &self.faces[f];
            let size = Aabb::of_points(face.surface.points()).diagonal();
            let density =
                |d: &FirstDerivs| ((d.s - origin).dot(&d.su.cross(&d.sv)) / 3.0, Vec3::zeros());
            let sum = surface_integral(face, 1e-9 * size.powi(3), &density).0.0;
            if face.flipped { -sum } else { sum }
        };
        let all: Vec<f64> = faces.par_iter().map(flux).collect();
        all.iter().sum()
    }

    /// Area centroid of all faces [mm]; `None` for a model of zero area.
    #[must_use]
    pub fn area_centroid(&self) -> Option<Vec3> {
        use rayon::prelude::*;
        let all: Vec<Moments> = self.faces.par_iter().map(|f| moments(f, 1e-10).0).collect();
        // A face with a clockwise outer loop has negative area and a moment of the same sign.
        let sum = all.iter().fold((0.0, Vec3::zeros()), |sum, &m| add(sum, m, m.0.signum()));
        (sum.0 > 0.0).then(|| sum.1 / sum.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rules differ on every interval with a step; without a budget a comb of steps would be bisected without end.
    #[test]
    fn a_divergent_integral_stops_when_its_budget_is_exhausted() {
        let breaks: Vec<f64> = (0..=400).map(f64::from).collect();
        for (allowed, converges) in [(10_000, false), (usize::MAX / BUDGET_FACTOR_MAX, true)] {
            let budget = EvaluationBudget { used: Cell::new(0), allowed };
            let mut comb = |t: f64| {
                budget.count();
                (f64::from(u8::from(t.fract() > 0.3)), Vec3::zeros())
            };
            let (area, _) = integrate(&mut comb, &breaks, (1e-9, &budget));
            assert_eq!(!budget.is_exhausted(), converges);
            // 400 intervals of 15 evaluations are always integrated, within four budgets.
            assert!(!converges || (area - 280.0).abs() < 1e-3, "{area}");
            assert!(converges || budget.used.get() < 4 * 10_000 + 15, "{}", budget.used.get());
        }
    }
}
