//! Bernstein form of `F = w^2 (|S - p|^2 - m)` over a Bezier cell. F is a polynomial also for rational S. If F >= 0 on
//! the cell, no point of the cell is closer to p than the square root of m.

use nalgebra::Vector4;

use super::basis::{LARGE, MEDIUM, bernstein, binomial};
use crate::Vec2;

/// Binomial factors of a pair of degrees.
#[derive(Debug, Clone)]
pub(super) struct DistanceForm {
    degrees: [usize; 2],
    /// `C(p, i) C(q, j)` of the control points.
    scale: Vec<f64>,
    /// `1 / (C(2p, k) C(2q, l))` of the coefficients of F.
    inverse: Vec<f64>,
}

/// Bernstein coefficients of F over a cell, index `k * (2q + 1) + l`.
#[derive(Debug, Clone, Default)]
pub(super) struct Coefficients {
    values: Vec<f64>,
    scaled: Vec<Vector4<f64>>,
}

impl DistanceForm {
    pub fn new(degrees: [usize; 2]) -> Self {
        let [p, q] = degrees;
        let product = |p: usize, q: usize| -> Vec<f64> {
            (0..=p).flat_map(|i| (0..=q).map(move |j| binomial(p, i) * binomial(q, j))).collect()
        };
        let inverse = product(2 * p, 2 * q).iter().map(|b| 1.0 / b).collect();
        Self { degrees, scale: product(p, q), inverse }
    }

    /// Computes the coefficients from the net `(w (P - p), w)` into `out`; returns a bound of their rounding error.
    pub fn fill(&self, net: &[Vector4<f64>], m: f64, out: &mut Coefficients) -> f64 {
        let [p, q] = self.degrees;
        let width = 2 * q + 1;
        out.values.clear();
        out.values.resize((2 * p + 1) * width, 0.0);
        out.scaled.clear();
        out.scaled.extend(net.iter().zip(&self.scale).map(|(h, s)| h * *s));
        let mut max_abs = 0.0f64;
        for h in net {
            max_abs = max_abs.max(h.x * h.x + h.y * h.y + h.z * h.z + m * h.w * h.w);
        }
        for i0 in 0..=p {
            for i1 in 0..=i0 {
                let twice = if i0 == i1 { 1.0 } else { 2.0 };
                let rows = [i0, i1].map(|i| &out.scaled[i * (q + 1)..(i + 1) * (q + 1)]);
                let target = &mut out.values[(i0 + i1) * width..(i0 + i1 + 1) * width];
                for (j0, a) in rows[0].iter().enumerate() {
                    let (a, mw) = (a * twice, m * a.w * twice);
                    for (b, slot) in rows[1].iter().zip(&mut target[j0..]) {
                        *slot += a.x * b.x + a.y * b.y + a.z * b.z - mw * b.w;
                    }
                }
            }
        }
        out.values.iter_mut().zip(&self.inverse).for_each(|(f, s)| *f *= s);
        16.0 * f64::EPSILON * max_abs
    }

    /// Smallest coefficient and its Greville point in `[0, 1]^2`.
    pub fn min_coefficient(&self, f: &Coefficients) -> (f64, Vec2) {
        let (mut min, mut at) = (f64::INFINITY, 0);
        for (k, &value) in f.values.iter().enumerate() {
            if value < min {
                (min, at) = (value, k);
            }
        }
        let [p, q] = self.degrees;
        let fraction =
            |k: usize, degree: usize| if degree > 0 { k as f64 / (2 * degree) as f64 } else { 0.0 };
        (min, Vec2::new(fraction(at / (2 * q + 1), p), fraction(at % (2 * q + 1), q)))
    }

    /// Minimum of F over the four corners.
    pub fn min_corner(&self, f: &Coefficients) -> f64 {
        let (width, count) = (2 * self.degrees[1] + 1, f.values.len());
        [0, width - 1, count - width, count - 1]
            .iter()
            .fold(f64::INFINITY, |m, &k| m.min(f.values[k]))
    }

    /// Bounds of the second derivatives with respect to the local parameters of the cell: minima of F_uu and F_vv,
    /// maxima of |F_uu|, |F_vv| and |F_uv|.
    pub fn curvature(&self, f: &Coefficients) -> Curvature {
        let [p, q] = self.degrees.map(|d| 2 * d);
        let at = |k: usize, l: usize| f.values[k * (q + 1) + l];
        let mut out = Curvature { min: [f64::INFINITY; 2], max_abs: [0.0; 2], mixed: 0.0 };
        let mut note = |axis: usize, degree: usize, value: f64| {
            let value = value * (degree * (degree - 1)) as f64;
            out.min[axis] = out.min[axis].min(value);
            out.max_abs[axis] = out.max_abs[axis].max(value.abs());
        };
        for l in 0..=q {
            (2..=p).for_each(|k| note(0, p, at(k, l) - 2.0 * at(k - 1, l) + at(k - 2, l)));
        }
        for k in 0..=p {
            (2..=q).for_each(|l| note(1, q, at(k, l) - 2.0 * at(k, l - 1) + at(k, l - 2)));
        }
        for k in 1..=p {
            for l in 1..=q {
                let value = at(k, l) - at(k - 1, l) - at(k, l - 1) + at(k - 1, l - 1);
                out.mixed = out.mixed.max(value.abs() * (p * q) as f64);
            }
        }
        out
    }

    /// Minimum over the cell of the tangent plane of F at `x` in `[0, 1]^2`: a lower bound of a convex F.
    pub fn tangent_bound(&self, f: &Coefficients, x: Vec2) -> f64 {
        if 2 * self.degrees[0].max(self.degrees[1]) < MEDIUM {
            self.tangent_bound_sized::<MEDIUM>(f, x)
        } else {
            self.tangent_bound_sized::<DOUBLE_DEGREE_SIZE>(f, x)
        }
    }

    fn tangent_bound_sized<const N: usize>(&self, f: &Coefficients, x: Vec2) -> f64 {
        let [p, q] = self.degrees.map(|d| 2 * d);
        let (bu, bv) = (bernstein::<N>(p, x.x).values, bernstein::<N>(q, x.y).values);
        let (mut value, mut slope) = (0.0, Vec2::zeros());
        for (k, row) in f.values.chunks_exact(q + 1).enumerate().take(p + 1) {
            let along: f64 = row.iter().zip(&bv[0]).map(|(c, b)| c * b).sum();
            let across: f64 = row.iter().zip(&bv[1]).map(|(c, b)| c * b).sum();
            value += along * bu[0][k];
            slope += Vec2::new(along * bu[1][k], across * bu[0][k]);
        }
        let fall = |g: f64, t: f64| (-g * t).min(g * (1.0 - t));
        value + fall(slope.x, x.x) + fall(slope.y, x.y)
    }
}

const DOUBLE_DEGREE_SIZE: usize = 2 * (LARGE - 1) + 1;

/// See [`DistanceForm::curvature`].
pub(super) struct Curvature {
    /// Minima of F_uu and F_vv.
    pub min: [f64; 2],
    /// Maxima of |F_uu| and |F_vv|.
    pub max_abs: [f64; 2],
    /// Maximum of |F_uv|.
    pub mixed: f64,
}

impl Curvature {
    /// True when F is convex over the cell. A curve has no F_vv (`INFINITY`).
    pub fn convex(&self) -> bool {
        let [a, c] = self.min;
        a >= 0.0 && c >= 0.0 && (c == f64::INFINITY || a * c >= self.mixed * self.mixed)
    }
}
