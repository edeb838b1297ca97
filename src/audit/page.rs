//! Audit page: tables, a histogram and a 3-D view.

use super::Audit;
use super::report::AuditReport;
use super::sample::PatchSamples;
use super::view::cut;
use crate::report::page::Page;
use crate::report::plot::{Axis, Plot, Series, Style};
use crate::report::viewer::{Field, Surface, View, fans};
use crate::tool::ToolModel;

/// The page of an audit.
#[must_use]
pub fn page(tool: &ToolModel, audit: &Audit) -> Page {
    let report = &audit.report;
    let mut page = Page::new(&format!("Audit of {}", tool.name));
    page.doubts(&report.doubts);
    whole(&mut page, report);
    page.heading("Where the error is");
    page.text("Signed shape error, positive where the patch is outside the CAD.");
    let surfaces = vec![surface(tool, &audit.samples)];
    page.view(&View { title: "Shape error of the tool".into(), surfaces, ..View::default() });
    page.heading("Area by shape error");
    histogram(&mut page, &audit.samples);
    page.heading("By CAD face");
    by_face(&mut page, report);
    page.heading("Worst patches");
    worst(&mut page, report);
    page
}

/// The patches as a coloured surface.
fn surface(tool: &ToolModel, samples: &[PatchSamples]) -> Surface {
    let cut = cut(tool, samples);
    let ids = |cell: &[usize]| cell.iter().map(|&k| k as u32).collect::<Vec<u32>>();
    let polygons: Vec<Vec<u32>> = cut.cells.iter().map(|(_, cell)| ids(cell)).collect();
    let (triangles, owners) = fans(polygons.iter().map(Vec::as_slice));
    let error = Field {
        name: "shape error [mm]".into(),
        signed: true,
        values: cut.delta,
        ..Field::default()
    };
    Surface {
        name: tool.name.clone(),
        points: cut.points,
        triangles,
        cells: owners.iter().map(|&cell| cut.cells[cell as usize].0 as u32).collect(),
        cell_name: "patch",
        fields: vec![error],
        ..Surface::default()
    }
}

fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:.2e}") } else { format!("{value:.4}") }
}

fn whole(page: &mut Page, r: &AuditReport) {
    let p = &r.percentiles_mm;
    let j = &r.jumps;
    let verdict = match (r.within_tolerance, r.tolerance_mm) {
        (None, _) => "no tolerance asked".to_owned(),
        (Some(kept), limit) => {
            let limit =
                limit.map_or_else(String::new, |l| format!(" (tolerance {} mm)", number(l)));
            format!("{}{limit}", if kept { "kept" } else { "exceeded" })
        }
    };
    let rows = [
        ("tool file", r.tool_file.clone()),
        ("CAD file", r.cad_file.clone()),
        ("patches", r.patches.to_string()),
        ("tolerance", verdict),
        ("largest shape error [mm]", number(r.max_mm)),
        ("smallest shape error [mm]", number(r.min_mm)),
        ("root mean square [mm]", number(r.rms_mm)),
        (
            "|error| of 50, 90, 95, 99 % of the area [mm]",
            [p.p50, p.p90, p.p95, p.p99].map(number).join(", "),
        ),
        ("largest distance to the CAD [mm]", number(r.distance_max_mm)),
        ("largest deviation of free borders [mm]", border(r)),
        ("largest normal error [deg]", number(r.normal_max_deg)),
        ("largest gap between neighbours [mm]", number(j.position_mm.max(j.border_gap_mm))),
        ("sides that do not meet their neighbours'", j.open_sides.to_string()),
        ("largest normal jump across a smooth edge [deg]", number(j.normal_deg)),
        (
            "edges: shared, free, creases",
            format!("{}, {}, {}", j.shared_edges, j.free_edges, j.creases),
        ),
        ("folded patches", r.folded.len().to_string()),
        ("faces of the CAD file that are lost", r.faces_lost.len().to_string()),
        ("points compared, lost", format!("{}, {}", r.points, r.points_lost)),
    ];
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(a, b)| vec![a.to_owned(), b]).collect();
    page.table(&["", ""], &rows);
}

/// Deviation of the free borders and its location.
fn border(r: &AuditReport) -> String {
    let place = r.borders.at.map(|[x, y, z]| format!(" at ({x:.3}, {y:.3}, {z:.3}) mm"));
    place.map_or("no free border".into(), |at| number(r.borders.deviation_mm()) + &at)
}

fn by_face(page: &mut Page, r: &AuditReport) {
    let row = |f: &super::report::FaceAudit| {
        let mut row = vec![f.face.to_string(), f.patches.to_string()];
        row.extend([f.max_mm, f.min_mm, f.rms_mm, f.normal_max_deg, f.border_mm].map(number));
        row.push(format!("{:.2}", f.area_mm2));
        row
    };
    let rows: Vec<Vec<String>> = r.faces.iter().map(row).collect();
    let head = [
        "face",
        "patches",
        "max [mm]",
        "min [mm]",
        "rms [mm]",
        "normal [deg]",
        "border [mm]",
        "area [mm^2]",
    ];
    page.table(&head, &rows);
}

fn worst(page: &mut Page, r: &AuditReport) {
    let row = |w: &super::report::WorstPatch| {
        let mut row = vec![w.patch.to_string(), w.face.to_string(), number(w.delta_mm)];
        row.extend([w.eta, w.zeta].map(|x| format!("{x:.3}")));
        row.extend(w.point.map(|x| format!("{x:.3}")));
        row
    };
    let rows: Vec<Vec<String>> = r.worst.iter().map(row).collect();
    let head = ["patch", "face", "error [mm]", "eta", "zeta", "x [mm]", "y [mm]", "z [mm]"];
    page.table(&head, &rows);
}

/// Number of bins of the histogram.
const BINS: usize = 40;

/// Fraction of the area in equal bins of |delta|.
fn histogram(page: &mut Page, samples: &[PatchSamples]) {
    let mut points = Vec::new();
    for s in samples {
        let areas = s.areas();
        points.extend(
            areas.iter().zip(&s.points).filter_map(|(a, p)| Some((p.as_ref()?.delta.abs(), *a))),
        );
    }
    let top = points.iter().map(|p| p.0).fold(0.0, f64::max);
    let total: f64 = points.iter().map(|p| p.1).sum();
    let mut shares = vec![0.0; BINS];
    for (delta, area) in points {
        let bar = if top > 0.0 { (delta / top * BINS as f64) as usize } else { 0 };
        shares[bar.min(BINS - 1)] += 100.0 * area / total;
    }
    let width = top / BINS as f64;
    let x: Vec<f64> = (0..BINS).map(|k| (k as f64 + 0.5) * width).collect();
    let series = Series { name: "fraction of the area".into(), x, y: shares };
    let axis = |title: &str, log| Axis { title: title.into(), log };
    let plot = Plot {
        x: axis("|shape error| [mm]", false),
        y: axis("fraction of the area [%]", true),
        series: vec![(series, Style::Bars(width))],
        equal: false,
    };
    page.plot(&plot, 340);
}
