use std::f64::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::measure::{Figures, points_near};
use super::*;
use crate::mesh::mapped::{self, MappedOptions};
use crate::study::file::{Description, read};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn model(name: &str) -> Model {
    crate::cad::read(&fixture(name)).unwrap().0
}

fn small() -> Value {
    json!({
        "format": "kanagata-patches", "version": 1, "name": "small", "cad": "cylinder_144.igs",
        "queries": {"seed": 7, "points": 50, "distance_mm": 0.5},
        "methods": [
            {"name": "facets, uniform", "kind": "facets", "divisions": [2, 4]},
            {"name": "Nagata", "kind": "nagata", "divisions": [2, 4]},
            {"name": "Bezier", "kind": "bezier", "tolerances_mm": [1e-3, 1e-16]},
        ],
    })
}

fn written(folder: &Path, study: &Value) -> PathBuf {
    let path = folder.join("small.json");
    std::fs::write(&path, study.to_string()).unwrap();
    path
}

fn parsed(study: Value) -> PatchStudy {
    serde_json::from_value(study).unwrap()
}

fn figures(study: &PatchStudy, model: &Model) -> Vec<Vec<Figures>> {
    let bench = Bench::new(study, model).unwrap();
    let one = |m: &Method, n: usize| *bench.row(m, Size::Divisions(n)).sound().unwrap();
    let of = |m: &Method| m.divisions.iter().map(|&n| one(m, n)).collect();
    study.methods.iter().map(of).collect()
}

/// Arcs of half angle h: chords miss them by `R (1 - cos h)`, Eq. 8 by `R (1 - cos h)^2 / (2 cos h)`; the normal of a
/// chord is h off.
#[test]
fn a_cylinder_has_the_errors_of_the_closed_form() {
    const RADIUS: f64 = 20.0;
    let mut study = parsed(small());
    study.methods.truncate(2);
    let found = figures(&study, &model("forming/cylinder_144.igs"));
    for (k, n) in [2.0, 4.0].into_iter().enumerate() {
        let h = FRAC_PI_4 / n;
        let chord = RADIUS * (1.0 - h.cos());
        let (facets, nagata) = (found[0][k], found[1][k]);
        assert!((facets.error_mm - chord).abs() < 1e-6, "{facets:?} {chord}");
        assert!((facets.normal_deg - h.to_degrees()).abs() < 1e-4, "{facets:?}");
        let exact = chord * (1.0 - h.cos()) / (2.0 * h.cos());
        assert!((nagata.error_mm - exact).abs() < 1e-6, "{nagata:?} {exact}");
        assert_eq!(facets.patches, nagata.patches);
    }
}

/// On a doubly curved surface divided both ways facets are of second order in the size of a patch, Nagata patches of
/// fourth: slopes of -1 and -2 over the number of patches. Normals: of first and of third order.
#[test]
fn slopes_over_the_patches_of_a_torus_are_those_of_the_orders() {
    let mut study = small();
    study["methods"] = json!([
        {"name": "facets", "kind": "facets", "divisions": [4, 8]},
        {"name": "Nagata", "kind": "nagata", "divisions": [4, 8]},
    ]);
    let found = figures(&parsed(study), &model("forming/torus_144.igs"));
    for (method, slopes) in found.iter().zip([[-1.0, -0.5], [-2.0, -1.5]]) {
        let more = (method[1].patches as f64 / method[0].patches as f64).ln();
        let error = (method[1].error_mm / method[0].error_mm).ln() / more;
        let normal = (method[1].normal_deg / method[0].normal_deg).ln() / more;
        println!("{error} {normal} {method:?}");
        assert!((error - slopes[0]).abs() < 0.15, "{error} {method:?}");
        assert!((normal - slopes[1]).abs() < 0.15, "{normal} {method:?}");
    }
    assert!(found[1][0].error_mm < found[0][0].error_mm / 10.0);
}

