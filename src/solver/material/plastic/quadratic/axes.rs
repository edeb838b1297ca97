//! Tensors in the eigenbasis of the yield function.

use pulp::Simd;

use crate::material::hill48::Spectrum;
use crate::numbers::lanes::Lane;

/// Components `v_i · t`.
#[inline(always)]
pub(super) fn components<S: Simd>(spectrum: &Spectrum, t: &[Lane<S>; 6]) -> [Lane<S>; 5] {
    let [v, w] = &spectrum.normal;
    [
        t[0] * v[0] + t[1] * v[1] + t[2] * v[2],
        t[0] * w[0] + t[1] * w[1] + t[2] * w[2],
        t[3],
        t[4],
        t[5],
    ]
}

/// Deviatoric tensors with components `x`.
#[inline(always)]
pub(super) fn tensor<S: Simd>(spectrum: &Spectrum, x: &[Lane<S>; 5]) -> [Lane<S>; 6] {
    let [v, w] = &spectrum.normal;
    [
        x[0] * v[0] + x[1] * w[0],
        x[0] * v[1] + x[1] * w[1],
        x[0] * v[2] + x[1] * w[2],
        x[2],
        x[3],
        x[4],
    ]
}
