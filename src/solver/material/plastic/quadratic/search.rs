//! The scalar equation of one return mapping: Newton's method kept inside a bracket.

/// Residual aimed at, relative to the flow stress.
const TARGET: f64 = 1e-14;
/// Residual accepted where rounding stops the iteration.
pub(super) const ACCEPTED: f64 = 1e-11;

/// The search for one point's increment.
#[derive(Clone, Copy)]
pub(super) struct Search {
    low: f64,
    high: f64,
    /// `σ_y / σ̄ - 1`, where it was last looked at.
    pub residual: f64,
}

impl Search {
    /// Nothing known yet; its residual is that of a point that stays elastic.
    pub(super) fn new() -> Self {
        Self { low: 0.0, high: f64::INFINITY, residual: 0.0 }
    }

    /// Where to look next after `x`, where `σ̄` and `Σ π_i ξ_i dξ_i/dx`, and the flow stress and its slope are known;
    /// `None` at the end. `least`: the first increment tried where Newton's method points nowhere.
    #[inline(always)]
    pub(super) fn next(
        &mut self,
        x: f64,
        [equivalent, hardening]: [f64; 2],
        [yield_stress, slope]: [f64; 2],
        least: f64,
    ) -> Option<f64> {
        self.residual = yield_stress / equivalent - 1.0;
        if self.residual.abs() <= TARGET {
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
                (2.0 * self.low).max(least)
            };
        }
        let still = (next - x).abs() <= 1e-16 * next;
        (!still && next != self.low && next != self.high).then_some(next)
    }
}
