//! Studies of patches: errors and orders of closed form, tables and drawings, what is refused.

use std::f64::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};

use kanagata::study::patches::run;
use kanagata::study::read::{Description, read};
use serde_json::{Value, json};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
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

/// Facets and Nagata patches at 4 and 8 divisions.
fn two() -> Value {
    let mut study = small();
    study["methods"] = json!([
        {"name": "facets", "kind": "facets", "divisions": [4, 8]},
        {"name": "Nagata", "kind": "nagata", "divisions": [4, 8]},
    ]);
    study
}

fn written(folder: &Path, study: &Value) -> PathBuf {
    let path = folder.join("small.json");
    std::fs::write(&path, study.to_string()).unwrap();
    path
}

/// Runs the study; gives how many models could not be made.
fn run_in(folder: &Path, study: &Value, cad: &str) -> usize {
    let file = written(folder, study);
    let Description::Patches(study) = read(&file).unwrap() else { panic!("another study") };
    let model = kanagata::cad::read(&fixture(cad)).unwrap().0;
    run(&study, &model, [&file, folder], &|_| ()).unwrap()
}

/// What the table says of two sizes of two methods: patches, largest shape error [mm] and normal error [degrees].
fn figures(study: &Value, cad: &str) -> [[[f64; 3]; 2]; 2] {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run_in(folder.path(), study, cad), 0);
    let text = std::fs::read_to_string(folder.path().join("patches.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|c| *c == name).unwrap();
    let columns = ["patches", "error_mm", "normal_deg"].map(column);
    let row = |k: usize| columns.map(|c| rows[k][c].parse::<f64>().unwrap());
    [[row(1), row(2)], [row(3), row(4)]]
}

/// Arcs of half angle h: chords miss them by `R (1 - cos h)`, Eq. 8 by `R (1 - cos h)^2 / (2 cos h)`; the normal of a
/// chord is h off.
#[test]
fn a_cylinder_has_the_errors_of_the_closed_form() {
    const RADIUS: f64 = 20.0;
    let found = figures(&two(), "forming/cylinder_144.igs");
    for (k, n) in [4.0, 8.0].into_iter().enumerate() {
        let h = FRAC_PI_4 / n;
        let chord = RADIUS * (1.0 - h.cos());
        let ([patches, error, normal], nagata) = (found[0][k], found[1][k]);
        assert!((error / chord - 1.0).abs() < 1e-4, "{error} {chord}");
        assert!((normal / h.to_degrees() - 1.0).abs() < 1e-4, "{normal}");
        let exact = chord * (1.0 - h.cos()) / (2.0 * h.cos());
        assert!((nagata[1] / exact - 1.0).abs() < 1e-4, "{nagata:?} {exact}");
        assert_eq!(patches, nagata[0]);
    }
}

/// On a doubly curved surface divided both ways facets are of second order in the size of a patch, Nagata patches of
/// fourth: slopes of -1 and -2 over the number of patches. Normals: of first and of third order.
#[test]
fn slopes_over_the_patches_of_a_torus_are_those_of_the_orders() {
    let found = figures(&two(), "forming/torus_144.igs");
    for (method, slopes) in found.iter().zip([[-1.0, -0.5], [-2.0, -1.5]]) {
        let [coarse, fine] = method;
        let more = (fine[0] / coarse[0]).ln();
        for (k, slope) in slopes.into_iter().enumerate() {
            let found = (fine[k + 1] / coarse[k + 1]).ln() / more;
            assert!((found - slope).abs() < 0.15, "{found} {slope} {method:?}");
        }
    }
    assert!(found[1][0][1] < found[0][0][1] / 10.0, "{found:?}");
}

#[test]
fn a_study_writes_its_tables_and_drawings_and_goes_on_after_a_model_that_cannot_be_made() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run_in(folder.path(), &small(), "forming/cylinder_144.igs"), 1);
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
fn a_description_that_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusals: [(&str, Value, &str, &str); 14] = [
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
        ("/methods/1/independent", json!(true), "independent: found true", "false, but for"),
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
    assert!(study.methods.iter().any(|m| m.kind == kanagata::tool::ToolKind::Facets));
}
