//! B-spline basis functions and their first two derivatives, in stack buffers of fixed size.

/// Largest degree accepted. Doubled: stack buffers of twice the size.
pub(super) const MAX_DEGREE: usize = 25;
/// Buffer size for degrees up to 3, the most frequent case.
pub(super) const SMALL: usize = 4;
/// Buffer size for degrees up to 9.
pub(super) const MEDIUM: usize = 10;
/// Buffer size for degrees up to 15.
pub(super) const WIDE: usize = 16;
/// Buffer size for every admissible degree.
pub(super) const LARGE: usize = MAX_DEGREE + 1;

/// The non-zero basis functions at a parameter with their derivatives; `SIZE > degree`.
pub(super) struct BasisWindow<const SIZE: usize> {
    /// Index of the first non-zero function.
    pub first: usize,
    /// Values, first and second derivatives; the first `degree + 1` entries of each are valid.
    pub values: [[f64; SIZE]; 3],
}

/// Knot span index k with `knots[k] <= t < knots[k + 1]` within the domain; the last non-empty span at its end. `t`
/// must not be NaN; if it is, the first span is returned and the basis functions are NaN.
pub(super) fn span(degree: usize, knots: &[f64], t: f64) -> usize {
    let (low, high) = (degree, knots.len() - 1 - degree);
    debug_assert!(!t.is_nan(), "a parameter that is not a number");
    if high == low + 1 {
        return low;
    }
    let t = t.clamp(knots[low], knots[high]);
    let k = (low + knots[low..=high].partition_point(|&k| k <= t) - 1).max(low);
    let mut k = k.min(high - 1);
    while knots[k] >= knots[k + 1] && k > low {
        k -= 1;
    }
    k
}

/// Basis functions of `degree` at `t` (clamped to the domain) by the Cox-de Boor recursion. Derivatives follow from the
/// functions of lower degree (Piegl/Tiller Eq. 2.7).
pub(super) fn basis<const SIZE: usize>(degree: usize, knots: &[f64], t: f64) -> BasisWindow<SIZE> {
    let t = t.clamp(knots[degree], knots[knots.len() - 1 - degree]);
    let k = span(degree, knots, t);
    // A constant degree lets the compiler unroll the loops.
    let values = match degree {
        1 => with_derivatives(1, knots, k, t),
        2 => with_derivatives(2, knots, k, t),
        3 => with_derivatives(3, knots, k, t),
        _ => with_derivatives(degree, knots, k, t),
    };
    BasisWindow { first: k - degree, values }
}

/// Values, first and second derivatives of the functions of `degree` in knot span k.
#[inline(always)]
fn with_derivatives<const SIZE: usize>(
    degree: usize,
    knots: &[f64],
    k: usize,
    t: f64,
) -> [[f64; SIZE]; 3] {
    let mut lower = [[0.0; SIZE]; 2];
    let keep = |j: usize, row: &[f64; SIZE]| {
        if j + 1 >= degree {
            lower[j + 1 - degree] = *row;
        }
    };
    let row = cox_de_boor(degree, knots, k, t, keep);
    let mut values = [row, [0.0; SIZE], [0.0; SIZE]];
    if degree >= 1 {
        values[1] = derive(degree, knots, k, &lower[1]);
    }
    if degree >= 2 {
        let first = derive(degree - 1, knots, k, &lower[0]);
        values[2] = derive(degree, knots, k, &first);
    }
    values
}

/// Values of the basis functions without derivatives, bit-identical to those of [`basis`]: index of the first function,
/// and values.
pub(super) fn basis_values<const SIZE: usize>(
    degree: usize,
    knots: &[f64],
    t: f64,
) -> (usize, [f64; SIZE]) {
    let t = t.clamp(knots[degree], knots[knots.len() - 1 - degree]);
    let k = span(degree, knots, t);
    // A constant degree lets the compiler unroll the loops.
    let row = match degree {
        1 => cox_de_boor(1, knots, k, t, |_, _| {}),
        2 => cox_de_boor(2, knots, k, t, |_, _| {}),
        3 => cox_de_boor(3, knots, k, t, |_, _| {}),
        5 if SIZE > 5 => cox_de_boor(5, knots, k, t, |_, _| {}),
        _ => cox_de_boor(degree, knots, k, t, |_, _| {}),
    };
    (k - degree, row)
}

