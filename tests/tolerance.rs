//! To a tolerance with as few patches as it takes: against the uniform mesh that reaches the same largest error.

use std::path::Path;

use kanagata::audit::{AuditOptions, CadReference, audit};
use kanagata::cad::{self, Model};
use kanagata::convert::tolerance::{Goal, Refined, to_patches, to_tolerance};
use kanagata::convert::{ConvertOptions, convert};
use kanagata::mesh::mapped::{MappedOptions, mesh};

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
    cad::read(&path).unwrap().0
}

fn refined(model: &Model, tol_mm: f64, two_sided: bool, through_cad: bool) -> Refined {
    let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided };
    let options = ConvertOptions { through_cad, ..ConvertOptions::default() };
    let found = to_tolerance(model, &MappedOptions::default(), &options, &goal).unwrap();
    let again = audit(&found.tool, &CadReference::new(model), &AuditOptions::default()).unwrap();
    assert!(again.report.worst_mm() <= tol_mm && again.report.folded.is_empty());
    assert!(again.report.jumps.position_mm < 1e-12);
    found
}

/// Patches of the first uniform structured mesh whose largest error is no larger.
fn uniform(model: &Model, error_mm: f64) -> usize {
    for arc_divisions in 1..64 {
        let options = MappedOptions { arc_divisions, ..MappedOptions::default() };
        let (tool, _) =
            convert(model, &mesh(model, &options).unwrap(), &ConvertOptions::default()).unwrap();
        let found = audit(&tool, &CadReference::new(model), &AuditOptions::default()).unwrap();
        if found.report.worst_mm() <= error_mm {
            return tool.patches.len();
        }
    }
    panic!("no uniform mesh reaches {error_mm} mm");
}

#[test]
fn the_cross_die_takes_fewer_patches_than_a_uniform_mesh_of_the_same_error() {
    let model = read("cross/die.igs");
    let found = refined(&model, 0.01, false, false);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("0.01 mm: {} patches, uniform {uniform}", found.tool.patches.len());
    assert!(found.tool.patches.len() as f64 <= 0.7 * uniform as f64);
    assert_eq!(found.moved_mm, 0.0);
}

#[test]
fn edges_that_follow_the_cad_halve_that() {
    let model = read("cross/die.igs");
    let found = refined(&model, 0.01, false, true);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("0.01 mm, edges through the CAD: {} patches", found.tool.patches.len());
    assert!(found.tool.patches.len() as f64 <= 0.5 * uniform as f64);
    assert!(!found.tool.curves.is_empty() && found.audit.normal_max_deg < 0.6);
}

/// The same mesh: Eq. 8 draws chords where a flat meets a fillet; and the order stays four.
#[test]
fn edges_that_follow_the_cad_take_off_most_of_the_error_of_a_mesh() {
    let model = read("cross/die.igs");
    let made = |arc_divisions, through_cad| {
        let mesh = mesh(&model, &MappedOptions { arc_divisions, ..MappedOptions::default() });
        let options = ConvertOptions { through_cad, ..ConvertOptions::default() };
        let (tool, _) = convert(&model, &mesh.unwrap(), &options).unwrap();
        audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report
    };
    let (plain, cad) = (made(4, false), made(4, true));
    println!("{} {}", plain.worst_mm(), cad.worst_mm());
    assert!(cad.worst_mm() < 0.2 * plain.worst_mm());
    assert!(cad.normal_max_deg < 0.2 * plain.normal_max_deg);
    let order = (cad.worst_mm() / made(8, true).worst_mm()).log2();
    assert!(order > 3.9, "{order}");
}

/// A fillet whose patches all stand out of it: half of that is taken off, so fewer do.
#[test]
fn balanced_vertices_need_no_more_patches() {
    let model = read("forming/torus_144.igs");
    let (one, two) = (refined(&model, 0.1, false, false), refined(&model, 0.1, true, false));
    println!("on the CAD {}, balanced {}", one.tool.patches.len(), two.tool.patches.len());
    assert!(two.tool.patches.len() <= one.tool.patches.len());
    assert!(two.audit.max_mm <= 0.1 && two.audit.min_mm >= -0.1);
}

#[test]
fn a_number_of_patches_is_not_exceeded_and_more_patches_are_better() {
    let model = read("forming/cross_punch_144.igs");
    let made = |patches| {
        to_patches(&model, &MappedOptions::default(), &ConvertOptions::default(), patches, false)
            .unwrap()
    };
    let (few, many) = (made(40), made(120));
    println!("{} {}", few.audit.worst_mm(), many.audit.worst_mm());
    assert!(few.tool.patches.len() <= 40 && many.tool.patches.len() <= 120);
    assert!(many.audit.worst_mm() < 0.5 * few.audit.worst_mm());
}

/// Arcs of a border that reach into coarse quads on a flat: their parts are moved apart, or the border is divided finer.
#[test]
fn quads_on_flats_with_concave_borders_do_not_fold() {
    for file in ["cross/die.igs", "cross/holder.igs"] {
        let model = read(file);
        let options = MappedOptions {
            arc_divisions: 4,
            style: kanagata::mesh::mapped::MeshStyle::Quads,
            ..MappedOptions::default()
        };
        let mesh = mesh(&model, &options).unwrap();
        assert!(mesh.elements.iter().all(|e| e.nodes().len() == 4));
        let (tool, report) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
        let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
        println!("{file}: {} quads", tool.patches.len());
        assert!(report.folded.is_empty() && found.report.folded.is_empty() && report.split == 0);
    }
}

/// A whole sphere has no edge but its seam: what is between its poles is divided too.
#[test]
fn a_whole_sphere_reaches_a_tolerance() {
    let model = read("forming/sphere_AP214.stp");
    let tol_mm = 1e-3 * model.bbox().diagonal();
    let found = refined(&model, tol_mm, true, true);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("{} patches, uniform {uniform}", found.tool.patches.len());
    assert!(found.tool.patches.len() <= uniform);
}
