//! Holes in faces that curve both ways: the face keeps the mesh it has without them, but around them.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use kanagata::audit::{AuditOptions, CadReference, audit};
use kanagata::cad::{self, Model};
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::mesh::mapped::{MappedOptions, mesh};

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming").join(file);
    cad::read(&path).unwrap().0
}

/// Patches of a model to a tolerance, its audit checked.
fn patches(model: &Model, tol_mm: f64) -> usize {
    let goal =
        Goal { tol_mm, normal_deg: f64::INFINITY, two_sided: true, borders: Borders::Conforming };
    let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
    let found = to_tolerance(model, &MappedOptions::default(), &options, &goal).unwrap();
    let again = audit(&found.tool, &CadReference::new(model), &AuditOptions::default()).unwrap();
    assert!(again.report.worst_mm() <= tol_mm && again.report.folded.is_empty());
    found.tool.patches.len()
}

/// A torus of 50 and 10 mm with a hole of 3 mm radius through its tube, across both of its seams.
#[test]
fn a_torus_is_cut_along_its_parameters_but_round_its_hole() {
    let model = read("torus_hole_AP214.stp");
    let divisions = 8;
    let options = MappedOptions { arc_divisions: divisions, ..MappedOptions::default() };
    let mesh = mesh(&model, &options).unwrap();
    let on_torus: Vec<_> = mesh.elements.iter().filter(|e| e.face == 0).collect();
    let quads = on_torus.iter().filter(|e| e.nodes().len() == 4).count();
    let whole = 16 * divisions * divisions;
    assert!(on_torus.len() as f64 <= 1.15 * whole as f64, "{} of {whole}", on_torus.len());
    assert!(quads as f64 >= 0.95 * on_torus.len() as f64, "{quads} of {}", on_torus.len());
    let (tool, _) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
    let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
    assert!(
        found.worst_mm() < 0.021 && found.rms_mm < 0.0016,
        "{} {}",
        found.worst_mm(),
        found.rms_mm
    );
}

/// 471 patches on a grid of its lengths; 54 without the hole.
#[test]
fn to_a_tolerance_a_hole_costs_the_patches_round_it() {
    let found = patches(&read("torus_hole_AP214.stp"), 0.1);
    assert!(found <= 130, "{found}");
}

/// A ball of 30 mm with a hole of 6 mm radius on its seam, to its middle.
#[test]
fn a_ball_with_a_hole_on_its_seam_is_whole() {
    let model = read("ball_hole_AP214.stp");
    let cut = 30.0 - (900.0_f64 - 36.0).sqrt();
    let exact = 2.0 * TAU * 900.0 - TAU * 30.0 * cut + TAU * 6.0 * (30.0 - cut) + PI * 36.0;
    let area: f64 = model.faces.iter().map(|f| f.area(1e-12)).sum();
    assert!((area / exact - 1.0).abs() < 1e-9, "{area} instead of {exact}");
    let found = patches(&model, 0.1);
    assert!(found <= 100, "{found}");
}
