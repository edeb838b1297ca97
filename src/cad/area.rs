//! Area, centroid and tight box of trimmed faces.

use super::model::{Face, Model};
use super::trim_region::TrimRegion;
use crate::geometry::nurbs::{Curve2, FirstDerivs, Surface};
use crate::geometry::{Aabb, Vec2, Vec3};

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

/// Area and first moment.
type Moments = (f64, Vec3);

fn add(a: Moments, b: Moments, by: f64) -> Moments {
    (a.0 + b.0 * by, a.1 + b.1 * by)
}

/// Kronrod and Gauss integrals of `f` over `[a, b]`.
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

/// Halvings of an interval between two breaks, at most, in the mean: noise must not be chased into every digit.
const MOST_HALVINGS: usize = 60;
/// Two rules that agree to this share of the integrand's own size cannot be told apart.
const ROUNDING: f64 = 1e-13;

/// Adaptive integral over consecutive breaks; an interval is halved while its two rules differ by more than
/// `tolerance` (absolute, on the area), at most 20 times.
fn integrate(f: &mut dyn FnMut(f64) -> Moments, breaks: &[f64], tolerance: f64) -> Moments {
    let mut sum = (0.0, Vec3::zeros());
    let mut halvings = 0;
    let mut stack: Vec<(f64, f64, u32)> =
        breaks.windows(2).rev().map(|w| (w[0], w[1], 0)).collect();
    while let Some((a, b, depth)) = stack.pop() {
        let (fine, coarse) = rule(f, a, b);
        let off = (fine.0 - coarse.0).abs();
        let enough = off <= tolerance || off <= ROUNDING * fine.0.abs();
        if enough || depth >= 20 || halvings >= MOST_HALVINGS * breaks.len() {
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

/// Knots of one direction strictly between two parameters, with both ends, rising.
fn breaks_between(knots: &[f64], a: f64, b: f64) -> Vec<f64> {
    let mut out = vec![a];
    out.extend(knots.iter().copied().filter(|&k| k > a && k < b));
    out.push(b);
    out.dedup();
    out
}

/// Area and first moment of a face, |su x sv| its density.
fn moments(face: &Face, relative: f64) -> Moments {
    let size = Aabb::of_points(face.surface.points()).diagonal();
    let density = |d: &FirstDerivs| {
        let da = d.su.cross(&d.sv).norm();
        (da, d.s * da)
    };
    surface_integral(face, relative * size * size, &density)
}

/// By Green's theorem: the integral of `F dv` round the loops, `F(u, v)` the integral of the density along u
/// from the lowest parameter. `tolerance` is absolute, on the first value.
fn surface_integral(
    face: &Face,
    tolerance: f64,
    density: &dyn Fn(&FirstDerivs) -> Moments,
) -> Moments {
    let surface = &face.surface;
    let region = TrimRegion::new(face);
    let [ku, kv] = surface.knots();
    // A strip is an area a unit of v.
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
            let inner = strip(surface, ku, region.low.x, d.c, (density, along_u));
            (inner.0 * d.d1.y, inner.1 * d.d1.y)
        };
        sum = add(sum, integrate(&mut along, &breaks, 1e-2 * tolerance), 1.0);
    }
    sum
}

/// Integral of the density along u from `low` to `uv.x` at `uv.y`, to a tolerance.
fn strip(
    surface: &Surface,
    knots: &[f64],
    low: f64,
    uv: Vec2,
    (density, tolerance): (&dyn Fn(&FirstDerivs) -> Moments, f64),
) -> Moments {
    let (from, to, sign) = if uv.x >= low { (low, uv.x, 1.0) } else { (uv.x, low, -1.0) };
    if to <= from {
        return (0.0, Vec3::zeros());
    }
    let line = surface.isoline(uv.y, [from, to]);
    let mut along = |u: f64| density(&line.derivs(u));
    let found = integrate(&mut along, &breaks_between(knots, from, to), tolerance);
    (sign * found.0, found.1 * sign)
}

/// Parameters at which a curve crosses a v knot line of the surface become breaks: the integrand has a kink there.
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

impl Face {
    /// Area [mm^2], adaptive to about `relative` (1e-9 say) of the face's size squared.
    #[must_use]
    pub fn area(&self, relative: f64) -> f64 {
        moments(self, relative).0.abs()
    }

    /// Area [mm^2] and its centroid [mm] (zero without area), to about 1e-9 of the face's size squared.
    #[must_use]
    pub fn area_and_centroid(&self) -> (f64, Vec3) {
        let (area, moment) = moments(self, 1e-9);
        (area.abs(), if area == 0.0 { Vec3::zeros() } else { moment / area })
    }

    /// Tight box of the trimmed face: its borders, and points inside where a coordinate is stationary.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for used in self.loops.iter().flat_map(|l| &l.uses) {
            self.border_extremes(&used.pcurve, &mut bounds);
        }
        let region = TrimRegion::new(self);
        let Ok(piece) =
            self.surface.trimmed([region.low.x, region.high.x], [region.low.y, region.high.y])
        else {
            return bounds;
        };
        // Nothing inside reaches beyond the control points.
        let hull = Aabb::of_points(piece.points());
        let margin = 1e-13 * hull.diagonal();
        for axis in 0..3 {
            if axis == 0
                && (hull.max - bounds.max).max().max((bounds.min - hull.min).max()) > margin
            {
                self.crease_extremes(&region, &mut bounds);
            }
            if hull.max[axis] > bounds.max[axis] + margin {
                self.interior_extremes(&region, axis, 1.0, &mut bounds);
            }
            if hull.min[axis] < bounds.min[axis] - margin {
                self.interior_extremes(&region, axis, -1.0, &mut bounds);
            }
        }
        bounds
    }

    /// Samples along a border, and the local extremes between them.
    fn border_extremes(&self, curve: &Curve2, bounds: &mut Aabb) {
        let [a, b] = curve.domain();
        let spans = curve.knots().windows(2).filter(|w| w[0] < w[1]).count();
        let inner = self.surface.knots().iter().map(|k| k.len()).max().unwrap_or(8);
        let n = (16 * spans).max(4 * inner).min(2000);
        let at = |k: usize| a + (b - a) * k as f64 / n as f64;
        let point = |t: f64| self.surface.point(curve.point(t));
        let samples: Vec<Vec3> = (0..=n).map(|k| point(at(k))).collect();
        samples.iter().for_each(|p| bounds.grow(p));
        for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let value = |k: usize| sign * samples[k][axis];
            for k in 1..n {
                let (before, here, after) = (value(k - 1), value(k), value(k + 1));
                let reach = (here - before).max(here - after);
                let end = if sign > 0.0 { bounds.max[axis] } else { -bounds.min[axis] };
                // A smooth peak does not rise above its sample by more than the sample above its neighbours.
                if here >= before && here >= after && reach > 0.0 && here + reach > end {
                    let t = peak(|t| sign * point(t)[axis], at(k - 1), at(k + 1));
                    bounds.grow(&point(t));
                }
            }
        }
    }

    /// Extremes along the lines on which the surface is only continuous: no derivative vanishes there.
    fn crease_extremes(&self, region: &TrimRegion, bounds: &mut Aabb) {
        for (axis, [low, high]) in self.surface.domain().into_iter().enumerate() {
            let (knots, degree) = (self.surface.knots()[axis], self.surface.degrees()[axis]);
            let mut lines: Vec<f64> =
                knots.iter().copied().filter(|t| *t > low && *t < high).collect();
            lines.dedup();
            lines.retain(|t| knots.iter().filter(|k| *k == t).count() >= degree);
            for line in lines {
                self.extremes_along(region, (axis, line), bounds);
            }
        }
    }

    /// Points of the trimmed region on a line of one parameter: at the knots, between them, and the peaks among these.
    fn extremes_along(&self, region: &TrimRegion, (axis, line): (usize, f64), bounds: &mut Aabb) {
        const PIECES_A_SPAN: usize = 8;
        let along = 1 - axis;
        let [low, high] = self.surface.domain()[along];
        let mut breaks: Vec<f64> = self.surface.knots()[along].to_vec();
        breaks.retain(|t| *t >= low && *t <= high);
        breaks.dedup();
        let at = |t: f64| if axis == 0 { Vec2::new(line, t) } else { Vec2::new(t, line) };
        let piece = |w: &[f64], k: usize| w[0] + (w[1] - w[0]) * k as f64 / PIECES_A_SPAN as f64;
        let spans = breaks.windows(2).flat_map(|w| (0..PIECES_A_SPAN).map(move |k| piece(w, k)));
        let steps: Vec<f64> = spans.chain(breaks.last().copied()).collect();
        let mut grow = |t: f64| {
            if region.contains(at(t)) {
                bounds.grow(&self.surface.point(at(t)));
            }
        };
        steps.iter().for_each(|&t| grow(t));
        for (coordinate, sign) in (0..3).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
            let value = |t: f64| sign * self.surface.point(at(t))[coordinate];
            for w in steps.windows(3) {
                if value(w[1]) >= value(w[0]).max(value(w[2])) {
                    grow(peak(value, w[0], w[2]));
                }
            }
        }
    }

    /// Stationary points of one coordinate inside the trim, by Newton from every local maximum of a grid.
    fn interior_extremes(&self, region: &TrimRegion, axis: usize, sign: f64, bounds: &mut Aabb) {
        let count = |k: usize| (4 * self.surface.count()[k]).clamp(12, 96);
        let (nu, nv) = (count(0), count(1));
        let at = |i: usize, j: usize| {
            let share = Vec2::new(i as f64 / nu as f64, j as f64 / nv as f64);
            region.low + (region.high - region.low).component_mul(&share)
        };
        let value = |uv: Vec2| sign * self.surface.point(uv)[axis];
        let grid: Vec<f64> = (0..=nu)
            .flat_map(|i| (0..=nv).map(move |j| (i, j)))
            .map(|(i, j)| value(at(i, j)))
            .collect();
        for (i, j) in (0..=nu).flat_map(|i| (0..=nv).map(move |j| (i, j))) {
            let here = grid[i * (nv + 1) + j];
            let around = (i.saturating_sub(1)..=(i + 1).min(nu))
                .flat_map(|a| (j.saturating_sub(1)..=(j + 1).min(nv)).map(move |b| (a, b)));
            if around.into_iter().any(|(a, b)| grid[a * (nv + 1) + b] > here) {
                continue;
            }
            let uv = self.climb(at(i, j), region, axis, sign);
            if region.contains(uv) {
                bounds.grow(&self.surface.point(uv));
            }
        }
    }

    /// Newton towards a stationary point of a coordinate, as long as it rises.
    fn climb(&self, mut uv: Vec2, region: &TrimRegion, axis: usize, sign: f64) -> Vec2 {
        for _ in 0..40 {
            let d = self.surface.derivs(uv);
            let g = Vec2::new(d.su[axis], d.sv[axis]);
            let h = nalgebra::Matrix2::new(d.suu[axis], d.suv[axis], d.suv[axis], d.svv[axis]);
            let Some(step) = h.try_inverse().map(|i| i * g) else { break };
            if !step.iter().all(|s| s.is_finite()) {
                break;
            }
            let next = (uv - step).sup(&region.low).inf(&region.high);
            let rise = sign * (self.surface.point(next)[axis] - d.s[axis]);
            if (next - uv).norm() <= 1e-15 * uv.norm() || rise < 0.0 {
                break;
            }
            uv = next;
        }
        uv
    }
}

