//! The tables of cases, for file and page: results, and what they cost.

use super::row::{CaseState, Row};
use crate::file::Study;
use kanagata_report::record::{FormabilityRecord, RunRecord};

/// A column: its name and its cell for a row.
type Column = (&'static str, fn(&Row<'_>) -> String);

/// Phases of a run: key in `run.json`, and name.
pub(super) const PHASES: [(&str, &str); 6] = [
    ("search", "search and projection"),
    ("contact", "contact"),
    ("elements", "elements (assembly)"),
    ("factor", "factorisation"),
    ("update", "updates of factors"),
    ("solve", "solves"),
];

/// Columns of results, the same wherever and however often a study is run on processors of a class.
const RESULTS: [Column; 34] = [
    ("state", state),
    ("doubts", |r| of(r, doubt_codes)),
    ("quality", |r| of(r, |r| r.quality_verdict().map_or("".into(), |v| v.to_string()))),
    ("thinning_percent", |r| formability(r, |f| format!("{:.2}", f.thinning.percent))),
    ("forming_limit_margin", |r| {
        formability(r, |f| f.margin.map_or("".into(), |margin| format!("{:.3}", margin.margin)))
    }),
    ("method", |r| r.method.clone()),
    ("patches", |r| r.patches.to_string()),
    ("shape_error_mm", |r| maybe(r.shape_error, 5)),
    ("increments", |r| of(r, |r| r.increments.to_string())),
    ("iterations", |r| of(r, |r| r.iterations.to_string())),
    ("step_cuts", |r| of(r, |r| r.step_cuts.to_string())),
    ("factorisations", |r| of(r, |r| r.factorisations.to_string())),
    ("updates", |r| of(r, |r| r.updates.to_string())),
    ("travel_mm", |r| maybe(r.curve.last().map(|p| p.0), 3)),
    ("force_max_n", |r| maybe(r.curve.iter().map(|p| p.1).reduce(f64::max), 0)),
    ("force_end_n", |r| maybe(r.curve.last().map(|p| p.1), 0)),
    ("draw_in_dx_mm", |r| maybe(r.sheet.as_ref().map(|s| s.draw_in[0]), 4)),
    ("draw_in_dxy_mm", |r| maybe(r.sheet.as_ref().map(|s| s.draw_in[1]), 4)),
    ("minimum_thickness_mm", |r| maybe(r.sheet.as_ref().map(|s| s.thinnest), 4)),
    ("springback_mm", |r| springback(r, |s| format!("{:.4}", s.largest_mm))),
    ("springback_rms_mm", |r| springback(r, |s| format!("{:.4}", s.rms_mm))),
    ("released_force_n", |r| springback(r, |s| format!("{:.0}", s.force_n))),
    ("springback_energy_nmm", |r| springback(r, |s| format!("{:.0}", s.energy_nmm))),
    ("snap_throughs", |r| of(r, |r| r.snap_throughs.to_string())),
    ("released_elastic_nmm", |r| of(r, |r| format!("{:.0}", r.released_elastic_nmm))),
    ("force_error", |r| of(r, |r| format!("{:.1e}", r.force_error))),
    ("energy_error", |r| of(r, |r| format!("{:.1e}", r.energy_error))),
    ("volume_error", |r| of(r, |r| r.volume_error.map_or("".into(), |v| format!("{v:.1e}")))),
    ("penetration_mm", |r| of(r, |r| format!("{:.1e}", r.penetration_mm))),
    ("force_rms_to_reference", |r| maybe(r.differences.force_rms, 5)),
    ("thickness_dx_difference_mm", |r| maybe(r.differences.thickness[0], 5)),
    ("thickness_dxy_difference_mm", |r| maybe(r.differences.thickness[1], 5)),
    ("cpu", |r| of(r, |r| r.cpu.clone())),
    ("reason", |r| r.reason.clone().unwrap_or_default()),
];

/// Columns of [`RESULTS`] that answer what is asked first about a case.
const ANSWERS: [&str; 11] = [
    "state",
    "doubts",
    "quality",
    "thinning_percent",
    "forming_limit_margin",
    "minimum_thickness_mm",
    "force_max_n",
    "draw_in_dx_mm",
    "springback_mm",
    "shape_error_mm",
    "reason",
];

