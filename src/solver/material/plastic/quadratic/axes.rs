//! Tensors in the eigenbasis of the yield function and in the axes of the material.

use pulp::Simd;

use crate::solver::lanes::Lane;
use crate::solver::material::hill48::Spectrum;
use crate::solver::tensor::Mandel66;

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

/// The deviatoric tensors with components `x`.
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

/// `map t`, or with the transpose of `map`.
#[inline(always)]
pub(super) fn turned<S: Simd>(map: &Mandel66, back: bool, t: &[Lane<S>; 6]) -> [Lane<S>; 6] {
    let mut out = *t;
    for (i, out) in out.iter_mut().enumerate() {
        let entry = |k: usize| if back { map[k][i] } else { map[i][k] };
        *out = t[0] * entry(0);
        for k in 1..6 {
            *out = *out + t[k] * entry(k);
        }
    }
    out
}

/// A tangent in material axes carried to the body's.
#[inline(always)]
pub(super) fn turn_back<S: Simd>(turn: &Mandel66, tangent: &mut [[Lane<S>; 6]; 6]) {
    // Rows, then columns, with the transpose of `turn`.
    for row in tangent.iter_mut() {
        *row = turned(turn, true, row);
    }
    for column in 0..6 {
        let mut one = tangent[0];
        for (one, row) in one.iter_mut().zip(tangent.iter()) {
            *one = row[column];
        }
        let one = turned(turn, true, &one);
        for (one, row) in one.iter().zip(tangent.iter_mut()) {
            row[column] = *one;
        }
    }
}
