//! Joins curves end to end into one rational B-spline.

use nalgebra::Vector4;

use kanagata_geometry::Vec3;
use kanagata_geometry::nurbs::{Curve3, NurbsError};

/// Concatenates curves, each with its own parameter length, from parameter 0. Degrees are raised to the highest; where
/// end points differ, the earlier one is used.
///
/// # Errors
/// [`NurbsError`] for an empty list.
pub(crate) fn join(curves: &[Curve3]) -> Result<Curve3, NurbsError> {
    let degree = curves.iter().map(Curve3::degree).max().unwrap_or(0);
    let mut net: Vec<Vector4<f64>> = Vec::new();
    let mut knots = vec![0.0; degree + 1];
    for curve in curves {
        append(curve, degree, &mut net, &mut knots)?;
    }
    if let Some(&last) = knots.last() {
        knots.push(last);
    }
    let points = net.iter().map(|h| Vec3::new(h.x, h.y, h.z) / h.w).collect();
    let weights = net.iter().map(|h| h.w).collect();
    Curve3::try_new(degree, knots, points, Some(weights))
}

/// Appends the Bezier segments of `curve`, raised to `degree`. Each adds `degree` control points and `degree` knots at
/// its end.
fn append(
    curve: &Curve3,
    degree: usize,
    net: &mut Vec<Vector4<f64>>,
    knots: &mut Vec<f64>,
) -> Result<(), NurbsError> {
    let [low, high] = curve.domain();
    let base = knots.last().copied().unwrap_or(0.0);
    let mut breaks: Vec<f64> =
        curve.knots().iter().copied().filter(|k| *k > low && *k < high).collect();
    breaks.dedup();
    breaks.push(high);
    let mut from = low;
    for to in breaks {
        let piece = curve.trimmed(from, to)?;
        let mut points = raised(&homogeneous(&piece), degree);
        if let (Some(last), Some(first)) = (net.last(), points.first()) {
            let ratio = last.w / first.w;
            points.iter_mut().for_each(|p| *p *= ratio);
            net.extend_from_slice(&points[1..]);
        } else {
            net.append(&mut points);
        }
        knots.extend(std::iter::repeat_n(base + (to - low), degree));
        from = to;
    }
    Ok(())
}

fn homogeneous(curve: &Curve3) -> Vec<Vector4<f64>> {
    let weighted = curve.points().iter().zip(curve.weights());
    weighted.map(|(p, w)| Vector4::new(p.x * w, p.y * w, p.z * w, *w)).collect()
}

/// Degree elevation of a Bezier segment: `Q_i = i/(p+1) P_{i-1} + (1 - i/(p+1)) P_i` (Piegl/Tiller Eq. 5.36).
fn raised(points: &[Vector4<f64>], degree: usize) -> Vec<Vector4<f64>> {
    let mut points = points.to_vec();
    while points.len() < degree + 1 {
        let n = points.len();
        points = (0..=n)
            .map(|i| {
                #[allow(clippy::cast_precision_loss)]
                let a = i as f64 / n as f64;
                let before = if i > 0 { points[i - 1] * a } else { Vector4::zeros() };
                let here = if i < n { points[i] * (1.0 - a) } else { Vector4::zeros() };
                before + here
            })
            .collect();
    }
    points
}
