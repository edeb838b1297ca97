//! Rational B-spline surfaces.

use nalgebra::Vector4;

use super::NurbsError;
use super::basis::{LARGE, MEDIUM, SMALL, WIDE, basis, basis_values};
use super::curve::{Curve2, Curve3};
use super::derivs::{SurfaceDerivs, tensor};
use super::net::{Net, check_knots, check_weights};
use super::prepared::Prepared;
use super::projector::SurfaceProjector;
use crate::{Affine, Vec2, Vec3};

/// A rational B-spline surface. Control point (i, j), i along u and j along v, is `points[i * count_v + j]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    pub(super) degrees: [usize; 2],
    pub(super) knots: [Vec<f64>; 2],
    pub(super) points: Vec<Vec3>,
    pub(super) weights: Vec<f64>,
    /// Search structure for closest points.
    pub(super) prepared: Prepared<SurfaceProjector>,
}

impl Surface {
    /// A surface from its control data, `points[i * count_v + j]`; `weights = None` is polynomial.
    ///
    /// # Errors
    /// [`NurbsError`] names the violated invariant (those of a curve, in both directions).
    pub fn try_new(
        degrees: [usize; 2],
        knots: [Vec<f64>; 2],
        points: Vec<Vec3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        let [knots_u, knots_v] = &knots;
        let count = [knots_u, knots_v].map(Vec::len);
        let along = |k: usize| count[k].saturating_sub(degrees[k] + 1);
        check_knots(degrees[0], knots_u, along(0))?;
        check_knots(degrees[1], knots_v, along(1))?;
        let needed = along(0) * along(1);
        if points.len() != needed {
            return Err(NurbsError::PointCount { found: points.len(), needed });
        }
        let weights = check_weights(weights, points.len())?;
        if points.iter().any(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(NurbsError::NotFinite);
        }
        Ok(Self::raw(degrees, knots, points, weights))
    }

    /// A surface from control data known to satisfy the invariants.
    pub(super) fn raw(
        degrees: [usize; 2],
        knots: [Vec<f64>; 2],
        points: Vec<Vec3>,
        weights: Vec<f64>,
    ) -> Self {
        Self { degrees, knots, points, weights, prepared: Prepared::default() }
    }

    /// Degrees along u and v.
    #[must_use]
    pub fn degrees(&self) -> [usize; 2] {
        self.degrees
    }

    /// Knots along u and v.
    #[must_use]
    pub fn knots(&self) -> [&[f64]; 2] {
        [&self.knots[0], &self.knots[1]]
    }

    /// Control points, `i * count_v + j`.
    #[must_use]
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Weights, in the order of the points.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Parameter ranges `[[u0, u1], [v0, v1]]`.
    #[must_use]
    pub fn domain(&self) -> [[f64; 2]; 2] {
        let end = |k: usize| {
            let (p, knots) = (self.degrees[k], &self.knots[k]);
            [knots[p], knots[knots.len() - 1 - p]]
        };
        [end(0), end(1)]
    }

    /// Point at `uv` (clamped to the domain), bit-identical to that of [`Surface::derivs`].
    #[must_use]
    pub fn point(&self, uv: Vec2) -> Vec3 {
        match self.degrees[0].max(self.degrees[1]) {
            0..SMALL => self.point_sized::<SMALL>(uv),
            SMALL..MEDIUM => self.point_sized::<MEDIUM>(uv),
            MEDIUM..WIDE => self.point_sized::<WIDE>(uv),
            _ => self.point_sized::<LARGE>(uv),
        }
    }

    fn point_sized<const N: usize>(&self, uv: Vec2) -> Vec3 {
        let (first_u, bu) = basis_values::<N>(self.degrees[0], &self.knots[0], uv.x);
        let (first_v, bv) = basis_values::<N>(self.degrees[1], &self.knots[1], uv.y);
        let count_v = self.count()[1];
        let mut sum = Vector4::zeros();
        for (i, b) in bu.iter().enumerate().take(self.degrees[0] + 1) {
            let from = (first_u + i) * count_v + first_v;
            let to = from + self.degrees[1] + 1;
            let mut along = Vector4::zeros();
            let row = self.points[from..to].iter().zip(&self.weights[from..to]);
            for ((p, &w), c) in row.zip(&bv) {
                along += (p * w).push(w) * *c;
            }
            sum += along * *b;
        }
        sum.xyz() / sum.w
    }

