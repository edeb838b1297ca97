//! Point and derivatives of a rational surface from homogeneous control points.

use nalgebra::Vector4;

use super::basis::BasisWindow;
use crate::Vec3;

/// Point and derivatives of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDerivs {
    /// Point.
    pub s: Vec3,
    /// First derivative with respect to u.
    pub su: Vec3,
    /// First derivative with respect to v.
    pub sv: Vec3,
    /// Second derivative with respect to u.
    pub suu: Vec3,
    /// Mixed derivative.
    pub suv: Vec3,
    /// Second derivative with respect to v.
    pub svv: Vec3,
}

/// Point and derivatives from the basis functions along u and v and the rows of homogeneous control points `(w P, w)`.
/// Applies the quotient rule to the sums of `w P` and `w` (Piegl/Tiller Eq. 4.20).
pub(super) fn tensor<const N: usize, R: Iterator<Item = Vector4<f64>>>(
    degree_u: usize,
    bu: &BasisWindow<N>,
    bv: &BasisWindow<N>,
    row: impl Fn(usize) -> R,
) -> SurfaceDerivs {
    // Sums for the derivative orders (0,0) (1,0) (0,1) (2,0) (1,1) (0,2).
    let mut sums = [Vector4::zeros(); 6];
    let [b0, b1, b2] = &bu.values;
    let [c0, c1, c2] = &bv.values;
    for i in 0..=degree_u {
        let mut along = [Vector4::zeros(); 3];
        for (j, h) in row(i).enumerate() {
            along[0] += h * c0[j];
            along[1] += h * c1[j];
            along[2] += h * c2[j];
        }
        sums[0] += along[0] * b0[i];
        sums[1] += along[0] * b1[i];
        sums[2] += along[1] * b0[i];
        sums[3] += along[0] * b2[i];
        sums[4] += along[1] * b1[i];
        sums[5] += along[2] * b0[i];
    }
    let (a, w) = (sums.map(|h| h.xyz()), sums.map(|h| h.w));
    let s = a[0] / w[0];
    let su = (a[1] - s * w[1]) / w[0];
    let sv = (a[2] - s * w[2]) / w[0];
    SurfaceDerivs {
        s,
        su,
        sv,
        suu: (a[3] - su * (2.0 * w[1]) - s * w[3]) / w[0],
        suv: (a[4] - su * w[2] - sv * w[1] - s * w[4]) / w[0],
        svv: (a[5] - sv * (2.0 * w[2]) - s * w[5]) / w[0],
    }
}
