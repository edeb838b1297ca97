//! Admissible ranges of numbers read from files. All CAD, mesh and tool readers check their data here before any
//! geometric computation.

use super::Vec3;
use super::nurbs::{Curve, Surface};

/// Largest coordinate or length [mm]: 10 km, which double precision resolves to 2e-9 mm. Doubled: half that resolution;
/// from 1e9 mm on, rounding exceeds the tolerances of joining and meshing.
pub const COORDINATE_MAX_MM: f64 = 1e7;
/// Largest absolute value of a parameter or knot. Doubled: one bit less resolution between neighbouring parameters.
pub const PARAMETER_MAX: f64 = 1e9;
/// Smallest difference of two distinct knots. The square of a second derivative scales with the inverse fourth power of
/// the knot difference. It stays finite with a factor of [`COORDINATE_MAX_MM`]; below 1e-73 it overflows. Round-off in
/// sums that should be equal is 1e-17 of the domain.
pub const KNOT_STEP_MIN: f64 = 1e-60;
/// Largest ratio of two weights of a rational curve or surface. Doubled: one bit less resolution in the quotients.
pub const WEIGHT_RATIO_MAX: f64 = 1e9;
/// Largest count of increments, iterations or failures accepted from a saved state. No run reaches it, and sums of a
/// few such counts do not overflow. Doubled: no change.
pub const COUNT_MAX: usize = u32::MAX as usize;

/// Checks a coordinate or length [mm]; returns the value and the admissible range when it is out of range or not
/// finite.
#[must_use]
pub fn coordinate_fault(x: f64) -> Option<String> {
    let sound = x.abs() <= COORDINATE_MAX_MM;
    (!sound).then(|| {
        format!("a coordinate or length of {x:e} mm; allowed: up to {COORDINATE_MAX_MM:e} mm")
    })
}

/// Checks the coordinates of a point [mm]; returns the first violation.
#[must_use]
pub fn point_fault(p: &Vec3) -> Option<String> {
    p.iter().find_map(|&x| coordinate_fault(x))
}

/// Index and description of the first point [mm] with an inadmissible coordinate.
pub fn first_fault<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Option<(usize, String)> {
    points.into_iter().enumerate().find_map(|(k, p)| Some((k, point_fault(p)?)))
}

/// Checks a parameter, knot or angle; returns the violation.
#[must_use]
pub fn parameter_fault(t: f64) -> Option<String> {
    let sound = t.abs() <= PARAMETER_MAX;
    (!sound).then(|| format!("a parameter of {t:e}; allowed: up to {PARAMETER_MAX:e}"))
}

/// Checks a knot vector: range, and difference of distinct neighbouring knots.
fn knots_fault(knots: &[f64]) -> Option<String> {
    let step = |w: &[f64]| Some(w[1] - w[0]).filter(|s| *s > 0.0 && *s < KNOT_STEP_MIN);
    let apart = |step: f64| {
        format!("knots {step:e} apart; allowed: equal ones, or at least {KNOT_STEP_MIN:e}")
    };
    let value = knots.iter().find_map(|&t| parameter_fault(t));
    value.or_else(|| knots.windows(2).find_map(step).map(apart))
}

fn weight_fault(weights: &[f64]) -> Option<String> {
    let (low, high) =
        weights.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
    let sound = weights.is_empty() || high <= low * WEIGHT_RATIO_MAX && high <= f64::MAX.sqrt();
    (!sound).then(|| {
        format!("weights from {low:e} to {high:e}; allowed: a ratio up to {WEIGHT_RATIO_MAX:e}")
    })
}

/// Checks control points, knots and weights of a space curve; returns the first violation.
#[must_use]
pub fn curve_fault(curve: &Curve<3>) -> Option<String> {
    let points = || curve.points().iter().find_map(point_fault);
    let knots = || knots_fault(curve.knots());
    points().or_else(knots).or_else(|| weight_fault(curve.weights()))
}

/// Checks control points, knots and weights of a curve in a parameter plane; returns the first violation.
#[must_use]
pub fn parameter_curve_fault(curve: &Curve<2>) -> Option<String> {
    let points = || curve.points().iter().flatten().find_map(|&t| parameter_fault(t));
    let knots = || knots_fault(curve.knots());
    points().or_else(knots).or_else(|| weight_fault(curve.weights()))
}

/// Checks control points, knots and weights of a rational B-spline surface; returns the first violation.
#[must_use]
pub fn surface_fault(surface: &Surface) -> Option<String> {
    let points = || surface.points().iter().find_map(point_fault);
    let knots = || surface.knots().into_iter().find_map(knots_fault);
    points().or_else(knots).or_else(|| weight_fault(surface.weights()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_infinite_and_too_large_ones_are_named_with_their_bound() {
        for x in [f64::NAN, f64::INFINITY, -1e9, 1.1e7] {
            let fault = point_fault(&Vec3::new(0.0, x, 0.0)).unwrap();
            assert!(fault.contains("allowed: up to 1e7 mm"), "{fault}");
            assert!(parameter_fault(x * 1e9).is_some(), "{x}");
        }
        assert_eq!(point_fault(&Vec3::repeat(-1e7)), None);
        assert_eq!(first_fault(&[Vec3::zeros(), Vec3::repeat(2e7)]).unwrap().0, 1);
        assert_eq!(parameter_fault(-1e9), None);
        assert!(weight_fault(&[1.0, 1e-12]).is_some() && weight_fault(&[1.0, 1e-3]).is_none());
        assert!(weight_fault(&[1e200, 1e200]).is_some());
        assert!(knots_fault(&[0.0, 0.0, 1e-320, 1.0]).unwrap().contains("apart"));
        assert_eq!(knots_fault(&[0.0, 0.0, 1e-17, 1.0]), None);
    }
}