/// Maximum of a function of one variable by golden sections.
fn peak(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    for _ in 0..60 {
        let (c, d) = (b - RATIO * (b - a), a + RATIO * (b - a));
        if f(c) > f(d) {
            b = d;
        } else {
            a = c;
        }
    }
    0.5 * (a + b)
}

impl Model {
    /// Area of all faces [mm^2], to about 1e-9.
    #[must_use]
    pub fn area(&self) -> f64 {
        use rayon::prelude::*;
        let areas: Vec<f64> = self.faces.par_iter().map(|f| f.area(1e-10)).collect();
        areas.iter().fold(0.0, |sum, a| sum + a)
    }

    /// Volume that closed faces enclose by their own normals [mm^3]: the divergence theorem, about the first
    /// face's middle.
    pub(super) fn volume_of(&self, faces: &[usize]) -> f64 {
        use rayon::prelude::*;
        let Some(first) = faces.first() else { return 0.0 };
        let origin = Aabb::of_points(self.faces[*first].surface.points()).center();
        let flux = |&f: &usize| {
            let face = &self.faces[f];
            let size = Aabb::of_points(face.surface.points()).diagonal();
            let density =
                |d: &FirstDerivs| ((d.s - origin).dot(&d.su.cross(&d.sv)) / 3.0, Vec3::zeros());
            let sum = surface_integral(face, 1e-9 * size.powi(3), &density).0;
            if face.flipped { -sum } else { sum }
        };
        let all: Vec<f64> = faces.par_iter().map(flux).collect();
        all.iter().sum()
    }

    /// Centroid of the area of all faces [mm]; `None` for a model without area.
    #[must_use]
    pub fn area_centroid(&self) -> Option<Vec3> {
        use rayon::prelude::*;
        let all: Vec<Moments> = self.faces.par_iter().map(|f| moments(f, 1e-10)).collect();
        // A face whose outer loop runs clockwise has a negative area, and its moment the same sign.
        let sum = all.iter().fold((0.0, Vec3::zeros()), |sum, &m| add(sum, m, m.0.signum()));
        (sum.0 > 0.0).then(|| sum.1 / sum.0)
    }

    /// Tight box of all faces.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        use rayon::prelude::*;
        let boxes: Vec<Aabb> = self.faces.par_iter().map(Face::bbox).collect();
        boxes.iter().fold(Aabb::EMPTY, |sum, b| if b.is_empty() { sum } else { sum.union(b) })
    }
}
