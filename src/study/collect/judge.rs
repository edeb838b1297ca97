//! The figures that a study's checks look at.

use super::{Off, Row};
use crate::report::record::RunRecord;
use crate::study::checks::{Check, Figure, Outcome};
use crate::study::compare::at;
use crate::study::file::Study;

/// Points at which two curves are compared.
const POINTS: usize = 500;
/// Share of the stroke that is not its late part.
const EARLY: f64 = 2.0 / 3.0;

/// Every check with its outcome.
pub(super) fn judge(study: &Study, rows: &[Row<'_>]) -> Vec<(Check, Outcome)> {
    let done = |id: &str| rows.iter().find(|r| r.case.id == id && r.done());
    let judged = |check: &Check| {
        let other = check.against.as_ref().or(study.reference.as_ref()).and_then(|id| done(id));
        let about = rows.iter().filter(|r| {
            let named = check.cases.is_empty() || check.cases.contains(&r.case.id);
            named && r.done()
        });
        let value = |row: &Row<'_>| {
            let (value, travel) = figure(check.figure, row, other)?;
            let place = travel.map_or_else(String::new, |x| format!(" at {x:.1} mm"));
            Some((format!("{}{place}", row.case.id), value))
        };
        let values: Vec<(String, f64)> = about.filter_map(value).collect();
        (check.clone(), check.judge(&values))
    };
    study.checks.iter().map(judged).collect()
}

/// A figure of a row, beside another one, with the travel at which it is found [mm]; `None` where one of them has not
/// got it.
fn figure(figure: Figure, row: &Row<'_>, other: Option<&Row<'_>>) -> Option<(f64, Option<f64>)> {
    let record = row.record.as_ref()?;
    let value = match figure {
        Figure::ForceRms => force_rms(&row.curve, &other?.curve)?,
        Figure::LateForceExcess => {
            let (travel, excess) = late_excess(&row.curve, &other?.curve)?;
            return Some((excess, Some(travel)));
        }
        Figure::ThicknessMm => Off::between(row, other?).thickest()?,
        Figure::PatchesOverReference => row.patches as f64 / other?.patches.max(1) as f64,
        Figure::SecondsOverReference => record.cpu_s / other?.record.as_ref()?.cpu_s,
        Figure::IterationInFactorisationsOverReference => {
            in_factorisations(record)? / in_factorisations(other?.record.as_ref()?)?
        }
        Figure::ForceBalance => record.force_balance,
        Figure::EnergyBalance => record.energy_balance,
        Figure::VolumeBalance => record.volume_balance?,
        Figure::PenetrationMm => record.penetration_mm,
    };
    Some((value, None))
}

/// Time of an iteration over that of a factorisation in the same run, both by the clocks of its phases; `None` of a run
/// without any. What is measured once an increment is of no iteration.
fn in_factorisations(run: &RunRecord) -> Option<f64> {
    let once = ["stability", "penetration"];
    let of_iterations = run.timings_s.iter().filter(|(phase, _)| !once.contains(&phase.as_str()));
    let iteration = of_iterations.map(|(_, s)| s).sum::<f64>() / run.iterations.max(1) as f64;
    let factor = run.timings_s.get("factor")? / run.factorisations.max(1) as f64;
    (factor > 0.0).then(|| iteration / factor)
}

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
