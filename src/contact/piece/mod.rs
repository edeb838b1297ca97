//! A piece of a patch with distance bounds: a lower bound of half the squared distance `F(u, v) = |p - S(u, v)|^2 / 2`
//! for any point `p`, and whether `F` is convex over the piece.
//!
//! With `w = p - centre` and `R = S - centre`, `F_ij = (R_i . R_j + R . R_ij) - w . S_ij`. The bracket is half the
//! second derivative of `|R|^2`, a polynomial independent of `p`, whose range over the piece is computed once. `S_ij`
//! is its value at the centre plus a remainder of length `e_ij` at most. Thus every second derivative lies in an
//! interval that costs three dot products. By Taylor's theorem `F(y) >= F(0) + g . y + y H y / 2` with the lower ends
//! `H` of the intervals.

use super::form::{Chart, Form, Shape, padded};
use super::wide::{Plain, Wide};
use kanagata_geometry::{Vec2, Vec3};
use kanagata_tool::Patch;

/// Rounding error of a bound relative to `|w|^2`.
const ROUNDING_REL: f64 = 1e-14;

/// Bounds of the second derivatives of `F`.
#[derive(Debug, Clone, Copy)]
struct CurvatureBounds {
    /// Minimum of `|R_u|^2 + R . R_uu`, and the same along v.
    min_curvature: [f64; 2],
    /// Middle and half width of the range of `R_u . R_v + R . R_uv`.
    mixed: [f64; 2],
    /// Largest change of `S_uu`, `S_uv`, `S_vv` from the centre [mm].
    change: [f64; 3],
    /// `S_i . S_j` at the centre.
    metric: [f64; 3],
    /// Ratio of the lengths along u and v, and its inverse.
    ratio: [f64; 2],
}

/// A piece of a patch.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Piece {
    pub(super) form: Form,
    curvature: CurvatureBounds,
    pub(super) shape: Shape,
    pub(super) patch: u32,
}

/// Bounds of a piece for one point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Floor {
    /// Lower bound of `F` [mm^2].
    pub(super) value: f64,
    /// True when `F` is certainly convex over the piece.
    pub(super) convex: bool,
    /// Lower bounds of the second derivatives of `F` along u and v after subtraction of the mixed part: for any two
    /// points of the piece `F(y) >= F(x) + g . (y - x) + sum min_curvature_i (y_i - x_i)^2 / 2`.
    pub(super) min_curvature: [f64; 2],
    /// Gradient of `F` at the centre.
    pub(super) gradient: Vec2,
    /// Second derivatives `uu, uv, vv` of `F` at the centre.
    pub(super) hessian: [f64; 3],
}

impl Piece {
    pub(super) fn new(patch: u32, shape: Shape, form: Form) -> Self {
        let curvature = CurvatureBounds::of(&form, shape.reach());
        Self { form, curvature, shape, patch }
    }

    /// Bounds for a point at `w` from the centre.
    #[inline(always)]
    pub(super) fn floor(&self, wide: impl Wide, w: &Vec3) -> Floor {
        let k = &self.curvature;
        let [c01, c02, c10, c11, _, c20, ..] = self.form.padded;
        let four = wide.four(padded(w));
        let along = |c| wide.mul(four, wide.four(c));
        let [g1, g2, w20, w11] = wide.sums([along(c10), along(c01), along(c20), along(c11)]);
        let [w02, size2] = wide.two_sums(along(c02), wide.mul(four, four));
        let gradient = Vec2::new(-g1, -g2);
        let pull = [2.0 * w20, w11, 2.0 * w02];
        let size = size2.sqrt();
        let h11 = k.min_curvature[0] - pull[0] - size * k.change[0];
        let h22 = k.min_curvature[1] - pull[2] - size * k.change[2];
        let h12 = (k.mixed[0] - pull[1]).abs() + k.mixed[1] + size * k.change[1];
        let convex = h11 > 0.0 && h22 > 0.0 && h11 * h22 > h12 * h12 * (1.0 + 1e-9);
        // h12 |y1 y2| <= h12 (ratio y1^2 + y2^2 / ratio) / 2: the remainder is separable.
        let (m1, m2) = (h11 - h12 * k.ratio[0], h22 - h12 * k.ratio[1]);
        let low = minimum_over(self.shape, gradient, [m1, m2]);
        // For a convex `F` the gradient alone is a bound.
        let min_curvature = if convex && (m1 < 0.0 || m2 < 0.0) { [0.0; 2] } else { [m1, m2] };
        Floor {
            value: (0.5 - ROUNDING_REL) * size2 + low,
            convex,
            min_curvature,
            gradient,
            hessian: [k.metric[0] - pull[0], k.metric[1] - pull[1], k.metric[2] - pull[2]],
        }
    }

