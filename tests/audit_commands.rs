//! `kanagata audit` from end to end: many models in one table, clearance between two tools, page and picture.

mod command;
mod page_data;

use std::path::Path;

use command::{fixture, kanagata};
use kanagata::audit::AuditReport;
use kanagata::audit::clearance::ClearanceReport;
use kanagata::geometry::Vec3;
use kanagata::report::vtu_read;
use kanagata::tool::ToolKind;
use kanagata::tool::build::build;
use kanagata::tool::edge::EdgeRule;
use kanagata::tool::file::{Provenance, ToolFile};
use kanagata::tool::model::PatchCorners;
use page_data::{Arrays, numbers, plots, views};

/// The cylinder of the forming files, about z.
const RADIUS: f64 = 20.0;

/// Points and normals, two for each place along x, as a strip 6 mm wide.
fn strip(name: &str, face: u32, places: &[(Vec3, Vec3)], into: &Path) {
    let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
    for (k, (x, n)) in (0u32..).zip(places) {
        vertices.extend([*x, x + Vec3::y() * 6.0]);
        normals.extend([*n, *n]);
        if k > 0 {
            let mut ids = vec![2 * k - 2, 2 * k, 2 * k + 1, 2 * k - 1];
            if n.z < 0.0 {
                ids.reverse();
            }
            corners.push(PatchCorners { vertices: ids.clone(), normals: ids, face });
        }
    }
    let rule = EdgeRule::Guarded;
    let (tool, _) = build(name.into(), ToolKind::Nagata, vertices, normals, corners, rule).unwrap();
    ToolFile::of_model(&tool, rule, Provenance::default()).write(into).unwrap();
}

/// A flat die at z = 0, and a punch of 20 mm radius above it whose lowest line, x = 0, is at z = 60.7.
fn punch_and_die(folder: &Path) -> [String; 2] {
    let [punch, die] = ["punch", "die"].map(|name| folder.join(format!("{name}.tool.json")));
    let flat = |x: f64| (Vec3::new(x, 0.0, 0.0), Vec3::z());
    strip("die", 0, &[flat(-15.0), flat(1.0), flat(15.0)], &die);
    let round = |degrees: f64| {
        let n = Vec3::new(degrees.to_radians().sin(), 0.0, -degrees.to_radians().cos());
        (Vec3::new(0.0, 0.0, 80.7) + n * 20.0, n)
    };
    strip("punch", 7, &[round(-15.0), round(5.0), round(25.0)], &punch);
    [punch, die].map(|path| path.to_str().unwrap().to_owned())
}

/// Exit code, output and figures of a clearance audit.
fn cleared(
    punch: &str,
    die: &str,
    travel: &str,
    thickness: &str,
) -> (i32, String, ClearanceReport) {
    let json = format!("{punch}.clearance.json");
    let (code, text, errors) = kanagata(&[
        "audit",
        punch,
        "--against",
        die,
        "--travel",
        travel,
        "--thickness",
        thickness,
        "--json",
        &json,
    ]);
    println!("{text}{errors}");
    let report = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    (code, text, report)
}

