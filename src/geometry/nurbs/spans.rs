//! Decomposition of B-splines into Bezier patches (one knot-insertion matrix per span and direction), and construction
//! of projectors from them.

use nalgebra::Vector4;

use super::bezier::BezierPiece;
use super::curve::Curve3;
use super::projector::{CurveProjector, SurfaceProjector};
use super::surface::Surface;
use crate::{Vec2, Vec3};

/// A non-empty knot span with the matrix that maps the control points acting on it to its Bezier points (Bezier
/// extraction).
struct Extraction {
    /// First of the `degree + 1` control points.
    first: usize,
    range: [f64; 2],
    /// See [`BezierPiece::last`].
    last: f64,
    /// Row i: coefficients of the control points in Bezier point i; `None` for the identity.
    rows: Option<Vec<f64>>,
}

fn extractions(degree: usize, knots: &[f64]) -> Vec<Extraction> {
    let (low, high) = (degree, knots.len() - 1 - degree);
    let mut out = Vec::new();
    for k in (low..high).filter(|&k| knots[k] < knots[k + 1]) {
        let range = [knots[k], knots[k + 1]];
        let clamped =
            knots[k + 1 - degree] == range[0] && knots[k + degree] == range[1] && degree > 0;
        let rows = (!clamped).then(|| extraction_rows(degree, knots, k));
        let jumps = k + 1 < high && knots[k + 1 + degree] == range[1];
        let last = if jumps { range[1].next_down() } else { range[1] };
        out.push(Extraction { first: k - degree, range, last, rows });
    }
    out
}

/// Bezier point i of span k is the blossom with `degree - i` arguments at the start of the span and i at its end.
fn extraction_rows(degree: usize, knots: &[f64], k: usize) -> Vec<f64> {
    let size = degree + 1;
    let mut rows = Vec::with_capacity(size * size);
    // Row j: coefficients of the control points in point j of the de Boor scheme.
    let mut scheme = vec![0.0; size * size];
    for i in 0..size {
        scheme.fill(0.0);
        (0..size).for_each(|j| scheme[j * size + j] = 1.0);
        for r in 0..degree {
            let t = if r < degree - i { knots[k] } else { knots[k + 1] };
            for j in (r + 1..=degree).rev() {
                let (left, right) = (knots[j + k - degree], knots[j + k - r]);
                let a = (t - left) / (right - left);
                let (before, own) = scheme.split_at_mut(j * size);
                let before = &before[(j - 1) * size..];
                own[..size].iter_mut().zip(before).for_each(|(d, b)| *d = b * (1.0 - a) + *d * a);
            }
        }
        rows.extend_from_slice(&scheme[degree * size..]);
    }
    rows
}

/// Applies an extraction matrix to the rows of `net` (`width` points per row).
fn combine(rows: Option<&[f64]>, net: Vec<Vector4<f64>>, width: usize) -> Vec<Vector4<f64>> {
    let Some(rows) = rows else { return net };
    let size = net.len() / width;
    let mut out = vec![Vector4::zeros(); net.len()];
    for i in 0..size {
        for k in 0..size {
            let fraction = rows[i * size + k];
            if fraction != 0.0 {
                for j in 0..width {
                    out[i * width + j] += net[k * width + j] * fraction;
                }
            }
        }
    }
    out
}

/// `net` with both directions exchanged.
fn transposed(net: &[Vector4<f64>], width: usize) -> Vec<Vector4<f64>> {
    let height = net.len() / width;
    (0..width).flat_map(|j| (0..height).map(move |i| net[i * width + j])).collect()
}

/// Homogeneous Bezier patches of a surface, u outermost.
fn pieces_of_surface(surface: &Surface) -> Vec<BezierPiece> {
    let [p, q] = surface.degrees;
    let [us, vs] = [0, 1].map(|k| extractions(surface.degrees[k], &surface.knots[k]));
    let count_v = surface.count()[1];
    let mut out = Vec::with_capacity(us.len() * vs.len());
    for u in &us {
        for v in &vs {
            let mut net = Vec::with_capacity((p + 1) * (q + 1));
            for i in 0..=p {
                let from = (u.first + i) * count_v + v.first;
                let points = surface.points[from..=from + q].iter();
                net.extend(points.zip(&surface.weights[from..=from + q]).map(|(x, &w)| lift(x, w)));
            }
            net = combine(u.rows.as_deref(), net, q + 1);
            if v.rows.is_some() {
                let turned = combine(v.rows.as_deref(), transposed(&net, q + 1), p + 1);
                net = transposed(&turned, p + 1);
            }
            let (low, high) =
                (Vec2::new(u.range[0], v.range[0]), Vec2::new(u.range[1], v.range[1]));
            let last = Vec2::new(u.last, v.last);
            out.push(BezierPiece { degrees: [p, q], low, high, last, net });
        }
    }
    out
}

/// Homogeneous Bezier segments of a curve, along u.
fn pieces_of_curve(curve: &Curve3) -> Vec<BezierPiece> {
    let p = curve.degree;
    let piece = |e: Extraction| {
        let points = curve.points[e.first..=e.first + p].iter();
        let net =
            points.zip(&curve.weights[e.first..=e.first + p]).map(|(x, &w)| lift(x, w)).collect();
        let (low, high) = (Vec2::new(e.range[0], 0.0), Vec2::new(e.range[1], 0.0));
        let last = Vec2::new(e.last, 0.0);
        BezierPiece { degrees: [p, 0], low, high, last, net: combine(e.rows.as_deref(), net, 1) }
    };
    extractions(p, &curve.knots).into_iter().map(piece).collect()
}

fn lift(point: &Vec3, weight: f64) -> Vector4<f64> {
    Vector4::new(point.x * weight, point.y * weight, point.z * weight, weight)
}

impl BezierPiece {
    /// The patch as a B-spline surface.
    fn surface(&self) -> Surface {
        let ends = |k: usize| {
            let p = self.degrees[k];
            [vec![self.low[k]; p + 1], vec![self.high[k]; p + 1]].concat()
        };
        let (points, weights) = self.net.iter().map(|h| (h.xyz() / h.w, h.w)).unzip();
        Surface::raw(self.degrees, [ends(0), ends(1)], points, weights)
    }
}

impl Surface {
    /// Bezier patches over the non-empty knot spans, each on its part of the domain, u outermost.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<Self> {
        pieces_of_surface(self).into_iter().map(|piece| piece.surface()).collect()
    }
}

impl SurfaceProjector {
    /// Builds the search structure of `surface`.
    #[must_use]
    pub fn new(surface: &Surface) -> Self {
        Self::of_pieces(pieces_of_surface(surface), surface.degrees())
    }
}

impl CurveProjector {
    /// Builds the search structure of `curve`.
    #[must_use]
    pub fn new(curve: &Curve3) -> Self {
        Self::of_pieces(pieces_of_curve(curve), [curve.degree(), 0])
    }
}
