//! The records of all cases side by side: `study.csv` and `study.html`.

use std::fs;
use std::path::Path;

use super::StudyError;
use super::cases::Case;
use super::execute::{Manifest, State, folder_of};
use super::file::Study;
use crate::files::write_atomic;
use crate::report::charts::{Series, lines};
use crate::report::page::Page;
use crate::report::record::RunRecord;

/// A case and what its run left.
struct Row<'a> {
    case: &'a Case,
    state: State,
    reason: Option<String>,
    record: Option<RunRecord>,
    /// Travel [mm] and force [N] of the watched tool while it moves.
    curve: Vec<(f64, f64)>,
    /// RMS of the difference of force from the reference over the travel, over the reference's RMS.
    force_rms: Option<f64>,
}

const PHASES: [&str; 5] = ["search", "contact", "elements", "factor", "solve"];

/// Writes `study.csv` and `study.html` into `folder`.
///
/// # Errors
/// [`StudyError::Write`].
pub fn collect(
    study: &Study,
    cases: &[Case],
    manifest: &Manifest,
    folder: &Path,
) -> Result<(), StudyError> {
    let mut rows: Vec<Row<'_>> = cases.iter().map(|c| row(study, c, manifest, folder)).collect();
    let reference = study.reference.as_deref();
    let curve =
        rows.iter().find(|r| Some(r.case.id.as_str()) == reference).map(|r| r.curve.clone());
    if let Some(curve) = curve {
        rows.iter_mut().for_each(|r| r.force_rms = force_rms(&r.curve, &curve));
    }
    let mut head: Vec<&str> = study.choices.iter().map(|c| c.name.as_str()).collect();
    head.extend(["state", "increments", "iterations", "factorisations", "cuts", "wall_s", "cpu_s"]);
    head.extend(PHASES);
    head.extend(["travel_mm", "force_max_n", "force_end_n", "force_rms_to_reference", "reason"]);
    let table: Vec<Vec<String>> = rows.iter().map(cells).collect();
    write_atomic(&folder.join("study.csv"), |w| {
        writeln!(w, "case,{}", head.join(","))?;
        for (row, cells) in rows.iter().zip(&table) {
            let quoted: Vec<String> = cells.iter().map(|c| quote(c)).collect();
            writeln!(w, "{},{}", row.case.id, quoted.join(","))?;
        }
        Ok(())
    })?;
    let mut page = Page::new(&study.name);
    page.heading("Cases");
    page.table(&head, &table);
    page.heading(&format!("Force of {} against its travel", study.watch));
    let series: Vec<Series> = rows.iter().filter(|r| r.curve.len() > 1).map(series).collect();
    let (traces, layout) = lines(&series, "travel [mm]", "force, whole process [N]");
    page.plot(&traces, &layout, 560);
    page.write(&folder.join("study.html"))?;
    Ok(())
}

fn row<'a>(study: &Study, case: &'a Case, manifest: &Manifest, folder: &Path) -> Row<'a> {
    let run = folder_of(folder, &case.id).join("run");
    let entry = manifest.cases.get(&case.id);
    let text = fs::read(run.join("run.json")).unwrap_or_default();
    Row {
        case,
        state: entry.map_or(State::Waiting, |e| e.state),
        reason: entry.and_then(|e| e.reason.clone()),
        record: serde_json::from_slice(&text).ok(),
        curve: curve(
            &fs::read_to_string(run.join("history.csv")).unwrap_or_default(),
            &study.watch,
        ),
        force_rms: None,
    }
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

/// Linear interpolation.
fn at(curve: &[(f64, f64)], x: f64) -> f64 {
    let after = curve.partition_point(|p| p.0 < x).clamp(1, curve.len().max(2) - 1);
    let (Some(&(x0, y0)), Some(&(x1, y1))) = (curve.get(after - 1), curve.get(after)) else {
        return curve.first().map_or(0.0, |p| p.1);
    };
    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
}

fn cells(row: &Row<'_>) -> Vec<String> {
    let mut out = row.case.options.clone();
    let state = match row.state {
        State::Waiting => "waiting",
        State::Done => "done",
        State::Failed => "failed",
    };
    out.push(state.into());
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
    out.push(row.force_rms.map_or_else(String::new, |e| format!("{e:.5}")));
    out.push(row.reason.clone().unwrap_or_default());
    out
}

fn quote(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

fn series(row: &Row<'_>) -> Series {
    let (x, y) = row.curve.iter().copied().unzip();
    Series { name: row.case.id.clone(), x, y }
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
