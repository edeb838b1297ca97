//! Rational B-spline curves in the plane and in space.

use nalgebra::SVector;

use super::NurbsError;
use super::basis::{LARGE, MEDIUM, SMALL, WIDE, basis, basis_values};
use super::net::{Net, check_knots, check_weights};
use super::prepared::Prepared;
use super::projector::CurveProjector;
use crate::Affine;

/// A rational B-spline curve in `D` dimensions. Invariants, checked by [`Curve::try_new`]: degree >= 1,
/// `knots.len() == points.len() + degree + 1`, knots non-decreasing with a non-empty domain, weights positive.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<const D: usize> {
    pub(super) degree: usize,
    pub(super) knots: Vec<f64>,
    pub(super) points: Vec<SVector<f64, D>>,
    pub(super) weights: Vec<f64>,
    /// Search structure for closest points.
    pub(super) prepared: Prepared<CurveProjector>,
}

/// A curve in a parameter plane.
pub type Curve2 = Curve<2>;
/// A curve in space [mm].
pub type Curve3 = Curve<3>;

/// Point and first two derivatives of a curve with respect to its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveDerivs<const D: usize> {
    /// Point.
    pub c: SVector<f64, D>,
    /// First derivative.
    pub d1: SVector<f64, D>,
    /// Second derivative.
    pub d2: SVector<f64, D>,
}

impl<const D: usize> Curve<D> {
    /// A curve from its control data; `weights = None` is polynomial. Unclamped knot vectors are allowed; the domain is
    /// `knots[degree] ..= knots[n]`.
    ///
    /// # Errors
    /// [`NurbsError`] names the violated invariant.
    pub fn try_new(
        degree: usize,
        knots: Vec<f64>,
        points: Vec<SVector<f64, D>>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        check_knots(degree, &knots, points.len())?;
        let weights = check_weights(weights, points.len())?;
        if points.iter().any(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(NurbsError::NotFinite);
        }
        Ok(Self::raw(degree, knots, points, weights))
    }

    /// A curve from control data known to satisfy the invariants.
    pub(super) fn raw(
        degree: usize,
        knots: Vec<f64>,
        points: Vec<SVector<f64, D>>,
        weights: Vec<f64>,
    ) -> Self {
        Self { degree, knots, points, weights, prepared: Prepared::default() }
    }

    /// The straight segment from `a` to `b` on the domain `[0, 1]`.
    #[must_use]
    pub fn line(a: SVector<f64, D>, b: SVector<f64, D>) -> Self {
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        Self::raw(1, knots, vec![a, b], vec![1.0; 2])
    }

    /// Degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Knots, non-decreasing.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Control points (Cartesian, not multiplied by their weights).
    #[must_use]
    pub fn points(&self) -> &[SVector<f64, D>] {
        &self.points
    }