/// Columns of cost, which differ between runs.
const COSTS: [Column; 11] = [
    ("wall_s", |r| of(r, |r| format!("{:.1}", r.wall_s))),
    ("cpu_s", |r| of(r, |r| format!("{:.1}", r.cpu_s))),
    ("peak_mb", |r| of(r, |r| format!("{:.0}", r.peak_mb))),
    ("search_and_projection_s", |r| of(r, |r| phase(r, 0))),
    ("contact_s", |r| of(r, |r| phase(r, 1))),
    ("elements_s", |r| of(r, |r| phase(r, 2))),
    ("factor_s", |r| of(r, |r| phase(r, 3))),
    ("update_s", |r| of(r, |r| phase(r, 4))),
    ("solve_s", |r| of(r, |r| phase(r, 5))),
    ("other_s", |r| of(r, |r| format!("{:.2}", rest(r)))),
    ("threads", |r| of(r, |r| r.threads.to_string())),
];

/// A table: header and rows.
pub(super) type Table = (Vec<String>, Vec<Vec<String>>);

/// Case, its options or the values of its row, and the results of its run.
pub(super) fn results(study: &Study, rows: &[Row<'_>]) -> Table {
    of_columns(study.varied(), &RESULTS, rows, |row| row.case.options.clone())
}

/// Case, its options or the values of its row, the main results, and processor time. A column without any value is left
/// out.
pub(super) fn answers(study: &Study, rows: &[Row<'_>]) -> Table {
    let chosen = |name: &str| RESULTS.iter().find(|(column, _)| *column == name).copied();
    let columns: Vec<Column> = ANSWERS.iter().filter_map(|name| chosen(name)).collect();
    let time = COSTS.iter().find(|(name, _)| *name == "cpu_s").copied();
    let has_value = |column: &Column| rows.iter().any(|row| !column.1(row).is_empty());
    let columns: Vec<Column> = columns.into_iter().chain(time).filter(has_value).collect();
    of_columns(study.varied(), &columns, rows, |row| row.case.options.clone())
}

/// Case, and the cost of its run.
pub(super) fn costs(rows: &[Row<'_>]) -> Table {
    of_columns(Vec::new(), &COSTS, rows, |_| Vec::new())
}

/// Columns for all rows, after the case and the columns `more`.
fn of_columns(
    more: Vec<String>,
    columns: &[Column],
    rows: &[Row<'_>],
    cells_of: impl Fn(&Row<'_>) -> Vec<String>,
) -> Table {
    let names = columns.iter().map(|(name, _)| (*name).to_owned());
    let head = std::iter::once("case".to_owned()).chain(more).chain(names).collect();
    let cells = |row: &Row<'_>| {
        let named = std::iter::once(row.case.id.clone()).chain(cells_of(row));
        named.chain(columns.iter().map(|(_, cell)| cell(row))).collect()
    };
    (head, rows.iter().map(cells).collect())
}

/// Wall time of phase `k` of [`PHASES`] [s].
pub(super) fn seconds(record: &RunRecord, k: usize) -> f64 {
    record.timings_s.get(PHASES[k].0).copied().unwrap_or(0.0)
}

/// Wall time outside all phases [s].
pub(super) fn rest(record: &RunRecord) -> f64 {
    let phases: f64 = (0..PHASES.len()).map(|k| seconds(record, k)).sum();
    (record.wall_s - phases).max(0.0)
}

fn state(row: &Row<'_>) -> String {
    match row.case_state {
        CaseState::Waiting => "waiting",
        CaseState::Done if row.is_doubtful() => "doubtful",
        CaseState::Done => "done",
        CaseState::Failed => "failed",
        CaseState::Stale => "stale",
    }
    .into()
}

/// Codes of the doubts about a run. The separator needs no quotes in a table file.
fn doubt_codes(record: &RunRecord) -> String {
    let codes: Vec<&str> = record.doubts.iter().map(|doubt| doubt.code.as_str()).collect();
    codes.join("; ")
}

fn phase(record: &RunRecord, k: usize) -> String {
    format!("{:.2}", seconds(record, k))
}

fn of(row: &Row<'_>, cell: impl Fn(&RunRecord) -> String) -> String {
    row.record.as_ref().map_or_else(String::new, cell)
}

fn springback(
    row: &Row<'_>,
    cell: impl Fn(&kanagata_report::record::SpringbackRecord) -> String,
) -> String {
    let found = row.record.as_ref().and_then(|r| r.springback.as_ref());
    found.map_or_else(String::new, cell)
}

fn formability(row: &Row<'_>, cell: impl Fn(&FormabilityRecord) -> String) -> String {
    let found = row.record.as_ref().and_then(|r| r.formability.as_ref());
    found.map_or_else(String::new, cell)
}

/// A number, or an empty cell.
fn maybe(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(String::new, |v| format!("{v:.digits$}"))
}
