//! Comparison of all cases: `study.csv`, `cost.csv`, `study.html` and charts.

mod chart_set;
mod curves;
mod evaluate;
mod mixtures;
mod page;
mod row;
mod table;
mod worst_doubts;

use std::path::Path;

use self::row::{CaseState, Differences, Row};
use self::worst_doubts::worst_doubts;
use super::StudyError;
use super::case::Case;
use super::checks::{Check, Outcome};
use super::compare::{sheet, tools};
use super::file::Study;
use super::inputs::folder_of;
use super::output::write_csv;
use super::states::{Entry, State, States};
use kanagata_report::csv;
use kanagata_report::doubt::Doubt;
use kanagata_report::drawing::write_chart;
use kanagata_report::record::RunRecord;

/// Travels and forces of a run.
const HISTORY: &str = "history.csv";
/// The formed sheet of a run.
const SHEET: &str = "steps/last.vtu";

/// Writes `study.csv`, `cost.csv`, `study.html` and the charts into `folder`.
///
/// A case is stale if its scene, tools or followed increments differ from those of its results. It is listed, but not
/// compared.
///
/// # Errors
/// [`StudyError::Write`].
pub fn collect(
    study: &Study,
    cases: &[Case],
    states: &States,
    folder: &Path,
) -> Result<Findings, StudyError> {
    let mut rows: Vec<Row<'_>> =
        cases.iter().map(|case| row(study, case, states.get(&case.id), folder)).collect();
    compare(&mut rows, study.reference.as_deref());
    let tables = [table::results(study, &rows), table::costs(&rows)];
    for (name, (head, cells)) in ["study.csv", "cost.csv"].into_iter().zip(&tables) {
        let names: Vec<&str> = head.iter().map(String::as_str).collect();
        write_csv(&folder.join(name), &names, cells)?;
    }
    let charts = chart_set::charts(study, &rows);
    let bars = chart_set::bars(&rows);
    let file = |name: &str| folder.join(name).with_extension("svg");
    charts.iter().try_for_each(|(name, chart)| write_chart(&file(name), chart))?;
    bars.iter().try_for_each(|(name, bars)| bars.write(&file(name)))?;
    let checks = evaluate::evaluate(study, &rows);
    let (doubts, notes) = (worst_doubts(&rows), mixtures::notes(&rows));
    let [results, costs] = &tables;
    let contents = page::Contents {
        study,
        rows: &rows,
        checks: &checks,
        doubts: &doubts,
        notes: &notes,
        tables: [results, costs],
        charts: &charts,
        bars: &bars,
    };
    page::page(&contents).write(&folder.join("study.html"))?;
    Ok(Findings { checks, doubts, notes })
}

/// Result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Outcomes of its checks.
    pub checks: Vec<(Check, Outcome)>,
    /// Doubts about the completed cases, one of each code; `place` and `text` start with the case that is farthest beyond its
    /// limit.
    pub doubts: Vec<Doubt>,
    /// Notes on runs that do not compare: of several builds, on several classes of processors, or with files that cannot be
    /// read.
    pub notes: Vec<String>,
}

/// State of a case in the table; one that is running has no results yet.
fn case_state(entry: Option<&Entry>) -> CaseState {
    match entry.map(|entry| entry.state) {
        None | Some(State::Waiting | State::Running) => CaseState::Waiting,
        Some(State::Done) => CaseState::Done,
        Some(State::Failed) => CaseState::Failed,
        Some(State::Stale) => CaseState::Stale,
    }
}

fn row<'a>(study: &Study, case: &'a Case, entry: Option<&Entry>, folder: &Path) -> Row<'a> {
    let run = folder_of(folder, &case.id).join("run");
    let own = folder.canonicalize().unwrap_or_else(|_| folder.into());
    let (patches, shape_error) = tools(&case.scene, &folder_of(&own, &case.id));
    let mut row = Row {
        case,
        case_state: case_state(entry),
        reason: entry.and_then(|entry| entry.reason.clone()),
        method: method(study, case),
        record: None,
        build: String::new(),
        patches,
        shape_error,
        curve: Vec::new(),
        sheet: None,
        unread: Vec::new(),
        differences: Differences::default(),
    };
    let record = entry.and_then(|entry| entry.record.clone()).or_else(|| record(&run));
    row.build = record.as_ref().map_or_else(String::new, |record| record.build.clone());
    if row.case_state == CaseState::Stale {
        return row;
    }
    row.record = record;
    let history = kanagata_files::read_text(&run.join(HISTORY), kanagata_files::Input::Table);
    let curve = history.ok().and_then(|text| curve(&text, &study.watch));
    // The last state of an unfinished case is not comparable, and its history may be missing.
    if row.done() {
        row.sheet = sheet(&run);
        let lost = [(HISTORY, curve.is_none()), (SHEET, row.sheet.is_none())];
        let is_there = |name: &str| name == HISTORY || run.join(name).exists();
        let lost = lost.into_iter().filter(|(name, lost)| *lost && is_there(name));
        row.unread = lost.map(|(name, _)| name).collect();
    }
    row.curve = curve.unwrap_or_default();
    row
}

/// The record of a run.
fn record(run: &Path) -> Option<RunRecord> {
    let text =
        kanagata_files::read(&run.join("run.json"), kanagata_files::Input::Description).ok()?;
    serde_json::from_slice(&text).ok()
}

/// Methods of the options of a case, in the order of the choices; its name if there are none.
fn method(study: &Study, case: &Case) -> String {
    let of = |(choice, name): (&super::file::Choice, &String)| {
        choice.options.iter().find(|o| o.name == *name)?.method.clone()
    };
    let named: Vec<String> = study.choices.iter().zip(&case.options).filter_map(of).collect();
    if named.is_empty() { case.id.clone() } else { named.join(", ") }
}

/// Sets the differences of all completed rows from the row named `reference`, if that is complete.
fn compare(rows: &mut [Row<'_>], reference: Option<&str>) {
    let named = |r: &&Row<'_>| Some(r.case.id.as_str()) == reference && r.done();
    let Some(reference) = rows.iter().find(named) else { return };
    let differences: Vec<Differences> =
        rows.iter()
            .map(|row| {
                if row.done() {
                    Differences::between(row, reference)
                } else {
                    Differences::default()
                }
            })
            .collect();
    rows.iter_mut().zip(differences).for_each(|(row, differences)| row.differences = differences);
}

/// Travel and force of a tool from `history.csv`, while its travel increases; `None` without columns of the tool.
fn curve(history: &str, tool: &str) -> Option<Vec<(f64, f64)>> {
    let mut rows = csv::rows(history).into_iter().map(csv::cells);
    let head = rows.next()?;
    let column = |name: String| head.iter().position(|h| *h == name);
    let x = column(format!("{tool}_travel_mm"))?;
    let y = column(format!("{tool}_force_n"))?;
    let number = |row: &[String], k: usize| row.get(k).and_then(|c| c.parse::<f64>().ok());
    let mut out: Vec<(f64, f64)> = Vec::new();
    for row in rows {
        if let (Some(x), Some(y)) = (number(&row, x), number(&row, y))
            && x > out.last().map_or(0.0, |p| p.0)
        {
            out.push((x, y));
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests;
