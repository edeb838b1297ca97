//! Scenes that can be run and are not what they were meant to be: runs end, and say so.

mod strip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use strip::scene_in;

/// The strip, changed, drawn a little way.
fn drawn(folder: &Path, change: impl FnOnce(&Path, &mut Value)) -> PathBuf {
    scene_in(folder, |folder, scene| {
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(0.5);
        change(folder, scene);
    })
}

/// What `check` says of it.
fn checked(change: impl FnOnce(&Path, &mut Value)) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = drawn(folder.path(), change);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    let done = command.arg("check").arg(&file).output().unwrap();
    String::from_utf8(done.stdout).unwrap()
}

/// Runs it: its record.
fn run(change: impl FnOnce(&Path, &mut Value)) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let file = drawn(folder, change);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("run").arg(&file).arg("-q").arg("-o").arg(folder.join("run"));
    let done = command.output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{said}");
    let record: Value =
        serde_json::from_slice(&fs::read(folder.join("run/run.json")).unwrap()).unwrap();
    let warnings = record["warnings"].as_array().cloned().unwrap_or_default();
    warnings.iter().for_each(|w| assert!(said.contains(w.as_str().unwrap()), "{w}: {said}"));
    record
}

fn warns(record: &Value, words: &str) -> bool {
    let warnings = record["warnings"].as_array().map_or(&[][..], Vec::as_slice);
    warnings.iter().any(|w| w.as_str().unwrap().contains(words))
}

#[test]
fn a_run_with_nothing_amiss_warns_of_nothing() {
    let record = run(|_, _| {});
    assert_eq!(record["warnings"].as_array().map_or(0, Vec::len), 0, "{record}");
}

/// Gives the punch a back, 10 mm above its face, and has it touch the wrong face of the sheet.
fn with_a_closed_punch_for_the_lower_face(folder: &Path, scene: &mut Value) {
    let path = folder.join("punch.tool.json");
    let mut tool: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let mut double = |key: &str, back: fn([f64; 3]) -> [f64; 3]| {
        let all = tool[key].as_array_mut().unwrap();
        let of = |x: &Value| back(serde_json::from_value(x.clone()).unwrap());
        all.extend(all.iter().map(|x| json!(of(x))).collect::<Vec<_>>());
        all.len() / 2
    };
    let vertices = double("vertices", |[x, y, z]| [x, y, z + 10.0]);
    let normals = double("normals", |n| n.map(|x| -x));
    let patches = tool["patches"].as_array_mut().unwrap();
    let turned = |patch: &Value| {
        let of = |key: &str, first: usize| -> Vec<u64> {
            let corners = patch[key].as_array().unwrap().iter().rev();
            corners.map(|c| c.as_u64().unwrap() + first as u64).collect()
        };
        json!({"vertices": of("vertices", vertices), "normals": of("normals", normals), "face": 1})
    };
    patches.extend(patches.iter().map(turned).collect::<Vec<_>>());
    fs::write(&path, tool.to_string()).unwrap();
    let punch = &mut scene["tools"][2];
    assert_eq!(punch["name"], "punch");
    punch["side"] = json!("bottom");
    // Its face at the sheet's lower one.
    punch["place"] = json!({"shift": [0.0, 0.0, -0.8]});
}

#[test]
fn a_tool_that_touches_the_wrong_face_is_told() {
    let text = checked(with_a_closed_punch_for_the_lower_face);
    assert!(text.contains("inside punch, the deepest by 0.8"), "{text}");
    assert!(text.contains("it is to touch the other face of the sheet"), "{text}");
    let record = run(with_a_closed_punch_for_the_lower_face);
    let found = &record["in_tool"];
    assert_eq!(found["tool"], "punch", "{record}");
    let depth = found["depth_mm"].as_f64().unwrap();
    // The sheet is 0.8 mm thick.
    assert!((0.7..0.9).contains(&depth), "{depth}");
    assert!(warns(&record, "a tool sees nodes of one face of the sheet"), "{record}");
}

#[test]
fn a_tool_in_another_unit_that_misses_the_sheet_is_told() {
    let record = run(|folder, scene| {
        let path = folder.join("punch.tool.json");
        let mut tool: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        // As a file in metres would be read.
        for vertex in tool["vertices"].as_array_mut().unwrap() {
            for x in vertex.as_array_mut().unwrap() {
                *x = json!(x.as_f64().unwrap() / 1000.0);
            }
        }
        fs::write(&path, tool.to_string()).unwrap();
        scene["tools"][2]["place"] = json!({"shift": [0.0, 0.0, 5.0]});
    });
    assert_eq!(record["untouched"], json!(["punch"]), "{record}");
    assert!(warns(&record, "punch travelled and never touched the sheet"), "{record}");
}

#[test]
fn a_scene_in_which_nothing_is_to_happen_is_told() {
    let record = run(|_, scene| {
        scene["loads"] = json!([]);
        scene["stages"] = json!([{"name": "nothing"}]);
    });
    assert!(warns(&record, "no stage moves a tool and no load acts"), "{record}");
}

#[test]
fn friction_and_forces_that_no_press_has_are_told() {
    let said = checked(|_, scene| {
        scene["tools"][0]["friction"] = json!(5);
        scene["stages"][0]["drive"]["punch"] = json!({"force_n": 2e7});
    });
    assert!(said.contains("has a friction of 5; lubricated sheets have"), "{said}");
    assert!(
        said.contains("punch pushes with 2.000e7 N") && said.contains("check the unit"),
        "{said}"
    );
}
