//! Divided differences of `f = ½ ln` at the eigenvalues of the right Cauchy-Green tensor, free of cancellation.
//!
//! With `s = a + b`, `x = (a - b) / s`, `y = x²`, `R = Σ y^k / (2 k + 3)` and `Q = atanh(x) / x = 1 + y R`:
//! `f[a,b] = Q / s`, `f[a,a,b] = -(Q + x R) / ((1 + x) s²)`, `f[b,b,a] = -(Q - x R) / ((1 - x) s²)`.

use pulp::Simd;

use crate::numbers::lanes::Lane;
use crate::numbers::tensor::PAIRS;

/// Divided differences of `½ ln` at three eigenvalues.
pub(super) struct Differences<S: Simd> {
    /// `2 f[a,b]` by Mandel pair.
    pub first: [Lane<S>; 6],
    /// `f[a,a,b]`.
    pub twice: [[Lane<S>; 3]; 3],
    /// `f[0,1,2]`.
    pub distinct: Lane<S>,
}

/// Value of `x²` below which `R` is computed from its series.
const PAIR_SERIES_LIMIT: f64 = 0.04;

impl<S: Simd> Differences<S> {
    /// From the eigenvalues `values` and half their logarithms `logs`.
    #[inline(always)]
    pub(super) fn new(simd: S, values: [Lane<S>; 3], logs: [Lane<S>; 3]) -> Self {
        let one = Lane::splat(simd, 1.0);
        let inverse = [one / values[0], one / values[1], one / values[2]];
        let mut first = [one; 6];
        let mut twice = [[one; 3]; 3];
        for a in 0..3 {
            first[a] = inverse[a];
            twice[a][a] = inverse[a] * inverse[a] * -0.25;
        }
        for pair in 3..6 {
            let (a, b) = PAIRS[pair];
            let inverse_sum = one / (values[a] + values[b]);
            let x = (values[a] - values[b]) * inverse_sum;
            let y = x * x;
            let series = pair_series(simd, y);
            let closed = ((logs[a] - logs[b]) / x - one) / y;
            let r = y.if_less(Lane::splat(simd, PAIR_SERIES_LIMIT), series, closed);
            let q = y.mul_add(r, one);
            first[pair] = (q + q) * inverse_sum;
            let squared = inverse_sum * inverse_sum;
            twice[a][b] = -(q + x * r) * squared / (one + x);
            twice[b][a] = -(q - x * r) * squared / (one - x);
        }
        let distinct = distinct(simd, values, &first);
        Self { first, twice, distinct }
    }
}

/// Series of `R` for `y` below [`PAIR_SERIES_LIMIT`].
#[inline(always)]
fn pair_series<S: Simd>(simd: S, y: Lane<S>) -> Lane<S> {
    let mut sum = Lane::splat(simd, 1.0 / 27.0);
    for k in (0..12).rev() {
        sum = sum.mul_add(y, Lane::splat(simd, 1.0 / f64::from(2 * k + 3)));
    }
    sum
}

/// Spread of three arguments over the smallest, below which `f[a,b,c]` is computed from its series.
const TRIPLE_SERIES_LIMIT: f64 = 0.15;

/// `f[a,b,c]` from the first differences (`first` holds `2 f[a,b]` by pair).
#[inline(always)]
fn distinct<S: Simd>(simd: S, values: [Lane<S>; 3], first: &[Lane<S>; 6]) -> Lane<S> {
    let [a, b, c] = values;
    // The pair with the largest distance has the smallest cancellation: f[a,b,c] = (f[a,c] - f[c,b]) / (a - b).
    let (mut distance, mut difference) = (a - b, first[5] - first[4]);
    for (next, step) in [(b - c, first[3] - first[5]), (c - a, first[4] - first[3])] {
        let (width, wider) = (distance.abs(), next.abs());
        difference = width.if_less(wider, step, difference);
        distance = width.if_less(wider, next, distance);
    }
    let smallest = a.min(b).min(c);
    let series = triple_series(simd, values);
    distance.abs().if_less(smallest * TRIPLE_SERIES_LIMIT, series, difference / distance * 0.5)
}

/// Series of `f[a,b,c]` for close arguments: `½ Σ_k (-1)^{k+1}/k h_{k-2}(δ) / m²`, with complete homogeneous
/// polynomials of the relative deviations `δ` from the mean `m`.
#[inline(always)]
fn triple_series<S: Simd>(simd: S, [a, b, c]: [Lane<S>; 3]) -> Lane<S> {
    let one = Lane::splat(simd, 1.0);
    let inverse = Lane::splat(simd, 3.0) / (a + b + c);
    let [x, y, z] = [a.mul_add(inverse, -one), b.mul_add(inverse, -one), c.mul_add(inverse, -one)];
    let spread = x.abs().max(y.abs()).max(z.abs()).largest();
    let (mut h1, mut h2, mut h3) = (one, one, one);
    let mut sum = Lane::splat(simd, -0.5);
    let mut size = 1.0;
    // Lanes with distant arguments do not use the series.
    for k in 3..21 {
        h1 = h1 * z;
        h2 = y.mul_add(h2, h1);
        h3 = x.mul_add(h3, h2);
        let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
        sum = h3.mul_add(Lane::splat(simd, sign / f64::from(k)), sum);
        size *= spread;
        if size < 1e-18 {
            break;
        }
    }
    sum * inverse * inverse * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Comparison with the explicit divided differences where these do not cancel.
    #[test]
    fn differences_agree_across_the_switches() {
        let simd = pulp::Scalar::new();
        let f = |a: f64, b: f64| if a == b { 0.5 / a } else { 0.5 * (a / b).ln() / (a - b) };
        for spread in [1.5, 0.7, 0.51, 0.49, 0.3, 0.2, 0.16, 0.155, 0.145, 0.14, 0.1] {
            let values: [f64; 3] = [1.3 * (1.0 + spread), 1.3, 1.3 * (1.0 + 0.4 * spread)];
            let lanes = values.map(|v| Lane::splat(simd, v));
            let logs = values.map(|v| Lane::splat(simd, 0.5 * v.ln()));
            let found = Differences::new(simd, lanes, logs);
            for a in 0..3 {
                for b in 0..3 {
                    if a != b {
                        let (x, y) = (values[a], values[b]);
                        let exact = (f(x, y) - f(x, x)) / (y - x);
                        let error = found.twice[a][b].largest() / exact - 1.0;
                        assert!(error.abs() < 1e-12, "{spread} {a} {b} {error:e}");
                    }
                }
            }
            let [x, y, z] = values;
            let exact = (f(x, z) - f(z, y)) / (x - y);
            let error = found.distinct.largest() / exact - 1.0;
            assert!(error.abs() < 1e-12, "{spread} {error:e}");
            for (pair, (a, b)) in PAIRS.into_iter().enumerate() {
                let exact = 2.0 * f(values[a], values[b]);
                let error = found.first[pair].largest() / exact - 1.0;
                assert!(error.abs() < 1e-15 * 4.0, "{spread} {pair} {error:e}");
            }
        }
        let two = [Lane::splat(simd, 2.0); 3];
        let equal = Differences::new(simd, two, [Lane::splat(simd, 0.5 * 2.0_f64.ln()); 3]);
        assert!((equal.twice[0][1].largest() + 0.0625).abs() < 1e-16);
        assert!((equal.distinct.largest() + 0.0625).abs() < 1e-16);
    }
}
