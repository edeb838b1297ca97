//! Spline curves: 112 parametric spline, 126 rational B-spline, and 106 polylines.

use super::curves::{Piece, Shape};
use super::file::Fault;
use super::reader::Reader;
use kanagata_geometry::Vec3;
use kanagata_geometry::nurbs::Curve3;

impl Reader<'_, '_> {
    /// Rational B-spline curve (126): K, M, PROP1-4, K+M+2 knots, K+1 weights, K+1 points, V0, V1.
    pub(super) fn rational_curve(&self, entity: usize) -> Result<Piece, Fault> {
        let mut p = self.file.params(entity)?;
        let upper = p.count("upper index K", 1)?;
        let degree = p.count("degree M", 1)?;
        for what in ["planar", "closed", "polynomial", "periodic"] {
            p.integer_or(what, 0)?;
        }
        p.expect((upper + degree + 2) + 4 * (upper + 1), "knots, weights and points")?;
        let knots = p.reals(upper + degree + 2, "knot")?;
        let weights = p.reals(upper + 1, "weight")?;
        let points = p.points(upper + 1, "control point")?;
        let range = [p.real_or("V0", f64::NAN)?, p.real_or("V1", f64::NAN)?];
        let curve =
            Curve3::try_new(degree, without_rounding(knots), points, normalised_weights(weights))
                .map_err(|e| self.nurbs_fault(entity, &e))?;
        Ok(Piece { curve: cut(curve, range), shape: Shape::Free })
    }

    /// Copious data (106): IP, N, then by IP 1: ZT and pairs, 2: triples, 3: sextuples. Forms 11-13 are polylines, form
    /// 63 is closed. The parameter is the point number, from 0.
    pub(super) fn copious(&self, entity: usize) -> Result<Piece, Fault> {
        let form = self.file.entry(entity).form;
        let mut p = self.file.params(entity)?;
        let layout = p.integer_or("IP", 1)?;
        let each = match layout {
            1 => 2,
            2 => 3,
            3 => 6,
            _ => return Err(p.fault(format_args!("IP = {layout}"), "1, 2 or 3")),
        };
        let count = p.count("number of points", each)?;
        let z = if layout == 1 { p.real("ZT")? } else { 0.0 };
        let mut points = Vec::with_capacity(count);
        for _ in 0..count {
            let (x, y) = (p.real("x")?, p.real("y")?);
            points.push(Vec3::new(x, y, if layout == 1 { z } else { p.real("z")? }));
            if layout == 3 {
                p.vec3("vector")?;
            }
        }
        if form == 63 && points.len() > 2 && points.first() != points.last() {
            points.extend(points.first().copied());
        }
        let curve = polyline(points).map_err(|e| self.nurbs_fault(entity, &e))?;
        Ok(Piece { curve, shape: Shape::Free })
    }

    /// Parametric spline curve (112): CTYPE, H, NDIM, N, N+1 breakpoints, then for each segment the
    /// coefficients A, B, C, D of x, of y and of z: `x = A + B s + C s^2 + D s^3`, s = t - T(i).
    pub(super) fn spline(&self, entity: usize) -> Result<Piece, Fault> {
        let mut p = self.file.params(entity)?;
        for what in ["spline type", "continuity"] {
            p.integer_or(what, 0)?;
        }
        let planar = p.integer_or("NDIM", 3)? == 2;
        let count = p.count("number of segments", 12)?;
        p.expect(count + 1 + 12 * count, "breakpoints and coefficients")?;
        let breaks = p.reals(count + 1, "breakpoint")?;
        let mut points: Vec<Vec3> = Vec::with_capacity(3 * count + 1);
        let mut knots = vec![breaks[0]; 4];
        for span in breaks.windows(2) {
            let mut axes = [[0.0; 4]; 3];
            for axis in &mut axes {
                *axis = [p.real("A")?, p.real("B")?, p.real("C")?, p.real("D")?];
            }
            if planar {
                axes[2][1..].fill(0.0);
            }
            let bezier = axes.map(|c| power_to_bezier(c, span[1] - span[0]));
            let first = usize::from(!points.is_empty());
            points.extend((first..4).map(|k| Vec3::new(bezier[0][k], bezier[1][k], bezier[2][k])));
            knots.extend([span[1]; 3]);
        }
        knots.extend(breaks.last().copied());
        let curve =
            Curve3::try_new(3, knots, points, None).map_err(|e| self.nurbs_fault(entity, &e))?;
        Ok(Piece { curve, shape: Shape::Free })
    }
}

/// Bezier ordinates of `a + b s + c s^2 + d s^3` over 0 to `h`.
pub(super) fn power_to_bezier([a, b, c, d]: [f64; 4], h: f64) -> [f64; 4] {
    let (b, c, d) = (b * h, c * h * h, d * h * h * h);
    [a, a + b / 3.0, a + 2.0 * b / 3.0 + c / 3.0, a + b + c + d]
}

/// A polyline; the parameter is the point number.
pub(super) fn polyline(points: Vec<Vec3>) -> Result<Curve3, kanagata_geometry::nurbs::NurbsError> {
    let count = points.len();
    #[allow(clippy::cast_precision_loss)]
    let inner = (0..count).map(|i| i as f64);
    #[allow(clippy::cast_precision_loss)]
    let end = count.saturating_sub(1) as f64;
    let knots = std::iter::once(0.0).chain(inner).chain(std::iter::once(end)).collect();
    Curve3::try_new(1, knots, points, None)
}

/// Knots with decreases below 1e-9 of the range (rounding) removed.
pub(super) fn without_rounding(mut knots: Vec<f64>) -> Vec<f64> {
    let (Some(first), Some(last)) = (knots.first(), knots.last()) else { return knots };
    let allowed = 1e-9 * (last - first).abs();
    for i in 1..knots.len() {
        let fall = knots[i - 1] - knots[i];
        if fall > 0.0 && fall <= allowed {
            knots[i] = knots[i - 1];
        }
    }
    knots
}

/// Weights; `None` when all are equal. If all are negative their sign is changed.
pub(super) fn normalised_weights(mut weights: Vec<f64>) -> Option<Vec<f64>> {
    let first = weights.first().copied()?;
    if first != 0.0 && weights.iter().all(|w| *w == first) {
        return None;
    }
    if weights.iter().all(|w| *w < 0.0) {
        weights.iter_mut().for_each(|w| *w = -*w);
    }
    Some(weights)
}

/// The segment `[V0, V1]` of a curve if it is shorter than the domain, with clamped ends for any knot vector of the
/// file (periodic splines have knots beyond the domain).
fn cut(curve: Curve3, [from, to]: [f64; 2]) -> Curve3 {
    let [low, high] = curve.domain();
    let tolerance = 1e-12 * (high - low);
    let (from, to) = (from.max(low), to.min(high));
    if to - from > tolerance && (from > low + tolerance || to < high - tolerance) {
        return curve.trimmed(from, to).unwrap_or(curve);
    }
    if is_clamped(curve.knots(), [low, high]) { curve } else { curve.clamped() }
}

/// True when a spline starts and ends in its end control points: no knots lie beyond its domain.
pub(super) fn is_clamped(knots: &[f64], domain: [f64; 2]) -> bool {
    let ends = [knots.first(), knots.last()];
    ends[0] == Some(&domain[0]) && ends[1] == Some(&domain[1])
}
