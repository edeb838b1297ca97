use std::fs;
use std::os::unix::fs::PermissionsExt;

use super::*;
use crate::mapped::{MappedOptions, MeshStyle};
use kanagata_cad::model::SurfaceKind;
use kanagata_geometry::Vec3;

/// One script at a time: a file that is open while another process starts cannot be executed.
static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// A shell script in place of gmsh.
fn stand_in(folder: &Path, script: &str) -> PathBuf {
    let program = folder.join("gmsh");
    fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    program
}

/// Runs a shell script in place of gmsh on a small file.
fn run_script(script: &str, limit_s: f64) -> Result<SurfaceMesh, MeshError> {
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let program = stand_in(folder.path(), script);
    let cad = folder.path().join("part.step");
    fs::write(&cad, "ISO-10303-21;").unwrap();
    let options = GmshOptions { limit_s, ..GmshOptions::default() };
    Run::new(&program, &cad, folder.path(), &options, 1e-4)?.surfaces(&Plan::default())
}

fn fixture(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/forming").join(file)
}

fn model(file: &str) -> Model {
    kanagata_cad::read(&fixture(file)).unwrap().0
}

/// Error of meshing a part with a script that produces `mesh`.
fn outcome_of(mesh: &SurfaceMesh, file: &str) -> MeshError {
    result_of(mesh, file).unwrap_err()
}

/// Result of meshing a part with a script that produces `mesh`.
fn result_of(mesh: &SurfaceMesh, file: &str) -> Result<GmshMesh, MeshError> {
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let given = folder.path().join("given.msh");
    crate::io::write(mesh, &given).unwrap();
    let program = stand_in(folder.path(), &format!("cp '{}' out.msh", given.display()));
    let options =
        GmshOptions { program: Some(program), style: MeshStyle::Quads, ..GmshOptions::default() };
    super::mesh(&fixture(file), &model(file), &options)
}

#[test]
fn exit_code_zero_without_a_mesh_is_a_failure_with_the_log() {
    let bad = run_script("echo Error: surface 3 is impossible; exit 0", 20.0).unwrap_err();
    let text = bad.to_string();
    assert!(text.contains("wrote no file") && text.contains("surface 3"), "{text}");
    let empty = "printf '$MeshFormat\\n4.1 0 8\\n$EndMeshFormat\\n' > out.msh";
    let text = run_script(empty, 20.0).unwrap_err().to_string();
    assert!(text.contains("no surface elements"), "{text}");
}

#[test]
fn long_lines_of_the_log_are_cut() {
    let bad =
        run_script("head -c 300000 /dev/zero | tr '\\0' x; echo; echo end", 20.0).unwrap_err();
    let text = bad.to_string();
    assert!(text.len() < 1000 && text.ends_with("x\n  end"), "{}", text.len());
}

#[test]
fn a_program_that_hangs_is_killed() {
    let text = run_script("exec sleep 60", 0.2).unwrap_err().to_string();
    assert!(text.contains("stopped after 0.2 s") && text.contains("`limit_s`"), "{text}");
}

#[test]
fn the_part_is_handed_over_under_its_formats_ending() {
    let text = run_script("cat part.geo; ls; echo \"$@\"", 20.0).unwrap_err().to_string();
    assert!(text.contains("Merge \"cad.stp\";") && text.contains("\n  cad.stp"), "{text}");
    assert!(text.contains("part.geo -2 -format msh41 -o out.msh"), "{text}");
    assert!(text.contains("Mesh.MeshSizeFromCurvature 16"), "{text}");
}

#[test]
fn a_missing_program_is_named_with_the_remedy() {
    let text = find(Some(Path::new("no/such/gmsh"))).unwrap_err().to_string();
    assert!(text.contains("no/such/gmsh") && text.contains("pip install gmsh"), "{text}");
}

#[test]
fn a_face_without_elements_is_named_with_the_remedy() {
    let model = model("cross_die_144.igs");
    let mut mesh = crate::mapped::mesh(&model, &Default::default()).unwrap();
    mesh.elements.retain(|e| e.face != 4);
    let text = outcome_of(&mesh, "cross_die_144.igs").to_string();
    let source = &model.faces[4].source;
    assert!(text.contains("1 of 15 CAD faces have no elements"), "{text}");
    assert!(text.contains(&format!("face 4 ({source})")), "{text}");
    assert!(text.contains("mesh finer or use the other mesher"), "{text}");
}

#[test]
fn an_area_that_is_off_is_named_with_the_face_and_the_remedy() {
    let model = model("cross_die_144.igs");
    let mesh = crate::mapped::mesh(&model, &Default::default()).unwrap();
    // All elements of the flat except one are removed.
    let mut holed = mesh.clone();
    let mut flat = mesh.elements.iter().filter(|e| e.face == 0).count();
    holed.elements.retain(|e| {
        e.face != 0 || {
            flat -= 1;
            flat == 0
        }
    });
    let text = outcome_of(&holed, "cross_die_144.igs").to_string();
    assert!(text.contains("area") && text.contains("most on face 0"), "{text}");
    assert!(text.contains("allowed: 5.000 %") && text.contains("mesh finer"), "{text}");
    // A wall without one of its elements: 1.7 % of the total area.
    let mut holed = mesh.clone();
    let one = holed.elements.iter().position(|e| e.face == 14).unwrap();
    holed.elements.remove(one);
    let text = outcome_of(&holed, "cross_die_144.igs").to_string();
    assert!(text.contains("face 14") && text.contains("another algorithm of gmsh"), "{text}");
}

