//! A run that cannot go on says where and why, and leaves what it had; one that can does.

mod strip;

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use strip::scene_in;

/// Runs the strip with other tools, stages and limits: the exit code and what was said.
fn run(folder: &Path, change: impl FnOnce(&mut Value)) -> (Option<i32>, String) {
    let file = scene_in(folder, |_, scene| change(scene));
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.arg("run").arg(&file).args(["-q", "--accept-doubts", "-o"]).arg(folder.join("run"));
    let done = command.output().unwrap();
    (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
}

#[test]
fn a_tool_that_cannot_be_placed_is_told_why_and_no_state_is_spoken_of() {
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = run(folder.path(), |scene| {
        let punch = &mut scene["tools"][2];
        assert_eq!(punch["name"], "punch");
        punch["direction"] = json!([0, 0, 1]);
        punch["side"] = json!("top");
        punch["place"] = json!("touch");
    });
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("`punch` cannot be placed touching")
            && said.contains("check its `direction`"),
        "{said}"
    );
    assert!(!said.contains("last good state") && !folder.path().join("run").exists(), "{said}");
}

/// The strip crushed by its holder in five iterations an increment, which do not suffice.
fn crushed(folder: &Path) -> (Option<i32>, String) {
    run(folder, |scene| {
        let crush = json!({"holder": {"travel_mm": 1.2}});
        scene["stages"] = json!([{"name": "crush", "drive": crush, "largest_increment": 0.1}]);
        scene["solver"] = json!({"iterations": 5});
    })
}

/// The strip held at its end and drawn until it has torn, then met by a second die where only the sheet has room.
#[test]
fn a_sheet_that_has_torn_and_a_tool_that_comes_in_within_it_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = run(folder.path(), |scene| {
        let end = json!({"where": {"plane": {"normal": "x", "at_mm": 70.0}}, "axes": ["x", "z"]});
        scene["holds"].as_array_mut().unwrap().push(end);
        scene["loads"] = json!([]);
        let mut late = scene["tools"][0].clone();
        assert_eq!(late["name"], "die");
        late["name"] = json!("late");
        late["place"] = json!({"shift": [0.0, 0.0, 1.0]});
        scene["tools"].as_array_mut().unwrap().push(late);
        let draw = json!({"punch": {"travel_mm": 25.0}, "late": {"absent": true}});
        let meet = json!({"late": {"travel_mm": 0.0}});
        scene["stages"] = json!([{"name": "draw", "drive": draw}, {"name": "meet", "drive": meet}]);
    });
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("stage `meet`") && said.contains("stage fraction 0.000000"), "{said}");
    assert!(said.contains("nodes of the sheet are inside late, the deepest by 1.0"), "{said}");
    assert!(said.contains("doubt thickness-below-half: The thickness is"), "{said}");
}

/// The strip crushed by its holder between die and symmetry plane, until what has no tool on it buckles plastically. The way
/// to the balance beyond takes some hundred iterations of slow motion.
#[test]
fn a_strip_crushed_until_it_buckles_is_followed_to_rest() {
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = run(folder.path(), |scene| {
        let crush = json!({"holder": {"travel_mm": 0.2}});
        scene["stages"] = json!([{"name": "crush", "drive": crush, "first_increment": 0.05}]);
    });
    assert_eq!(code, Some(0), "{said}");
    let record = fs::read_to_string(folder.path().join("run/run.json")).unwrap();
    let record: Value = serde_json::from_str(&record).unwrap();
    assert!(record["snap_throughs"].as_u64().unwrap() > 0, "{record}");
    assert!(record["energy_error"].as_f64().unwrap() < 1e-2, "{record}");
}

#[test]
fn giving_up_names_the_place_and_leaves_state_and_residuals() {
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = crushed(folder.path());
    assert_eq!(code, Some(3), "{said}");
    let words =
        ["stage `crush`", "not converged after 5 iterations", "Nearest tool there", "node "];
    for words in words.into_iter().chain(["try: `kanagata-solve check` on the scene"]) {
        assert!(said.contains(words), "{words}: {said}");
    }
    let node: usize = said
        .split("largest residual at node ")
        .nth(1)
        .unwrap()
        .split('.')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let run = folder.path().join("run");
    let read = |name: &str| fs::read_to_string(run.join(name)).unwrap();
    let record: Value = serde_json::from_str(&read("run.json")).unwrap();
    assert_eq!(record["verdict"], "not_converged");
    let thickness = |name: &str| record["thickness"][name].as_f64().unwrap();
    let is_thin = thickness("minimum_mm") < 0.5 * thickness("initial_mm");
    assert!(said.contains("doubt thickness-below-half") == is_thin, "{said}");
    assert!(record["message"].as_str().unwrap().contains("A check of the scene reports"));
    let count = |name: &str| record[name].as_u64().unwrap();
    assert!(count("step_cuts") > 0 && count("iterations") > 3 * count("step_cuts") / 2, "{record}");

    // The iterations of the last attempt stand behind those of the increments that ended.
    let table = read("iterations.csv");
    let last = table.lines().last().unwrap();
    let failed = count("increments") + 1;
    assert!(last.starts_with(&format!("{failed},")), "{last}");

    // The state before it, with the forces of the tools, and the node marked.
    let grid = kanagata::report::vtu_read::read(&run.join("steps/last.vtu")).unwrap();
    let array = |name: &str| grid.point_data.iter().find(|a| a.name == name).unwrap();
    let marked: Vec<usize> = (0..grid.points.len())
        .filter(|&node| array("not_converged_here").values[node] != 0.0)
        .collect();
    assert_eq!(marked, [node]);
    assert!(array("contact_force_n").values.iter().any(|f| f.abs() > 1.0));
}
