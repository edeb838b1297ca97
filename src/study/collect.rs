//! The records of all cases side by side: `study.csv`, `study.html` and drawings.

use std::fs;
use std::path::Path;

use super::StudyError;
use super::cases::Case;
use super::checks::{Check, Figure, Outcome};
use super::compare::{Sheet, at, front, largest_difference, sheet, tools};
use super::execute::{Manifest, State, folder_of};
use super::file::Study;
use super::output::{plot, write_csv};
use crate::report::drawing::{Chart, Line, write_chart};
use crate::report::page::Page;
use crate::report::record::RunRecord;

/// A case and what its run left.
struct Row<'a> {
    case: &'a Case,
    state: State,
    reason: Option<String>,
    record: Option<RunRecord>,
    patches: usize,
    shape_error: Option<f64>,
    /// Travel [mm] and force [N] of the watched tool while it moves.
    curve: Vec<(f64, f64)>,
    sheet: Sheet,
    off: Off,
}

/// Differences from the reference.
#[derive(Default, Clone, Copy)]
struct Off {
    /// RMS of the difference of force over the travel, over the reference's RMS.
    force_rms: Option<f64>,
    /// Largest difference of thickness along dx and along dxy [mm].
    thickness: [Option<f64>; 2],
}

const PHASES: [&str; 6] = ["search", "contact", "elements", "factor", "update", "solve"];
const COUNTS: [&str; 8] = [
    "state",
    "patches",
    "shape_error_mm",
    "increments",
    "iterations",
    "factorisations",
    "cuts",
    "wall_s",
];
const RESULTS: [&str; 10] = [
    "travel_mm",
    "force_max_n",
    "force_end_n",
    "draw_in_dx_mm",
    "draw_in_dxy_mm",
    "thinnest_mm",
    "force_rms_to_reference",
    "thickness_dx_off_mm",
    "thickness_dxy_off_mm",
    "reason",
];

/// Writes `study.csv`, `study.html` and the drawings into `folder`.
///
/// Returns how the study's checks came out.
///
/// # Errors
/// [`StudyError::Write`].
pub fn collect(
    study: &Study,
    cases: &[Case],
    manifest: &Manifest,
    folder: &Path,
) -> Result<Vec<(Check, Outcome)>, StudyError> {
    let mut rows: Vec<Row<'_>> = cases.iter().map(|c| row(study, c, manifest, folder)).collect();
    compare(&mut rows, study.reference.as_deref());
    let mut head: Vec<&str> = study.choices.iter().map(|c| c.name.as_str()).collect();
    head.extend(COUNTS.iter().chain(&["cpu_s"]).chain(&PHASES).chain(&RESULTS));
    let table: Vec<Vec<String>> = rows.iter().map(cells).collect();
    let named = rows
        .iter()
        .zip(&table)
        .map(|(row, cells)| [std::slice::from_ref(&row.case.id), &cells[..]].concat());
    let named: Vec<Vec<String>> = named.collect();
    write_csv(&folder.join("study.csv"), &[&["case"], &head[..]].concat(), &named)?;
    let charts = charts(study, &rows);
    for (name, chart) in &charts {
        write_chart(&folder.join(name).with_extension("svg"), chart)?;
    }
    let checks = judge(study, &rows);
    let mut page = Page::new(&study.name);
    page.heading("Cases");
    page.table(&head, &table);
    put_checks(&mut page, &checks);
    charts.iter().for_each(|(_, chart)| plot(&mut page, chart));
    page.write(&folder.join("study.html"))?;
    Ok(checks)
}

fn put_checks(page: &mut Page, checks: &[(Check, Outcome)]) {
    if checks.is_empty() {
        return;
    }
    let said = |(check, outcome): &(Check, Outcome)| {
        let [state, value] = outcome.words();
        vec![check.says.clone(), state, value, check.allowed()]
    };
    page.heading("What it is expected to show");
    let said: Vec<Vec<String>> = checks.iter().map(said).collect();
    page.table(&["expected", "", "found", "allowed"], &said);
}