#[test]
fn too_small_a_clearance_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let [punch, die] = punch_and_die(folder.path());
    let asked = |travel: &str, thickness: &str| cleared(&punch, &die, travel, thickness);
    let (code, text, r) = asked("0,0,-60", "0.8");
    assert_eq!(code, 1);
    // The parabola of the patch stands out of the arc by R h^4 / 8 = 0.0023 mm in its middle.
    let least = r.min_mm.unwrap();
    assert!((0.6965..=0.7).contains(&least), "{least}");
    assert!((r.pinch - (1.0 - least / 0.8)).abs() < 1e-12);
    let [x, y, z] = r.at_mm.unwrap();
    assert!(x.abs() < 0.5 && (0.0..=6.0).contains(&y) && (z - least).abs() < 1e-9);
    assert_eq!((r.patches, r.nearest[0].face), (Some([0, 0]), 7));
    assert_eq!((r.format.as_str(), r.version), ("kanagata-clearance", 1));
    assert_eq!((&r.tool_file[..], &r.against_file[..]), ("punch.tool.json", "die.tool.json"));
    assert_eq!((r.travel_mm, r.thickness_mm), ([0.0, 0.0, -60.0], 0.8));
    // Closer than 0.8 mm while 20 (1 - cos a) < 0.1: up to 5.73 degrees each way of 15 and 25.
    let near = 2.0 * (1.0f64 - 0.1 / 20.0).acos().to_degrees() / 40.0;
    assert!((r.share_below - near).abs() < 0.05, "{} {near}", r.share_below);
    assert!((r.histogram.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(text.contains(&format!("least clearance {least:.5} mm, ")), "{text}");
    assert!(text.contains(&format!("patch 0 on face 7: {least:.5} mm to patch 0 at ({x:.3}, ")));

    assert_eq!(asked("0,0,-60", "0.7").0, 0, "within the 1 % that is let pass");
    let (code, _, r) = asked("0,0,-59", "0.8");
    assert!(code == 0 && (r.min_mm.unwrap() - 1.7).abs() < 0.0035 && r.pinch == 0.0);
}

#[test]
fn tools_that_do_not_face_each_other_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [punch, die] = punch_and_die(folder.path());
    let (code, _, errors) = kanagata(&[
        "audit",
        &punch,
        "--against",
        &die,
        "--travel",
        "0,90,-60",
        "--thickness",
        "0.8",
    ]);
    assert!(code == 2 && errors.contains("no point faces die.tool.json"), "{code} {errors}");
}

#[test]
fn clearances_of_several_tools_stand_in_one_table_and_one_list() {
    let folder = tempfile::tempdir().unwrap();
    let [punch, die] = punch_and_die(folder.path());
    let json = folder.path().join("list.json").to_str().unwrap().to_owned();
    let (code, text, errors) = kanagata(&[
        "audit",
        &punch,
        &punch,
        "--against",
        &die,
        "--travel",
        "0,0,-60",
        "--thickness",
        "0.8",
        "--json",
        &json,
    ]);
    assert_eq!(code, 1, "{errors}");
    let list: Vec<ClearanceReport> =
        serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((list.len(), &list[0]), (2, &list[1]));
    let row: Vec<&str> = text.lines().nth(2).unwrap().split_whitespace().collect();
    assert_eq!(row[1..3], ["2", &format!("{:.5}", list[1].min_mm.unwrap())]);
    assert_eq!(row[3], format!("{:.2}", 100.0 * list[1].pinch));
    assert_eq!(row[4], format!("{:.3}", 100.0 * list[1].share_below));
}

/// Tools of the cylinder with so many divisions of a quarter turn.
fn cylinders(folder: &Path, divisions: &[&str]) -> (String, Vec<String>) {
    let cad = fixture("forming/cylinder_144.igs");
    let made = divisions.iter().map(|n| {
        let out = folder.join(format!("by-{n}.tool.json")).to_str().unwrap().to_owned();
        let (code, _, errors) = kanagata(&["convert", &cad, "-o", &out, "--arc-divisions", n]);
        assert_eq!(code, 0, "{errors}");
        out
    });
    let made = made.collect();
    (cad, made)
}

