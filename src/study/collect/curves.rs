//! Differences of force-travel curves.

use crate::compare::at;

/// Number of intervals at which two curves are compared.
const INTERVALS: usize = 500;

/// Fraction of the stroke before its late part.
const EARLY_FRACTION: f64 = 2.0 / 3.0;

/// RMS of the difference of two curves over their common travel, over the RMS of the second one.
pub(super) fn force_rms(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<f64> {
    let (start, end) = common(curve, reference)?;
    let (mut difference, mut size) = (0.0, 0.0);
    for k in 0..=INTERVALS {
        let x = start + (end - start) * k as f64 / INTERVALS as f64;
        let (a, b) = (at(curve, x), at(reference, x));
        difference += (a - b) * (a - b);
        size += b * b;
    }
    (size > 0.0).then(|| (difference / size).sqrt())
}

/// Largest excess of a curve over a reference in the last third of their common travel, over the largest force of the
/// reference; and its travel.
pub(super) fn late_excess(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (_, end) = common(curve, reference)?;
    let largest = reference.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let excess = (0..=INTERVALS).map(|k| {
        let x = end * (EARLY_FRACTION + (1.0 - EARLY_FRACTION) * k as f64 / INTERVALS as f64);
        (x, (at(curve, x) - at(reference, x)) / largest)
    });
    excess.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| largest > 0.0)
}

/// Common range of travel of two curves.
fn common(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<(f64, f64)> {
    let start = curve.first()?.0.max(reference.first()?.0);
    let end = curve.last()?.0.min(reference.last()?.0);
    (end > start).then_some((start, end))
}
