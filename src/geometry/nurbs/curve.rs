//! Rational B-spline curves in the plane and in space.

use nalgebra::SVector;

use super::NurbsError;
use crate::geometry::{Affine, Frame, Vec3};

/// A rational B-spline curve in `D` dimensions. Invariants (kept by [`Curve::try_new`]): degree >= 1,
/// `knots.len() == points.len() + degree + 1`, knots never fall and leave a non-empty domain, weights positive.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<const D: usize> {
    degree: usize,
    knots: Vec<f64>,
    points: Vec<SVector<f64, D>>,
    weights: Vec<f64>,
}

/// A curve in a parameter plane.
pub type Curve2 = Curve<2>;
/// A curve in space [mm].
pub type Curve3 = Curve<3>;

/// Value and first two derivatives of a curve by its parameter.
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
    /// A curve from its control data; `weights = None` is polynomial. Unclamped knots are allowed (domain
    /// is `knots[degree] ..= knots[n]`).
    ///
    /// # Errors
    /// [`NurbsError`] names what breaks the invariants.
    pub fn try_new(
        degree: usize,
        knots: Vec<f64>,
        points: Vec<SVector<f64, D>>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        let _ = (degree, knots, points, weights);
        unimplemented!("geometry: curve construction")
    }

    /// The straight segment from `a` to `b` on the domain `[0, 1]`.
    #[must_use]
    pub fn line(a: SVector<f64, D>, b: SVector<f64, D>) -> Self {
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        Self { degree: 1, knots, points: vec![a, b], weights: vec![1.0; 2] }
    }

    /// Degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Knots, never falling.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Control points (not multiplied by their weights).
    #[must_use]
    pub fn points(&self) -> &[SVector<f64, D>] {
        &self.points
    }

    /// Weights, one a control point.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Parameter range `[start, end]`.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.points.len()]]
    }

    /// Point at `t` (clamped to the domain).
    #[must_use]
    pub fn point(&self, t: f64) -> SVector<f64, D> {
        self.derivs(t).c
    }

    /// Point and derivatives at `t` (clamped to the domain). No allocation.
    #[must_use]
    pub fn derivs(&self, t: f64) -> CurveDerivs<D> {
        let _ = t;
        unimplemented!("geometry: curve evaluation")
    }

    /// The same curve run backwards, on the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        unimplemented!("geometry: curve reversal")
    }

    /// The piece on `[from, to]`, keeping its parameters.
    ///
    /// # Errors
    /// [`NurbsError::Range`] when the range is empty or leaves the domain.
    pub fn trimmed(&self, from: f64, to: f64) -> Result<Self, NurbsError> {
        let _ = (from, to);
        unimplemented!("geometry: curve trimming")
    }
}

impl Curve3 {
    /// Elliptic arc in the plane of `frame`: `origin + rx cos a x + ry sin a y` for `a` from `from` to `to`
    /// [rad], `0 < to - from <= 2 pi`. Exact; its knots are the angles at the ends of its spans, so that the
    /// parameter equals the angle there.
    #[must_use]
    pub fn ellipse_arc(frame: &Frame, rx: f64, ry: f64, from: f64, to: f64) -> Self {
        let _ = (frame, rx, ry, from, to);
        unimplemented!("geometry: arcs")
    }

    /// Image under an affine map.
    #[must_use]
    pub fn transformed(&self, map: &Affine) -> Self {
        let mut out = self.clone();
        out.points.iter_mut().for_each(|p| *p = map.point(p));
        out
    }

    /// Closest point: parameter and squared distance [mm^2], global over the curve.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (f64, f64) {
        let _ = p;
        unimplemented!("geometry: curve projection")
    }
}
