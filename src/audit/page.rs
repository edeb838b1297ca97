//! Audit page: verdict, answers, a 3-D view, tables and a histogram.

use super::Audit;
use super::report::{AuditReport, WorstPatch};
use super::sample::PatchSamples;
use super::view::cut;
use kanagata_report::doubt::place_mm;
use kanagata_report::page::{Outcome, Page};
use kanagata_report::plot::{Axis, Plot, Series, Style};
use kanagata_report::viewer::{Field, Surface, View, fans};
use kanagata_tool::ToolModel;

/// The page of an audit: verdict and answers, the error in 3-D, by face and by patch, set-up, and folded at the end what
/// the comparison consists of.
#[must_use]
pub fn page(tool: &ToolModel, audit: &Audit) -> Page {
    let report = &audit.report;
    let mut page = Page::new(&format!("Audit of {}", tool.name));
    verdict(&mut page, report);
    page.doubts(&report.doubts);
    answers(&mut page, report);
    page.heading("Where the error is");
    page.text("Signed shape error, positive where the patch is outside the CAD.");
    let surfaces = vec![surface(tool, &audit.samples)];
    page.view(&View { title: "Shape error of the tool".into(), surfaces, ..View::default() });
    page.heading("Worst patches");
    worst(&mut page, report);
    page.heading("By CAD face");
    by_face(&mut page, report);
    page.heading("Area by shape error");
    histogram(&mut page, &audit.samples);
    page.heading("Set-up");
    setup(&mut page, report);
    page.folded("Diagnostics of the comparison", |page| diagnostics(page, report));
    page
}

/// Writes the outcome in a sentence.
fn verdict(page: &mut Page, r: &AuditReport) {
    let error = format!("The shape error is {}", shape_error(r));
    let limit = r.tolerance_mm.map_or_else(String::new, |l| format!(" of {} mm", number(l)));
    let doubts = match r.doubts.len() {
        0 => "there is no doubt".to_owned(),
        1 => "there is 1 doubt".into(),
        count => format!("there are {count} doubts"),
    };
    let (outcome, kept) = match r.within_tolerance {
        Some(false) => (Outcome::Failed, format!("exceeds its tolerance{limit}")),
        Some(true) => (Outcome::Good, format!("keeps its tolerance{limit}, and {doubts}")),
        None => (Outcome::Good, format!("was compared without a tolerance, and {doubts}")),
    };
    let doubtful = outcome == Outcome::Good && !r.doubts.is_empty();
    let outcome = if doubtful { Outcome::Doubtful } else { outcome };
    page.outcome(outcome, &format!("The tool {kept}. {error}."));
}

/// The largest |shape error| with its sign, place, patch and face.
fn shape_error(r: &AuditReport) -> String {
    let place = |w: &WorstPatch| {
        format!(
            "{} mm at {}, patch {} of face {}",
            signed(w.delta_mm),
            place_mm(&w.point),
            w.patch,
            w.face
        )
    };
    r.worst.first().map_or_else(|| "not known: no point could be compared".into(), place)
}

fn signed(value: f64) -> String {
    format!("{}{}", if value > 0.0 { "+" } else { "" }, number(value))
}

/// Writes what is asked first about a tool.
fn answers(page: &mut Page, r: &AuditReport) {
    let (p, j) = (&r.percentiles_mm, &r.jumps);
    let gap = number(j.position_mm.max(j.border_gap_mm));
    let at = j.border_gap_at.filter(|_| j.border_gap_mm >= j.position_mm && j.border_gap_mm > 0.0);
    let gap_at = at.map_or_else(String::new, |at| format!(" at {}", place_mm(&at)));
    let jump = j.normal_patches.map_or_else(String::new, |[a, b]| format!(", patches {a} and {b}"));
    let rows = vec![
        ("largest shape error", shape_error(r)),
        ("signed shape error", format!("{} to {} mm", signed(r.min_mm), signed(r.max_mm))),
        (
            "root mean square; within 95 % and 99 % of the area",
            format!("{}; {} and {} mm", number(r.rms_mm), number(p.p95), number(p.p99)),
        ),
        ("largest normal error", format!("{} degrees", number(r.normal_max_deg))),
        ("largest deviation of free borders", border(r)),
        ("largest gap between neighbours", format!("{gap} mm{gap_at}")),
        (
            "largest jump of normals across a smooth edge",
            format!("{} degrees{jump}", number(j.normal_deg)),
        ),
        ("free edges beside those of other faces", open_joints(r)),
        ("folded patches", count(r.folded.len())),
        ("lost faces of the CAD", count(r.faces_lost.len())),
    ];
    two_columns(page, rows);
}

