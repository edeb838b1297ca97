//! `kanagata run`: tools from the CAD that a scene names, and the run.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use kanagata::prelude::{AuditOptions, Cad, Tool, make_tools};
use serde_json::{Value, json};

fn fixture(path: &str) -> String {
    format!("{}/fixtures/{path}", env!("CARGO_MANIFEST_DIR"))
}

fn kanagata(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kanagata")).args(args).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The dome on a coarse mesh, drawn by 5 mm, with tools from CAD.
fn dome(folder: &Path) -> Value {
    let mut scene: Value =
        serde_json::from_str(&fs::read_to_string(fixture("dome/dome.scene.json")).unwrap())
            .unwrap();
    scene["blank"]["shape"] = json!({"quarter_disc": {"radius_mm": 66, "core": 4, "rings": 8}});
    scene["stages"] = json!([{"name": "draw", "drive": {"punch": {"travel_mm": 5}}}]);
    for (tool, file) in [(0, "round_die_144.igs"), (1, "hemi_punch_144.igs")] {
        scene["tools"][tool]["friction"] = json!(0.1);
        scene["tools"][tool]["cad"] =
            json!({"file": fixture(&format!("forming/{file}")), "tol_mm": 0.02});
    }
    write(folder, &scene);
    scene
}

fn write(folder: &Path, scene: &Value) {
    fs::write(folder.join("dome.scene.json"), scene.to_string()).unwrap();
}

#[test]
fn a_scene_with_cad_is_converted_once_checked_and_run() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut scene = dome(folder);
    let checked = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["check", "dome.scene.json"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert_eq!(checked.status.code(), Some(2), "{}", text(&checked.stderr));
    let expected = "`kanagata run dome.scene.json -o DIR` makes the tool files";
    assert!(text(&checked.stderr).contains(expected), "{}", text(&checked.stderr));
    let args = ["run", "dome.scene.json", "-o", "out", "--accept-doubts"];
    let done = kanagata(folder, &args);
    let (out, notes) = (text(&done.stdout), text(&done.stderr));
    assert_eq!(done.status.code(), Some(0), "{notes}");
    assert!(notes.contains("note: die is made from its CAD"), "{notes}");
    assert!(out.contains("  die: ") && out.contains("shape error 0.0"), "{out}");
    assert!(out.contains("  unknowns ") && out.contains("all stages done"), "{out}");
    assert!(folder.join("out/report.html").is_file());

    let bytes = fs::read(folder.join("die.tool.json")).unwrap();
    let again = kanagata(folder, &args);
    assert!(!text(&again.stderr).contains("is made from"), "{}", text(&again.stderr));
    assert!(text(&again.stdout).contains("(as it was)"), "{}", text(&again.stdout));
    assert_eq!(fs::read(folder.join("die.tool.json")).unwrap(), bytes);

    // Another tolerance, another direction: made again.
    scene["tools"][0]["cad"]["tol_mm"] = json!(0.05);
    write(folder, &scene);
    let made = make_tools(folder.join("dome.scene.json"), &mut |_| ()).unwrap();
    assert_eq!(made.iter().map(|m| m.is_new).collect::<Vec<_>>(), [true, false]);
    assert!(made[0].tool.shape_error_mm().unwrap() <= 0.05);
}

/// The punch of the square cup as the offset of the die in one block: only the faces within reach are offset, the sharp edges
/// of the block do not matter, and an audit repeats the offset.
#[test]
fn a_punch_is_made_of_the_die_by_an_offset() {
    let folder = tempfile::tempdir().unwrap();
    let file = fixture("bodies/die-set.stp");
    let scene = json!({
        "format": "kanagata-scene", "version": 1, "name": "offset",
        "blank": {
            "shape": {"rectangle": {"size_mm": [85, 85], "corner_mm": [0, 0], "elements": [20, 20]}},
            "thickness_mm": 0.8
        },
        "material": "mild-steel-neto2012",
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "tools": [
            {"name": "die", "file": "die.tool.json", "direction": [0, 0, 1], "friction": 0.1,
                "cad": {"file": file, "bodies": ["die"], "tol_mm": 0.05}},
            {"name": "punch", "file": "punch.tool.json", "direction": [0, 0, -1], "friction": 0.1,
                "cad": {"file": file, "bodies": ["die"], "flip": true, "tol_mm": 0.05, "sheet_surface": "lower"}}
        ],
        "stages": [{"name": "draw", "drive": {"punch": {"travel_mm": 5}}}]
    });
    write(folder.path(), &scene);
    let made = make_tools(folder.path().join("dome.scene.json"), &mut |_| ()).unwrap();
    let cad = Cad::read(&file).unwrap();
    for made in &made {
        let tool = Tool::read(folder.path().join(format!("{}.tool.json", made.name))).unwrap();
        let audit = tool.audit(&cad, &AuditOptions::default()).unwrap();
        assert!(audit.report.worst_mm() <= 0.0501, "{}: {}", made.name, audit.report.worst_mm());
    }
    assert_eq!(made[0].tool.provenance().offset_mm, None);
    assert!(made[1].tool.provenance().offset_mm.unwrap().abs() == 0.8);
}

#[test]
fn what_cannot_be_made_ends_with_exit_code_2_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (key, value, expected) in [
        ("file", json!(fixture("dome/dome.scene.json")), "export the model as IGES 5.3 or STEP"),
        ("bodies", json!(["9"]), "the body '9' is not in the CAD file"),
        ("tol_mm", json!(0), "tools[0].cad.tol_mm"),
        ("sheet_surface", json!("outer"), "sheet_surface"),
        ("layer", json!(["x"]), "layer"),
    ] {
        let mut scene = dome(folder);
        scene["tools"][0]["cad"][key] = value;
        write(folder, &scene);
        let done = kanagata(folder, &["run", "dome.scene.json", "-o", "out"]);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{key}: {said}");
        assert!(said.contains(expected), "{key}: {said}");
        assert!(!folder.join("out").exists(), "{key}");
    }
    let mut scene = dome(folder);
    scene["tools"][0]["cad"]["file"] = json!("none.igs");
    write(folder, &scene);
    let done = kanagata(folder, &["run", "dome.scene.json", "-o", "out"]);
    assert_eq!(done.status.code(), Some(4), "{}", text(&done.stderr));
}