    /// As [`Self::floor`] where the mixed derivative matters, with a second-order bound: its gap decreases with the
    /// third power of the size of the piece.
    pub(super) fn sharp_floor(&self, w: &Vec3) -> Floor {
        let floor = self.floor(Plain, w);
        let (c, k) = (&self.form.low, &self.curvature);
        let size = w.norm();
        let h11 = k.min_curvature[0] - 2.0 * w.dot(&c[6]) - size * k.change[0];
        let h22 = k.min_curvature[1] - 2.0 * w.dot(&c[2]) - size * k.change[2];
        let h12 = k.mixed[0] - w.dot(&c[4]);
        let loose = (k.mixed[1] + size * k.change[1]) * self.shape.reach().powi(2);
        let low = minimum_of_indefinite(floor.gradient, [h11, h12, h22], self.shape) - loose;
        let value = floor.value.max((0.5 - ROUNDING_REL) * w.norm_squared() + low);
        Floor { value, ..floor }
    }

    /// The part that is the image of `chart`.
    pub(super) fn part(&self, chart: &Chart) -> Self {
        Self::new(self.patch, self.shape, self.form.part(chart))
    }

    /// Halves across the longer parameter, or quarters where neither is much longer. A collapsed side is never divided,
    /// because its parts would double at every level.
    pub(super) fn cuts(&self) -> Vec<Chart> {
        const LONGER: f64 = 4.0;
        let [g11, _, g22] = self.curvature.metric;
        if self.shape == Shape::Triangle || g11.max(g22) <= LONGER * g11.min(g22) {
            return self.shape.quarters().into();
        }
        halves(usize::from(g22 > g11)).into()
    }

    /// Lower bound of `F` over the image of `chart`, for a point at `w` with the given [`Floor::min_curvature`] over
    /// the whole piece: parts excluded by it need not be constructed.
    pub(super) fn floor_of_part(&self, w: &Vec3, min_curvature: [f64; 2], chart: &Chart) -> f64 {
        let d = self.form.derivs(chart.origin.x, chart.origin.y);
        let q = w - d.s;
        let (x, y) = (chart.columns[0].x, chart.columns[1].y);
        let gradient = Vec2::new(-q.dot(&d.d1) * x, -q.dot(&d.d2) * y);
        let min_curvature = [min_curvature[0] * x * x, min_curvature[1] * y * y];
        floor_about(self.shape, &Vec2::zeros(), 0.5 * q.norm_squared(), &gradient, min_curvature)
    }

    /// `S_i . S_j` at the centre.
    #[inline(always)]
    pub(super) fn metric(&self) -> [f64; 3] {
        self.curvature.metric
    }

    /// True where the metric alone (a point on the surface) is regular all over the piece.
    fn regular(&self) -> bool {
        self.floor(Plain, &Vec3::zeros()).convex
    }
}

/// Minimum of `g . y + sum m_i y_i^2 / 2` over the domain.
#[inline(always)]
fn minimum_over(shape: Shape, g: Vec2, m: [f64; 2]) -> f64 {
    let both_ways = |g: f64, m: f64| {
        let size = g.abs();
        if size < m { -0.5 * g * g / m } else { 0.5 * m - size }
    };
    match shape {
        Shape::Square => both_ways(g.x, m[0]) + both_ways(g.y, m[1]),
        Shape::Triangle => minimum_over_triangle(g, m[0], m[1]),
    }
}

/// Lower bound of `F` over the domain, from its value and gradient at `x` and [`Floor::min_curvature`].
#[inline(always)]
pub(super) fn floor_about(shape: Shape, x: &Vec2, value: f64, gradient: &Vec2, m: [f64; 2]) -> f64 {
    let moved = Vec2::new(gradient.x - m[0] * x.x, gradient.y - m[1] * x.y);
    let bend = 0.5 * (m[0] * x.x * x.x + m[1] * x.y * x.y);
    let constant = value - gradient.dot(x) + bend;
    let rounding =
        ROUNDING_REL * (value + m[0].abs() + m[1].abs() + gradient.x.abs() + gradient.y.abs());
    constant - rounding + minimum_over(shape, moved, m)
}

/// Minimum of `g t + m t^2 / 2` for `a <= t <= b`.
#[inline(always)]
fn minimum_on(g: f64, m: f64, a: f64, b: f64) -> f64 {
    let at = |t: f64| (g + 0.5 * m * t) * t;
    if m > 0.0 && -g > a * m && -g < b * m {
        return -0.5 * g * g / m;
    }
    let (x, y) = (at(a), at(b));
    if x < y { x } else { y }
}