/// Every check with its outcome.
fn judge(study: &Study, rows: &[Row<'_>]) -> Vec<(Check, Outcome)> {
    let done = |id: &str| rows.iter().find(|r| r.case.id == id && r.state == State::Done);
    let judged = |check: &Check| {
        let other = check.against.as_ref().or(study.reference.as_ref()).and_then(|id| done(id));
        let about = rows.iter().filter(|r| {
            let named = check.cases.is_empty() || check.cases.contains(&r.case.id);
            named && r.state == State::Done
        });
        let values: Vec<(String, f64)> = about
            .filter_map(|r| Some((r.case.id.clone(), figure(check.figure, r, other)?)))
            .collect();
        (check.clone(), check.judge(&values))
    };
    study.checks.iter().map(judged).collect()
}

/// A figure of a row, beside another one; `None` where one of them has not got it.
fn figure(figure: Figure, row: &Row<'_>, other: Option<&Row<'_>>) -> Option<f64> {
    let record = row.record.as_ref()?;
    let seconds = |r: &RunRecord| r.cpu_s / r.iterations.max(1) as f64;
    Some(match figure {
        Figure::ForceRms => force_rms(&row.curve, &other?.curve)?,
        Figure::ThicknessMm => {
            let (now, then) = (&row.sheet, &other?.sheet);
            let off = largest_difference(&now.dx, &then.dx)?;
            off.max(largest_difference(&now.dxy, &then.dxy)?)
        }
        Figure::PatchesOverReference => row.patches as f64 / other?.patches.max(1) as f64,
        Figure::SecondsAnIterationOverReference => {
            seconds(record) / seconds(other?.record.as_ref()?)
        }
        Figure::ForceBalance => record.force_balance,
        Figure::EnergyBalance => record.energy_balance,
        Figure::PenetrationMm => record.penetration_mm,
    })
}

fn row<'a>(study: &Study, case: &'a Case, manifest: &Manifest, folder: &Path) -> Row<'a> {
    let run = folder_of(folder, &case.id).join("run");
    let entry = manifest.cases.get(&case.id);
    let text = fs::read(run.join("run.json")).unwrap_or_default();
    let (patches, shape_error) = tools(&case.scene);
    let state = entry.map_or(State::Waiting, |e| e.state);
    // The last picture of a case under way is of no stage that others have too.
    let last = (state == State::Done).then(|| sheet(&run)).flatten();
    Row {
        case,
        state,
        reason: entry.and_then(|e| e.reason.clone()),
        record: serde_json::from_slice(&text).ok(),
        patches,
        shape_error,
        curve: curve(
            &fs::read_to_string(run.join("history.csv")).unwrap_or_default(),
            &study.watch,
        ),
        sheet: last.unwrap_or_default(),
        off: Off::default(),
    }
}