    /// Points on the tensor grid of `us` and `vs`, v fastest, bit-identical to those of [`Surface::point`]. Each row of
    /// control points is evaluated once for every v.
    #[must_use]
    pub fn grid(&self, us: &[f64], vs: &[f64]) -> Vec<Vec3> {
        match self.degrees[0].max(self.degrees[1]) {
            0..SMALL => self.grid_sized::<SMALL>(us, vs),
            SMALL..MEDIUM => self.grid_sized::<MEDIUM>(us, vs),
            MEDIUM..WIDE => self.grid_sized::<WIDE>(us, vs),
            _ => self.grid_sized::<LARGE>(us, vs),
        }
    }

    fn grid_sized<const N: usize>(&self, us: &[f64], vs: &[f64]) -> Vec<Vec3> {
        let [count_u, count_v] = self.count();
        let mut rows = Vec::with_capacity(count_u * vs.len());
        let along_v = vs.iter().map(|&v| basis_values::<N>(self.degrees[1], &self.knots[1], v));
        let along_v: Vec<(usize, [f64; N])> = along_v.collect();
        for i in 0..count_u {
            for (first, values) in &along_v {
                let from = i * count_v + first;
                let to = from + self.degrees[1] + 1;
                let row = self.points[from..to].iter().zip(&self.weights[from..to]);
                let one = row.zip(values).map(|((p, &w), c)| (p * w).push(w) * *c);
                rows.push(one.fold(Vector4::zeros(), |sum, h| sum + h));
            }
        }
        let mut points = Vec::with_capacity(us.len() * vs.len());
        for &u in us {
            let (first, values) = basis_values::<N>(self.degrees[0], &self.knots[0], u);
            for j in 0..vs.len() {
                let at = |i: usize| rows[(first + i) * vs.len() + j];
                let used = values.iter().enumerate().take(self.degrees[0] + 1);
                let sum = used.fold(Vector4::zeros(), |sum, (i, b)| sum + at(i) * *b);
                points.push(sum.xyz() / sum.w);
            }
        }
        points
    }

    /// Point and derivatives at `uv` (clamped to the domain). Does not allocate.
    #[must_use]
    pub fn derivs(&self, uv: Vec2) -> SurfaceDerivs {
        match self.degrees[0].max(self.degrees[1]) {
            0..SMALL => self.derivs_sized::<SMALL>(uv),
            SMALL..MEDIUM => self.derivs_sized::<MEDIUM>(uv),
            MEDIUM..WIDE => self.derivs_sized::<WIDE>(uv),
            _ => self.derivs_sized::<LARGE>(uv),
        }
    }

    fn derivs_sized<const N: usize>(&self, uv: Vec2) -> SurfaceDerivs {
        let bu = basis::<N>(self.degrees[0], &self.knots[0], uv.x);
        let bv = basis::<N>(self.degrees[1], &self.knots[1], uv.y);
        let count_v = self.count()[1];
        let row = |i: usize| {
            let from = (bu.first + i) * count_v + bv.first;
            let to = from + self.degrees[1] + 1;
            let weights = self.weights[from..to].iter();
            self.points[from..to].iter().zip(weights).map(|(p, &w)| (p * w).push(w))
        };
        tensor(self.degrees[0], &bu, &bv, row)
    }

    /// The exact image of a straight line of constant u or v in the parameter plane; `None` for any other curve.
    /// Direction is preserved, parametrisation is not.
    #[must_use]
    pub fn isoparametric_curve(&self, line: &Curve2) -> Option<Curve3> {
        let [a, b] = [*line.points().first()?, *line.points().last()?];
        let k = (0..2).find(|&k| line.degree() == 1 && line.points().len() == 2 && a[k] == b[k])?;
        let (p, q, count) = (self.degrees[k], self.degrees[1 - k], self.count());
        let (first, values) = basis_values::<LARGE>(p, &self.knots[k], a[k]);
        let stride = [count[1], 1];
        let mut points = Vec::with_capacity(count[1 - k]);
        let mut weights = Vec::with_capacity(count[1 - k]);
        for j in 0..count[1 - k] {
            let mut sum = Vector4::zeros();
            for (i, value) in values.iter().enumerate().take(p + 1) {
                let at = (first + i) * stride[k] + j * stride[1 - k];
                sum += (self.points[at] * self.weights[at]).push(self.weights[at]) * *value;
            }
            points.push(sum.xyz() / sum.w);
            weights.push(sum.w);
        }
        let whole = Curve3::try_new(q, self.knots[1 - k].clone(), points, Some(weights)).ok()?;
        let [from, to] = [a[1 - k].min(b[1 - k]), a[1 - k].max(b[1 - k])];
        let [low, high] = whole.domain();
        let piece = whole.trimmed(from.max(low), to.min(high)).ok()?;
        Some(if a[1 - k] < b[1 - k] { piece } else { piece.reversed() })
    }

