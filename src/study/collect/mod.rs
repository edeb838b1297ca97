//! Comparison of all cases: `study.csv`, `cost.csv`, `study.html` and charts.

mod chart_set;
mod curves;
mod evaluate;
mod mixtures;
mod row;
mod table;

use std::path::Path;

use self::row::{CaseState, Differences, Row};
use super::case::Case;
use super::checks::{Check, Outcome};
use super::compare::{sheet, tools};
use super::file::Study;
use super::inputs::folder_of;
use super::output::{plot, write_csv};
use super::states::{Entry, State, States};
use super::{LISTED_MAX, StudyError};
use crate::report::csv;
use crate::report::doubt::Doubt;
use crate::report::drawing::write_chart;
use crate::report::page::Page;
use crate::report::record::RunRecord;

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
    let tables = [
        ("Cases", "study.csv", table::results(study, &rows)),
        ("Cost", "cost.csv", table::costs(&rows)),
    ];
    let charts = chart_set::charts(study, &rows);
    let bars = chart_set::bars(&rows);
    for (name, chart) in &charts {
        write_chart(&folder.join(name).with_extension("svg"), chart)?;
    }
    for (name, bars) in &bars {
        bars.write(&folder.join(name).with_extension("svg"))?;
    }
    let checks = evaluate::evaluate(study, &rows);
    let mut page = Page::new(&study.name);
    let doubts = doubts(&rows);
    page.doubts(&doubts);
    let notes = mixtures::notes(&rows);
    page.notes(&notes);
    for (title, name, (head, cells)) in &tables {
        let names: Vec<&str> = head.iter().map(String::as_str).collect();
        write_csv(&folder.join(name), &names, cells)?;
        page.heading(title);
        page.table(&names, cells);
    }
    put_checks(&mut page, &checks);
    for (_, bars) in &bars {
        page.heading(&bars.title);
        let (traces, layout) = bars.traces();
        page.plot(&traces, &layout, bars.height());
    }
    charts.iter().for_each(|(_, chart)| plot(&mut page, chart));
    page.write(&folder.join("study.html"))?;
    Ok(Findings { checks, doubts, notes })
}

/// Result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Outcomes of its checks.
    pub checks: Vec<(Check, Outcome)>,
    /// Doubts about the completed cases, one of each code; `place` and `text` start with the case that exceeds the limit most.
    pub doubts: Vec<Doubt>,
    /// Notes on runs that do not compare: of several builds, or on several classes of processors.
    pub notes: Vec<String>,
}

/// Doubts about all completed cases: one of each code, that which exceeds its limit most, with the names of the other cases.
fn doubts(rows: &[Row<'_>]) -> Vec<Doubt> {
    /// The worst doubt of a code with its case, and all cases that have one.
    struct Worst<'a>(&'a Doubt, &'a str, Vec<&'a str>);
    let mut found: Vec<Worst<'_>> = Vec::new();
    for row in rows.iter().filter(|row| row.done()) {
        let case = row.case.id.as_str();
        for doubt in row.record.iter().flat_map(|record| &record.doubts) {
            match found.iter_mut().find(|worst| worst.0.code == doubt.code) {
                None => found.push(Worst(doubt, case, vec![case])),
                Some(worst) => {
                    if excess(doubt) > excess(worst.0) {
                        (worst.0, worst.1) = (doubt, case);
                    }
                    if !worst.2.contains(&case) {
                        worst.2.push(case);
                    }
                }
            }
        }
    }
    let with_others = |Worst(doubt, case, cases): Worst<'_>| {
        let mut told = of_case(doubt, case);
        let rest: Vec<&str> = cases.into_iter().filter(|other| *other != case).collect();
        told.text += &others(&rest);
        told
    };
    found.into_iter().map(with_others).collect()
}

/// How far a doubt exceeds its limit, over the limit; 0 without numbers.
fn excess(doubt: &Doubt) -> f64 {
    let ratio = doubt.value.zip(doubt.limit).map(|(value, limit)| (value / limit).abs());
    ratio.filter(|ratio| ratio.is_finite()).unwrap_or(0.0)
}

/// A doubt whose place and text begin with its case.
fn of_case(doubt: &Doubt, case: &str) -> Doubt {
    Doubt {
        place: format!("{case}: {}", doubt.place),
        text: format!("{case}: {}", doubt.text),
        ..doubt.clone()
    }
}

/// A sentence that names other cases with the same doubt; empty without any.
fn others(cases: &[&str]) -> String {
    let named = cases.iter().take(LISTED_MAX).copied().collect::<Vec<_>>().join(", ");
    match cases.len() {
        0 => String::new(),
        1 => format!(" The same doubt applies to {named}."),
        count if count <= LISTED_MAX => {
            format!(" The same doubt applies to {count} others: {named}.")
        }
        count => {
            let more = count - LISTED_MAX;
            format!(
                " The same doubt applies to {count} others: {named} and {more} more (study.csv)."
            )
        }
    }
}

fn put_checks(page: &mut Page, checks: &[(Check, Outcome)]) {
    if checks.is_empty() {
        return;
    }
    let cells = |(check, outcome): &(Check, Outcome)| {
        let [state, value] = outcome.texts();
        vec![check.says.clone(), state, value, check.allowed()]
    };
    page.heading("What it is expected to show");
    let cells: Vec<Vec<String>> = checks.iter().map(cells).collect();
    page.table(&["expected", "", "found", "allowed"], &cells);
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
        differences: Differences::default(),
    };
    let record = entry.and_then(|entry| entry.record.clone()).or_else(|| record(&run));
    row.build = record.as_ref().map_or_else(String::new, |record| record.build.clone());
    if row.case_state == CaseState::Stale {
        return row;
    }
    row.record = record;
    let history = crate::files::read_text(&run.join("history.csv"), crate::files::Input::Table)
        .unwrap_or_default();
    row.curve = curve(&history, &study.watch);
    // The last state of an unfinished case is not comparable.
    row.sheet = row.done().then(|| sheet(&run)).flatten();
    row
}

/// The record of a run.
fn record(run: &Path) -> Option<RunRecord> {
    let text = crate::files::read(&run.join("run.json"), crate::files::Input::Description).ok()?;
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

/// Travel and force of a tool from `history.csv`, while its travel increases.
fn curve(history: &str, tool: &str) -> Vec<(f64, f64)> {
    let mut rows = csv::rows(history).into_iter().map(csv::cells);
    let Some(head) = rows.next() else { return Vec::new() };
    let column = |name: String| head.iter().position(|h| *h == name);
    let columns = (column(format!("{tool}_travel_mm")), column(format!("{tool}_force_n")));
    let (Some(x), Some(y)) = columns else { return Vec::new() };
    let number = |row: &[String], k: usize| row.get(k).and_then(|c| c.parse::<f64>().ok());
    let mut out: Vec<(f64, f64)> = Vec::new();
    for row in rows {
        if let (Some(x), Some(y)) = (number(&row, x), number(&row, y))
            && x > out.last().map_or(0.0, |p| p.0)
        {
            out.push((x, y));
        }
    }
    out
}

#[cfg(test)]
mod tests;