fn report(path: &Path) -> AuditReport {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// The figures of a row.
fn row(r: &AuditReport) -> Vec<String> {
    let gap = r.jumps.position_mm.max(r.jumps.border_gap_mm);
    let mut told = vec![r.patches.to_string()];
    told.extend([r.max_mm, r.min_mm].map(|x| format!("{x:+.5}")));
    told.extend([r.rms_mm, r.percentiles_mm.p99].map(|x| format!("{x:.5}")));
    told.extend([r.normal_max_deg, r.jumps.normal_deg].map(|x| format!("{x:.3}")));
    told.push(format!("{gap:.1e}"));
    told
}

#[test]
fn many_models_stand_in_one_table_and_one_list() {
    let folder = tempfile::tempdir().unwrap();
    let (cad, tools) = cylinders(folder.path(), &["1", "2", "3"]);
    let [one, list] = ["one.json", "list.json"].map(|name| folder.path().join(name));
    let asked = |tools: &[String], options: &[&str]| {
        let tools: Vec<&str> = tools.iter().map(String::as_str).collect();
        kanagata(&[&["audit"], &tools[..], &["--cad", &cad], options].concat())
    };
    let (code, text, errors) = asked(&tools, &["--json", list.to_str().unwrap()]);
    println!("{text}{errors}");
    assert_eq!((code, errors.as_str()), (0, ""));
    let lines: Vec<Vec<&str>> = text.lines().map(|l| l.split_whitespace().collect()).collect();
    assert_eq!(lines.len(), 4);
    let head = "tool patches max [mm] min [mm] rms [mm] p99 [mm] normal jump gap [mm]";
    assert_eq!(lines[0].join(" "), head);
    let all: Vec<AuditReport> = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    for (k, tool) in tools.iter().enumerate() {
        let alone = asked(&tools[k..=k], &["--json", one.to_str().unwrap()]);
        assert_eq!(alone.0, 0);
        let r = report(&one);
        assert_eq!(
            (&all[k], r.patches),
            (&r, [4, 8, 12][k] + r.faces[1..].iter().map(|f| f.patches).sum::<usize>())
        );
        assert!(tool.ends_with(&r.tool_file));
        let h = (45.0 / (k as f64 + 1.0)).to_radians();
        let exact = RADIUS * (1.0 - h.cos()).powi(2) / (2.0 * h.cos());
        assert!((r.max_mm / exact - 1.0).abs() < 1e-6, "{} {exact}", r.max_mm);
        assert!(lines[k + 1][0].ends_with(&format!("/by-{}", k + 1)), "{:?}", lines[k + 1]);
        assert_eq!(lines[k + 1][1..], row(&r));
    }
    assert_eq!(asked(&tools, &["--tol", "0.4mm"]).0, 1, "the first of them is above it");
    assert_eq!(asked(&tools[1..], &["--tol", "0.4mm"]).0, 0);
    let (code, _, errors) = asked(&tools, &["--vtu", "x.vtu"]);
    assert!(code == 2 && errors.contains("with several tools"), "{errors}");
}

/// An audit of the cylinder: what was asked for in files.
struct Files {
    report: AuditReport,
    grid: vtu_read::Grid,
    page: String,
}

impl Files {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (cad, tools) = cylinders(folder.path(), &["2"]);
        let [json, vtu, html] = ["a.json", "a.vtu", "a.html"].map(|name| folder.path().join(name));
        let names = [&json, &vtu, &html].map(|p| p.to_str().unwrap());
        let (code, _, errors) = kanagata(&[
            "audit", &tools[0], "--cad", &cad, "--json", names[0], "--vtu", names[1], "--html",
            names[2],
        ]);
        assert_eq!(code, 0, "{errors}");
        let page = std::fs::read_to_string(&html).unwrap();
        Self { report: report(&json), grid: vtu_read::read(&vtu).unwrap(), page }
    }

    /// Values of an array of the picture.
    fn array(&self, name: &str) -> Vec<f64> {
        let mut arrays = self.grid.point_data.iter().chain(&self.grid.cell_data);
        arrays.find(|a| a.name == name).unwrap().values.clone()
    }
}

