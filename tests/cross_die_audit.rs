//! CAD to mesh to tool model to audit, on the cross tool: how the shape error falls with the number of patches.

use std::path::Path;

use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad;
use kanagata::convert::{ConvertOptions, convert};
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};

fn audited(file: &str, arc_divisions: usize, style: MeshStyle) -> AuditReport {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming").join(file);
    let (model, _) = cad::read(&path).unwrap();
    let options = MappedOptions { arc_divisions, style, ..MappedOptions::default() };
    let mesh = mesh(&model, &options).unwrap();
    let (tool, found) = convert(&model, &mesh, &ConvertOptions::default()).unwrap();
    let r = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
    println!(
        "{file} {arc_divisions} {style:?}: {} patches, {:+.6} {:+.6} rms {:.2e} mm, normal {:.3} jump {:.3} deg, gap {:.0e} mm, creases {} ({:.2} deg), straight {}, folded {:?}, worst on face {}",
        r.patches,
        r.max_mm,
        r.min_mm,
        r.rms_mm,
        r.normal_max_deg,
        r.jumps.normal_deg,
        r.jumps.position_mm,
        r.jumps.creases,
        r.jumps.crease_deg,
        found.straight.len(),
        r.folded,
        r.worst[0].face,
    );
    assert_eq!((r.points_lost, r.patches), (0, tool.patches.len()));
    assert!(!r.turned && r.jumps.position_mm < 1e-12);
    r
}

/// Fourth order: a sixteenth with twice the divisions, at least a twelfth on coarse patches.
fn falls(file: &str) {
    let [a, b, c] = [2, 4, 8].map(|n| audited(file, n, MeshStyle::Structured));
    for (coarse, fine) in [(&a, &b), (&b, &c)] {
        let ratio = coarse.worst_mm() / fine.worst_mm();
        println!("{file}: falls by {ratio:.2}");
        assert!(ratio >= 12.0, "{file}: {ratio}");
    }
    for r in [a, b, c] {
        assert!(r.folded.is_empty() && r.normal_max_deg < 10.0, "{file}");
    }
}

#[test]
fn error_of_the_cross_die_falls_with_the_fourth_power() {
    falls("cross_die_144.igs");
}

#[test]
fn error_of_the_cross_punch_falls_with_the_fourth_power() {
    falls("cross_punch_144.igs");
}

#[test]
fn a_flat_holder_is_off_at_its_curved_borders_only() {
    let r = audited("cross_holder_144.igs", 4, MeshStyle::Structured);
    assert!(r.normal_max_deg < 1e-6 && r.folded.is_empty());
    // Four chords of a quarter turn of the opening's largest arc, of 21 mm, leave the border by their sagitta.
    let sagitta = 21.0 * (1.0 - (std::f64::consts::PI / 16.0).cos());
    assert!((r.worst_mm() / sagitta - 1.0).abs() < 1e-6, "{} {sagitta}", r.worst_mm());
    assert!((r.borders.deviation_mm() / sagitta - 1.0).abs() < 1e-6, "{:?}", r.borders);
}

/// At a crease a point of one side takes the normal of its own face, not of the one met first.
#[test]
fn creases_do_not_count_as_normal_errors() {
    let r = audited("cylinder_144.igs", 4, MeshStyle::Structured);
    assert!(r.jumps.creases > 0 && (r.jumps.crease_deg - 90.0).abs() < 1.0);
    assert!(r.normal_max_deg < 1.0, "{}", r.normal_max_deg);
    let h: f64 = 11.25f64.to_radians();
    let exact = 20.0 * (1.0 - h.cos()).powi(2) / (2.0 * h.cos());
    assert!((r.max_mm / exact - 1.0).abs() < 1e-6, "{} {exact}", r.max_mm);
}
