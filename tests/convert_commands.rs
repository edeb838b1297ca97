//! `kanagata convert` from end to end: normals to a tolerance, Bezier and back, the list of straight edges, meshes in other formats.

mod command;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use command::{fixture, kanagata};
use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad;
use kanagata::convert::ConvertOptions;
use kanagata::convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata::convert::unfolded::mesh_and_convert;
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::{MappedOptions, MeshStyle};
use kanagata::mesh::{SurfaceMesh, io};
use kanagata::tool::edge::EdgeFault;
use kanagata::tool::file::read;
use kanagata::tool::{Patch, ToolKind, ToolModel};

/// A conversion that must succeed: its output, errors and tool.
fn converted(file: &str, out: &Path, options: &[&str]) -> (String, String, ToolModel) {
    let asked = [&["convert", file, "-o", out.to_str().unwrap()], options].concat();
    let (code, text, errors) = kanagata(&asked);
    assert_eq!(code, 0, "{options:?}: {errors}");
    (text, errors, read(out).unwrap().model)
}

fn audited(tool: &ToolModel, cad_file: &str) -> AuditReport {
    let model = cad::read(Path::new(cad_file)).unwrap().0;
    audit(tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report
}

/// A tolerance that is not reached in the time is a doubt: the tool is written, with its error.
#[test]
fn a_tolerance_not_reached_in_time_is_a_doubt_and_the_tool_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (die, out) = (fixture("cross/die.igs"), folder.path().join("die.tool.json"));
    let asked = ["convert", &die, "-o", out.to_str().unwrap(), "--tol", "1e-7mm", "--time", "1ms"];
    let (code, text, errors) = kanagata(&asked);
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("doubt tolerance-exceeded: The tool deviates by"), "{errors}");
    assert!(errors.contains("The search for a finer model ended at its limit of work or time."));
    let error_mm = audited(&read(&out).unwrap().model, &die).worst_mm();
    assert!(errors.contains(&format!("deviates by {error_mm:.5} mm")), "{error_mm}: {errors}");
    assert!(text.contains("die.tool.json"), "{text}");
    let accepted = [&asked[..], &["--accept-doubts"]].concat();
    assert_eq!(kanagata(&accepted).0, 0);
    let (code, _, errors) = kanagata(&["convert", &die, "-o", "x.tool.json", "--time", "1s"]);
    assert!(code == 2 && errors.contains("--time without --tol"), "{errors}");
}

/// A looser tolerance on the position alone leaves normals 1.2 and 3.3 degrees off (docs/results/patches.md).
#[test]
fn a_normal_tolerance_is_kept_and_takes_more_patches() {
    let folder = tempfile::tempdir().unwrap();
    let (die, out) = (fixture("cross/die.igs"), folder.path().join("die.tool.json"));
    let asked = |options: &[&str]| {
        let (text, _, tool) = converted(&die, &out, options);
        println!("{options:?}: {text}");
        audited(&tool, &die)
    };
    let position = asked(&["--tol", "0.1mm"]);
    let both = asked(&["--tol", "0.1mm", "--normal-tol", "0.5deg"]);
    let normal = asked(&["--normal-tol", "0.5deg"]);
    assert!(position.normal_max_deg > 1.0 && position.worst_mm() <= 0.1);
    assert!(both.normal_max_deg <= 0.5 && both.worst_mm() <= 0.1, "{}", both.normal_max_deg);
    assert!(normal.normal_max_deg <= 0.5, "{}", normal.normal_max_deg);
    assert!(both.patches > position.patches && normal.patches > position.patches);
}

#[test]
fn the_library_keeps_a_normal_tolerance_too() {
    let file = fixture("forming/square_die_144.igs");
    let model = cad::read(Path::new(&file)).unwrap().0;
    let refined = |normal_deg: f64| {
        let goal = Goal { tol_mm: 0.5, normal_deg, two_sided: true, borders: Borders::Conforming };
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap().tool
    };
    let mut patches = 0;
    for normal_deg in [f64::INFINITY, 2.0, 0.5] {
        let tool = refined(normal_deg);
        let found = audited(&tool, &file);
        println!("{normal_deg}: {} patches, {:.3} deg", found.patches, found.normal_max_deg);
        assert!(found.normal_max_deg <= normal_deg && found.worst_mm() <= 0.5);
        assert!(found.patches > patches, "{normal_deg}: {} of {patches}", found.patches);
        assert!(normal_deg < 2.5 || found.normal_max_deg > 2.0);
        patches = found.patches;
    }
}

