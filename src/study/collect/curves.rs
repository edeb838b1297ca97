//! Differences of curves of force over travel.

use crate::study::compare::at;

/// Points at which two curves are compared.
const POINTS: usize = 500;

/// Share of the stroke that is not its late part.
const EARLY: f64 = 2.0 / 3.0;

/// RMS over the common travel of the difference of two curves, over the second one's RMS.
pub(super) fn force_rms(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<f64> {
    let (start, end) = common(curve, reference)?;
    let (mut off, mut size) = (0.0, 0.0);
    for k in 0..=POINTS {
        let x = start + (end - start) * k as f64 / POINTS as f64;
        let (a, b) = (at(curve, x), at(reference, x));
        off += (a - b) * (a - b);
        size += b * b;
    }
    (size > 0.0).then(|| (off / size).sqrt())
}

/// Largest excess of a curve over another in the last third of their common travel, over the second one's largest
/// force, and the travel there.
pub(super) fn late_excess(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (_, end) = common(curve, reference)?;
    let largest = reference.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let excess = (0..=POINTS).map(|k| {
        let x = end * (EARLY + (1.0 - EARLY) * k as f64 / POINTS as f64);
        (x, (at(curve, x) - at(reference, x)) / largest)
    });
    excess.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| largest > 0.0)
}

/// Travel that two curves have in common.
fn common(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<(f64, f64)> {
    let start = curve.first()?.0.max(reference.first()?.0);
    let end = curve.last()?.0.min(reference.last()?.0);
    (end > start).then_some((start, end))
}
