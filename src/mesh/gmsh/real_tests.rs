//! Tests with the gmsh program, skipped where it is not installed.

use std::path::{Path, PathBuf};

use super::*;
use crate::mapped::MeshStyle;

const ALL: [GmshAlgorithm; 9] = [
    GmshAlgorithm::MeshAdapt,
    GmshAlgorithm::Automatic,
    GmshAlgorithm::InitialOnly,
    GmshAlgorithm::Delaunay,
    GmshAlgorithm::FrontalDelaunay,
    GmshAlgorithm::Bamg,
    GmshAlgorithm::FrontalQuads,
    GmshAlgorithm::Parallelograms,
    GmshAlgorithm::QuasiStructured,
];

fn is_there() -> bool {
    let found = find(None).is_ok();
    if !found {
        crate::skipping::skip(crate::skipping::GMSH);
    }
    found
}

fn part(file: &str) -> (PathBuf, Model) {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming")
        .join(file);
    let model = kanagata_cad::read(&path).unwrap().0;
    (path, model)
}

fn made(file: &str, options: &GmshOptions) -> GmshMesh {
    let (path, model) = part(file);
    super::mesh(&path, &model, options).unwrap()
}

fn quads_on(mesh: &SurfaceMesh, face: u32) -> [usize; 2] {
    let on: Vec<_> = mesh.elements.iter().filter(|e| e.face == face).collect();
    [on.iter().filter(|e| e.nodes().len() == 4).count(), on.len()]
}

#[test]
fn every_algorithm_meshes_the_cross_die() {
    if !is_there() {
        return;
    }
    let (path, model) = part("cross_die_144.igs");
    for algorithm in ALL {
        let options = GmshOptions { algorithm, per_turn: 24, ..GmshOptions::default() };
        let made = super::mesh(&path, &model, &options).unwrap();
        let report = MeshReport::new(&made.mesh, &model);
        assert!(report.area_error.abs() < 0.005, "{algorithm:?}: {}", report.area_error);
        assert_eq!((report.faces, report.inverted), (15, 0), "{algorithm:?}");
    }
}

#[test]
fn triangles_of_every_algorithm_keep_the_area_or_are_refused() {
    if !is_there() {
        return;
    }
    let (path, model) = part("cross_die_AP214.stp");
    for algorithm in ALL {
        let style = MeshStyle::Triangles;
        let options = GmshOptions { algorithm, style, per_turn: 24, ..GmshOptions::default() };
        let cuts = [GmshAlgorithm::InitialOnly, GmshAlgorithm::FrontalQuads].contains(&algorithm);
        match super::mesh(&path, &model, &options) {
            Ok(made) => {
                let report = MeshReport::new(&made.mesh, &model);
                assert!(report.area_error.abs() < 0.005, "{algorithm:?}: {}", report.area_error);
                let four = algorithm == GmshAlgorithm::QuasiStructured;
                assert!(report.quads == 0 || four, "{algorithm:?}");
            }
            Err(error) => {
                let text = error.to_string();
                assert!(
                    cuts && text.contains("another algorithm of gmsh"),
                    "{algorithm:?}: {text}"
                );
            }
        }
    }
}

#[test]
fn grids_are_quads_with_the_divisions_asked_and_conform() {
    if !is_there() {
        return;
    }
    for (file, n) in
        [("cross_die_144.igs", 4), ("cross_die_AP214.stp", 8), ("cross_die_144.igs", 1)]
    {
        let options =
            GmshOptions { per_turn: 4 * n, area_tolerance: 0.3, ..GmshOptions::default() };
        let made = made(file, &options);
        assert_eq!(made.notes, Vec::<String>::new());
        // Face 0 is the flange with eleven curves; faces 1 to 7 are fillets of 90 degrees.
        for face in 1..15 {
            let [quads, all] = quads_on(&made.mesh, face);
            assert_eq!(quads, all, "face {face}");
            assert!(face > 7 || all % n == 0, "face {face}: {all}");
        }
        assert_eq!(quads_on(&made.mesh, 1)[1], n, "a straight fillet");
        let (_, model) = part(file);
        let report = MeshReport::new(&made.mesh, &model);
        assert_eq!((report.inverted, report.irregular_sides), (0, 0));
        let mut places: Vec<_> =
            made.mesh.vertices.iter().map(|p| p.map(|x| (1e5 * x).round() as i64)).collect();
        places.sort_unstable_by_key(|p| (p.x, p.y, p.z));
        assert!(places.windows(2).all(|w| w[0] != w[1]), "vertices of faces that do not join");
    }
}

#[test]
fn sizes_from_curvature_follow_the_divisions() {
    if !is_there() {
        return;
    }
    let count = |style, per_turn| {
        let options = GmshOptions { style, per_turn, ..GmshOptions::default() };
        let made = made("cross_die_AP214.stp", &options);
        (1..8).map(|f| quads_on(&made.mesh, f)[1]).sum::<usize>() as f64
    };
    // Grids have twice the elements on straight fillets and four times on curved ones; sizes four times.
    let grids = count(MeshStyle::Structured, 32) / count(MeshStyle::Structured, 16);
    assert!((2.0..4.0).contains(&grids), "{grids}");
    let free = count(MeshStyle::Triangles, 64) / count(MeshStyle::Triangles, 32);
    assert!((3.0..5.0).contains(&free), "{free}");
}

#[test]
fn closed_faces_do_not_break_grids() {
    if !is_there() {
        return;
    }
    for file in [
        "cylinder_AP214.stp",
        "round_die_144.igs",
        "hemi_punch_144.igs",
        "torus_144.igs",
        "cone_186.igs",
    ] {
        for style in [MeshStyle::Structured, MeshStyle::Mixed] {
            let (path, model) = part(file);
            let options = GmshOptions { style, per_turn: 32, ..GmshOptions::default() };
            let mesh = super::mesh(&path, &model, &options).unwrap().mesh;
            let report = MeshReport::new(&mesh, &model);
            assert!(report.area_error.abs() < 0.02, "{file}: {}", report.area_error);
        }
    }
}

#[test]
fn a_grid_that_folds_is_given_up_with_a_note() {
    if !is_there() {
        return;
    }
    let made = made("cross_punch_144.igs", &GmshOptions::default());
    assert!(made.notes.len() == 1 && made.notes[0].contains("fold"), "{:?}", made.notes);
    let (_, model) = part("cross_punch_144.igs");
    let report = MeshReport::new(&made.mesh, &model);
    assert_eq!((report.faces, report.inverted), (15, 0));
}

#[test]
fn a_program_that_is_too_old_ends_with_a_message_and_without_a_file() {
    if !is_there() {
        return;
    }
    let program = find(None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (oldest, ends) in [(script::VERSION_MIN, false), ([999, 0], true)] {
        let text = script::version_guard(oldest) + "Point(1) = {0, 0, 0};\n";
        let path = folder.path().join("guard.geo");
        kanagata_files::write_atomic(&path, |w| w.write_all(text.as_bytes())).unwrap();
        let mut command = std::process::Command::new(&program);
        command.args(["guard.geo", "-1", "-o", "out.msh"]);
        let limit = std::time::Duration::from_secs(60);
        let outcome = crate::external::run(&mut command, folder.path(), limit).unwrap();
        let log = String::from_utf8_lossy(&outcome.log).into_owned();
        assert_eq!(log.contains("too old; allowed: 999.0 or newer"), ends, "{log}");
        assert_eq!(folder.path().join("out.msh").exists(), !ends, "{log}");
        let _ = std::fs::remove_file(folder.path().join("out.msh"));
    }
}
