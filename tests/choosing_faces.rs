//! Bodies, names, layers and colours of CAD files, and commands for chosen faces.

mod command;

use std::collections::BTreeSet;
use std::path::Path;

use command::{fixture, kanagata};
use kanagata::audit::AuditReport;
use kanagata::cad;
use kanagata::cad::attributes::BodyKind;
use kanagata::tool::file::read;
use serde_json::Value;

fn press(name: &str) -> cad::Model {
    cad::read(Path::new(&fixture(&format!("bodies/{name}")))).unwrap().0
}

/// Path, kind, faces, colours and layers of every body.
fn bodies(model: &cad::Model) -> Vec<(String, BodyKind, usize, String, String)> {
    let body = |(b, body): (usize, &cad::attributes::Body)| {
        let own = || model.faces.iter().map(|f| &f.attributes).filter(|a| a.body == b);
        let colours: BTreeSet<_> =
            own().filter_map(|a| a.colour).map(cad::attributes::colour_text).collect();
        let layers: BTreeSet<_> =
            own().flat_map(|a| a.layers.iter().map(ToString::to_string)).collect();
        let list = |set: BTreeSet<String>| set.into_iter().collect::<Vec<_>>().join(" ");
        (body.path_text(), body.kind, own().count(), list(colours), list(layers))
    };
    model.bodies.iter().enumerate().map(body).collect()
}

#[test]
fn a_step_assembly_has_a_body_for_every_occurrence_with_names_layers_and_colours() {
    let model = press("press.stp");
    let expected = [
        ("press/die/die block", BodyKind::Solid, 6, "#ff0000 #ff8000", "contact lower"),
        ("press/binder/binder left/binder skin", BodyKind::Shell, 5, "", "lower"),
        ("press/binder/binder right/binder skin", BodyKind::Shell, 5, "", "lower"),
        ("press/punch/punch.1", BodyKind::Solid, 6, "#0000ff", "contact upper"),
    ];
    let expected = expected.map(|(p, k, n, c, l)| (p.to_owned(), k, n, c.to_owned(), l.to_owned()));
    assert_eq!(bodies(&model), expected);
    let named = model.faces.iter().filter_map(|f| f.attributes.name.as_deref());
    assert_eq!(named.collect::<Vec<_>>(), ["die face", "punch face"]);
}

#[test]
fn loose_iges_surfaces_are_bodies_where_they_are_connected() {
    let model = press("press.igs");
    let expected = [("#ff0000", "10"), ("", "20 holding"), ("#ff8000", "30 31")];
    let expected =
        expected.map(|(c, l)| (String::new(), BodyKind::Faces, 6, c.to_owned(), l.to_owned()));
    assert_eq!(bodies(&model), expected);
    let name = |f: usize| model.faces[f].attributes.name.as_deref();
    assert_eq!(
        [name(0), name(1), name(7), name(12)],
        [Some("DIE.1"), Some("die face"), Some("BINDER.2"), None]
    );
    let solid = cad::read(Path::new(&fixture("forming/round_die_186.igs"))).unwrap().0;
    assert_eq!(solid.bodies.len(), 1);
}

fn ok(arguments: &[&str]) -> String {
    let (code, text, errors) = kanagata(arguments);
    assert_eq!(code, 0, "{arguments:?}: {text}{errors}");
    text
}

