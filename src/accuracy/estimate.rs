//! Error of a mesh from the distances of successive runs (Richardson's extrapolation with an observed order).
//!
//! A quantity of meshes with the element length h has the error `C h^p`. For three meshes with the lengths h0 > h1 > h2 and
//! the ratios r1 = h0/h1, r2 = h1/h2 the distances of successive runs are
//! `d1 = C h1^p (r1^p - 1)`, `d2 = C h2^p (r2^p - 1)`, and the error of the last is `d2 / (r2^p - 1)`.

/// Smallest order that is believed. Contact at nodes and fronts of yielding keep forces and thickness at 1 to 2. At half this
/// order, estimates from runs whose distances scatter are 2.3 times as large; at the double 2.7 times as small.
const ORDER_MIN: f64 = 0.75;
/// Largest order that is believed: that of the elements. Without this bound two runs that agree by chance pass for exact.
const ORDER_MAX: f64 = 2.0;
/// Order assumed with two meshes.
const ORDER_UNKNOWN: f64 = 1.0;

/// Observed order of convergence from the distances `d` of three successive runs with the ratios `r` (each > 1) of their
/// element lengths, within the orders that are believed.
pub(super) fn order(d: [f64; 2], r: [f64; 2]) -> f64 {
    if d[1] <= 0.0 {
        return ORDER_MAX;
    }
    // The quotient d1 / d2 = r2^p (r1^p - 1) / (r2^p - 1) increases with p.
    let quotient = |p: f64| {
        let [a, b] = r.map(|r| r.powf(p));
        b * (a - 1.0) / (b - 1.0)
    };
    let wanted = d[0] / d[1];
    let (mut low, mut high) = (ORDER_MIN, ORDER_MAX);
    if quotient(low) >= wanted {
        return low;
    }
    if quotient(high) <= wanted {
        return high;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if quotient(middle) < wanted { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Error of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeshError {
    /// The error, in the unit of the distances.
    pub(super) error: f64,
    /// Order of convergence that was observed; `None` if it is assumed.
    pub(super) order: Option<f64>,
}

impl MeshError {
    /// Error of the finest mesh, from the distances of successive runs and the ratios of their element lengths, the finest
    /// last. With two meshes the order is assumed. `None` for a single run.
    pub(super) fn new(distances: &[f64], ratios: &[f64]) -> Option<Self> {
        let (&d, &r) = (distances.last()?, ratios.last()?);
        let before = distances.len().checked_sub(2).map(|k| ([distances[k], d], [ratios[k], r]));
        let observed = before.map(|(d, r)| order(d, r));
        let p = observed.unwrap_or(ORDER_UNKNOWN);
        Some(Self { error: d / (r.powf(p) - 1.0), order: observed })
    }

    /// Ratio of element lengths that brings the error to `wanted`.
    pub(super) fn ratio_to(&self, wanted: f64) -> f64 {
        (self.error / wanted).powf(1.0 / self.order.unwrap_or(ORDER_UNKNOWN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances of runs with the error `0.3 h^p`.
    fn distances(h: [f64; 3], p: f64) -> [f64; 2] {
        let error = h.map(|h| 0.3 * h.powf(p));
        [error[0] - error[1], error[1] - error[2]]
    }

    #[test]
    fn order_and_error_of_a_power_law_are_exact_for_any_ratios() {
        for p in [0.8, 1.0, 1.5, 2.0] {
            for h in [[1.0, 0.5, 0.25], [1.0, 0.5, 0.32], [1.0, 0.7, 0.3]] {
                let (d, r) = (distances(h, p), [h[0] / h[1], h[1] / h[2]]);
                let found = MeshError::new(&d, &r).unwrap();
                let MeshError { error, order } = found;
                assert!((order.unwrap() - p).abs() < 1e-9, "{p} {h:?}: {order:?}");
                assert!((error - 0.3 * h[2].powf(p)).abs() < 1e-9, "{p} {h:?}: {error}");
                let finer = found.ratio_to(0.1 * error);
                assert!((finer.powf(p) - 10.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn orders_that_are_not_believed_are_bounded() {
        assert_eq!(order([1.0, 2.0], [2.0; 2]), ORDER_MIN);
        assert_eq!(order([1.0, 0.01], [2.0; 2]), ORDER_MAX);
        assert_eq!(order([1.0, 0.0], [2.0; 2]), ORDER_MAX);
        let assumed = MeshError { error: 0.2, order: None };
        assert_eq!(MeshError::new(&[0.2], &[2.0]), Some(assumed));
        assert_eq!(MeshError::new(&[], &[]), None);
    }
}
