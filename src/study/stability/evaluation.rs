//! Rounding errors of three forms of a polynomial with given Bernstein coefficients, compared with exact arithmetic.
//!
//! Coefficients are integer multiples of 2^-48 and parameters of 2^-6. The exact value of degree n is then an integer
//! multiple of 2^-(48 + 6 n), which 128 bits hold up to degree 12.

use super::description::EvaluationMap;
use kanagata_report::drawing::{Chart, Line};

const COEFFICIENT_BITS: u32 = 48;
const PARAMETER_BITS: u32 = 6;
const STEPS: i64 = 1 << PARAMETER_BITS;
/// Exact values are multiples of 2^-120.
const SCALE_BITS: u32 = 120;

type Form = (&'static str, fn(&[f64]) -> Vec<f64>, fn(&[f64], f64) -> f64);

const FORMS: [Form; 3] = [
    ("monomials about a corner", at_corner, |c, t| horner(c, t)),
    ("monomials about the middle", at_middle, |c, t| horner(c, 2.0 * t - 1.0)),
    ("Bernstein (de Casteljau)", <[f64]>::to_vec, de_casteljau),
];

/// Largest error by degree, in units of 2^-53 of the largest coefficient.
pub(super) fn chart(plan: &EvaluationMap) -> Chart {
    let lines = FORMS.iter().map(|form| {
        let worst = |degree: usize| (degree as f64, largest_error(form, degree, plan.polynomials));
        let points = (2..=plan.highest_degree).map(worst).collect();
        Line { name: form.0.into(), points, marks_only: false }
    });
    Chart {
        title: "Rounding of a polynomial's value".into(),
        x: ("degree".into(), false),
        y: ("largest error [2^-53 of the largest coefficient]".into(), true),
        lines: lines.collect(),
    }
}

fn largest_error((_, prepare, evaluate): &Form, degree: usize, count: usize) -> f64 {
    let mut seed = 0x5eed_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> (63 - COEFFICIENT_BITS)) as i64 - (1 << COEFFICIENT_BITS)
    };
    let mut worst = 0.0_f64;
    for _ in 0..count {
        let whole: Vec<i64> = (0..=degree).map(|_| random()).collect();
        let largest = whole.iter().map(|c| c.abs()).max().unwrap_or(0).max(1);
        let unit = (0.5_f64).powi(COEFFICIENT_BITS as i32);
        let form = prepare(&whole.iter().map(|&c| c as f64 * unit).collect::<Vec<_>>());
        for step in 0..=STEPS {
            let found = evaluate(&form, step as f64 / STEPS as f64);
            let difference = whole_multiple(found) - exact(&whole, step);
            let error = difference.unsigned_abs() as f64 / (2.0_f64).powi(SCALE_BITS as i32);
            worst = worst.max(error / (largest as f64 * unit));
        }
    }
    worst * (2.0_f64).powi(53)
}

/// `value` in multiples of 2^-120, truncated.
fn whole_multiple(value: f64) -> i128 {
    (value * (2.0_f64).powi(SCALE_BITS as i32)) as i128
}

/// Value at `step / STEPS` in multiples of 2^-120, by de Casteljau's algorithm in integers.
pub(super) fn exact(coefficients: &[i64], step: i64) -> i128 {
    let mut c: Vec<i128> = coefficients.iter().map(|&c| i128::from(c)).collect();
    let (step, rest) = (i128::from(step), i128::from(STEPS - step));
    for level in (1..c.len()).rev() {
        for i in 0..level {
            c[i] = rest * c[i] + step * c[i + 1];
        }
    }
    let bits = COEFFICIENT_BITS + PARAMETER_BITS * (coefficients.len() as u32 - 1);
    c[0] << (SCALE_BITS - bits)
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |b, i| b * (n - i) as f64 / (i + 1) as f64).round()
}

/// Coefficients of `t^k`.
pub(super) fn at_corner(bernstein: &[f64]) -> Vec<f64> {
    let n = bernstein.len() - 1;
    let of = |k: usize| {
        let sum: f64 = (0..=k)
            .map(|i| if (k - i).is_multiple_of(2) { 1.0 } else { -1.0 } * binomial(k, i) * bernstein[i])
            .sum();
        binomial(n, k) * sum
    };
    (0..=n).map(of).collect()
}

/// Coefficients of `(2 t - 1)^k`.
pub(super) fn at_middle(bernstein: &[f64]) -> Vec<f64> {
    let n = bernstein.len() - 1;
    let mut out = vec![0.0; n + 1];
    for (i, c) in bernstein.iter().enumerate() {
        // binomial(n, i) (1 + u)^i (1 - u)^(n - i) / 2^n, in integers throughout.
        let mut product = vec![binomial(n, i)];
        for factor in 0..n {
            let sign = if factor < i { 1.0 } else { -1.0 };
            product.push(0.0);
            for k in (1..product.len()).rev() {
                product[k] += sign * product[k - 1];
            }
        }
        out.iter_mut().zip(&product).for_each(|(o, p)| *o += c * p * 0.5_f64.powi(n as i32));
    }
    out
}

fn horner(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn de_casteljau(c: &[f64], t: f64) -> f64 {
    let mut c = c.to_vec();
    for level in (1..c.len()).rev() {
        for i in 0..level {
            c[i] = (1.0 - t) * c[i] + t * c[i + 1];
        }
    }
    c[0]
}
