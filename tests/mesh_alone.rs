//! `kanagata convert` on meshes without CAD, audited against the CAD that they came from.

mod command;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use command::{fixture, kanagata};
use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::tool::file::read;
use kanagata::{cad, mesh};

/// Largest error of the die with four divisions of a quarter turn and normals from the CAD [mm] (docs/results/main-job.md).
const WITH_CAD: f64 = 0.02611;

fn die() -> PathBuf {
    fixture("cross/die.igs").into()
}

fn done(arguments: &[&str]) -> String {
    let (code, text, errors) = kanagata(arguments);
    assert_eq!(code, 0, "{arguments:?}: {errors}");
    text
}

/// The audit against the die, its patches put on the faces nearest to them.
fn audited(tool: &Path) -> AuditReport {
    let model = cad::read(&die()).unwrap().0;
    let reference = CadReference::new(&model);
    let mut tool = read(tool).unwrap().model;
    tool.faces = reference.faces_of(&tool);
    audit(&tool, &reference, &AuditOptions::default()).unwrap().report
}

/// The vertices and normals of a tool as OBJ: every fourth element the wrong way round.
fn obj(made: &kanagata::tool::ToolModel) -> String {
    let mut obj = String::new();
    for p in &made.vertices {
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for n in &made.normals {
        writeln!(obj, "vn {} {} {}", n.x, n.y, n.z).unwrap();
    }
    for (k, corners) in made.corners.iter().enumerate() {
        let pairs = corners.vertices.iter().zip(&corners.normals);
        let mut words: Vec<String> = pairs.map(|(v, n)| format!("{}//{}", v + 1, n + 1)).collect();
        if k % 4 == 3 {
            words.reverse();
        }
        writeln!(obj, "f {}", words.join(" ")).unwrap();
    }
    obj
}

#[test]
fn normals_of_the_file_make_the_tool_that_the_cad_makes_and_estimated_ones_a_worse_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let text = |name: &str| path(name).to_str().unwrap().to_owned();
    let cad_file = die();
    done(&["mesh", cad_file.to_str().unwrap(), "-o", &text("die.vtu")]);
    done(&["convert", cad_file.to_str().unwrap(), "-o", &text("cad.tool.json")]);
    let made = read(&path("cad.tool.json")).unwrap().model;

    std::fs::write(path("die.obj"), obj(&made)).unwrap();
    let said = done(&["convert", &text("die.obj"), "-o", &text("given.tool.json")]);
    assert!(said.contains("normals of corners from the file, 0 estimated"), "{said}");
    let given = audited(&path("given.tool.json"));
    assert!((given.worst_mm() - WITH_CAD).abs() < 2e-5, "{}", given.worst_mm());
    assert_eq!((given.patches, given.folded.len()), (92, 0));

    // From vertices alone: twelve times the error, and less than with facets.
    let said = done(&["convert", &text("die.vtu"), "-o", &text("own.tool.json")]);
    assert!(said.contains("0 normals of corners from the file, 362 estimated"), "{said}");
    let own = audited(&path("own.tool.json"));
    println!("estimated: {} mm, given: {} mm", own.worst_mm(), given.worst_mm());
    assert!((0.30..0.35).contains(&own.worst_mm()), "{}", own.worst_mm());
    assert!(own.folded.is_empty());

    // The program's own audit says the same, and that the file is another.
    let json = text("audit.json");
    let arguments = ["audit", &text("own.tool.json"), "--cad", cad_file.to_str().unwrap()];
    let (code, _, errors) = kanagata(&[&arguments[..], &["--json", &json]].concat());
    assert!(
        code == 0 && errors.contains("each patch is put on the face nearest to it"),
        "{errors}"
    );
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(report["max_mm"].as_f64(), Some(own.max_mm));
}

/// A mesh of triangles as STL, without normals.
fn stl(triangles: &mesh::SurfaceMesh) -> String {
    let mut stl = String::from("solid die\n");
    for element in &triangles.elements {
        stl += "facet normal 0 0 0\nouter loop\n";
        for p in triangles.corners(element) {
            writeln!(stl, "vertex {} {} {}", p.x, p.y, p.z).unwrap();
        }
        stl += "endloop\nendfacet\n";
    }
    stl += "endsolid die\n";
    stl
}

#[test]
fn stl_becomes_facets_and_what_needs_cad_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let model = cad::read(&die()).unwrap().0;
    let options =
        mesh::mapped::MappedOptions { arc_divisions: 4, ..mesh::mapped::MappedOptions::default() };
    let triangles = mesh::mapped::mesh(&model, &options).unwrap().to_triangles();
    std::fs::write(path("die.stl"), stl(&triangles)).unwrap();
    let said = done(&[
        "convert",
        &path("die.stl"),
        "-o",
        &path("flat.tool.json"),
        "--kind",
        "facets",
        "--sheet-side=-z",
    ]);
    assert!(said.contains("turned round"), "{said}");
    let tool = read(Path::new(&path("flat.tool.json"))).unwrap();
    assert_eq!(tool.model.patches.len(), triangles.elements.len());
    assert_eq!(tool.provenance.mesher, "mesh file without CAD, normals estimated crease-deg=40");

    for wrong in [
        &["--tol", "0.01mm"][..],
        &["--patches", "100"],
        &["--kind", "bezier"],
        &["--edge", "cad"],
        &["--mesher", "gmsh"],
        &["--mesh", "other.stl"],
    ] {
        let (file, out) = (path("die.stl"), path("none.tool.json"));
        let all = [&["convert", &file, "-o", &out][..], wrong].concat();
        let (code, _, errors) = kanagata(&all);
        assert_eq!(code, 2, "{wrong:?}: {errors}");
        assert!(errors.contains("allowed: with an IGES or STEP file"), "{wrong:?}: {errors}");
    }
}

#[test]
fn the_angle_of_creases_goes_with_a_mesh_alone() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("none.tool.json");
    let (cad, out) = (fixture("cross/die.igs"), out.to_str().unwrap());
    let (code, _, errors) = kanagata(&["convert", &cad, "-o", out, "--crease-deg", "30"]);
    assert!(code == 2 && errors.contains("--crease-deg with a CAD file"), "{errors}");
    let (code, _, errors) = kanagata(&["convert", "none.stl", "-o", out, "--crease-deg=-3"]);
    assert!(code == 2 && errors.contains("--crease-deg"), "{errors}");
}