    /// Number of control points along u and v.
    #[must_use]
    pub fn count(&self) -> [usize; 2] {
        [0, 1].map(|k| self.knots[k].len() - self.degrees[k] - 1)
    }

    /// The patch on `[u0, u1] x [v0, v1]` with unchanged parametrisation.
    ///
    /// # Errors
    /// [`NurbsError::Range`] when a range is empty or not within the domain.
    pub fn trimmed(&self, u: [f64; 2], v: [f64; 2]) -> Result<Self, NurbsError> {
        for (range, domain) in [u, v].into_iter().zip(self.domain()) {
            let inside = range[0] >= domain[0] && range[1] <= domain[1] && range[0] < range[1];
            if !inside {
                let ([from, to], [low, high]) = (range, domain);
                return Err(NurbsError::Range { from, to, low, high });
            }
        }
        Ok(self.cut_v(v).transposed().cut_v(u).transposed())
    }

    fn cut_v(&self, range: [f64; 2]) -> Self {
        let [_, count_v] = self.count();
        let mut out = Self { points: Vec::new(), weights: Vec::new(), ..self.clone() };
        for (p, w) in self.points.chunks_exact(count_v).zip(self.weights.chunks_exact(count_v)) {
            let mut net = Net::of_curve(&self.knots[1], self.degrees[1], p, w);
            net.cut(range[0], range[1]);
            let (p, w) = net.projected();
            out.points.extend(p);
            out.weights.extend(w);
            out.knots[1] = net.knots;
        }
        out
    }

    /// Moves the seam of a surface closed in direction `k` to the parameter `start` (of any period). The points are
    /// unchanged.
    ///
    /// # Errors
    /// [`NurbsError`] when `start` is not finite or leaves a part of zero extent.
    pub fn with_seam_at(&self, k: usize, start: f64) -> Result<Self, NurbsError> {
        if k == 0 {
            return Ok(self.transposed().with_seam_at(1, start)?.transposed());
        }
        let [u, [low, high]] = self.domain();
        let period = high - low;
        let turns = ((start - low) / period + 1e-9).floor();
        let cut = start - turns * period;
        if cut - low <= 1e-9 * period {
            return Ok(self.clone().with_v_shifted(turns * period));
        }
        let first = self.trimmed(u, [cut, high])?.with_v_shifted(turns * period);
        let second = self.trimmed(u, [low, cut])?.with_v_shifted((turns + 1.0) * period);
        Ok(first.joined_along_v(&second))
    }

    fn with_v_shifted(mut self, by: f64) -> Self {
        self.knots[1].iter_mut().for_each(|t| *t += by);
        self
    }

    /// Concatenation of two surfaces clamped along v; `next` begins where `self` ends.
    fn joined_along_v(&self, next: &Self) -> Self {
        let ([nu, na], [_, nb]) = (self.count(), next.count());
        let mut out = Self { points: Vec::new(), weights: Vec::new(), ..self.clone() };
        for i in 0..nu {
            let (a, b) = (i * na..(i + 1) * na, i * nb + 1..(i + 1) * nb);
            let scale = self.weights[a.end - 1] / next.weights[i * nb];
            out.points.extend_from_slice(&self.points[a.clone()]);
            out.weights.extend_from_slice(&self.weights[a]);
            out.points.extend_from_slice(&next.points[b.clone()]);
            out.weights.extend(next.weights[b].iter().map(|w| w * scale));
        }
        out.knots[1].pop();
        out.knots[1].extend_from_slice(&next.knots[1][next.degrees[1] + 1..]);
        out
    }

    /// The surface with u and v exchanged, which reverses its normal.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let [nu, nv] = self.count();
        let order = (0..nv).flat_map(|j| (0..nu).map(move |i| i * nv + j));
        let (points, weights) = order.map(|k| (self.points[k], self.weights[k])).unzip();
        let [ku, kv] = self.knots.clone();
        Self::raw([self.degrees[1], self.degrees[0]], [kv, ku], points, weights)
    }

    /// Image under an affine map.
    #[must_use]
    pub fn transformed(&self, map: &Affine) -> Self {
        let mut out = self.clone();
        out.points.iter_mut().for_each(|p| *p = map.point(p));
        out
    }
}