#[test]
fn inverted_elements_are_mended_with_a_note_or_named_with_the_remedy() {
    let file = "cross_die_144.igs";
    let model = model(file);
    let options = MappedOptions { max_size: Some(8.0), ..MappedOptions::default() };
    let mesh = crate::mapped::mesh(&model, &options).unwrap();
    // A node inside a flat face is moved beyond one of its neighbours.
    let faces_at = |n: u32| -> BTreeSet<u32> {
        mesh.elements.iter().filter(|e| e.nodes().contains(&n)).map(|e| e.face).collect()
    };
    // Around a node inside, every node beside it belongs to two sides of elements there.
    let is_around = |n: u32| {
        let sides = mesh.elements.iter().flat_map(crate::Element::sides);
        let beside: Vec<u32> =
            sides.filter(|s| s.contains(&n)).map(|[a, b]| if a == n { b } else { a }).collect();
        beside.iter().all(|m| beside.iter().filter(|o| *o == m).count() == 2)
    };
    let is_flat =
        |n: u32| faces_at(n).iter().all(|&f| model.faces[f as usize].kind == SurfaceKind::Plane);
    let inside = (0..mesh.vertices.len() as u32)
        .find(|&n| faces_at(n).len() == 1 && is_flat(n) && is_around(n))
        .unwrap();
    let one = mesh.elements.iter().find(|e| e.nodes().contains(&inside)).unwrap();
    let opposite = mesh.corners(one).into_iter().map(|p| p - mesh.vertices[inside as usize]);
    let away = opposite.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap();
    let mut folded = mesh.clone();
    folded.vertices[inside as usize] += 1.2 * away;
    let made = result_of(&folded, file).unwrap();
    assert_eq!(MeshReport::new(&made.mesh, &model).inverted, 0);
    assert!(made.notes.iter().any(|n| n.contains("nodes moved on")), "{:?}", made.notes);
    // An element turned over, on nodes of which none is free.
    let mut turned = mesh.to_triangles();
    let bound = |e: &crate::Element| e.nodes().iter().all(|&n| faces_at(n).len() > 1);
    let k = turned.elements.iter().position(|e| bound(e) && e.face != 0).unwrap();
    turned.elements[k] = turned.elements[k].reversed();
    let text = outcome_of(&turned, file).to_string();
    let face = turned.elements[k].face;
    assert!(text.contains("1 of") && text.contains(&format!("most on face {face} (")), "{text}");
    assert!(text.contains("another algorithm of gmsh or a smaller size"), "{text}");
}

#[test]
fn a_time_limit_must_be_above_zero() {
    let options = GmshOptions { limit_s: 0.0, ..GmshOptions::default() };
    let text = super::mesh(&fixture("cross_die_144.igs"), &model("cross_die_144.igs"), &options);
    let text = text.unwrap_err().to_string();
    assert!(text.contains("limit_s is 0") && text.contains("above zero"), "{text}");
}

/// A square of four straight curves and a half disc of two, beside a closed curve.
fn outline() -> outline::Outline {
    let text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n5 6 3 0\n\
        1 0 0 0 0\n2 1 0 0 0\n3 1 1 0 0\n4 0 1 0 0\n5 9 0 0 0\n\
        1 0 0 0 1 0 0 0 2 1 -2\n2 1 0 0 1 1 0 0 2 2 -3\n3 0 1 0 1 1 0 0 2 4 -3\n4 0 0 0 0 1 0 0 2 1 -4\n\
        5 1 0 0 2 1 0 0 2 2 -3\n6 8 0 0 9 1 0 0 2 5 -5\n\
        1 0 0 0 1 1 0 0 4 1 2 -3 -4\n2 1 0 0 2 1 0 0 2 5 -2\n3 8 0 0 9 1 0 0 1 6\n$EndEntities\n\
        $Nodes\n2 4 1 9\n1 5 0 3\n6\n7\n8\n1.353553 0.146447 0\n1.5 0.5 0\n1.353553 0.853553 0\n\
        1 6 0 1\n9\n8 0 0\n$EndNodes\n";
    outline::parse(text.as_bytes(), "outline.msh").unwrap()
}

#[test]
fn outlines_have_turn_and_length_of_their_curves() {
    let outline = outline();
    let arc = &outline.curves[&5];
    assert_eq!((arc.ends, arc.line.len()), ([2, 3], 5));
    assert_eq!(arc.line[0], Vec3::new(1.0, 0.0, 0.0));
    assert!((arc.turn() - std::f64::consts::PI).abs() < 1e-5, "{}", arc.turn());
    assert!(outline.curves[&1].turn() == 0.0 && outline.curves[&1].length() == 1.0);
    let text = outline::parse(b"$Entities\n0 0 x", "outline.msh").unwrap_err().to_string();
    assert!(text.contains("'x'"), "{text}");
}

#[test]
fn grids_are_planned_on_single_loops_with_four_corners() {
    let options = GmshOptions { size: [None, Some(0.25)], ..GmshOptions::default() };
    let plan = Plan::new(&outline(), &options, &BTreeSet::new());
    assert_eq!(plan.grids.len(), 1);
    assert_eq!(plan.grids[0].corners, [1, 2, 3, 4]);
    assert_eq!(plan.quads(&plan.grids[0]), Some(16));
    let text = script::grids(&plan, true);
    assert!(text.contains("Transfinite Curve {2} = 5;\n"), "{text}");
    assert!(text.ends_with("Surface {1} = {1, 2, 3, 4};\nRecombine Surface {1};\n"), "{text}");
    assert!(Plan::new(&outline(), &options, &BTreeSet::from([1])).grids.is_empty());
    let none = GmshOptions { unstructured: true, ..options };
    assert_eq!(Plan::new(&outline(), &none, &BTreeSet::new()), Plan::default());
}
