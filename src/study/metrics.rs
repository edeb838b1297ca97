//! Results of a run as one flat table of numbers and texts, for optimisers and scripts.
//!
//! | key | meaning |
//! |---|---|
//! | `verdict`, `doubts` | outcome as in `run.json`; codes of the doubts, separated by spaces |
//! | `increments`, `iterations`, `step_cuts` | counts |
//! | `wall_s`, `cpu_s`, `peak_mb` | cost |
//! | `travel_end_mm.TOOL`, `force_max_n.TOOL`, `force_end_n.TOOL` | of each tool; the force of largest magnitude |
//! | `thickness_min_mm`, `thickness_max_mm` | of the last equilibrium |
//! | `thinning_max` | largest decrease of thickness over the initial thickness [1] |
//! | `thinning_percent`, `forming_limit_margin` | largest thinning of an element [%], smallest margin |
//! | `quality` | `kept`, `exceeded` or `cracks` |
//! | `draw_in_dx_mm`, `draw_in_dxy_mm` | inward displacement of the ends of the lines x and xy of the blank |
//! | `springback_max_mm`, `springback_rms_mm` | displacements since the tools were released |
//! | `external_work_nmm`, `internal_work_nmm`, `friction_work_nmm` | energies |
//! | `energy_error`, `force_error`, `penetration_mm` | numerical errors as in `run.json` |
//!
//! What a run does not have (springback without release, say) has no key.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::StudyError;
use super::compare::sheet;
use kanagata_files::{Input, write_atomic};
use kanagata_report::record::{History, RunRecord};

/// Keys and values; the file has the keys in this order.
pub type Metrics = BTreeMap<String, Value>;

/// Metrics of the run in `folder`, from its `run.json`, `history.csv` and `steps/last.vtu`.
///
/// # Errors
/// [`StudyError::Io`] and [`StudyError::Value`] name the file.
pub fn metrics(folder: &Path) -> Result<Metrics, StudyError> {
    let read = |name: &str| {
        let path = folder.join(name);
        let text = kanagata_files::read(&path, Input::Description);
        text.map_err(|source| StudyError::Io { path, source })
    };
    let fault = |name: &str, found: String| StudyError::Value {
        path: folder.join(name),
        place: "file".into(),
        found,
        allowed: "the file of a run by this program".into(),
    };
    let record = RunRecord::parse(&read("run.json")?).map_err(|found| fault("run.json", found))?;
    let text = String::from_utf8_lossy(&read("history.csv")?).into_owned();
    let history = History::parse(&text).map_err(|found| fault("history.csv", found))?;
    let mut out = of_record(&record);
    of_history(&history, &mut out);
    if let Some(sheet) = sheet(folder) {
        out.insert("draw_in_dx_mm".into(), sheet.draw_in[0].into());
        out.insert("draw_in_dxy_mm".into(), sheet.draw_in[1].into());
    }
    Ok(out)
}

/// Metrics of `run.json`.
fn of_record(record: &RunRecord) -> Metrics {
    let codes: Vec<String> = record.doubts.iter().map(|doubt| doubt.code.to_string()).collect();
    let verdict = serde_json::to_value(record.verdict).unwrap_or_default();
    let counts = [
        ("increments", record.increments),
        ("iterations", record.iterations),
        ("step_cuts", record.step_cuts),
    ];
    let margin = record.formability.as_ref().and_then(|f| Some(f.margin?.margin));
    let measured = [
        ("wall_s", Some(record.wall_s)),
        ("cpu_s", Some(record.cpu_s)),
        ("peak_mb", Some(record.peak_mb)),
        ("energy_error", Some(record.energy_error)),
        ("force_error", Some(record.force_error)),
        ("penetration_mm", Some(record.penetration_mm)),
        ("thickness_min_mm", record.thickness.map(|t| t.minimum_mm)),
        ("thickness_max_mm", record.thickness.map(|t| t.maximum_mm)),
        ("thinning_max", record.thickness.map(|t| 1.0 - t.minimum_mm / t.initial_mm)),
        ("thinning_percent", record.formability.as_ref().map(|f| f.thinning.percent)),
        ("forming_limit_margin", margin),
        ("springback_max_mm", record.springback.map(|s| s.largest_mm)),
        ("springback_rms_mm", record.springback.map(|s| s.rms_mm)),
    ];
    let counts = counts.map(|(key, count)| (key.to_owned(), count.into()));
    // JSON has no infinite numbers: such a result has no key.
    let measured = measured.into_iter().filter_map(|(key, value)| {
        let value = value.filter(|value| value.is_finite())?;
        Some((key.to_owned(), value.into()))
    });
    let texts = [("verdict".to_owned(), verdict), ("doubts".to_owned(), codes.join(" ").into())];
    let quality = record.quality_verdict().map(|v| ("quality".to_owned(), v.to_string().into()));
    texts.into_iter().chain(quality).chain(counts).chain(measured).collect()
}

/// Metrics of `history.csv`: tools and energies.
fn of_history(history: &History, out: &mut Metrics) {
    let Some(last) = history.rows.last() else { return };
    for (k, tool) in history.tools.iter().enumerate() {
        let forces = history.rows.iter().map(|row| row.force_n[k]);
        let largest = forces.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        out.insert(format!("travel_end_mm.{tool}"), last.travel_mm[k].into());
        out.insert(format!("force_max_n.{tool}"), largest.into());
        out.insert(format!("force_end_n.{tool}"), last.force_n[k].into());
    }
    out.insert("external_work_nmm".into(), last.energy.external.into());
    out.insert("internal_work_nmm".into(), last.energy.internal.into());
    out.insert("friction_work_nmm".into(), last.energy.friction.into());
}

/// Writes metrics to `path` as one JSON object.
///
/// # Errors
/// [`StudyError::Write`] when the folder is missing or full.
pub fn write(path: &Path, metrics: &Metrics) -> Result<(), StudyError> {
    write_atomic(path, |w| {
        serde_json::to_writer_pretty(&mut *w, metrics)?;
        w.write_all(b"\n")
    })?;
    Ok(())
}
