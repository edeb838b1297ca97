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

/// Runs it in the way that `arguments` ask for: exit code, standard output and error, and the run folder.
fn run_with(
    arguments: &[&str],
    change: impl FnOnce(&Path, &mut Value),
) -> (Option<i32>, [String; 2], tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let file = drawn(folder.path(), change);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("run").arg(&file).args(arguments).arg("-o").arg(folder.path().join("run"));
    let done = command.output().unwrap();
    let said = [done.stdout, done.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    (done.status.code(), said, folder)
}

fn record_in(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("run/run.json")).unwrap()).unwrap()
}

fn doubts(record: &Value) -> Vec<Value> {
    record["doubts"].as_array().cloned().unwrap_or_default()
}

/// Runs it: its record. Its doubts stand on stderr, in the verdict and in the exit code.
fn run(change: impl FnOnce(&Path, &mut Value)) -> Value {
    let (code, [_, said], folder) = run_with(&["-q"], change);
    let record = record_in(folder.path());
    let doubts = doubts(&record);
    let (verdict, exit) = if doubts.is_empty() { ("completed", 0) } else { ("doubtful", 1) };
    assert_eq!((record["verdict"].as_str(), code), (Some(verdict), Some(exit)), "{said}");
    for doubt in &doubts {
        let [code, text] = ["code", "text"].map(|key| doubt[key].as_str().unwrap());
        assert!(said.contains(&format!("doubt {code}: {text}")), "{doubt}: {said}");
    }
    record
}

/// Whether a doubt of this code is there, whose text has these words.
fn has(record: &Value, code: &str, words: &str) -> bool {
    let is =
        |doubt: &Value| doubt["code"] == code && doubt["text"].as_str().unwrap().contains(words);
    doubts(record).iter().any(is)
}

#[test]
fn a_run_with_nothing_amiss_has_no_doubts() {
    let record = run(|_, _| {});
    assert_eq!(record["doubts"], json!([]), "{record}");
}

fn without_friction(_: &Path, scene: &mut Value) {
    scene["tools"][0].as_object_mut().unwrap().remove("friction");
}

#[test]
fn a_doubt_stands_in_every_place() {
    let code = "friction-not-given";
    // Last on the terminal.
    let (exit, [out, err], folder) = run_with(&[], without_friction);
    assert_eq!(exit, Some(1), "{err}");
    let lines: Vec<&str> = err.lines().collect();
    let last = lines.len() - 2;
    assert!(lines[last].starts_with(&format!("doubt {code}: No friction")), "{err}");
    assert!(
        lines[last + 1].contains("1 doubt:") && lines[last + 1].contains("--accept-doubts"),
        "{err}"
    );
    assert!(out.contains("report.html"), "{out}");
    // In run.json, with everything that a script needs.
    let doubt = &record_in(folder.path())["doubts"][0];
    assert_eq!((&doubt["code"], &doubt["where"]), (&json!(code), &json!("die")), "{doubt}");
    // First in the report.
    let page = fs::read_to_string(folder.path().join("run/report.html")).unwrap();
    let body = page.split("<main>").nth(1).unwrap();
    let first = body.find(code).unwrap();
    assert!(first < body.find("<table>").unwrap() && first < body.find("Force against").unwrap());
    // In the status.
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    let status = command.arg("status").arg(folder.path().join("run")).output().unwrap();
    let said = String::from_utf8(status.stdout).unwrap();
    assert!(said.contains(&format!("doubt      {code}")), "{said}");
}

#[test]
fn quiet_and_json_have_doubts_on_stderr_and_accepted_ones_stay_in_the_list() {
    for (arguments, exit) in
        [(&["-q"][..], 1), (&["--json"], 1), (&["--lines"], 1), (&["-q", "--accept-doubts"], 0)]
    {
        let (code, [out, err], folder) = run_with(arguments, without_friction);
        assert_eq!(code, Some(exit), "{arguments:?}: {err}");
        assert!(err.contains("doubt friction-not-given: "), "{arguments:?}: {err}");
        assert!(!out.contains("doubt friction"), "{arguments:?}: {out}");
        let record = record_in(folder.path());
        assert_eq!(record["verdict"], "doubtful");
        assert!(has(&record, "friction-not-given", "die"), "{record}");
    }
}

