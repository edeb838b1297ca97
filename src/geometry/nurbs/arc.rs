//! Exact elliptic arcs as rational quadratic B-splines, and the relation of their parameter to the angle.

use std::f64::consts::FRAC_PI_2;

use super::curve::{Curve, Curve3};
use crate::{Frame, Vec3};

fn span_count([from, to]: [f64; 2]) -> usize {
    ((to - from) / FRAC_PI_2 - 1e-9).ceil().clamp(1.0, 64.0) as usize
}

/// Angles [rad] at the span ends of an arc: equal spans of at most 90 degrees.
pub(super) fn span_angles([from, to]: [f64; 2]) -> Vec<f64> {
    let spans = span_count([from, to]);
    let mut angles: Vec<f64> =
        (0..=spans).map(|k| from + (to - from) * k as f64 / spans as f64).collect();
    angles[spans] = to;
    angles
}

/// Knot vector of a rational quadratic arc with spans between `angles`.
pub(super) fn arc_knots(angles: &[f64]) -> Vec<f64> {
    let ends = [angles[0], angles[angles.len() - 1]];
    let mut knots = vec![ends[0]; 3];
    for &a in &angles[1..angles.len() - 1] {
        knots.extend([a, a]);
    }
    knots.extend([ends[1]; 3]);
    knots
}

/// (angle [rad], radius factor, weight) of every control point of the arc (Piegl/Tiller, section 7.3).
pub(super) fn arc_points(angles: &[f64]) -> Vec<(f64, f64, f64)> {
    let mut points = vec![(angles[0], 1.0, 1.0)];
    for w in angles.windows(2) {
        let half = 0.5 * (w[1] - w[0]);
        points.push((w[0] + half, 1.0 / half.cos(), half.cos()));
        points.push((w[1], 1.0, 1.0));
    }
    points
}

impl Curve3 {
    /// Elliptic arc `origin + rx cos a x + ry sin a y` in the plane of `frame`, `a` from `from` to `to` [rad],
    /// `0 < to - from <= 2 pi`. The representation is exact. The knots are the angles at the span ends, so that
    /// parameter and angle agree there.
    #[must_use]
    pub fn ellipse_arc(frame: &Frame, rx: f64, ry: f64, from: f64, to: f64) -> Self {
        let angles = span_angles([from, to]);
        let place = |(a, factor, _): &(f64, f64, f64)| {
            frame.point(&Vec3::new(rx * factor * a.cos(), ry * factor * a.sin(), 0.0))
        };
        let control = arc_points(&angles);
        let points = control.iter().map(place).collect();
        Curve::raw(2, arc_knots(&angles), points, control.iter().map(|c| c.2).collect())
    }
}

/// Rational parameter of an angle [rad]. In a span with middle m and half angle h the local parameter s in [-1, 1]
/// satisfies `tan((angle - m)/2) = s tan(h/2)`.
pub(super) fn parameter_of_angle(range: [f64; 2], angle: f64) -> f64 {
    let (middle, half) = span_of(range, angle);
    middle + half * ((angle - middle) / 2.0).tan() / (half / 2.0).tan()
}

/// The inverse of [`parameter_of_angle`].
pub(super) fn angle_of_parameter(range: [f64; 2], parameter: f64) -> f64 {
    let (middle, half) = span_of(range, parameter);
    middle + 2.0 * ((parameter - middle) / half * (half / 2.0).tan()).atan()
}

/// Middle and half width of the span that contains `value`; values outside the range belong to the nearest end span.
fn span_of([from, to]: [f64; 2], value: f64) -> (f64, f64) {
    let spans = span_count([from, to]);
    let at = |k: usize| {
        if k == spans { to } else { from + (to - from) * k as f64 / spans as f64 }
    };
    let mut k = 0;
    while k + 1 < spans && at(k + 1) <= value {
        k += 1;
    }
    (0.5 * (at(k) + at(k + 1)), 0.5 * (at(k + 1) - at(k)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_full_circle_is_round_to_the_last_digits() {
        let c = Curve3::ellipse_arc(&Frame::world(), 3.0, 3.0, -1.0, 2.0 * PI - 1.0);
        for k in 0..=100 {
            let t = -1.0 + 2.0 * PI * f64::from(k) / 100.0;
            let d = c.derivs(t);
            assert!((d.c.norm() - 3.0).abs() < 1e-14, "{t}");
            assert!(d.c.dot(&d.d1).abs() < 1e-12, "the tangent is across the radius at {t}");
        }
    }

    #[test]
    fn angle_and_parameter_are_inverse_and_agree_with_the_curve() {
        let range = [0.3, 0.3 + 1.7 * PI];
        let c = Curve3::ellipse_arc(&Frame::world(), 2.0, 2.0, range[0], range[1]);
        for k in 0..=60 {
            let angle = range[0] + (range[1] - range[0]) * f64::from(k) / 60.0;
            let t = parameter_of_angle(range, angle);
            let p = c.point(t);
            assert!((p - Vec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), 0.0)).norm() < 1e-13);
            assert!((angle_of_parameter(range, t) - angle).abs() < 1e-13);
        }
    }
}