const NEAR: f64 = -1.0 / 3.0;
const FAR: f64 = 2.0 / 3.0;

/// Minimum of `g . y + (m1 y1^2 + m2 y2^2) / 2` over the triangle.
fn minimum_over_triangle(g: Vec2, m1: f64, m2: f64) -> f64 {
    // On the oblique side y1 = t, y2 = 1/3 - t.
    let slanting = || {
        let ends = -NEAR * g.y + 0.5 * m2 * NEAR * NEAR;
        ends + minimum_on(g.x - g.y + m2 * NEAR, m1 + m2, NEAR, FAR)
    };
    let on_side = |g: f64, m: f64| (g + 0.5 * m * NEAR) * NEAR;
    // Along a non-convex direction the minimum is at an end.
    if m1 <= 0.0 {
        return slanting().min(on_side(g.x, m1) + minimum_on(g.y, m2, NEAR, FAR));
    }
    if m2 <= 0.0 {
        return slanting().min(on_side(g.y, m2) + minimum_on(g.x, m1, NEAR, FAR));
    }
    let free = Vec2::new((-g.x / m1).max(NEAR), (-g.y / m2).max(NEAR));
    if free.x + free.y <= -NEAR {
        return minimum_on(g.x, m1, NEAR, FAR) + minimum_on(g.y, m2, NEAR, FAR);
    }
    slanting()
}

/// Minimum of `g . y + y h y / 2` over the domain, for any signs.
fn minimum_of_indefinite(g: Vec2, h: [f64; 3], shape: Shape) -> f64 {
    let form =
        |a: &Vec2, b: &Vec2| h[0] * a.x * b.x + h[1] * (a.x * b.y + a.y * b.x) + h[2] * a.y * b.y;
    let det = h[0] * h[2] - h[1] * h[1];
    if h[0] > 0.0 && det > 1e-12 * h[0] * h[2] {
        let free = Vec2::new(h[1] * g.y - h[2] * g.x, h[1] * g.x - h[0] * g.y) / det;
        if shape.holds(&free) {
            return 0.5 * g.dot(&free);
        }
    }
    let corners = shape.corners();
    let sides = shape.sides();
    (0..sides)
        .map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % sides]);
            let along = b - a;
            let start = g.dot(&a) + 0.5 * form(&a, &a);
            start + minimum_on(g.dot(&along) + form(&a, &along), form(&along, &along), 0.0, 1.0)
        })
        .fold(f64::INFINITY, f64::min)
}

impl CurvatureBounds {
    fn of(form: &Form, reach: f64) -> Self {
        let (degrees, c) = form.coefficients();
        let (half, columns) = half_square(degrees, c);
        let (mut uu, mut uv, mut vv) = (Range::ZERO, Range::ZERO, Range::ZERO);
        for (k, row) in half.chunks_exact(columns).enumerate().take(2 * degrees[0] + 1) {
            for (l, &b) in row.iter().enumerate().take(2 * degrees[1] + 1) {
                let (x, y) = (k as f64, l as f64);
                uu.add(x * (x - 1.0) * b, [k.wrapping_sub(2), l], reach);
                uv.add(x * y * b, [k.wrapping_sub(1), l.wrapping_sub(1)], reach);
                vv.add(y * (y - 1.0) * b, [k, l.wrapping_sub(2)], reach);
            }
        }
        let metric = [c_dot(form, 3, 3), c_dot(form, 3, 1), c_dot(form, 1, 1)];
        let slack = 1e-13 * (metric[0] + metric[2]);
        let ratio = (metric[0] / metric[2]).sqrt();
        let ratio = if ratio.is_finite() && ratio > 0.0 { ratio.clamp(1e-6, 1e6) } else { 1.0 };
        Self {
            min_curvature: [uu.low - slack, vv.low - slack],
            mixed: [0.5 * (uv.low + uv.high), 0.5 * (uv.high - uv.low) + slack],
            change: changes(degrees, c, reach),
            metric,
            ratio: [ratio, 1.0 / ratio],
        }
    }
}

fn c_dot(form: &Form, a: usize, b: usize) -> f64 {
    form.low[a].dot(&form.low[b])
}

/// Coefficients of `|R|^2 / 2`, (k, l) at `k * columns + l`, and the number of columns.
fn half_square([n, m]: [usize; 2], c: &[Vec3]) -> ([f64; 169], usize) {
    let columns = 2 * m + 1;
    let mut half = [0.0; 169];
    for (at, a) in c.iter().enumerate() {
        let (i, j) = (at / (m + 1), at % (m + 1));
        for (beside, b) in c.iter().enumerate().skip(at) {
            let (k, l) = (beside / (m + 1), beside % (m + 1));
            let twice = if at == beside { 0.5 } else { 1.0 };
            half[(i + k) * columns + j + l] += twice * a.dot(b);
        }
    }
    debug_assert!((2 * n + 1) * columns <= half.len());
    (half, columns)
}

