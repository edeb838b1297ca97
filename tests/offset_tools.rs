//! `convert --offset`: tools of the offset of a CAD file, their audit and what is refused.

mod command;

use std::path::Path;

use command::{fixture, kanagata};
use kanagata::cad;
use kanagata::cad::closest::ClosestPoint;
use kanagata::tool::Patch;
use kanagata::tool::file::read;

/// A conversion that must succeed: its output.
fn converted(file: &str, out: &Path, options: &[&str]) -> String {
    let asked = [&["convert", file, "-o", out.to_str().unwrap()], options].concat();
    let (code, text, errors) = kanagata(&asked);
    assert_eq!(code, 0, "{options:?}: {errors}");
    text
}

/// A conversion that must be refused: its errors.
fn refused(file: &str, options: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tool.json");
    let asked = [&["convert", file, "-o", out.to_str().unwrap()], options].concat();
    let (code, _, errors) = kanagata(&asked);
    assert_eq!(code, 2, "{options:?}: {errors}");
    assert!(!out.exists());
    errors
}

/// Smallest and largest distance of points of the patches from the CAD [mm], and the smallest product of their normals
/// with the directions from the CAD.
fn from_cad(tool: &Path, file: &str) -> ([f64; 2], f64) {
    let tool = read(tool).unwrap().model;
    let model = cad::read(Path::new(file)).unwrap().0;
    let search = ClosestPoint::new(&model);
    let (mut range, mut facing) = ([f64::INFINITY, 0.0_f64], f64::INFINITY);
    for patch in &tool.patches {
        for (i, j) in (0..=4).flat_map(|i| (0..=4).map(move |j| (f64::from(i), f64::from(j)))) {
            let (eta, zeta) = (0.25 * i, 0.25 * j);
            if matches!(patch, Patch::Triangle(_)) && zeta > eta {
                continue;
            }
            let d = patch.derivs(eta, zeta);
            let foot = search.closest(&d.s).unwrap();
            range = [range[0].min(foot.distance), range[1].max(foot.distance)];
            let n = d.d1.cross(&d.d2).normalize();
            facing = facing.min(n.dot(&(d.s - foot.point).normalize()));
        }
    }
    (range, facing)
}

#[test]
fn a_punch_is_the_offset_of_its_die_and_is_audited_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let (die, punch) = (folder.path().join("die.tool.json"), folder.path().join("punch.tool.json"));
    let file = fixture("forming/cross_die_144.igs");
    converted(&file, &die, &["--tol", "0.01mm"]);
    let text = converted(&file, &punch, &["--tol", "0.01mm", "--offset", "0.8mm", "--flip"]);
    assert!(
        text.contains("offset by 0.8 mm") && text.contains("0.800000 to 0.800000 mm"),
        "{text}"
    );
    assert!(text.contains("smallest radius on that side"), "{text}");
    assert_eq!(read(&punch).unwrap().provenance.offset_mm, Some(0.8));
    // Independent of the offset model: distances from the CAD itself, within the tolerance; normals look at the die.
    let (range, facing) = from_cad(&punch, &file);
    assert!(range[0] > 0.8 - 0.0101 && range[1] < 0.8 + 0.0101, "{range:?}");
    assert!(facing < -0.9, "{facing}");
    let (code, text, errors) =
        kanagata(&["audit", punch.to_str().unwrap(), "--cad", &file, "--tol", "0.01mm"]);
    assert_eq!(code, 0, "{text}{errors}");
    assert!(text.contains("offset by 0.8 mm"), "{text}");
    // Without the record the whole offset is an error.
    let mut value: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&punch).unwrap()).unwrap();
    value["provenance"].as_object_mut().unwrap().remove("offset_mm").unwrap();
    let plain = folder.path().join("plain.tool.json");
    std::fs::write(&plain, value.to_string()).unwrap();
    let (code, text, _) =
        kanagata(&["audit", plain.to_str().unwrap(), "--cad", &file, "--tol", "0.01mm"]);
    assert_eq!(code, 1, "{text}");
    // Punch and die leave the thickness of the sheet between them.
    let asked = [punch.to_str().unwrap(), "--against", die.to_str().unwrap(), "--thickness", "0.8"];
    let (code, text, errors) = kanagata(&[&["audit"], &asked[..], &["--pinch", "0.03"]].concat());
    assert_eq!(code, 0, "{text}{errors}");
}

