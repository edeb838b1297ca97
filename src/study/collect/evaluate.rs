//! Evaluates the checks of a study.

use super::curves::{force_rms, late_excess};
use super::row::{Differences, Row};
use crate::checks::{Check, Figure, Outcome};
use crate::file::Study;
use kanagata_report::record::RunRecord;

/// Every check with its outcome.
pub(super) fn evaluate(study: &Study, rows: &[Row<'_>]) -> Vec<(Check, Outcome)> {
    let done = |id: &str| rows.iter().find(|r| r.case.id == id && r.done());
    let evaluated = |check: &Check| {
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
        (check.clone(), check.evaluate(&values))
    };
    study.checks.iter().map(evaluated).collect()
}

/// A quantity of a row relative to another one, and the travel at which it occurs [mm]. `None` if one of them lacks
/// data.
fn figure(figure: Figure, row: &Row<'_>, other: Option<&Row<'_>>) -> Option<(f64, Option<f64>)> {
    let record = row.record.as_ref()?;
    let value = match figure {
        Figure::ForceRms => force_rms(&row.curve, &other?.curve)?,
        Figure::LateForceExcess => {
            let (travel, excess) = late_excess(&row.curve, &other?.curve)?;
            return Some((excess, Some(travel)));
        }
        Figure::ThicknessMm => Differences::between(row, other?).thickest()?,
        Figure::PatchesOverReference => row.patches as f64 / other?.patches.max(1) as f64,
        Figure::SecondsOverReference => record.cpu_s / other?.record.as_ref()?.cpu_s,
        Figure::IterationInFactorisationsOverReference => {
            in_factorisations(record)? / in_factorisations(other?.record.as_ref()?)?
        }
        Figure::ForceError => record.force_error,
        Figure::EnergyError => record.energy_error,
        Figure::VolumeError => record.volume_error?,
        Figure::PenetrationMm => record.penetration_mm,
    };
    Some((value, None))
}

/// Time of an iteration over that of a factorisation in the same run, by the timings of the phases. `None` without
/// factorisations. Phases that run once per increment are excluded.
fn in_factorisations(run: &RunRecord) -> Option<f64> {
    let once = ["stability", "penetration"];
    let of_iterations = run.timings_s.iter().filter(|(phase, _)| !once.contains(&phase.as_str()));
    let iteration = of_iterations.map(|(_, s)| s).sum::<f64>() / run.iterations.max(1) as f64;
    let factor = run.timings_s.get("factor")? / run.factorisations.max(1) as f64;
    (factor > 0.0).then(|| iteration / factor)
}