/// Cox-de Boor recursion up to `degree` in knot span k; `before(j, ..)` receives the functions of degree j - 1.
#[inline(always)]
fn cox_de_boor<const SIZE: usize>(
    degree: usize,
    knots: &[f64],
    k: usize,
    t: f64,
    mut before: impl FnMut(usize, &[f64; SIZE]),
) -> [f64; SIZE] {
    let near = &knots[k + 1 - degree..k + 1 + degree];
    let mut row = [0.0; SIZE];
    row[0] = 1.0;
    for j in 1..=degree {
        before(j, &row);
        let mut saved = 0.0;
        for r in 0..j {
            let (right, left) = (near[degree + r] - t, t - near[degree + r - j]);
            let fraction = row[r] / (right + left);
            row[r] = saved + right * fraction;
            saved = left * fraction;
        }
        row[j] = saved;
    }
    row
}

/// `p (f_i / (t_{i+p} - t_i) - f_{i+1} / (t_{i+p+1} - t_{i+1}))` in knot span k (Piegl/Tiller Eq. 2.7). Maps functions
/// of degree p - 1, or their derivatives, to the next derivative of the functions of degree p.
#[inline(always)]
fn derive<const SIZE: usize>(
    p: usize,
    knots: &[f64],
    k: usize,
    lower: &[f64; SIZE],
) -> [f64; SIZE] {
    let near = &knots[k + 1 - p..k + 1 + p];
    let mut out = [0.0; SIZE];
    for r in 0..p {
        let fraction = p as f64 * lower[r] / (near[p + r] - near[r]);
        out[r] -= fraction;
        out[r + 1] += fraction;
    }
    out
}

/// Bernstein polynomials of `degree < SIZE` at `t` with first and second derivatives; the window starts at index 0.
pub(super) fn bernstein<const SIZE: usize>(degree: usize, t: f64) -> BasisWindow<SIZE> {
    let (mut row, mut lower) = ([0.0; SIZE], [[0.0; SIZE]; 2]);
    row[0] = 1.0;
    for j in 1..=degree {
        lower = [lower[1], row];
        let mut saved = 0.0;
        for slot in &mut row[..j] {
            let fraction = *slot;
            *slot = saved + (1.0 - t) * fraction;
            saved = t * fraction;
        }
        row[j] = saved;
    }
    let mut values = [row, [0.0; SIZE], [0.0; SIZE]];
    let n = degree as f64;
    // Functions of lower degree with an index outside their range vanish.
    let at = |row: &[f64; SIZE], i: Option<usize>| i.map_or(0.0, |i| row[i]);
    let [low, lower] = &lower;
    for (i, slot) in values[1].iter_mut().enumerate().take(degree + 1) {
        *slot = n * (at(lower, i.checked_sub(1)) - lower[i]);
    }
    for (i, slot) in values[2].iter_mut().enumerate().take(degree + 1) {
        let bend = at(low, i.checked_sub(2)) - 2.0 * at(low, i.checked_sub(1)) + low[i];
        *slot = n * (n - 1.0) * bend;
    }
    BasisWindow { first: 0, values }
}

/// Binomial coefficient `C(n, k)`; exact for n up to 50.
pub(super) fn binomial(n: usize, k: usize) -> f64 {
    let k = k.min(n - k);
    (0..k).fold(1.0, |b, i| (b * (n - i) as f64 / (i + 1) as f64).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_sum_to_one_and_derivatives_to_zero() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 2.0, 2.0, 2.0, 2.0];
        for t in [0.0, 0.2, 0.5, 0.7, 1.0, 1.9, 2.0] {
            let b = basis::<SMALL>(3, &knots, t);
            for (order, expected) in [(0, 1.0), (1, 0.0), (2, 0.0)] {
                let sum: f64 = b.values[order][..4].iter().sum();
                assert!((sum - expected).abs() < 1e-12, "t {t}, order {order}: {sum}");
            }
        }
    }

    #[test]
    fn bernstein_polynomials_are_the_basis_of_one_span() {
        for degree in 1..=9 {
            let knots = [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat();
            for t in [0.0, 0.3, 0.75, 1.0] {
                let (a, b) = (bernstein::<MEDIUM>(degree, t), basis::<MEDIUM>(degree, &knots, t));
                for (x, y) in a.values.iter().flatten().zip(b.values.iter().flatten()) {
                    assert!((x - y).abs() < 1e-12 * (1.0 + y.abs()), "degree {degree} at {t}");
                }
            }
        }
        assert_eq!(binomial(50, 25), 126_410_606_437_752.0);
    }

    #[test]
    fn empty_spans_and_full_interior_multiplicity_are_stepped_over() {
        let knots = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        assert_eq!(span(1, &knots, 1.0), 3);
        assert_eq!(span(1, &knots, 2.0), 3);
        assert_eq!(span(1, &knots, 0.5), 1);
    }
}
