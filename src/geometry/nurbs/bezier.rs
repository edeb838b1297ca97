//! Rational Bezier patches in homogeneous coordinates.

use nalgebra::Vector4;

use super::basis::{LARGE, MEDIUM, SMALL, WIDE, bernstein};
use super::derivs::{SurfaceDerivs, tensor};
use crate::{Aabb, Vec2};

/// A rational Bezier patch over a rectangle of the parameter plane. A curve has degree 0 along v.
#[derive(Debug, Clone)]
pub(super) struct BezierPiece {
    pub degrees: [usize; 2],
    /// Smallest parameters of the rectangle.
    pub low: Vec2,
    /// Largest parameters of the rectangle.
    pub high: Vec2,
    /// Largest parameters that evaluate to this patch: `high`, or the next smaller number at a discontinuity of the
    /// B-spline.
    pub last: Vec2,
    /// Homogeneous control points `(w P, w)`; point (i, j) is `net[i * (degree_v + 1) + j]`.
    pub net: Vec<Vector4<f64>>,
}

impl BezierPiece {
    /// Point and derivatives with respect to the local parameters in `[0, 1]^2`.
    pub fn derivs(&self, st: Vec2) -> SurfaceDerivs {
        match self.degrees[0].max(self.degrees[1]) {
            0..SMALL => self.derivs_sized::<SMALL>(st),
            SMALL..MEDIUM => self.derivs_sized::<MEDIUM>(st),
            MEDIUM..WIDE => self.derivs_sized::<WIDE>(st),
            _ => self.derivs_sized::<LARGE>(st),
        }
    }

    /// Point and derivatives with respect to the parameters of the surface at `uv`, to rounding those of the B-spline.
    pub fn derivs_at(&self, uv: Vec2) -> SurfaceDerivs {
        let d = self.derivs(self.local(uv));
        let [u, v] = [0, 1].map(|k| 1.0 / (self.high[k] - self.low[k]));
        SurfaceDerivs {
            s: d.s,
            su: d.su * u,
            sv: d.sv * v,
            suu: d.suu * (u * u),
            suv: d.suv * (u * v),
            svv: d.svv * (v * v),
        }
    }

    fn derivs_sized<const N: usize>(&self, st: Vec2) -> SurfaceDerivs {
        let [p, q] = self.degrees;
        let bu = bernstein::<N>(p, st.x);
        let bv = bernstein::<N>(q, st.y);
        let row = |i: usize| self.net[i * (q + 1)..(i + 1) * (q + 1)].iter().copied();
        tensor(p, &bu, &bv, row)
    }

    /// Surface parameters of local parameters; exact at the ends, where `last` replaces `high`.
    pub fn parameters(&self, st: Vec2) -> Vec2 {
        let at = |k: usize| {
            if st[k] >= 1.0 {
                self.last[k]
            } else {
                self.low[k] + (self.high[k] - self.low[k]) * st[k]
            }
        };
        Vec2::new(at(0), at(1))
    }

    /// Local parameters of `uv`, clamped to `[0, 1]^2`.
    pub fn local(&self, uv: Vec2) -> Vec2 {
        let at = |k: usize| {
            let width = self.high[k] - self.low[k];
            if width > 0.0 { ((uv[k] - self.low[k]) / width).clamp(0.0, 1.0) } else { 0.0 }
        };
        Vec2::new(at(0), at(1))
    }

    /// Bounding box of the control points; contains the patch (convex hull property).
    pub fn bounds(&self) -> Aabb {
        let mut out = Aabb::EMPTY;
        self.net.iter().for_each(|h| out.grow(&(h.xyz() / h.w)));
        out
    }
}
