//! Table, charts and page of a patch study.

use std::path::Path;

use super::PatchStudy;
use super::measure::{Figures, Row, Size};
use crate::StudyError;
use crate::compare::pareto_front;
use crate::output::{plot, write_csv};
use kanagata_report::drawing::{Chart, Line, write_chart};
use kanagata_report::page::Page;

const HEAD: [&str; 17] = [
    "method",
    "kind",
    "style",
    "divisions",
    "tolerance_mm",
    "state",
    "patches",
    "error_mm",
    "rms_mm",
    "normal_deg",
    "convert_s",
    "index_s",
    "query_us",
    "front_error",
    "front_normal",
    "front_time",
    "reason",
];

const ABOUT: &str = "Error: the largest |shape error| (Eq. 24) and the largest angle between the normals of model and \
    CAD, both by the audit. Rings: what no other model beats in both quantities. Times are processor seconds of one \
    thread of the machine that this was made on; they compare the methods with one another and hold nowhere else. \
    Conversion is from the CAD in memory to the tool model, with the search for the divisions where a tolerance is \
    given; a query is a closest point without a hint.";

/// A plotted quantity: its title with unit, and its value.
type Quantity = (&'static str, fn(&Figures) -> f64);

const PATCHES: Quantity = ("patches", |f| f.patches as f64);
const ERROR: Quantity = ("largest |shape error| (Eq. 24) [mm]", |f| f.error_mm);
const NORMAL: Quantity = ("largest normal error [degrees]", |f| f.normal_deg);
const CONVERT: Quantity = ("conversion, one thread of this machine [s]", |f| f.convert_s);
const QUERY: Quantity = ("a closest point, one thread of this machine [us]", |f| f.query_us);

/// Charts: file, title, quantities of the axes, and whether the Pareto front is marked.
const CHARTS: [(&str, &str, [Quantity; 2], bool); 5] = [
    ("error-against-patches", "Largest shape error against patches", [PATCHES, ERROR], true),
    ("normal-against-patches", "Largest normal error against patches", [PATCHES, NORMAL], true),
    ("error-against-conversion", "Shape error against conversion time", [CONVERT, ERROR], true),
    ("query-against-patches", "Query time against patches", [PATCHES, QUERY], false),
    ("error-against-query", "Shape error against query time", [QUERY, ERROR], true),
];

/// Writes `patches.csv`, `fewest.csv`, `patches.html` and the charts into `folder`.
///
/// # Errors
/// [`StudyError::Write`].
pub(super) fn write(study: &PatchStudy, rows: &[Row<'_>], folder: &Path) -> Result<(), StudyError> {
    let table = table(rows);
    write_csv(&folder.join("patches.csv"), &HEAD, &table)?;
    let (head, fewest) = fewest(study, rows);
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    write_csv(&folder.join("fewest.csv"), &head, &fewest)?;
    let mut page = Page::new(&study.name);
    page.text(ABOUT);
    for (name, title, quantities, marked) in CHARTS {
        let chart = chart(study, rows, title, quantities, marked);
        write_chart(&folder.join(name).with_extension("svg"), &chart)?;
        plot(&mut page, &chart);
    }
    page.heading("Fewest patches of those tried, by the largest shape error allowed");
    page.table(&head, &fewest);
    page.heading("Models");
    page.table(&HEAD, &table);
    page.write(&folder.join("patches.html"))?;
    Ok(())
}

/// Whether each row is on the Pareto front of two quantities; rows without a usable model are not.
fn on_front(rows: &[Row<'_>], [x, y]: [Quantity; 2]) -> Vec<bool> {
    let points = rows.iter().map(|r| r.sound().map(|f| (x.1(f), y.1(f))));
    let points: Vec<(f64, f64)> =
        points.map(|p| p.unwrap_or((f64::INFINITY, f64::INFINITY))).collect();
    pareto_front(&points).iter().zip(rows).map(|(on, row)| *on && row.sound().is_some()).collect()
}

fn table(rows: &[Row<'_>]) -> Vec<Vec<String>> {
    let fronts = [[PATCHES, ERROR], [PATCHES, NORMAL], [CONVERT, ERROR]].map(|q| on_front(rows, q));
    rows.iter().enumerate().map(|(k, row)| cells(row, fronts.each_ref().map(|f| f[k]))).collect()
}

fn cells(row: &Row<'_>, fronts: [bool; 3]) -> Vec<String> {
    let word = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
    let method = row.method;
    let mut out = vec![method.name.clone(), word(&method.kind), word(&method.style)];
    out.extend(match row.size {
        Size::Divisions(n) => [n.to_string(), String::new()],
        Size::Tolerance(t) => [String::new(), t.to_string()],
    });
    let state = match (&row.figures, row.sound()) {
        (None, _) => "failed",
        (Some(_), None) => "folds",
        (Some(_), Some(_)) => "sound",
    };
    out.push(state.into());
    match &row.figures {
        Some(f) => {
            out.push(f.patches.to_string());
            out.extend([f.error_mm, f.rms_mm, f.normal_deg].map(|v| format!("{v:.4e}")));
            out.extend([f.convert_s, f.index_s].map(|v| format!("{v:.3e}")));
            out.push(format!("{:.3}", f.query_us));
        }
        None => out.extend(std::iter::repeat_n(String::new(), 7)),
    }
    out.extend(fronts.map(|on| if on { "yes".into() } else { String::new() }));
    out.push(row.reason.clone());
    out
}

/// For tolerances of 1 and 3 times powers of ten: the fewest patches of each method within them.
fn fewest(study: &PatchStudy, rows: &[Row<'_>]) -> (Vec<String>, Vec<Vec<String>>) {
    let errors = rows.iter().filter_map(|r| r.sound().map(|f| f.error_mm));
    let (low, high) = errors.fold((f64::INFINITY, 0.0_f64), |(a, b), e| (a.min(e), b.max(e)));
    let levels = (-12..=3).rev().flat_map(|k| [3.0, 1.0].map(|m| m * 10.0_f64.powi(k)));
    let levels = levels.filter(|l| (low..=high).contains(l));
    let fewest_patches = |name: &str, level: f64| {
        let own = rows.iter().filter(|r| r.method.name == name).filter_map(Row::sound);
        own.filter(|f| f.error_mm <= level).map(|f| f.patches).min()
    };
    let line = |level: f64| {
        let found = study.methods.iter().map(|m| fewest_patches(&m.name, level));
        let cells = found.map(|n| n.map_or_else(|| "-".into(), |n| n.to_string()));
        std::iter::once(format!("{level:.0e}")).chain(cells).collect()
    };
    let head = std::iter::once("error_mm".to_owned());
    (head.chain(study.methods.iter().map(|m| m.name.clone())).collect(), levels.map(line).collect())
}

fn chart(
    study: &PatchStudy,
    rows: &[Row<'_>],
    title: &str,
    [x, y]: [Quantity; 2],
    marked: bool,
) -> Chart {
    let line = |name: &str| {
        let own = rows.iter().filter(|r| r.method.name == name).filter_map(Row::sound);
        let points = own.map(|f| (x.1(f), y.1(f))).collect();
        Line { name: name.into(), points, marks_only: false }
    };
    let mut lines: Vec<Line> = study.methods.iter().map(|m| line(&m.name)).collect();
    if marked {
        let best = rows.iter().zip(on_front(rows, [x, y])).filter(|(_, on)| *on);
        let points = best.filter_map(|(r, _)| r.sound().map(|f| (x.1(f), y.1(f)))).collect();
        lines.push(Line { name: "nobody beats".into(), points, marks_only: true });
    }
    let [x, y] = [x, y].map(|(title, _)| (title.to_owned(), true));
    Chart { title: title.into(), x, y, lines }
}