#[test]
fn the_picture_holds_the_errors_of_the_report() {
    let files = Files::new();
    let (r, grid) = (&files.report, &files.grid);
    let (error, normal) = (files.array("shape_error_mm"), files.array("normal_error_deg"));
    let (patch, face) = (files.array("patch"), files.array("face"));
    assert_eq!((error.len(), patch.len()), (grid.points.len(), grid.cells.len()));
    assert_eq!(grid.points.len(), r.points);
    let round = r.faces.iter().find(|f| f.max_mm > 1e-6).unwrap().face;
    for p in &r.by_patch {
        let cells = grid.cells.iter().zip(&patch).filter(|c| *c.1 == f64::from(p.id));
        let ids: Vec<usize> = cells.flat_map(|c| &c.0.1).map(|&k| k as usize).collect();
        let most = |of: &[f64]| ids.iter().map(|&k| of[k]).fold(f64::NEG_INFINITY, f64::max);
        // The middle of the arc, where the error is largest, is on the grid; the normal's is not.
        assert!((most(&error) - p.max_mm).abs() < 1e-9, "patch {}", p.id);
        assert!(most(&normal) <= p.normal_max_deg + 1e-9);
        assert!(most(&normal) >= 0.9 * p.normal_max_deg - 1e-6);
        for &k in ids.iter().filter(|_| p.face == round) {
            let exact = grid.points[k].xy().norm() - RADIUS;
            assert!((error[k] - exact).abs() < 1e-9, "{} {exact}", error[k]);
        }
    }
    let faces: Vec<f64> = patch.iter().map(|&k| f64::from(r.by_patch[k as usize].face)).collect();
    assert_eq!(face, faces);
}

#[test]
fn the_page_shows_the_picture_and_its_histogram_the_shares_of_the_area() {
    let files = Files::new();
    let (r, grid, error) = (&files.report, &files.grid, files.array("shape_error_mm"));
    let ([view], [histogram]) = (&views(&files.page)[..], &plots(&files.page)[..]) else {
        panic!("a view and a plot")
    };
    let (part, arrays) = (&view["parts"][0], Arrays::of(&files.page));
    let shown = arrays.read(&part["fields"][0]["values"]);
    // Single precision has no numbers below 1e-45.
    let near = |a: &f64, b: &f64| (a - b).abs() <= 1e-5 * b.abs() + 1e-40;
    assert!(shown.len() == error.len() && shown.iter().zip(&error).all(|(a, b)| near(a, b)));
    let accuracy = view["accuracy"].as_f64().unwrap();
    assert!(accuracy < 1e-3, "{accuracy}");
    for k in 0..3 {
        let places = arrays.read(&part["points"][k]);
        let within = |(a, b): (&f64, &Vec3)| f64::abs(a - b[k]) <= 1.001 * accuracy;
        assert!(places.len() == grid.points.len() && places.iter().zip(&grid.points).all(within));
    }
    let limits = numbers(&view["fields"][0]["limits"]);
    assert!(near(&limits[1], &r.worst_mm()) && limits[0] == -limits[1]);
    let triangles: usize = grid.cells.iter().map(|c| c.1.len() - 2).sum();
    assert_eq!(arrays.read(&part["triangles"]).len(), 3 * triangles);
    // Edges are those of the patches, which are square grids of their points.
    let side = (grid.points.len() as f64 / r.patches as f64).sqrt().round() as usize - 1;
    assert_eq!(arrays.read(&part["edges"]).len(), 2 * 4 * side * r.patches);

    let series = &histogram["series"][0];
    let (bars, shares) = (numbers(&series["x"]), numbers(&series["y"]));
    let width = r.worst_mm() / 40.0;
    // Bins without area are not drawn on the logarithmic axis; values have six digits.
    assert!((shares.iter().sum::<f64>() - 100.0).abs() < 1e-3 && shares.len() <= 40);
    assert!((bars.last().unwrap() / (39.5 * width) - 1.0).abs() < 1e-5);
    let p = &r.percentiles_mm;
    for (share, at) in [(50.0, p.p50), (90.0, p.p90), (95.0, p.p95), (99.0, p.p99)] {
        let bar = ((at / width) as usize).min(39) as f64;
        let up_to = |end: f64| -> f64 {
            let bins = bars.iter().zip(&shares).filter(|(x, _)| **x < end * width);
            bins.map(|(_, share)| share).sum()
        };
        let (below, above) = (up_to(bar), up_to(bar + 1.0));
        assert!(below <= share + 1e-3 && share <= above + 1e-3, "{share} % at {at}");
    }
    let told = [r.max_mm, r.rms_mm, r.percentiles_mm.p99].map(|x| format!("{x:.4}"));
    assert!(told.iter().all(|t| files.page.contains(&t[..])), "{told:?}");
}
