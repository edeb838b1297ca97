//! Scalar equation of one return mapping: Newton's method safeguarded by a bracket.

/// Convergence tolerance of the residual, relative to the flow stress.
const RESIDUAL_TOLERANCE: f64 = 1e-14;
/// Residual accepted if rounding stops the iteration.
pub(super) const RESIDUAL_ACCEPTED: f64 = 1e-11;

/// Bracket of the increment of one point.
#[derive(Clone, Copy)]
pub(super) struct Search {
    low: f64,
    high: f64,
    /// `σ_y / σ̄ - 1` at the last iterate.
    pub residual: f64,
}

impl Search {
    /// Empty bracket; the residual 0 is that of an elastic point.
    pub(super) fn new() -> Self {
        Self { low: 0.0, high: f64::INFINITY, residual: 0.0 }
    }

    /// Next iterate after `x`; `None` if converged or stagnant. `equivalent` is `σ̄`, `hardening` is
    /// `Σ π_i ξ_i dξ_i/dx`, `slope` the slope of the flow stress. `increment_min` is the first increment if the
    /// Newton step leaves the bracket.
    #[inline(always)]
    pub(super) fn next(
        &mut self,
        x: f64,
        [equivalent, hardening]: [f64; 2],
        [yield_stress, slope]: [f64; 2],
        increment_min: f64,
    ) -> Option<f64> {
        self.residual = yield_stress / equivalent - 1.0;
        if self.residual.abs() <= RESIDUAL_TOLERANCE {
            return None;
        }
        if self.residual < 0.0 {
            self.low = x;
        } else {
            self.high = x;
        }
        let rate = (slope - yield_stress / equivalent * (hardening / equivalent)) / equivalent;
        let mut next = x - self.residual / rate;
        if !(next > self.low && next < self.high) {
            next = if self.high.is_finite() {
                0.5 * (self.low + self.high)
            } else {
                (2.0 * self.low).max(increment_min)
            };
        }
        let stagnant = (next - x).abs() <= 1e-16 * next;
        (!stagnant && next != self.low && next != self.high).then_some(next)
    }
}
