//! Error of a mesh from the distances of coarser runs to its own (Richardson's extrapolation with an observed order).
//!
//! A quantity of meshes with the element length h has the error `C h^p`. The distance of a run whose elements are R times as
//! long to the finest one is `d = C h^p (R^p - 1)`, and the error of the finest is `d / (R^p - 1)`. With two such runs the
//! quotient of their distances gives the order p.

/// Smallest order that is believed. Contact at nodes and fronts of yielding keep forces and thickness at 1 to 2. At half this
/// order, estimates from runs whose distances scatter are 2.3 times as large; at the double 2.7 times as small.
const ORDER_MIN: f64 = 0.75;
/// Largest order that is believed: that of the elements. Without this bound two runs that agree by chance pass for exact.
const ORDER_MAX: f64 = 2.0;
/// Order assumed with two meshes.
const ORDER_UNKNOWN: f64 = 1.0;

/// Smallest ratio of element lengths of runs that are compared. Part of a distance is roughness, which both runs have
/// without relation: at a ratio of 1.4 the extrapolation takes it for an error 2.5 times as large, at 2 it is as large. The
/// ratio is a little smaller than 2 because elements are counted in whole numbers.
const RATIO_COMPARED: f64 = 1.9;

/// Factor on the extrapolated error, that of the grid convergence index for an observed order (Roache 1994): three meshes
/// are seldom in the asymptotic range. Without it errors of the U-draw are 1.2 times the estimate; with the double most are
/// below half of it.
const SAFETY: f64 = 1.25;

/// Observed order of convergence from the distances `d` of two runs to a finer one and the ratios `r` (each > 1, the first
/// larger) of their element lengths to its, within the orders that are believed.
pub(super) fn order(d: [f64; 2], r: [f64; 2]) -> f64 {
    if d[1] <= 0.0 {
        return ORDER_MAX;
    }
    // It increases with p.
    let quotient = |p: f64| (r[0].powf(p) - 1.0) / (r[1].powf(p) - 1.0);
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
    /// Error of the finest mesh, from the `distances` of coarser runs to it and the `ratios` of their element lengths to its,
    /// the coarsest first. The finest of those with a sufficient ratio is compared, and the one before it gives the order;
    /// without one before, the order is assumed. `None` without a coarser run.
    pub(super) fn new(distances: &[f64], ratios: &[f64]) -> Option<Self> {
        let k = ratios.iter().rposition(|ratio| *ratio >= RATIO_COMPARED).unwrap_or(0);
        let (&d, &r) = (distances.get(k)?, ratios.get(k)?);
        let before = k.checked_sub(1).map(|k| ([distances[k], d], [ratios[k], r]));
        let observed = before.map(|(d, r)| order(d, r));
        let p = observed.unwrap_or(ORDER_UNKNOWN);
        Some(Self { error: SAFETY * d / (r.powf(p) - 1.0), order: observed })
    }

    /// Ratio of element lengths that brings the error to `wanted`.
    pub(super) fn ratio_to(&self, wanted: f64) -> f64 {
        (self.error / wanted).powf(1.0 / self.order.unwrap_or(ORDER_UNKNOWN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_and_error_of_a_power_law_are_exact_for_any_ratios() {
        for p in [0.8, 1.0, 1.5, 2.0] {
            for h in [[1.0, 0.5, 0.25], [1.0, 0.5, 0.26], [1.0, 0.7, 0.3]] {
                let error = h.map(|h: f64| 0.3 * h.powf(p));
                let (d, r) =
                    ([error[0] - error[2], error[1] - error[2]], [h[0] / h[2], h[1] / h[2]]);
                let found = MeshError::new(&d, &r).unwrap();
                assert!((found.order.unwrap() - p).abs() < 1e-9, "{p} {h:?}: {found:?}");
                assert!((found.error - SAFETY * error[2]).abs() < 1e-9, "{p} {h:?}: {found:?}");
                let finer = found.ratio_to(0.1 * found.error);
                assert!((finer.powf(p) - 10.0).abs() < 1e-6);
                // A run whose elements are hardly longer says nothing.
                let close = MeshError::new(&[d[0], d[1], 9.0], &[r[0], r[1], 1.4]).unwrap();
                assert_eq!(close, found);
            }
        }
    }

    #[test]
    fn orders_that_are_not_believed_are_bounded() {
        assert_eq!(order([1.0, 2.0], [4.0, 2.0]), ORDER_MIN);
        assert_eq!(order([1.0, 0.01], [4.0, 2.0]), ORDER_MAX);
        assert_eq!(order([1.0, 0.0], [4.0, 2.0]), ORDER_MAX);
        let assumed = MeshError { error: 0.2 * SAFETY, order: None };
        assert_eq!(MeshError::new(&[0.2], &[2.0]), Some(assumed));
        // Nothing but a run with a small ratio.
        assert!((MeshError::new(&[0.2], &[1.5]).unwrap().error - 0.4 * SAFETY).abs() < 1e-12);
        assert_eq!(MeshError::new(&[], &[]), None);
    }
}