/// Largest distance between points of the same patches at the same parameters [mm].
fn apart(one: &ToolModel, other: &ToolModel) -> f64 {
    assert_eq!(one.patches.len(), other.patches.len());
    let mut most = 0.0f64;
    for (a, b) in one.patches.iter().zip(&other.patches) {
        assert_eq!(a.sides(), b.sides());
        for k in 0..49 {
            let (e, z) = (f64::from(k / 7) / 6.0, f64::from(k % 7) / 6.0);
            if a.sides() == 4 || z <= e {
                most = most.max((a.derivs(e, z).s - b.derivs(e, z).s).norm());
            }
        }
    }
    most
}

/// Triangles of the one become degenerate quadrilaterals of the other and triangles again, or stay what they are.
#[test]
fn bezier_and_back_gives_the_same_patches() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (style, edge) in
        [("structured", "guarded"), ("structured", "cad"), ("triangles", "guarded")]
    {
        let (first, bezier, back) =
            (at("die.tool.json"), at("bezier.tool.json"), at("back.tool.json"));
        let die = fixture("cross/die.igs");
        let options = ["--style", style, "--edge", edge, "--arc-divisions", "3"];
        let (_, _, nagata) = converted(&die, &first, &options);
        let (text, _, middle) = converted(first.to_str().unwrap(), &bezier, &["--to", "bezier"]);
        assert!(text.starts_with(&format!("{} patches\n", nagata.patches.len())), "{text}");
        assert_eq!((middle.kind, &middle.faces), (ToolKind::Bezier, &nagata.faces));
        let (text, _, again) = converted(bezier.to_str().unwrap(), &back, &["--to", "nagata"]);
        println!("{style} {edge}: {text}");
        assert_eq!((again.kind, &again.faces), (ToolKind::Nagata, &nagata.faces));
        let said = text.split("largest discrepancy ").nth(1).unwrap().split(" mm, on patch ");
        let said: f64 = said.into_iter().next().unwrap().parse().unwrap();
        let found = apart(&nagata, &again);
        assert!(found < 1e-11 && said < 1e-11, "{style} {edge}: {found:e} mm, said {said:e}");
        let found = audited(&again, &die);
        assert!((found.worst_mm() - audited(&nagata, &die).worst_mm()).abs() < 1e-11);
    }
}

/// Each line is an edge that the library made straight, with its patches, place and reason.
#[test]
fn straight_edges_are_listed_with_patches_place_and_reason() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.tool.json");
    for (file, style, reason) in [
        ("forming/cone_144.igs", MeshStyle::Structured, EdgeFault::TurnsBack),
        ("forming/torus_144.igs", MeshStyle::Triangles, EdgeFault::Folds),
    ] {
        let (file, name) = (fixture(file), format!("{style:?}").to_lowercase());
        let options = ["--arc-divisions", "1", "--style", &name];
        let (_, errors, tool) = converted(&file, &out, &options);
        let model = cad::read(Path::new(&file)).unwrap().0;
        let mesh = MappedOptions { arc_divisions: 1, style, ..MappedOptions::default() };
        let report = mesh_and_convert(&model, &mesh, &ConvertOptions::default()).unwrap().1;
        let expected = report.straight.iter().map(|edge| {
            let ([a, b], patches) = (edge.vertices, &edge.patches[..]);
            let p = (tool.vertices[a as usize] + tool.vertices[b as usize]) * 0.5;
            let patches: Vec<String> = patches.iter().map(u32::to_string).collect();
            format!(
                "warning: edge {a}-{b} of patches {} near ({:.3}, {:.3}, {:.3}) mm: straight; {}",
                patches.join(", "),
                p.x,
                p.y,
                p.z,
                edge.fault
            )
        });
        println!("{errors}");
        let more = report.straight.len().saturating_sub(8);
        let last = format!("warning: and {more} more edges: straight");
        let expected = expected.take(8).chain((more > 0).then_some(last));
        assert_eq!(errors.lines().collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        assert!(report.straight.len() >= 3);
        assert!(report.straight.iter().all(|edge| edge.fault == reason));
        for edge in &report.straight {
            let [a, b] = edge.vertices;
            for &k in &edge.patches {
                let corners = &tool.corners[k as usize].vertices;
                let at = |v: u32| corners.iter().position(|&c| c == v).unwrap();
                assert!(bend(&tool.patches[k as usize], at(a), at(b)) < 1e-12, "{edge:?}");
            }
        }
    }
}