#[test]
fn inspect_answers_in_twenty_lines_and_lists_the_tree_on_request() {
    let file = fixture("bodies/press.stp");
    let text = ok(&["inspect", &file]);
    println!("{text}");
    assert!(text.lines().count() <= 20 && !text.contains("ADVANCED_FACE"));
    for part in [
        "4: 2 solids, 2 shells",
        "faces       22: 22 plane",
        "100.0000 x 80.0000 x 80.0000 mm",
        "health      not sound: 8 free edges",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(ok(&["inspect", &file, "--entities"]).contains("17 x ADVANCED_FACE"));
    let tree = ok(&["inspect", &file, "--tree", "--list"]);
    println!("{tree}");
    for part in [
        "1  press/die/die block: closed solid, 6 faces 0-5, 23200.000 mm2",
        "2  press/binder/binder left/binder skin: open shell, 5 faces 6-10",
        "contact: 2 faces 1,16",
        "#0000ff blue: 6 faces 16-21",
        "none: 10 faces 6-15",
        "'die face': plane, body 1, 8000.000 mm2, layer contact, #ff8000",
    ] {
        assert!(tree.contains(part), "{part}: {tree}");
    }
    let json: Value =
        serde_json::from_str(&ok(&["inspect", &file, "--json", "--tree", "--bodies", "punch"]))
            .unwrap();
    assert_eq!((json["faces"].as_u64(), json["bodies"].as_u64()), (Some(6), Some(1)));
    assert_eq!(json["tree"]["faces"][0]["number"], 16);
    assert_eq!(json["tree"]["bodies"][0]["closed"], true);
}

#[test]
fn many_notes_of_a_kind_are_one_line() {
    let text = std::fs::read_to_string(fixture("bodies/press.stp")).unwrap();
    let bad = text.replace("#10=VERTEX_POINT('',#9)", "#10=VERTEX_POINT('',#99999)");
    assert_ne!(bad, text);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.stp");
    std::fs::write(&path, bad).unwrap();
    let text = ok(&["inspect", path.to_str().unwrap()]);
    println!("{text}");
    assert!(text.lines().count() <= 20 && text.contains("skipped     3 faces, the first #"));
    assert!(text.contains("not sound: 3 lost faces"));
}

#[test]
fn a_tool_of_chosen_faces_is_audited_against_these() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cad_file, tool, json) =
        (fixture("bodies/press.stp"), at("die.tool.json"), at("die.audit.json"));
    ok(&[
        "convert",
        &cad_file,
        "-o",
        &tool,
        "--bodies",
        "die,binder left",
        "--facing",
        "-z",
        "--sheet-side",
        "+z",
    ]);
    let loaded = read(Path::new(&tool)).unwrap();
    let faces: BTreeSet<u32> = loaded.model.faces.iter().copied().collect();
    assert_eq!(faces, BTreeSet::from([0, 6]));
    let selection = loaded.provenance.selection.unwrap();
    assert_eq!(selection.bodies, ["die", "binder left"]);
    assert_eq!(selection.facing.unwrap().direction, [0.0, 0.0, -1.0]);
    let text = ok(&["audit", &tool, "--cad", &cad_file, "--json", &json, "--tol", "1e-6"]);
    assert!(text.contains("made from 2 of 22 faces"), "{text}");
    let report: AuditReport = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert!(report.worst_mm() < 1e-9 && report.borders.deviation_mm() < 1e-6, "{report:?}");
    // Without the choice the border of the chosen faces is that of solids: not free.
    let file: Value = serde_json::from_slice(&std::fs::read(&tool).unwrap()).unwrap();
    assert_eq!(file["provenance"]["selection"]["bodies"][1], "binder left");
}

/// The floor of the binder is also that of an excluded body: its points are compared with the chosen face only.
#[test]
fn faces_that_are_not_chosen_do_not_hide_errors() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cad_file, tool, json) =
        (fixture("bodies/press.stp"), at("die.tool.json"), at("die.audit.json"));
    ok(&["convert", &cad_file, "-o", &tool, "--faces", "die face"]);
    let text = std::fs::read_to_string(&tool).unwrap();
    // The vertices at z = 20 moved to z = 30, onto the floor of the binder.
    let mut file: Value = serde_json::from_str(&text).unwrap();
    for vertex in file["vertices"].as_array_mut().unwrap() {
        vertex[2] = 30.0.into();
    }
    std::fs::write(&tool, file.to_string()).unwrap();
    let (code, said, errors) =
        kanagata(&["audit", &tool, "--cad", &cad_file, "--json", &json, "--tol", "1mm"]);
    assert_eq!(code, 1, "{said}{errors}");
    let report: AuditReport = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert!((report.max_mm - 10.0).abs() < 1e-9 && (report.min_mm - 10.0).abs() < 1e-9, "{said}");
    assert_eq!(report.worst[0].face, 1);
}

#[test]
fn meshes_have_the_numbers_of_the_whole_file_and_errors_name_what_is_near() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("punch.msh");
    let (file, out) = (fixture("bodies/press.igs"), mesh.to_str().unwrap().to_owned());
    ok(&["mesh", &file, "-o", &out, "--layers", "31"]);
    let found = kanagata::mesh::io::read(&mesh).unwrap();
    let faces: BTreeSet<u32> = found.elements.iter().map(|e| e.face).collect();
    assert_eq!(faces.len(), 6);
    let (code, _, errors) = kanagata(&["mesh", &file, "-o", &out, "--bodies", "7"]);
    assert!(
        code == 2 && errors.contains("numbers: 1 to 3") && errors.contains("inspect FILE --tree"),
        "{errors}"
    );
    let (code, _, errors) =
        kanagata(&["mesh", &file, "-o", &out, "--bodies", "1", "--mesher", "gmsh"]);
    assert!(code == 2 && errors.contains("--mesher gmsh with a choice of faces"), "{errors}");
}

