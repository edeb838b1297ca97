//! Stages hand over to each other: whatever drove a tool before, it goes on from where it is, with the force that it carries.
//! The sheet and the tools are those of `fixtures/u-draw`.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

/// The scene with these drives of its punch, a stage each.
fn write_scene(folder: &Path, drives: &[Value]) -> PathBuf {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/u-draw");
    let text = fs::read_to_string(fixture.join("u-draw.scene.json")).unwrap();
    let mut scene: Value = serde_json::from_str(&text).unwrap();
    for tool in scene["tools"].as_array_mut().unwrap() {
        let file = fixture.join(tool["file"].as_str().unwrap());
        tool["file"] = file.to_string_lossy().into_owned().into();
    }
    let stages = drives.iter().zip(["a", "b", "c"]).map(
        |(drive, name)| json!({"name": name, "drive": {"punch": drive}, "first_increment": 0.05}),
    );
    scene["stages"] = stages.collect();
    scene["output"] = json!({"checkpoint_every": 1});
    let path = folder.join("case.scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    path
}

fn command(scene: &Path, out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.args(["run", "--lines", "--accept-doubts", "--threads", "1", "-o"]).args([out, scene]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Stage, travel [mm] and force [N] of the punch after every increment.
fn punch(out: &Path) -> Vec<(String, f64, f64)> {
    let text = fs::read_to_string(out.join("history.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let column = |name: &str| head.iter().position(|c| *c == name).unwrap();
    let of = [column("stage"), column("punch_travel_mm"), column("punch_force_n")];
    let number = |text: &str| text.parse::<f64>().unwrap();
    lines.map(|l| (l[of[0]].to_owned(), number(l[of[1]]), number(l[of[2]]))).collect()
}

/// Runs these drives: the end of the first stage, and the second.
fn run(drives: [Value; 2]) -> ([f64; 2], Vec<[f64; 2]>) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let done = command(&write_scene(folder.path(), &drives), &out).output().unwrap();
    assert!(done.status.success(), "{drives:?}: {}", String::from_utf8_lossy(&done.stderr));
    let rows = punch(&out);
    let first = rows.iter().rfind(|r| r.0 == "a").map(|r| [r.1, r.2]).unwrap();
    (first, rows.into_iter().filter(|r| r.0 == "b").map(|r| [r.1, r.2]).collect())
}

#[test]
fn a_travel_comes_from_where_the_tool_is() {
    for before in [json!({"advance_mm": 1.0}), json!({"force_n": 5.0})] {
        let ([mut last, _], second) = run([before, json!({"travel_mm": 1.5})]);
        assert!(last > 0.3, "{last}");
        for [travel, _] in &second {
            assert!(*travel > last, "{travel} after {last}: {second:?}");
            last = *travel;
        }
        assert_eq!(last, 1.5);
    }
}

#[test]
fn a_force_comes_from_what_the_tool_carries() {
    let stiffness = 5.0;
    for (after, end) in [
        (json!({"force_n": 12.0}), None),
        (json!({"spring": {"stiffness_n_per_mm": stiffness, "force_n": 24.0}}), Some(24.0)),
    ] {
        let ([travel, force], second) = run([json!({"travel_mm": 1.5}), after]);
        let mut last = [travel, force];
        for now in &second {
            assert!(now[0] > last[0] && now[1] > last[1], "{now:?} after {last:?}: {second:?}");
            last = *now;
        }
        let pushed = end.map_or(12.0, |at_zero: f64| at_zero - stiffness * last[0]);
        assert!((last[1] - pushed).abs() < 1e-4 * pushed, "{last:?} {pushed}");
        // The first twentieth of the stage is one of the way, too.
        let share = (second[0][1] - force) / (last[1] - force);
        assert!(share < 0.1, "{share}");
    }
}

#[test]
fn a_curve_goes_through_its_pairs() {
    let curve = json!({"travel_mm": [[0, 0], [0.25, 1.5], [1, 0.5]]});
    let ([travel, _], second) = run([curve, json!({"advance_mm": [[0.5, 0.25], [1, 0]]})]);
    assert_eq!(travel, 0.5);
    let most = second.iter().map(|row| row[0]).fold(0.0, f64::max);
    assert!(most > 0.6 && most <= 0.75, "{most}");
    assert_eq!(second.last().unwrap()[0], 0.5);
}

#[test]
fn a_stage_that_came_from_a_force_is_gone_on_with_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let drives = [json!({"travel_mm": 1.0}), json!({"force_n": 12.0}), json!({"travel_mm": 3.0})];
    let scene = write_scene(folder, &drives);
    let [whole, killed] = ["whole", "killed"].map(|name| folder.join(name));
    assert!(command(&scene, &whole).output().unwrap().status.success());
    for stage in ["b", "c"] {
        let mut child = command(&scene, &killed);
        if killed.join("checkpoint-0.bin").exists() {
            child.arg("--restart");
        }
        let mut child = child.spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        // Its third increment: the one before has its checkpoint.
        let under_way = lines.map_while(Result::ok).filter(|l| l.ends_with(&format!("  {stage}")));
        assert_eq!(under_way.take(3).count(), 3);
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let done = command(&scene, &killed).arg("--restart").output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let again = command(&scene, &killed).arg("--restart").output().unwrap();
    let said = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(again.status.code() == Some(2) && said.contains("has completed all stages"), "{said}");
    let [whole, killed] = [whole, killed].map(|f| fs::read(f.join("history.csv")).unwrap());
    assert_eq!(String::from_utf8(whole).unwrap(), String::from_utf8(killed).unwrap());
}
