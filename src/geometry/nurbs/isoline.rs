//! Isoparametric curve of constant v on a surface, for evaluation at many points.

use nalgebra::Vector4;

use super::Surface;
use super::basis::{BasisWindow, LARGE, MEDIUM, SMALL, WIDE, basis, span};
use crate::Vec3;

/// Point and first derivatives of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstDerivs {
    /// Point.
    pub s: Vec3,
    /// Derivative with respect to u.
    pub su: Vec3,
    /// Derivative with respect to v.
    pub sv: Vec3,
}

/// The isoparametric curve `v` = constant of a surface on an interval of u. The rows of control points are summed over
/// v once.
#[derive(Debug)]
pub struct Isoline<'a> {
    degree: usize,
    knots: &'a [f64],
    ends: [f64; 2],
    /// Row of the control net to which `rows[0]` belongs.
    first: usize,
    /// Homogeneous points and their derivatives with respect to v.
    rows: Vec<[Vector4<f64>; 2]>,
}

impl Surface {
    /// The isoparametric curve at `v` from `u[0]` to `u[1]` (increasing; both clamped to the domain).
    #[must_use]
    pub fn isoline(&self, v: f64, u: [f64; 2]) -> Isoline<'_> {
        match self.degrees[1] {
            0..SMALL => self.isoline_sized::<SMALL>(v, u),
            SMALL..MEDIUM => self.isoline_sized::<MEDIUM>(v, u),
            MEDIUM..WIDE => self.isoline_sized::<WIDE>(v, u),
            _ => self.isoline_sized::<LARGE>(v, u),
        }
    }

    fn isoline_sized<const N: usize>(&self, v: f64, u: [f64; 2]) -> Isoline<'_> {
        let (degree, knots) = (self.degrees[0], &self.knots[0][..]);
        let [first, last] = [span(degree, knots, u[0]) - degree, span(degree, knots, u[1])];
        let across: BasisWindow<N> = basis(self.degrees[1], &self.knots[1], v);
        let [values, slopes, _] = &across.values;
        let row = |i: usize| {
            let from = i * self.count()[1] + across.first;
            let to = from + self.degrees[1] + 1;
            let mut sums = [Vector4::zeros(); 2];
            let row = self.points[from..to].iter().zip(&self.weights[from..to]);
            for (((p, &w), b), slope) in row.zip(values).zip(slopes) {
                let h = (p * w).push(w);
                sums[0] += h * *b;
                sums[1] += h * *slope;
            }
            sums
        };
        Isoline { degree, knots, ends: u, first, rows: (first..=last).map(row).collect() }
    }
}

impl Isoline<'_> {
    /// Point and first derivatives at `u`, clamped to the interval of construction.
    #[must_use]
    pub fn derivs(&self, u: f64) -> FirstDerivs {
        let u = u.max(self.ends[0]).min(self.ends[1]);
        match self.degree {
            0..SMALL => self.derivs_sized::<SMALL>(u),
            SMALL..MEDIUM => self.derivs_sized::<MEDIUM>(u),
            MEDIUM..WIDE => self.derivs_sized::<WIDE>(u),
            _ => self.derivs_sized::<LARGE>(u),
        }
    }

    fn derivs_sized<const N: usize>(&self, u: f64) -> FirstDerivs {
        let along: BasisWindow<N> = basis(self.degree, self.knots, u);
        let [values, slopes, _] = &along.values;
        let mut sums = [Vector4::zeros(); 3];
        let used = &self.rows[along.first - self.first..][..=self.degree];
        for ((row, b), slope) in used.iter().zip(values).zip(slopes) {
            sums[0] += row[0] * *b;
            sums[1] += row[0] * *slope;
            sums[2] += row[1] * *b;
        }
        let [a, du, dv] = sums;
        let s = a.xyz() / a.w;
        FirstDerivs { s, su: (du.xyz() - s * du.w) / a.w, sv: (dv.xyz() - s * dv.w) / a.w }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec2;

    #[test]
    fn a_line_is_the_surface_at_its_parameter() {
        let knots_u = vec![0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 1.0, 2.0, 2.0, 2.0, 2.0];
        let knots_v = vec![-1.0, -1.0, -1.0, 0.5, 1.0, 1.0, 1.0];
        let at = |k: usize| {
            let (i, j) = (k as f64 / 4.0, k as f64 % 4.0);
            Vec3::new(i, j + 0.2 * i * i, (i * j).sin())
        };
        let weights = (0..28).map(|k| 1.0 + 0.3 * f64::from(k % 5)).collect();
        let points = (0..28).map(at).collect();
        let surface = Surface::try_new([3, 2], [knots_u, knots_v], points, Some(weights)).unwrap();
        for v in [-1.0, 0.2, 0.5, 1.0] {
            for ends in [[0.0, 2.0], [0.1, 0.3], [0.31, 0.9], [1.0, 1.5]] {
                let line = surface.isoline(v, ends);
                for fraction in [0.0_f64, 0.4, 1.0, 1.0 + f64::EPSILON] {
                    let u = ends[0] + fraction * (ends[1] - ends[0]);
                    let (found, expected) = (line.derivs(u), surface.derivs(Vec2::new(u, v)));
                    assert!((found.s - expected.s).norm() < 1e-14);
                    assert!((found.su - expected.su).norm() < 1e-12);
                    assert!((found.sv - expected.sv).norm() < 1e-12);
                }
            }
        }
    }
}