    /// Weights, one per control point.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Parameter range `[start, end]`.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.points.len()]]
    }

    /// Point at `t` (clamped to the domain), bit-identical to that of [`Curve::derivs`].
    #[must_use]
    pub fn point(&self, t: f64) -> SVector<f64, D> {
        match self.degree {
            0..SMALL => self.point_sized::<SMALL>(t),
            SMALL..MEDIUM => self.point_sized::<MEDIUM>(t),
            MEDIUM..WIDE => self.point_sized::<WIDE>(t),
            _ => self.point_sized::<LARGE>(t),
        }
    }

    fn point_sized<const N: usize>(&self, t: f64) -> SVector<f64, D> {
        let (first, values) = basis_values::<N>(self.degree, &self.knots, t);
        let (mut sum, mut w) = (SVector::<f64, D>::zeros(), 0.0);
        for (k, value) in values.iter().enumerate().take(self.degree + 1) {
            let fraction = value * self.weights[first + k];
            sum += self.points[first + k] * fraction;
            w += fraction;
        }
        sum / w
    }

    /// Point and derivatives at `t` (clamped to the domain). Does not allocate.
    #[must_use]
    pub fn derivs(&self, t: f64) -> CurveDerivs<D> {
        match self.degree {
            0..SMALL => self.derivs_sized::<SMALL>(t),
            SMALL..MEDIUM => self.derivs_sized::<MEDIUM>(t),
            MEDIUM..WIDE => self.derivs_sized::<WIDE>(t),
            _ => self.derivs_sized::<LARGE>(t),
        }
    }

    fn derivs_sized<const N: usize>(&self, t: f64) -> CurveDerivs<D> {
        let b = basis::<N>(self.degree, &self.knots, t);
        let mut a = [SVector::<f64, D>::zeros(); 3];
        let mut w = [0.0; 3];
        for k in 0..=self.degree {
            let (point, weight) = (&self.points[b.first + k], self.weights[b.first + k]);
            for order in 0..3 {
                let fraction = b.values[order][k] * weight;
                a[order] += point * fraction;
                w[order] += fraction;
            }
        }
        let c = a[0] / w[0];
        let d1 = (a[1] - c * w[1]) / w[0];
        let d2 = (a[2] - d1 * (2.0 * w[1]) - c * w[2]) / w[0];
        CurveDerivs { c, d1, d2 }
    }

    /// The curve with reversed orientation on the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let [low, high] = self.domain();
        let mut out = self.clone();
        out.points.reverse();
        out.weights.reverse();
        // Rounding must not change the ends of the domain: all knots at one end come to the other, also where the sum of both
        // ends is the larger one.
        let mirrored = |k: f64| match k {
            k if k == high => low,
            k if k == low => high,
            k => low + high - k,
        };
        out.knots = self.knots.iter().rev().map(|k| mirrored(*k)).collect();
        let (p, n) = (self.degree, self.points.len());
        out.knots[..p].iter_mut().for_each(|k| *k = k.min(low));
        out.knots[p..n].iter_mut().for_each(|k| *k = k.clamp(low, high));
        out.knots[n..].iter_mut().for_each(|k| *k = k.max(high));
        out
    }

    /// The segment on `[from, to]` with unchanged parametrisation.
    ///
    /// # Errors
    /// [`NurbsError::Range`] when the range is empty or not within the domain.
    pub fn trimmed(&self, from: f64, to: f64) -> Result<Self, NurbsError> {
        let [low, high] = self.domain();
        let inside = from >= low && to <= high && from < to;
        if !inside {
            return Err(NurbsError::Range { from, to, low, high });
        }
        let mut net = Net::of_curve(&self.knots, self.degree, &self.points, &self.weights);
        net.cut(from, to);
        let (points, weights) = net.projected();
        Ok(Self::raw(self.degree, net.knots, points, weights))
    }

    /// The same curve with a clamped knot vector, so that the first and last control points are the end points.
    #[must_use]
    pub fn clamped(&self) -> Self {
        let [low, high] = self.domain();
        self.trimmed(low, high).unwrap_or_else(|_| self.clone())
    }

    /// The curve with `map` applied to its control points. For an affine `map` this is the image of the curve.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(SVector<f64, D>) -> SVector<f64, D>) -> Self {
        let mut out = self.clone();
        out.points.iter_mut().for_each(|p| *p = map(*p));
        out
    }

    /// The clamped curve with its first control point replaced.
    #[must_use]
    pub fn with_start(&self, start: SVector<f64, D>) -> Self {
        let mut out = self.clone();
        out.points[0] = start;
        out
    }

    /// The clamped curve with its last control point replaced.
    #[must_use]
    pub fn with_end(&self, end: SVector<f64, D>) -> Self {
        let mut out = self.clone();
        let last = out.points.len() - 1;
        out.points[last] = end;
        out
    }

    /// The curve linearly reparametrised to `[from, to]`, `from < to`.
    #[must_use]
    pub fn on_domain(&self, from: f64, to: f64) -> Self {
        let [low, high] = self.domain();
        let scale = (to - from) / (high - low);
        let mut out = self.clone();
        out.knots.iter_mut().for_each(|k| *k = from + (*k - low) * scale);
        let (p, n) = (self.degree, self.points.len());
        for (k, knot) in out.knots.iter_mut().enumerate() {
            if k <= p && self.knots[k] >= low {
                *knot = from;
            } else if k >= n && self.knots[k] <= high {
                *knot = to;
            }
        }
        out
    }

    /// Bezier segments over the non-empty knot spans, each on its part of the domain.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<Self> {
        let [low, high] = self.domain();
        let mut breaks: Vec<f64> =
            self.knots.iter().copied().filter(|k| *k >= low && *k <= high).collect();
        breaks.dedup();
        breaks.windows(2).filter_map(|w| self.trimmed(w[0], w[1]).ok()).collect()
    }

    /// The same curve after exact degree elevation to `degree`, with full multiplicity at every break, including
    /// `extra_breaks`.
    #[must_use]
    pub fn elevated(&self, degree: usize, extra_breaks: &[f64]) -> Self {
        let [low, high] = self.domain();
        let mut breaks: Vec<f64> = self
            .knots
            .iter()
            .chain(extra_breaks)
            .copied()
            .filter(|k| *k >= low && *k <= high)
            .collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        let mut knots = vec![low; degree + 1];
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for w in breaks.windows(2) {
            let Ok(piece) = self.trimmed(w[0], w[1]) else { continue };
            let mut net = Net::of_curve(&piece.knots, piece.degree, &piece.points, &piece.weights);
            for _ in piece.degree..degree {
                net.elevate_bezier();
            }
            let (p, q) = net.projected();
            let skip = usize::from(!points.is_empty());
            points.extend(p.into_iter().skip(skip));
            weights.extend(q.into_iter().skip(skip));
            knots.extend(std::iter::repeat_n(w[1], degree));
        }
        knots.push(high);
        Self::raw(degree, knots, points, weights)
    }
}

impl Curve3 {
    /// Image under an affine map.
    #[must_use]
    pub fn transformed(&self, map: &Affine) -> Self {
        let mut out = self.clone();
        out.points.iter_mut().for_each(|p| *p = map.point(p));
        out
    }

    /// Arc length [mm]: Gauss quadrature with bisection of the spans until both halves agree to 1e-12 of the total.
    #[must_use]
    pub fn length(&self) -> f64 {
        // Five-point Gauss rule on [-1, 1].
        const RULE: [(f64, f64); 3] = [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        ];
        let speed = |t: f64| self.derivs(t).d1.norm();
        let gauss = |a: f64, b: f64| {
            let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
            RULE.iter().fold(0.0, |sum, &(x, w)| {
                let both = if x > 0.0 { speed(m + h * x) + speed(m - h * x) } else { speed(m) };
                sum + w * h * both
            })
        };
        let [low, high] = self.domain();
        let mut breaks: Vec<f64> =
            self.knots.iter().copied().filter(|t| *t >= low && *t <= high).collect();
        breaks.dedup();
        let rough: f64 = breaks.windows(2).map(|w| gauss(w[0], w[1])).sum();
        let mut stack: Vec<(f64, f64, u32)> = breaks.windows(2).map(|w| (w[0], w[1], 0)).collect();
        let mut sum = 0.0;
        while let Some((a, b, depth)) = stack.pop() {
            let m = 0.5 * (a + b);
            let (whole, halves) = (gauss(a, b), gauss(a, m) + gauss(m, b));
            if depth >= 20 || (whole - halves).abs() <= 1e-12 * rough {
                sum += halves;
            } else {
                stack.extend([(a, m, depth + 1), (m, b, depth + 1)]);
            }
        }
        sum
    }
}
