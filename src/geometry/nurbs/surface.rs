//! Rational B-spline surfaces, and the exact ones of planes, quadrics, tori, sweeps.

use super::{Curve3, NurbsError};
use crate::geometry::{Affine, Frame, Vec2, Vec3};

/// A rational B-spline surface. Control point (i, j), i along u and j along v, is `points[i * count_v + j]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    degrees: [usize; 2],
    knots: [Vec<f64>; 2],
    points: Vec<Vec3>,
    weights: Vec<f64>,
}

/// Value and derivatives of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDerivs {
    /// Point.
    pub s: Vec3,
    /// First derivative by u.
    pub su: Vec3,
    /// First derivative by v.
    pub sv: Vec3,
    /// Second derivative by u.
    pub suu: Vec3,
    /// Mixed derivative.
    pub suv: Vec3,
    /// Second derivative by v.
    pub svv: Vec3,
}

impl Surface {
    /// A surface from its control data, `points[i * count_v + j]`; `weights = None` is polynomial.
    ///
    /// # Errors
    /// [`NurbsError`] names what breaks the invariants (those of a curve, in both directions).
    pub fn try_new(
        degrees: [usize; 2],
        knots: [Vec<f64>; 2],
        points: Vec<Vec3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        let _ = (degrees, knots, points, weights);
        unimplemented!("geometry: surface construction")
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

    /// Weights, ordered as the points.
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

    /// Point at `uv` (clamped to the domain).
    #[must_use]
    pub fn point(&self, uv: Vec2) -> Vec3 {
        self.derivs(uv).s
    }

    /// Point and derivatives at `uv` (clamped to the domain). No allocation.
    #[must_use]
    pub fn derivs(&self, uv: Vec2) -> SurfaceDerivs {
        let _ = uv;
        unimplemented!("geometry: surface evaluation")
    }

    /// Unit normal `su x sv / |.|`; at a pole or collapsed edge its limit along the surface; `None` where
    /// there is none (apex of a cone).
    #[must_use]
    pub fn normal(&self, uv: Vec2) -> Option<Vec3> {
        let _ = uv;
        unimplemented!("geometry: surface normal")
    }

    /// Planar rectangle `origin + u x + v y`.
    #[must_use]
    pub fn plane(frame: &Frame, u: [f64; 2], v: [f64; 2]) -> Self {
        let _ = (frame, u, v);
        unimplemented!("geometry: plane")
    }

    /// Surface of revolution of `generatrix` (along v, keeping its parameters) about the axis
    /// `(origin, axis)`, angle u from `angles[0]` to `angles[1]` [rad], at most 2 pi; u equals the angle at
    /// span ends (see [`Surface::angle_of_arc_parameter`]). Angle 0 is where the generatrix is.
    #[must_use]
    pub fn revolution(generatrix: &Curve3, origin: Vec3, axis: Vec3, angles: [f64; 2]) -> Self {
        let _ = (generatrix, origin, axis, angles);
        unimplemented!("geometry: revolution")
    }

    /// Sweep of `directrix` (along u, keeping its parameters) by `v * direction`, v in the given range.
    #[must_use]
    pub fn extrusion(directrix: &Curve3, direction: Vec3, v: [f64; 2]) -> Self {
        let _ = (directrix, direction, v);
        unimplemented!("geometry: extrusion")
    }

    /// Ruled surface between two curves: u runs over both (each domain mapped to [0, 1] linearly), v from 0
    /// on `c0` to 1 on `c1`.
    #[must_use]
    pub fn ruled(c0: &Curve3, c1: &Curve3) -> Self {
        let _ = (c0, c1);
        unimplemented!("geometry: ruled")
    }

    /// Rational parameter of the angle `angle` on an arc built by [`Curve3::ellipse_arc`] or
    /// [`Surface::revolution`] with the range `angles` (both [rad]). Exact, increasing, identity at span ends.
    #[must_use]
    pub fn arc_parameter_of_angle(angles: [f64; 2], angle: f64) -> f64 {
        let _ = (angles, angle);
        unimplemented!("geometry: arc parameter")
    }

    /// The inverse of [`Surface::arc_parameter_of_angle`].
    #[must_use]
    pub fn angle_of_arc_parameter(angles: [f64; 2], parameter: f64) -> f64 {
        let _ = (angles, parameter);
        unimplemented!("geometry: arc parameter")
    }

    /// Image under an affine map.
    #[must_use]
    pub fn transformed(&self, map: &Affine) -> Self {
        let mut out = self.clone();
        out.points.iter_mut().for_each(|p| *p = map.point(p));
        out
    }

    /// Closest point of the untrimmed surface: parameters and squared distance [mm^2]; global.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> (Vec2, f64) {
        let _ = p;
        unimplemented!("geometry: surface projection")
    }

    /// Closest point by Newton from `start` with bounds and a fallback to [`Surface::closest`]; for
    /// points whose neighbour's foot is known.
    #[must_use]
    pub fn closest_near(&self, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        let _ = (p, start);
        unimplemented!("geometry: surface projection")
    }
}