/// How far the middle of the side between two corners is off its chord [mm].
fn bend(patch: &Patch, a: usize, b: usize) -> f64 {
    let place = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let at = |e: f64, z: f64| patch.derivs(e, z).s;
    let ([e, z], [f, y]) = (place[a], place[b]);
    (at(0.5 * (e + f), 0.5 * (z + y)) - (at(e, z) + at(f, y)) * 0.5).norm()
}

fn obj(mesh: &SurfaceMesh) -> String {
    let mut text = String::from("# written by a test\n");
    mesh.vertices.iter().for_each(|p| writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap());
    for e in &mesh.elements {
        let ids: Vec<String> = e.nodes().iter().map(|n| format!("{}", n + 1)).collect();
        writeln!(text, "f {}", ids.join(" ")).unwrap();
    }
    text
}

fn text_stl(mesh: &SurfaceMesh) -> String {
    let mut text = String::from("solid die\n");
    for e in &mesh.to_triangles().elements {
        text += "facet normal 0 0 0\nouter loop\n";
        mesh.corners(e)
            .iter()
            .for_each(|p| writeln!(text, "vertex {} {} {}", p.x, p.y, p.z).unwrap());
        text += "endloop\nendfacet\n";
    }
    text + "endsolid die\n"
}

fn binary_stl(mesh: &SurfaceMesh) -> Vec<u8> {
    let triangles = mesh.to_triangles().elements;
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for e in &triangles {
        bytes.extend([0; 12]);
        let points = mesh.corners(e);
        let numbers = points.iter().flat_map(|p| [p.x, p.y, p.z]);
        bytes.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A mesh of the die written by `kanagata mesh`, and the same in a format that names no faces: they are found again, and the tool is
/// the same but for the rounding of its coordinates.
fn reattached(style: &str, ending: &str, write: impl Fn(&SurfaceMesh, &Path), rounding: f64) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (die, msh, other) = (fixture("cross/die.igs"), at("die.msh"), at(&format!("die.{ending}")));
    let meshed = ["mesh", &die, "-o", msh.to_str().unwrap(), "--style", style];
    assert_eq!(kanagata(&meshed).0, 0);
    write(&io::read(&msh).unwrap(), &other);
    let made = |mesh: &Path| {
        let options = ["--mesh", mesh.to_str().unwrap(), "--sheet-side=+z"];
        let (_, _, tool) = converted(&die, &at("die.tool.json"), &options);
        let found = audited(&tool, &die);
        assert!(found.folded.is_empty() && found.jumps.open_sides == 0, "{ending}");
        (tool, found)
    };
    let ((one, first), (two, second)) = (made(&msh), made(&other));
    println!("{ending}: {} patches, {} {}", second.patches, first.worst_mm(), second.worst_mm());
    let numbers = |tool: &ToolModel| {
        let places = tool.faces.iter().zip(&tool.corners).map(|(f, c)| {
            let sum: Vec3 = c.vertices.iter().map(|&v| tool.vertices[v as usize]).sum();
            (*f, [sum.x, sum.y, sum.z].map(|x| (x * 1e3).round() as i64))
        });
        places.collect::<BTreeSet<_>>()
    };
    assert_eq!(numbers(&one), numbers(&two), "{ending}: the same elements on the same faces");
    assert!((first.worst_mm() - second.worst_mm()).abs() <= rounding);
    assert!((first.rms_mm - second.rms_mm).abs() <= rounding);
    assert!(first.worst_mm() < 0.04);
}

#[test]
fn an_obj_mesh_becomes_the_same_tool() {
    reattached("structured", "obj", |mesh, path| std::fs::write(path, obj(mesh)).unwrap(), 1e-9);
}

#[test]
fn an_stl_mesh_becomes_the_same_tool_in_text_and_binary() {
    let text = |mesh: &SurfaceMesh, path: &Path| std::fs::write(path, text_stl(mesh)).unwrap();
    reattached("triangles", "stl", text, 1e-9);
    let binary = |mesh: &SurfaceMesh, path: &Path| std::fs::write(path, binary_stl(mesh)).unwrap();
    reattached("triangles", "stl", binary, 1e-5);
}

#[test]
fn a_vtu_mesh_becomes_the_same_tool() {
    reattached("structured", "vtu", |mesh, path| io::write(mesh, path).unwrap(), 1e-9);
    // From another program: no array says which face an element is on.
    let bare = |mesh: &SurfaceMesh, path: &Path| {
        let mut grid = io::to_vtu(mesh);
        grid.cell_data.clear();
        grid.write(path).unwrap();
    };
    reattached("structured", "vtu", bare, 1e-9);
}