/// Free edges that run beside those of other faces, with the widest gap.
fn open_joints(r: &AuditReport) -> String {
    let open = &r.open_joints;
    let place = open.at.map(|at| format!("{} mm at {}", number(open.widest_mm), place_mm(&at)));
    place.map_or_else(|| "none".into(), |place| format!("{}, up to {place}", open.edges))
}

/// A count, or none.
fn count(count: usize) -> String {
    if count == 0 { "none".into() } else { count.to_string() }
}

fn two_columns(page: &mut Page, rows: Vec<(&str, String)>) {
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(a, b)| vec![a.to_owned(), b]).collect();
    page.table(&["", ""], &rows);
}

/// Writes files, size and tolerances.
fn setup(page: &mut Page, r: &AuditReport) {
    let limit = |limit: Option<f64>, unit: &str| {
        limit.map_or_else(|| "none".into(), |limit| format!("{} {unit}", number(limit)))
    };
    let rows = vec![
        ("tool file", r.tool_file.clone()),
        ("CAD file", r.cad_file.clone()),
        ("patches, area", format!("{}, {:.1} mm2", r.patches, r.area_mm2)),
        ("tolerance of the shape error", limit(r.tolerance_mm, "mm")),
        ("tolerance of the normal error", limit(r.normal_tolerance_deg, "degrees")),
        ("program", r.program.clone()),
    ];
    two_columns(page, rows);
    let digests = [(&r.tool_file, &r.tool_sha256), (&r.cad_file, &r.cad_sha256)];
    let digests = digests.map(|(file, sha256)| vec![file.clone(), sha256.clone()]);
    page.folded("Digests of the files", |page| page.table(&["file", "SHA-256"], &digests));
}

/// Writes what was compared, and how the patches meet.
fn diagnostics(page: &mut Page, r: &AuditReport) {
    let (p, j) = (&r.percentiles_mm, &r.jumps);
    let turned = if r.turned { "yes: the normals of the CAD were turned" } else { "no" };
    let rows = vec![
        ("points compared, lost", format!("{}, {}", r.points, r.points_lost)),
        ("points where patch or CAD has no normal", r.points_without_normal.to_string()),
        ("the tool looks the other way than the CAD", turned.into()),
        (
            "|error| of 50, 90, 95, 99 % of the area [mm]",
            [p.p50, p.p90, p.p95, p.p99].map(number).join(", "),
        ),
        ("largest distance to the CAD [mm]", number(r.distance_max_mm)),
        (
            "edges: shared, free, creases",
            format!("{}, {}, {}", j.shared_edges, j.free_edges, j.creases),
        ),
        ("sides that do not meet their neighbours'", j.open_sides.to_string()),
        ("largest angle across a crease [deg]", number(j.crease_deg)),
        (
            "free borders: sides of the tool, edges of the CAD",
            format!("{}, {}", r.borders.tool_sides, r.borders.cad_edges),
        ),
    ];
    two_columns(page, rows);
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

/// Deviation of the free borders and its location.
fn border(r: &AuditReport) -> String {
    let deviation = number(r.borders.deviation_mm());
    let place = r.borders.at.map(|at| format!("{deviation} mm at {}", place_mm(&at)));
    place.unwrap_or_else(|| "no free border".into())
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
    let row = |w: &WorstPatch| {
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
