//! Charts of a study: results, run times, and cost of accuracy.

use super::row::Row;
use super::table::{PHASES, rest, seconds};
use crate::compare::pareto_front;
use crate::file::Study;
use kanagata_report::bars::Bars;
use kanagata_report::drawing::{Chart, Line};
use kanagata_report::record::RunRecord;

/// A profile or a curve of a row.
type ProfileOf = for<'r, 'c> fn(&'r Row<'c>) -> &'r [(f64, f64)];
/// A number of a completed row.
pub(super) type Number = fn(&Row<'_>, &RunRecord) -> Option<f64>;
/// Prefix of the file name, name in titles, axis title, and the number.
pub(super) type Axis = (&'static str, &'static str, &'static str, Number);

/// Measures of accuracy.
const ERRORS: [Axis; 3] = [
    ("error", "Error of the force", "RMS difference / RMS of the reference", |r, _| {
        r.differences.force_rms
    }),
    ("thickness-error", "Error of the thickness", "largest difference [mm]", |r, _| {
        r.differences.thickest()
    }),
    ("shape-error", "Shape error", "largest shape error [mm]", |r, _| r.shape_error),
];
/// Measures of cost.
const COSTS: [Axis; 2] = [
    ("time", "time", "processor time [s]", |_, record| Some(record.cpu_s)),
    ("patches", "patches", "patches of all tools", |r, _| Some(r.patches as f64)),
];

/// Charts by file name: force and thickness of all cases, and error over cost with one line per method.
pub(super) fn charts(study: &Study, rows: &[Row<'_>]) -> Vec<(String, Chart)> {
    let travel = format!("travel of {} [mm]", study.watch);
    let flat = "distance in the flat blank [mm]";
    let thick = "thickness [mm]";
    let force = "force, whole process [N]";
    let mut out = vec![
        ("force", profiles("Force against travel", rows, [&travel, force], |r| &r.curve)),
        ("thickness-dx", {
            profiles("Thickness along dx", rows, [flat, thick], |r| r.profile(|s| &s.dx))
        }),
        ("thickness-dxy", {
            profiles("Thickness along dxy", rows, [flat, thick], |r| r.profile(|s| &s.dxy))
        }),
    ]
    .into_iter()
    .map(|(name, chart)| (name.to_owned(), chart))
    .collect::<Vec<_>>();
    for error in &ERRORS {
        for cost in &COSTS {
            let chart = against(rows, error, cost);
            if chart.lines.iter().any(|l| !l.points.is_empty()) {
                out.push((format!("{}-against-{}", error.0, cost.0), chart));
            }
        }
    }
    let search: Axis =
        ("search", "Search and projection", "wall time an iteration [ms]", |_, r| {
            Some(1e3 * seconds(r, 0) / r.iterations.max(1) as f64)
        });
    let chart = against(rows, &search, &COSTS[1]);
    if chart.lines.iter().any(|l| !l.points.is_empty()) {
        out.push(("search-against-patches".into(), chart));
    }
    out
}

fn profiles(title: &str, rows: &[Row<'_>], axes: [&str; 2], of: ProfileOf) -> Chart {
    let some = rows.iter().filter(|r| of(r).len() > 1);
    let line =
        |r: &Row<'_>| Line { name: r.case.id.clone(), points: of(r).to_vec(), marks_only: false };
    let [x, y] = axes.map(|title| (title.to_owned(), false));
    Chart { title: title.into(), x, y, lines: some.map(line).collect() }
}

/// Chart of one number of the completed cases over another, both positive: a line per method, and rings around the
/// Pareto-optimal cases.
pub(super) fn against(rows: &[Row<'_>], error: &Axis, cost: &Axis) -> Chart {
    let mut lines: Vec<Line> = Vec::new();
    for row in rows.iter().filter(|r| r.done()) {
        let Some(record) = &row.record else { continue };
        let (Some(x), Some(y)) = ((cost.3)(row, record), (error.3)(row, record)) else { continue };
        if !(x > 0.0 && y > 0.0) {
            continue;
        }
        match lines.iter_mut().find(|l| l.name == row.method) {
            Some(line) => line.points.push((x, y)),
            None => {
                let (name, points) = (row.method.clone(), vec![(x, y)]);
                lines.push(Line { name, points, marks_only: false });
            }
        }
    }
    for line in &mut lines {
        line.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let all: Vec<(f64, f64)> = lines.iter().flat_map(|l| l.points.clone()).collect();
    let unbeaten = all.iter().zip(pareto_front(&all)).filter(|(_, f)| *f).map(|(p, _)| *p);
    let points: Vec<(f64, f64)> = unbeaten.collect();
    if !points.is_empty() {
        lines.push(Line { name: "nobody beats".into(), points, marks_only: true });
    }
    let title = format!("{} against {}", error.1, cost.1);
    Chart { title, x: (cost.2.into(), true), y: (error.2.into(), true), lines }
}

/// Bar charts by file name: time by phase, and springback if any.
pub(super) fn bars(rows: &[Row<'_>]) -> Vec<(&'static str, Bars)> {
    let done: Vec<(&Row<'_>, &RunRecord)> =
        rows.iter().filter(|r| r.done()).filter_map(|r| Some((r, r.record.as_ref()?))).collect();
    let mut out = Vec::new();
    if !done.is_empty() {
        out.push(("time", time(&done)));
    }
    if done.iter().any(|(_, record)| record.springback.is_some()) {
        out.push(("springback", springback(&done)));
    }
    out
}

/// Processor time split in proportion to the wall time of the phases. Wall time alone would overstate cases that shared
/// the processor with others.
fn time(done: &[(&Row<'_>, &RunRecord)]) -> Bars {
    let share =
        |r: &RunRecord, wall: f64| if r.wall_s > 0.0 { r.cpu_s * wall / r.wall_s } else { 0.0 };
    let of = |k: usize| done.iter().map(|(_, r)| share(r, seconds(r, k))).collect();
    let phases = PHASES.iter().enumerate().map(|(k, (_, name))| ((*name).to_owned(), of(k)));
    let rest = done.iter().map(|(_, r)| share(r, rest(r))).collect();
    Bars {
        title: "Total time by phase".into(),
        x: "processor time [s], by the phases' shares of wall time".into(),
        names: done.iter().map(|(row, _)| row.case.id.clone()).collect(),
        parts: phases.chain([("rest".to_owned(), rest)]).collect(),
        stacked: true,
    }
}

fn springback(done: &[(&Row<'_>, &RunRecord)]) -> Bars {
    let sprung = || done.iter().filter_map(|(row, record)| Some((row, record.springback?)));
    Bars {
        title: "Springback".into(),
        x: "displacement from the drawn to the released sheet [mm]".into(),
        names: sprung().map(|(row, _)| row.case.id.clone()).collect(),
        parts: vec![
            ("largest".into(), sprung().map(|(_, s)| s.largest_mm).collect()),
            ("RMS over the sheet".into(), sprung().map(|(_, s)| s.rms_mm).collect()),
        ],
        stacked: false,
    }
}
