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

fn refined(model: &Model, tol_mm: f64, two_sided: bool) -> Refined {
    let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided };
    let found =
        to_tolerance(model, &MappedOptions::default(), &ConvertOptions::default(), &goal).unwrap();
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
    let found = refined(&model, 0.01, false);
    let uniform = uniform(&model, found.audit.worst_mm());
    println!("0.01 mm: {} patches, uniform {uniform}", found.tool.patches.len());
    assert!(found.tool.patches.len() as f64 <= 0.7 * uniform as f64);
    assert_eq!(found.moved_mm, 0.0);
}

/// A fillet whose patches all stand out of it: half of that is taken off, so fewer do.
#[test]
fn balanced_vertices_need_no_more_patches() {
    let model = read("forming/torus_144.igs");
    let (one, two) = (refined(&model, 0.1, false), refined(&model, 0.1, true));
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