#[test]
fn a_study_writes_its_tables_and_drawings_and_goes_on_after_a_model_that_cannot_be_made() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), &small());
    let Description::Patches(study) = read(&file).unwrap() else { panic!("another study") };
    let said = std::cell::RefCell::new(Vec::new());
    let say = |line: &str| said.borrow_mut().push(line.to_owned());
    let cylinder = model("forming/cylinder_144.igs");
    assert_eq!(run(&study, &cylinder, [&file, folder.path()], &say).unwrap(), 1);
    assert_eq!(said.borrow().len(), 6);

    let text = std::fs::read_to_string(folder.path().join("patches.csv")).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 1 + 6);
    assert!(rows[1].starts_with("\"facets, uniform\",facets,structured,2,,sound,"), "{}", rows[1]);
    assert!(rows[5].starts_with("Bezier,bezier,structured,,0.001,sound,"), "{}", rows[5]);
    assert!(rows[6].contains(",failed,,,") && rows[6].contains("allowed: 0.0000"), "{}", rows[6]);
    // Fewer patches and less error than all others; what lasts how long is not for a test.
    let front = |k: usize| rows[k].rsplit(',').nth(3).unwrap();
    assert_eq!([1, 2, 3, 4, 5].map(front), ["", "", "", "", "yes"], "{text}");

    let fewest = std::fs::read_to_string(folder.path().join("fewest.csv")).unwrap();
    assert!(fewest.starts_with("error_mm,\"facets, uniform\",Nagata,Bezier\n"), "{fewest}");
    for name in ["error-against-patches", "normal-against-patches", "query-against-patches"] {
        let drawing = std::fs::read_to_string(folder.path().join(name).with_extension("svg"));
        assert!(drawing.unwrap().contains("facets, uniform"));
    }
    let page = std::fs::read_to_string(folder.path().join("patches.html")).unwrap();
    assert!(page.contains("nobody beats") && page.contains("hold nowhere else"));
}

#[test]
fn query_points_lie_within_their_distance_and_follow_the_seed() {
    let torus = model("forming/torus_144.igs");
    let mesh = mapped::mesh(&torus, &MappedOptions { arc_divisions: 32, ..Default::default() });
    let queries = Queries { seed: 3, points: 400, distance_mm: 0.5 };
    let points = points_near(&mesh.as_ref().unwrap().clone(), &queries);
    let index = crate::cad::closest::ClosestPoint::new(&torus);
    let off: Vec<f64> =
        points.iter().map(|p| (index.closest(p).unwrap().point - p).norm()).collect();
    assert!(off.iter().all(|d| *d < 0.52) && off.iter().any(|d| *d > 0.4));
    assert_eq!(points, points_near(mesh.as_ref().unwrap(), &queries));
    let other = points_near(mesh.as_ref().unwrap(), &Queries { seed: 4, ..queries });
    assert_ne!(points, other);
}

#[test]
fn a_description_that_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusals: [(&str, Value, &str, &str); 13] = [
        ("/version", json!(2), "version: found 2", "allowed: 1"),
        ("/queries/points", json!(0), "queries.points: found 0", "1 to 1000000"),
        ("/queries/distance_mm", json!(-1.0), "queries.distance_mm: found -1", "above 0 mm"),
        ("/methods", json!([]), "methods: found 0", "1 to 11"),
        ("/methods/1/name", json!(" "), "methods[1].name: found nothing", "a name"),
        ("/methods/1/name", json!("facets, uniform"), "methods[1].name: found", "of its own"),
        ("/methods/1/divisions", json!([]), "methods[1].divisions: found 0", "one of the two"),
        ("/methods/1/divisions/0", json!(0), "methods[1].divisions[0]: found 0", "1 to 256"),
        ("/methods/2/tolerances_mm/1", json!(0.0), "tolerances_mm[1]: found 0", "above 0 mm"),
        ("/methods/1/kind", json!("bezier"), "methods[1].divisions: found 2", "tolerances_mm"),
        ("/methods/1/on_cad", json!(true), "methods[1].on_cad: found true", "false, but for"),
        ("/methods/0/edges", json!("cad"), "methods[0].edges: found cad", "Nagata"),
        ("/methods/0/colour", json!("red"), "colour", "schemas/patches.schema.json"),
    ];
    for (place, value, found, allowed) in refusals {
        let mut study = small();
        let (parent, key) = place.rsplit_once('/').unwrap();
        match study.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            other => other[key] = value,
        }
        let error = read(&written(folder.path(), &study)).unwrap_err().to_string();
        let told = ["small.json", found, allowed].iter().all(|part| error.contains(part));
        assert!(told, "{place}: {error}");
    }
    let mut study = small();
    study["sheet_side"] = json!([0.0, 0.0, 0.0]);
    let error = read(&written(folder.path(), &study)).unwrap_err().to_string();
    assert!(error.contains("sheet_side: found [0, 0, 0]; allowed: a direction"), "{error}");
}

#[test]
fn the_shipped_study_is_sound() {
    let file = fixture("studies/patches.json");
    let Description::Patches(study) = read(&file).unwrap() else { panic!("another study") };
    assert!(file.parent().unwrap().join(&study.cad).exists());
    assert!(study.methods.iter().any(|m| m.kind == crate::tool::ToolKind::Facets));
}