#[test]
fn split_makes_a_tool_file_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tools");
    let text =
        ok(&["split", &fixture("bodies/press.stp"), "-o", out.to_str().unwrap(), "--tol", "0.1mm"]);
    println!("{text}");
    assert_eq!(text.lines().count(), 4);
    let expected = [("die block", 6), ("binder skin", 5), ("binder skin-2", 5), ("punch.1", 6)];
    for (k, (name, faces)) in expected.iter().enumerate() {
        let name = name.replace(' ', "-");
        let loaded = read(&out.join(format!("{name}.tool.json"))).unwrap();
        assert_eq!(loaded.model.name, name);
        assert_eq!(loaded.model.faces.iter().collect::<BTreeSet<_>>().len(), *faces);
        assert_eq!(loaded.provenance.selection.unwrap().bodies, [(k + 1).to_string()]);
        assert!(loaded.provenance.shape_error_mm.unwrap() < 1e-6);
    }
    let up = folder.path().join("up");
    let text =
        ok(&["split", &fixture("bodies/press.stp"), "-o", up.to_str().unwrap(), "--facing", "+z"]);
    assert_eq!(text.lines().count(), 2, "open binders have no top: {text}");
}

/// Area of a tool made from the faces of the press inside or outside a region, and its audit.
fn area_of(region: &[&str]) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (cad_file, tool, json) =
        (fixture("bodies/press.stp"), at("die.tool.json"), at("audit.json"));
    ok(&[&["convert", &cad_file, "-o", &tool, "--faces", "die face", "--tol", "0.001mm"], region]
        .concat());
    ok(&["audit", &tool, "--cad", &cad_file, "--json", &json, "--tol", "0.002"]);
    let report: AuditReport = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert!(report.doubts.is_empty(), "{:?}", report.doubts);
    report.area_mm2
}

#[test]
fn regions_are_points_tables_and_curves_of_cad_files() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("region.csv");
    std::fs::write(&table, "x,y\n10,10\n60,10\n60,50\n10,50\n").unwrap();
    let table = table.to_str().unwrap();
    for region in ["10,10 60,10 60,50 10,50", table] {
        assert!((area_of(&["--within", region]) - 2000.0).abs() < 1e-6, "{region}");
        assert!((area_of(&["--outside", region]) - 6000.0).abs() < 1e-6, "{region}");
    }
    let circle = std::f64::consts::PI * 144.0;
    for file in ["bodies/circle.igs", "bodies/circle.stp"] {
        let region = fixture(file);
        let found = area_of(&["--within", &region]);
        assert!((found - circle).abs() < 1e-3 * circle, "{file}: {found} of {circle}");
        let ring = area_of(&["--outside", &region, "--within", "30,20 70,20 70,60 30,60"]);
        assert!((ring - 1600.0 + circle).abs() < 1e-3 * circle, "{file}: {ring}");
    }
}

#[test]
fn regions_that_cannot_be_used_are_errors_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.msh").to_str().unwrap().to_owned();
    let asked = |region: &str| {
        let (code, _, errors) =
            kanagata(&["mesh", &fixture("bodies/press.stp"), "-o", &out, "--within", region]);
        (code, errors)
    };
    let (code, errors) = asked("no-such-region.csv");
    assert!(code == 4 && errors.contains("no-such-region.csv"), "{errors}");
    let (code, errors) = asked("0,0 10,10 10,0 0,5");
    assert!(code == 2 && errors.contains("crosses itself"), "{errors}");
    let (code, errors) = asked("500,0 510,0 510,10");
    assert!(code == 2 && errors.contains("no face is inside the curve"), "{errors}");
    let (code, errors) = asked(&fixture("forming/cone_AP214.stp"));
    assert!(code == 2 && errors.contains("0 curves"), "{errors}");
    let (code, errors) = asked(&fixture("bodies/press.stp"));
    assert!(code == 2 && errors.contains("an assembly, whose placements"), "{errors}");
}
