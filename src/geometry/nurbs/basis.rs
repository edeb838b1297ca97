//! B-spline basis functions and their first two derivatives, on fixed stack buffers.

/// Largest degree accepted.
pub(super) const MAX_DEGREE: usize = 25;
/// Buffer for degrees up to 3, the common case.
pub(super) const SMALL: usize = 4;
/// Buffer for any degree.
pub(super) const LARGE: usize = MAX_DEGREE + 1;

/// The basis functions that are not zero at a parameter, with derivatives; `SIZE > degree`.
pub(super) struct BasisWindow<const SIZE: usize> {
    /// Index of the first of them.
    pub first: usize,
    /// Values, first and second derivatives; `degree + 1` of each are set.
    pub values: [[f64; SIZE]; 3],
}

/// Index k with `knots[k] <= t < knots[k + 1]` inside the domain; the last non-empty span at its end.
pub(super) fn span(degree: usize, knots: &[f64], t: f64) -> usize {
    let (low, high) = (degree, knots.len() - 1 - degree);
    let t = t.clamp(knots[low], knots[high]);
    // Knots up to and including t, within the domain.
    let k = low + knots[low..=high].partition_point(|&k| k <= t) - 1;
    let mut k = k.min(high - 1);
    while knots[k] >= knots[k + 1] && k > low {
        k -= 1;
    }
    k
}

/// Basis functions of `degree` at `t` (clamped to the domain), by the Cox-de Boor recursion; derivatives from
/// the functions of lower degree.
pub(super) fn basis<const SIZE: usize>(degree: usize, knots: &[f64], t: f64) -> BasisWindow<SIZE> {
    let t = t.clamp(knots[degree], knots[knots.len() - 1 - degree]);
    let k = span(degree, knots, t);
    let mut row = [0.0; SIZE];
    let mut lower = [[0.0; SIZE]; 2];
    row[0] = 1.0;
    for j in 1..=degree {
        if j + 1 >= degree {
            lower[j + 1 - degree] = row;
        }
        let mut saved = 0.0;
        for r in 0..j {
            let (right, left) = (knots[k + r + 1] - t, t - knots[k + 1 + r - j]);
            let share = row[r] / (right + left);
            row[r] = saved + right * share;
            saved = left * share;
        }
        row[j] = saved;
    }
    let mut values = [row, [0.0; SIZE], [0.0; SIZE]];
    if degree >= 1 {
        values[1] = derive(degree, knots, k, &lower[1]);
    }
    if degree >= 2 {
        let first = derive(degree - 1, knots, k, &lower[0]);
        values[2] = derive(degree, knots, k, &first);
    }
    BasisWindow { first: k - degree, values }
}

/// `p (f_i / (t_{i+p} - t_i) - f_{i+1} / (t_{i+p+1} - t_{i+1}))`: turns (derivatives of) the functions of degree
/// p - 1 into the next derivatives of those of degree p, all in span k.
fn derive<const SIZE: usize>(
    p: usize,
    knots: &[f64],
    k: usize,
    lower: &[f64; SIZE],
) -> [f64; SIZE] {
    let mut out = [0.0; SIZE];
    for (r, slot) in out.iter_mut().enumerate().take(p + 1) {
        let i = k - p + r;
        if r > 0 {
            *slot += p as f64 * lower[r - 1] / (knots[i + p] - knots[i]);
        }
        if r < p {
            *slot -= p as f64 * lower[r] / (knots[i + p + 1] - knots[i + 1]);
        }
    }
    out
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
    fn empty_spans_and_full_interior_multiplicity_are_stepped_over() {
        let knots = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        assert_eq!(span(1, &knots, 1.0), 3);
        assert_eq!(span(1, &knots, 2.0), 3);
        assert_eq!(span(1, &knots, 0.5), 1);
    }
}