#[test]
fn check_sorts_findings_by_level_and_has_them_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let file = drawn(folder.path(), without_friction);
    let check = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
        let done = command.arg("check").arg(&file).args(more).output().unwrap();
        (done.status.code(), String::from_utf8(done.stdout).unwrap())
    };
    let (code, text) = check(&[]);
    assert_eq!(code, Some(1), "{text}");
    let levels = |level: &str| text.lines().position(|line| line.trim_start().starts_with(level));
    assert!(levels("doubt").unwrap() < levels("note").unwrap_or(usize::MAX), "{text}");
    let (code, text) = check(&["--json", "--accept-doubts"]);
    let found: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((code, &found["findings"][0]["level"]), (Some(0), &json!("doubt")), "{text}");
    assert_eq!(found["findings"][0]["code"], "friction-not-given");
    assert_eq!(found["cost"]["measured"], false);
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
fn a_tool_that_touches_the_wrong_face_is_a_doubt() {
    let text = checked(with_a_closed_punch_for_the_lower_face);
    assert!(text.contains("inside punch, the deepest by 0.8"), "{text}");
    assert!(text.contains("selects the other face of the sheet"), "{text}");
    let record = run(with_a_closed_punch_for_the_lower_face);
    let found = &record["inside_tool"];
    assert_eq!(found["tool"], "punch", "{record}");
    let depth = found["depth_mm"].as_f64().unwrap();
    // The sheet is 0.8 mm thick.
    assert!((0.7..0.9).contains(&depth), "{depth}");
    assert!(has(&record, "inside-tool", "are inside punch"), "{record}");
}

#[test]
fn a_tool_in_another_unit_that_misses_the_sheet_is_a_doubt() {
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
    assert_eq!(record["tools_never_touched"], json!(["punch"]), "{record}");
    assert!(has(&record, "tool-never-touched", "punch travelled"), "{record}");
    // What rounding leaves of no work at all is no energy.
    assert!(!has(&record, "energy-balance", ""), "{record}");
    assert!(has(&record, "scene-units", "Check the units of the tool file"), "{record}");
}

#[test]
fn a_scene_in_which_nothing_is_to_happen_is_a_doubt() {
    let record = run(|_, scene| {
        scene["loads"] = json!([]);
        scene["stages"] = json!([{"name": "nothing"}]);
    });
    assert!(has(&record, "nothing-moves", "No stage moves a tool"), "{record}");
}

#[test]
fn friction_and_forces_that_no_press_has_are_doubts() {
    let said = checked(|_, scene| {
        scene["tools"][0]["friction"] = json!(5);
        scene["stages"][0]["drive"]["punch"] = json!({"force_n": 2e7});
    });
    assert!(said.contains("doubt      scene-units: die has a friction coefficient of 5"), "{said}");
    assert!(
        said.contains("punch pushes with 2.000e7 N") && said.contains("Check the unit"),
        "{said}"
    );
}

#[test]
fn a_sheet_that_is_held_everywhere_is_refused() {
    let all = json!([{"where": {"all": true}, "axes": ["x", "y", "z"]}]);
    let (code, [_, said], _) = run_with(&["-q"], |_, scene| scene["holds"] = all);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("nodes of the blank are constrained in x, y and z"), "{said}");
}

#[test]
fn units_that_are_not_mm_are_doubts_that_name_the_unit() {
    let said = checked(|_, scene| scene["blank"]["thickness_mm"] = json!(0.0008));
    assert!(
        said.contains("doubt      scene-units: The thickness of the blank is 0.0008 mm"),
        "{said}"
    );
    assert!(said.contains("in metres this would be 0.8 mm"), "{said}");
}

#[test]
fn comments_and_the_schema_key_are_passed_over_and_other_keys_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = drawn(folder.path(), |_, scene| {
        scene["$schema"] = json!("scene.schema.json");
        scene["_comment"] = json!(["why", {"x": 1}]);
        scene["blank"]["_comment_2"] = json!("why");
    });
    let check = |file: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
        command.arg("check").arg(file).output().unwrap()
    };
    assert_eq!(check(&file).status.code(), Some(0));
    let text = fs::read_to_string(&file).unwrap().replace("_comment_2", "comment");
    fs::write(&file, text).unwrap();
    let done = check(&file);
    assert_eq!(done.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&done.stderr).contains("unknown field `comment`"));
}

/// The strip with a holder under force, whose front begins at 33.1 mm, over a blank of this length [mm].
fn held(length: f64, travel: f64) -> Value {
    run(|_, scene| {
        scene["blank"]["shape"]["rectangle"]["size_mm"] = json!([length, 1.0]);
        scene["loads"] = json!([]);
        scene["tools"][1].as_object_mut().unwrap().remove("place");
        let clamp = json!({"holder": {"force_n": 20}});
        let draw = json!({"holder": {"force_n": 20}, "punch": {"travel_mm": travel}});
        scene["stages"] =
            json!([{"name": "clamp", "drive": clamp}, {"name": "draw", "drive": draw}]);
    })
}

/// Over a travel of 7 mm the rim of a blank of 36 mm passes the edge of the holder, that of one of 44 mm does not.
#[test]
fn a_blank_that_is_drawn_out_from_under_its_holder_is_a_doubt() {
    let lost = held(36.0, 7.0);
    assert!(has(&lost, "holder-lost", "drawn out from under holder in increment"), "{lost}");
    let (first, last) = (&lost["holder_lost"]["increment"], &lost["increments"]);
    assert!(first.as_u64() <= last.as_u64() && first.as_u64() > Some(3), "{first} of {last}");
    let held = held(44.0, 7.0);
    assert!(!has(&held, "holder-lost", "") && held["holder_lost"].is_null(), "{held}");
}
