//! Exact planes, surfaces of revolution, extruded and ruled surfaces (Piegl/Tiller, chapter 8).

use super::arc::{angle_of_parameter, arc_knots, arc_points, parameter_of_angle, span_angles};
use super::curve::Curve3;
use super::surface::Surface;
use crate::{Frame, Vec3};

impl Surface {
    /// Planar rectangle `origin + u x + v y`.
    #[must_use]
    pub fn plane(frame: &Frame, u: [f64; 2], v: [f64; 2]) -> Self {
        let corner = |a: f64, b: f64| frame.point(&Vec3::new(a, b, 0.0));
        let knots = [u, v].map(|r| vec![r[0], r[0], r[1], r[1]]);
        let points =
            vec![corner(u[0], v[0]), corner(u[0], v[1]), corner(u[1], v[0]), corner(u[1], v[1])];
        Self::raw([1, 1], knots, points, vec![1.0; 4])
    }

    /// Surface of revolution about the axis `(origin, axis)`, u from `angles[0]` to `angles[1]` [rad], at most 2 pi.
    /// `generatrix` lies along v with its own parametrisation, at angle 0. u equals the angle at span ends (see
    /// [`Surface::angle_of_arc_parameter`]).
    #[must_use]
    pub fn revolution(generatrix: &Curve3, origin: Vec3, axis: Vec3, angles: [f64; 2]) -> Self {
        let axis = axis.normalize();
        let spans = span_angles(angles);
        let control = arc_points(&spans);
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for &(angle, factor, weight) in &control {
            for (p, w) in generatrix.points.iter().zip(&generatrix.weights) {
                let center = origin + axis * axis.dot(&(p - origin));
                let x = p - center;
                let y = axis.cross(&x);
                points.push(center + (x * angle.cos() + y * angle.sin()) * factor);
                weights.push(w * weight);
            }
        }
        let knots = [arc_knots(&spans), generatrix.knots.clone()];
        Self::raw([2, generatrix.degree], knots, points, weights)
    }

    /// Extrusion of `directrix` (along u, with its own parametrisation) by `v * direction`, v in the given range.
    #[must_use]
    pub fn extrusion(directrix: &Curve3, direction: Vec3, v: [f64; 2]) -> Self {
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for (p, &w) in directrix.points.iter().zip(&directrix.weights) {
            points.extend([p + direction * v[0], p + direction * v[1]]);
            weights.extend([w, w]);
        }
        let knots = [directrix.knots.clone(), vec![v[0], v[0], v[1], v[1]]];
        Self::raw([directrix.degree, 1], knots, points, weights)
    }

    /// Ruled surface between two curves: u along both (each domain mapped linearly to [0, 1]), v from 0 on `c0` to 1 on
    /// `c1`.
    #[must_use]
    pub fn ruled(c0: &Curve3, c1: &Curve3) -> Self {
        let (c0, c1) = (c0.on_domain(0.0, 1.0), c1.on_domain(0.0, 1.0));
        let degree = c0.degree.max(c1.degree);
        let (a, b) = (c0.elevated(degree, &c1.knots), c1.elevated(degree, &c0.knots));
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for k in 0..a.points.len() {
            points.extend([a.points[k], b.points[k]]);
            weights.extend([a.weights[k], b.weights[k]]);
        }
        let knots = [a.knots, vec![0.0, 0.0, 1.0, 1.0]];
        Self::raw([degree, 1], knots, points, weights)
    }

    /// Rational parameter of the angle `angle` [rad] on an arc of [`Curve3::ellipse_arc`] or [`Surface::revolution`]
    /// with the range `angles` [rad]. Exact and increasing; equal to the angle at span ends.
    #[must_use]
    pub fn arc_parameter_of_angle(angles: [f64; 2], angle: f64) -> f64 {
        parameter_of_angle(angles, angle)
    }

    /// The inverse of [`Surface::arc_parameter_of_angle`].
    #[must_use]
    pub fn angle_of_arc_parameter(angles: [f64; 2], parameter: f64) -> f64 {
        angle_of_parameter(angles, parameter)
    }
}
