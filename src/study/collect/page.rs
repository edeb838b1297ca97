//! `study.html`: verdict, checks and answers of all cases, charts, set-up, and folded at the end all columns and the cost.

use super::row::{CaseState, Row};
use super::table::{self, Table};
use crate::checks::{Check, Outcome};
use crate::file::Study;
use crate::output::plot;
use kanagata_report::bars::Bars;
use kanagata_report::doubt::Doubt;
use kanagata_report::drawing::Chart;
use kanagata_report::page::{Outcome as Shown, Page};

/// What the page shows.
pub(super) struct Contents<'a, 'r> {
    pub(super) study: &'a Study,
    pub(super) rows: &'a [Row<'r>],
    pub(super) checks: &'a [(Check, Outcome)],
    pub(super) doubts: &'a [Doubt],
    pub(super) notes: &'a [String],
    /// All results, and the cost, as in `study.csv` and `cost.csv`.
    pub(super) tables: [&'a Table; 2],
    pub(super) charts: &'a [(String, Chart)],
    pub(super) bars: &'a [(&'static str, Bars)],
}

/// The page of a study.
pub(super) fn page(contents: &Contents<'_, '_>) -> Page {
    let Contents { study, rows, checks, charts, bars, .. } = *contents;
    let mut page = Page::new(&study.name);
    let (outcome, text) = verdict(rows, checks);
    page.outcome(outcome, &text);
    page.doubts(contents.doubts);
    page.notes(contents.notes);
    put_checks(&mut page, checks);
    page.heading("Cases");
    put(&mut page, &table::answers(study, rows));
    let (of_cost, of_results): (Vec<_>, Vec<_>) =
        charts.iter().partition(|(name, _)| name.contains("-against-"));
    of_results.iter().for_each(|(_, chart)| plot(&mut page, chart));
    for (_, bars) in bars {
        page.heading(&bars.title);
        page.bars(bars);
    }
    of_cost.iter().for_each(|(_, chart)| plot(&mut page, chart));
    page.heading("Set-up");
    setup(&mut page, contents);
    let [results, costs] = contents.tables;
    page.folded("All results (study.csv)", |page| put(page, results));
    page.folded("Cost (cost.csv)", |page| put(page, costs));
    page
}

/// The outcome in a sentence: checks that fail, cases that are not done, and doubts.
fn verdict(rows: &[Row<'_>], checks: &[(Check, Outcome)]) -> (Shown, String) {
    let of = |state: CaseState| rows.iter().filter(|row| row.case_state == state).count();
    let done = of(CaseState::Done);
    let mut text = if done == rows.len() {
        format!("All {} are done", counted(done, "case"))
    } else {
        let others = [
            (CaseState::Failed, "failed"),
            (CaseState::Stale, "stale"),
            (CaseState::Waiting, "waiting"),
        ];
        let others = others.iter().map(|(state, name)| (of(*state), *name));
        let others = others.filter(|(count, _)| *count > 0);
        let others: Vec<String> = others.map(|(count, name)| format!("{count} {name}")).collect();
        format!("{done} of {} are done ({})", counted(rows.len(), "case"), others.join(", "))
    };
    let doubtful = rows.iter().filter(|row| row.is_doubtful()).count();
    if doubtful > 0 {
        text += &format!(", {doubtful} of them with doubts");
    }
    let count = |is: fn(&Outcome) -> bool| checks.iter().filter(|(_, one)| is(one)).count();
    let fails = count(|one| matches!(one, Outcome::Fails { .. }));
    let open = count(|one| matches!(one, Outcome::Open));
    if !checks.is_empty() {
        let holds = checks.len() - fails - open;
        text += &format!("; {holds} of {} hold", counted(checks.len(), "expectation"));
        text += &if open > 0 { format!(", {open} open") } else { String::new() };
    }
    let outcome = if fails > 0 || of(CaseState::Failed) > 0 {
        Shown::Failed
    } else if doubtful > 0 || done < rows.len() {
        Shown::Doubtful
    } else {
        Shown::Good
    };
    (outcome, format!("{text}."))
}

/// A count with its noun.
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn put(page: &mut Page, (head, cells): &Table) {
    let names: Vec<&str> = head.iter().map(String::as_str).collect();
    page.table(&names, cells);
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

/// What is varied, watched and compared with.
fn setup(page: &mut Page, contents: &Contents<'_, '_>) {
    let Contents { study, rows, .. } = *contents;
    let mut lines = vec![("watched tool", study.watch.clone())];
    lines.extend(study.reference.clone().map(|case| ("reference case", case)));
    let choices = study.choices.iter().map(|choice| {
        let options: Vec<&str> = choice.options.iter().map(|o| o.name.as_str()).collect();
        format!("{}: {}", choice.name, options.join(", "))
    });
    lines.extend(choices.map(|text| ("varied", text)));
    lines.extend(study.table.clone().map(|file| ("varied by the table", file)));
    let mut builds: Vec<&str> = rows.iter().map(|row| row.build.as_str()).collect();
    builds.sort_unstable();
    builds.dedup();
    let builds: Vec<&str> = builds.into_iter().filter(|build| !build.is_empty()).collect();
    lines.push(("builds of the runs", builds.join("; ")));
    let lines: Vec<Vec<String>> =
        lines.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    page.table(&["", ""], &lines);
}