#[test]
fn all_kinds_of_patches_and_chosen_faces_follow_the_offset() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("tool.json");
    let file = fixture("forming/square_die_nurbs144.igs");
    for (options, tolerance) in [
        (&["--kind", "bezier", "--tol", "0.001mm"][..], 0.001),
        (&["--kind", "facets", "--tol", "0.1mm"], 0.1),
        (&["--tol", "0.02mm", "--borders", "independent"], 0.02),
    ] {
        let text = converted(&file, &tool, &[options, &["--offset=-1.2mm"]].concat());
        assert!(text.contains("faces fitted within"), "{text}");
        let (range, facing) = from_cad(&tool, &file);
        let within = 1.01 * tolerance;
        assert!(range[0] > 1.2 - within && range[1] < 1.2 + within, "{options:?}: {range:?}");
        assert!(facing < -0.9, "the tool faces the sheet, and the CAD: {facing}");
    }
    converted(&file, &tool, &["--facing", "+z,60", "--offset", "0.5mm", "--tol", "0.02mm"]);
    let (code, text, errors) =
        kanagata(&["audit", tool.to_str().unwrap(), "--cad", &file, "--tol", "0.02mm"]);
    assert_eq!(code, 0, "{text}{errors}");
    assert!(text.contains("of 17 faces, offset by 0.5 mm"), "{text}");
}

#[test]
fn the_reference_surface_of_the_sheet_gives_the_distance() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("tool.json");
    let file = fixture("forming/cross_die_144.igs");
    let offset = |options: &[&str]| {
        let sheet = ["--sheet-thickness", "0.8mm"];
        converted(&file, &tool, &[options, &sheet[..]].concat());
        read(&tool).unwrap().provenance.offset_mm
    };
    // The normals of this die point up: it is below the sheet.
    assert_eq!(offset(&["--reference", "lower"]), None);
    assert_eq!(offset(&["--reference", "middle"]), Some(-0.4));
    assert_eq!(offset(&["--reference", "upper"]), Some(-0.8));
    assert_eq!(offset(&["--reference", "lower", "--flip"]), Some(0.8));
    assert_eq!(offset(&["--reference", "middle", "--sheet-side=-z"]), Some(0.4));
}

#[test]
fn folds_sharp_edges_and_options_that_do_not_fit_are_refused() {
    let die = fixture("forming/square_die_144.igs");
    let said = refused(&die, &["--offset=-5.5mm"]);
    for part in ["folds on", "radius 5.0000 mm", "at (", "face ", "try: a smaller --offset"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let cylinder = fixture("forming/cylinder_144.igs");
    let said = refused(&cylinder, &["--offset", "0.8mm"]);
    for part in ["2 sharp edges", "90.0 degrees", "opens", "try: --faces"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // The side alone has no sharp edge.
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("side.tool.json");
    converted(&cylinder, &tool, &["--offset", "0.8mm", "--faces", "0"]);
    assert!(refused(&die, &["--offset", "0"]).contains("other than zero"));
    assert!(
        refused(&die, &["--offset", "1", "--mesher", "gmsh"])
            .contains("--mesher gmsh with an offset")
    );
    let both = ["--offset", "1", "--reference", "middle", "--sheet-thickness", "1"];
    assert!(refused(&die, &both).contains("cannot be used with"));
    assert!(refused(&die, &["--reference", "middle"]).contains("--sheet-thickness"));
    let strip = fixture("seeds/strip.stl");
    assert!(refused(&strip, &["--offset", "1"]).contains("--offset or --reference with the mesh"));
    let bezier = fixture("seeds/bezier.tool.json");
    let said = refused(&bezier, &["--to", "nagata", "--offset", "1"]);
    assert!(said.contains("--offset or --reference with --to"), "{said}");
}