/// Differences of all rows from the row named `reference`.
fn compare(rows: &mut [Row<'_>], reference: Option<&str>) {
    let Some(reference) = rows.iter().find(|r| Some(r.case.id.as_str()) == reference) else {
        return;
    };
    let (curve, sheet) = (reference.curve.clone(), reference.sheet.clone());
    for row in rows {
        row.off = Off {
            force_rms: force_rms(&row.curve, &curve),
            thickness: [
                largest_difference(&row.sheet.dx, &sheet.dx),
                largest_difference(&row.sheet.dxy, &sheet.dxy),
            ],
        };
    }
}

/// A profile or curve of a row.
type ProfileOf = for<'r, 'c> fn(&'r Row<'c>) -> &'r [(f64, f64)];

/// Drawings by file name: force and thickness of all cases, error against cost where there is a reference.
fn charts(study: &Study, rows: &[Row<'_>]) -> Vec<(&'static str, Chart)> {
    let travel = format!("travel of {} [mm]", study.watch);
    let flat = "distance in the flat blank [mm]";
    let thick = "thickness [mm]";
    let force = "force, whole process [N]";
    let mut out = vec![
        ("force", profiles("Force against travel", rows, [&travel, force], |r| &r.curve)),
        ("thickness-dx", profiles("Thickness along dx", rows, [flat, thick], |r| &r.sheet.dx)),
        ("thickness-dxy", profiles("Thickness along dxy", rows, [flat, thick], |r| &r.sheet.dxy)),
    ];
    if rows.iter().any(|r| r.off.force_rms.is_some_and(|e| e > 0.0)) {
        let seconds = |r: &Row<'_>| r.record.as_ref().map_or(f64::NAN, |r| r.cpu_s);
        let patches = |r: &Row<'_>| r.patches as f64;
        out.push(("error-against-time", error_against("processor time [s]", rows, seconds)));
        out.push(("error-against-patches", error_against("patches of all tools", rows, patches)));
    }
    out
}

fn profiles(title: &str, rows: &[Row<'_>], axes: [&str; 2], of: ProfileOf) -> Chart {
    let some = rows.iter().filter(|r| of(r).len() > 1);
    let lines = some.map(|r| line(&r.case.id, of(r).to_vec())).collect();
    let [x, y] = axes.map(|title| (title.to_owned(), false));
    Chart { title: title.into(), x, y, lines }
}

/// Error of the force against a cost: a mark for every case that is done, a line through those that nobody beats.
fn error_against(cost: &str, rows: &[Row<'_>], of: fn(&Row<'_>) -> f64) -> Chart {
    let points = rows.iter().filter_map(|r| {
        let error = r.off.force_rms.filter(|e| *e > 0.0)?;
        (r.state == State::Done).then(|| (r.case.id.as_str(), (of(r), error)))
    });
    let (names, points): (Vec<&str>, Vec<(f64, f64)>) = points.unzip();
    let unbeaten = points.iter().zip(front(&points)).filter(|(_, f)| *f);
    let mut best: Vec<(f64, f64)> = unbeaten.map(|(p, _)| *p).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Under the marks of the cases.
    let mut lines = vec![line("nobody beats", best)];
    lines.extend(names.iter().zip(&points).map(|(n, p)| line(n, vec![*p])));
    let title = format!("Error of the force against {}", cost.split(" [").next().unwrap_or(cost));
    let y = ("RMS difference / RMS of the reference".into(), true);
    Chart { title, x: (cost.into(), true), y, lines }
}

fn line(name: &str, points: Vec<(f64, f64)>) -> Line {
    Line { name: name.into(), points, marks_only: false }
}

/// Travel and force of a tool from `history.csv`, as long as its travel grows.
fn curve(history: &str, tool: &str) -> Vec<(f64, f64)> {
    let mut rows = history.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let Some(head) = rows.next() else { return Vec::new() };
    let column = |name: String| head.iter().position(|h| *h == name);
    let columns = (column(format!("{tool}_travel_mm")), column(format!("{tool}_force_n")));
    let (Some(x), Some(y)) = columns else { return Vec::new() };
    let number = |row: &[&str], k: usize| row.get(k).and_then(|c| c.parse::<f64>().ok());
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

/// RMS over the common travel of the difference of two curves, over the second one's RMS.
fn force_rms(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Option<f64> {
    const POINTS: usize = 500;
    let (start, end) =
        (curve.first()?.0.max(reference.first()?.0), curve.last()?.0.min(reference.last()?.0));
    if end <= start {
        return None;
    }
    let (mut off, mut size) = (0.0, 0.0);
    for k in 0..=POINTS {
        let x = start + (end - start) * k as f64 / POINTS as f64;
        let (a, b) = (at(curve, x), at(reference, x));
        off += (a - b) * (a - b);
        size += b * b;
    }
    (size > 0.0).then(|| (off / size).sqrt())
}

fn cells(row: &Row<'_>) -> Vec<String> {
    let mut out = row.case.options.clone();
    let state = match row.state {
        State::Waiting => "waiting",
        State::Done => "done",
        State::Failed => "failed",
    };
    let maybe = |v: Option<f64>| v.map_or_else(String::new, |e| format!("{e:.5}"));
    out.extend([state.into(), row.patches.to_string(), maybe(row.shape_error)]);
    match &row.record {
        Some(r) => {
            out.extend(
                [r.increments, r.iterations, r.factorisations, r.cuts].map(|n| n.to_string()),
            );
            out.extend([r.wall_s, r.cpu_s].map(|s| format!("{s:.1}")));
            let phase = |name: &str| r.timings_s.get(name).copied().unwrap_or(0.0);
            out.extend(PHASES.map(|name| format!("{:.2}", phase(name))));
        }
        None => out.extend(std::iter::repeat_n(String::new(), 6 + PHASES.len())),
    }
    let end = row.curve.last().copied().unwrap_or_default();
    let most = row.curve.iter().map(|p| p.1).fold(0.0, f64::max);
    out.extend([format!("{:.3}", end.0), format!("{most:.0}"), format!("{:.0}", end.1)]);
    let sheet = &row.sheet;
    out.extend(sheet.draw_in.iter().chain([&sheet.thinnest]).map(|v| format!("{v:.4}")));
    out.push(maybe(row.off.force_rms));
    out.extend(row.off.thickness.map(maybe));
    out.push(row.reason.clone().unwrap_or_default());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_compared_over_their_common_travel() {
        let text = "increment,stage,punch_travel_mm,punch_force_n\n1,clamp,0,5\n2,draw,1,10\n3,draw,3,30\n4,release,3,0\n";
        let a = curve(text, "punch");
        assert_eq!(a, [(1.0, 10.0), (3.0, 30.0)]);
        assert!(curve(text, "die").is_empty());
        let b: Vec<(f64, f64)> = [(1.0, 11.0), (2.0, 22.0), (4.0, 44.0)].into();
        assert!((force_rms(&b, &a).unwrap() - 0.1).abs() < 1e-12);
        assert!((force_rms(&a, &a).unwrap()).abs() < 1e-15);
        assert!(force_rms(&a, &[]).is_none());
    }
}