/// Largest changes of the second derivatives from the centre.
fn changes([_, m]: [usize; 2], c: &[Vec3], reach: f64) -> [f64; 3] {
    let mut change = [0.0; 3];
    for (at, c) in c.iter().enumerate() {
        let (i, j) = (at / (m + 1), at % (m + 1));
        let factors = [i * i.saturating_sub(1), i * j, j * j.saturating_sub(1)];
        if i + j > 2 {
            let size = c.norm() * power(reach, i + j - 2) * (1.0 + 1e-13);
            for (change, factor) in change.iter_mut().zip(factors) {
                *change += factor as f64 * size;
            }
        }
    }
    change
}

/// `x^n`.
fn power(x: f64, n: usize) -> f64 {
    (0..n).map(|_| x).product()
}

/// Range of a polynomial over `|u|, |v| <= reach`, by interval arithmetic on its terms.
#[derive(Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// Adds `coefficient u^i v^j`; zero coefficients are accepted with any powers.
    fn add(&mut self, coefficient: f64, [i, j]: [usize; 2], reach: f64) {
        if coefficient == 0.0 {
            return;
        }
        let size = coefficient * power(reach, i + j);
        if i + j == 0 {
            self.low += size;
            self.high += size;
        } else if i % 2 == 0 && j % 2 == 0 {
            self.low += size.min(0.0);
            self.high += size.max(0.0);
        } else {
            self.low -= size.abs();
            self.high += size.abs();
        }
    }
}

/// Divides a patch into pieces with a normal variation of at most about 25 degrees, at most 4^3 of them; further
/// divided up to three times where that makes them regular.
pub(super) fn pieces_of(id: u32, patch: &Patch) -> Vec<(Piece, Chart)> {
    const MAX_DEPTH: u32 = 6;
    let shape = if patch.sides() == 3 { Shape::Triangle } else { Shape::Square };
    let chart = Chart::whole(shape);
    let mut done = Vec::new();
    let mut todo = vec![(Piece::new(id, shape, Form::of(patch, &chart)), chart, 0)];
    while let Some((piece, chart, depth)) = todo.pop() {
        let axis = if depth < MAX_DEPTH { cut(&piece, depth) } else { None };
        match axis {
            None => done.push((piece, chart)),
            Some(_) if shape == Shape::Triangle => {
                todo.extend(shape.quarters().map(|q| (piece.part(&q), chart.after(&q), depth + 2)));
            }
            Some(axis) => {
                todo.extend(halves(axis).map(|h| (piece.part(&h), chart.after(&h), depth + 1)));
            }
        }
    }
    done
}

/// The halves of a square across axis 0 (u) or 1 (v).
fn halves(axis: usize) -> [Chart; 2] {
    let mut columns = [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)];
    columns[axis] *= 0.5;
    [-1.0, 1.0].map(|side| Chart { origin: columns[axis] * side, columns })
}

/// The axis across which the piece should be divided, if any.
fn cut(piece: &Piece, depth: u32) -> Option<usize> {
    const COS_TURN: f64 = 0.9;
    const FOR_REGULARITY: u32 = 3;
    let (turn, axis) = turning(piece);
    let [g11, _, g22] = piece.curvature.metric;
    if turn < COS_TURN {
        return Some(axis);
    }
    (depth < FOR_REGULARITY && !piece.regular()).then_some(usize::from(g22 > g11))
}

/// Smallest cosine between the normals at the corners, and the axis of the larger variation.
fn turning(piece: &Piece) -> (f64, usize) {
    let corners = &piece.shape.corners()[..piece.shape.sides()];
    let normal = |x: &Vec2| {
        let d = piece.form.derivs(x.x, x.y);
        let n = d.d1.cross(&d.d2);
        (n.norm() > 1e-12 * d.d1.norm() * d.d2.norm()).then(|| n.normalize())
    };
    let normals: Vec<_> = corners.iter().map(normal).collect();
    let cosine = |a: usize, b: usize| match (normals.get(a), normals.get(b)) {
        (Some(Some(n)), Some(Some(m))) => n.dot(m),
        _ => 1.0,
    };
    let along_u = cosine(0, 1).min(cosine(3, 2));
    let along_v = cosine(1, 2).min(cosine(0, 3));
    let smallest = along_u.min(along_v).min(cosine(0, 2)).min(cosine(1, 3));
    (smallest, usize::from(along_v < along_u))
}

#[cfg(test)]
mod tests;
