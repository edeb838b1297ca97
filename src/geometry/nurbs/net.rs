//! Control nets in homogeneous coordinates: validation, knot insertion, extraction of segments, degree elevation.

use nalgebra::SVector;

use super::NurbsError;
use super::basis::{MAX_DEGREE, span};

/// Checks degree, knot count, knot order and that the domain is not empty.
pub(super) fn check_knots(degree: usize, knots: &[f64], points: usize) -> Result<(), NurbsError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(NurbsError::Degree { found: degree });
    }
    if points < degree + 1 {
        return Err(NurbsError::PointCount { found: points, needed: degree + 1 });
    }
    if knots.len() != points + degree + 1 {
        return Err(NurbsError::KnotCount { found: knots.len(), needed: points + degree + 1 });
    }
    if knots.iter().any(|k| !k.is_finite()) {
        return Err(NurbsError::NotFinite);
    }
    let falls = knots.windows(2).position(|w| w[1] < w[0]);
    if let Some(k) = falls {
        return Err(NurbsError::Knots { index: k + 1, left: knots[k], right: knots[k + 1] });
    }
    if knots[degree] >= knots[points] {
        let (left, right) = (knots[degree], knots[points]);
        return Err(NurbsError::Knots { index: points, left, right });
    }
    Ok(())
}

/// The given weights, or ones. Fails unless all are positive and finite and there is one per point.
pub(super) fn check_weights(
    weights: Option<Vec<f64>>,
    points: usize,
) -> Result<Vec<f64>, NurbsError> {
    let Some(weights) = weights else { return Ok(vec![1.0; points]) };
    if weights.len() != points {
        return Err(NurbsError::PointCount { found: weights.len(), needed: points });
    }
    match weights.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        Some(index) => Err(NurbsError::Weight { index, found: weights[index] }),
        None => Ok(weights),
    }
}

/// One row of homogeneous control points `(w P, w)`. All rows of a surface net are processed alike.
#[derive(Debug, Clone)]
pub(super) struct Net<const D: usize> {
    pub degree: usize,
    pub knots: Vec<f64>,
    pub points: Vec<(SVector<f64, D>, f64)>,
}

impl<const D: usize> Net<D> {
    pub fn of_curve(
        knots: &[f64],
        degree: usize,
        points: &[SVector<f64, D>],
        weights: &[f64],
    ) -> Self {
        let points = points.iter().zip(weights).map(|(p, &w)| (p * w, w)).collect();
        Self { degree, knots: knots.to_vec(), points }
    }

    /// Cartesian control points and weights.
    pub fn projected(&self) -> (Vec<SVector<f64, D>>, Vec<f64>) {
        self.points.iter().map(|(p, w)| (p / *w, *w)).unzip()
    }

    /// Restricts the net to `[from, to]`, clamped at both ends. Each new control point is the blossom of the old net at
    /// its own consecutive knots, which preserves any interior multiplicity, including full multiplicity.
    pub fn cut(&mut self, from: f64, to: f64) {
        let p = self.degree;
        let mut knots = vec![from; p + 1];
        knots.extend(self.knots.iter().copied().filter(|&k| k > from && k < to));
        knots.extend(std::iter::repeat_n(to, p + 1));
        let points = (0..knots.len() - p - 1)
            .filter_map(|i| {
                // A non-empty span within the support of this control point.
                let j = (i..=i + p).find(|&j| knots[j] < knots[j + 1])?;
                let k = span(p, &self.knots, 0.5 * (knots[j] + knots[j + 1]));
                Some(self.blossom(k, &knots[i + 1..=i + p]))
            })
            .collect();
        self.knots = knots;
        self.points = points;
    }

    /// Polar form (blossom) of the polynomial on span `k` at `degree` arguments: de Boor's algorithm with a new
    /// argument at each level.
    fn blossom(&self, k: usize, arguments: &[f64]) -> (SVector<f64, D>, f64) {
        let p = self.degree;
        let mut d: Vec<_> = self.points[k - p..=k].to_vec();
        for (r, &t) in arguments.iter().enumerate() {
            for j in (r + 1..=p).rev() {
                let (left, right) = (self.knots[j + k - p], self.knots[j + k - r]);
                let a = (t - left) / (right - left);
                d[j] = (d[j - 1].0 * (1.0 - a) + d[j].0 * a, d[j - 1].1 * (1.0 - a) + d[j].1 * a);
            }
        }
        d[p]
    }

    /// Raises the degree of a Bezier net by one (Piegl/Tiller Eq. 5.36).
    pub fn elevate_bezier(&mut self) {
        let p = self.degree;
        let mut next = Vec::with_capacity(p + 2);
        for i in 0..=p + 1 {
            let fraction = i as f64 / (p + 1) as f64;
            let mut sum = (SVector::<f64, D>::zeros(), 0.0);
            if i > 0 {
                sum = (self.points[i - 1].0 * fraction, self.points[i - 1].1 * fraction);
            }
            if i <= p {
                sum.0 += self.points[i].0 * (1.0 - fraction);
                sum.1 += self.points[i].1 * (1.0 - fraction);
            }
            next.push(sum);
        }
        let (low, high) = (self.knots[0], self.knots[self.knots.len() - 1]);
        self.degree += 1;
        self.points = next;
        self.knots = [vec![low; p + 2], vec![high; p + 2]].concat();
    }
}
