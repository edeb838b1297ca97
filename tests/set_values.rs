//! Values of a scene set from outside, and results as one flat object.

mod bend;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

/// Runs the bend in `folder` with more arguments.
fn run(folder: &Path, out: &str, more: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["run", "bend.scene.json", "-q", "--accept-doubts", "-o", out])
        .args(more)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!text.contains("panicked"), "{text}");
    output
}

/// Exit code of a run with a value set that is stopped, by the end of its standard input, when it has two checkpoints.
fn stopped_after_two_checkpoints(folder: &Path, out: &str, set: &str) -> Option<i32> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["run", "bend.scene.json", "-q", "--tied", "--set", set, "-o", out])
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !folder.join(out).join("checkpoint-1.bin").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    drop(child.stdin.take());
    child.wait().unwrap().code()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The bend in a folder of its own, and its first tool.
fn bend_in(folder: &Path) -> String {
    bend::write_tools(folder);
    let scene = bend::scene("");
    fs::write(folder.join("bend.scene.json"), scene.to_string()).unwrap();
    scene["tools"][0]["name"].as_str().unwrap().to_owned()
}

#[test]
fn a_value_set_gives_the_results_of_a_scene_with_that_value() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tool = bend_in(folder);
    let set = format!("tools.{tool}.friction=0.2");
    assert!(run(folder, "set", &["--set", &set, "--metrics", "m.json"]).status.success());
    let mut scene = bend::scene("");
    scene["tools"][0]["friction"] = 0.2.into();
    fs::write(folder.join("bend.scene.json"), scene.to_string()).unwrap();
    assert!(run(folder, "written", &[]).status.success());
    let history = |out: &str| fs::read_to_string(folder.join(out).join("history.csv")).unwrap();
    assert_eq!(history("set"), history("written"));
    assert_eq!(json(&folder.join("set/run.json"))["set"], serde_json::json!([set]));

    let (metrics, record) = (json(&folder.join("m.json")), json(&folder.join("set/run.json")));
    let values = metrics.as_object().unwrap().values();
    assert!(values.clone().all(|v| v.is_number() || v.is_string()), "{metrics}");
    for key in ["verdict", "increments", "iterations", "energy_error"] {
        assert_eq!(metrics[key], record[key], "{key}");
    }
    assert_eq!(metrics["thickness_min_mm"], record["thickness"]["minimum_mm"]);
    // Columns of a tool in `history.csv`.
    let rows = history("set");
    let head: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
    let column = head.iter().position(|h| *h == format!("{tool}_force_n")).unwrap();
    let force = |row: &str| row.split(',').nth(column).unwrap().parse::<f64>().unwrap();
    let largest = rows.lines().skip(1).map(force).fold(
        0.0,
        |a: f64, b| {
            if b.abs() >= a.abs() { b } else { a }
        },
    );
    assert_eq!(metrics[format!("force_max_n.{tool}")], largest);
    assert_eq!(metrics[format!("force_end_n.{tool}")], force(rows.lines().last().unwrap()));
}

#[test]
fn a_wrong_value_is_refused_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tool = bend_in(folder);
    for (set, expected) in [
        ("tools.none.friction=0.1".to_owned(), tool.clone()),
        (format!("tools.{tool}.friction=-1"), "friction".to_owned()),
        (format!("tools.{tool}.friktion=0.1"), "friktion".to_owned()),
        ("blank.layers=two".to_owned(), "layers".to_owned()),
        ("name".to_owned(), "PATH=VALUE".to_owned()),
    ] {
        let output = run(folder, "out", &["--set", &set]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{set}: {text}");
        assert!(text.contains(&expected) && text.contains(&set), "{set}: {text}");
        assert!(!folder.join("out").exists(), "{set}");
    }
}

#[test]
fn a_stopped_run_is_continued_with_the_values_it_had() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tool = bend_in(folder);
    let set = format!("tools.{tool}.friction=0.2");
    assert!(run(folder, "whole", &["--set", &set]).status.success());
    assert_eq!(stopped_after_two_checkpoints(folder, "part", &set), Some(5));
    let other = run(folder, "part", &["--restart"]);
    assert_eq!(other.status.code(), Some(2), "another scene continues the run");
    let again = run(folder, "part", &["--set", &set]);
    let text = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(
        again.status.code() == Some(2) && text.contains(&format!("--set {set} --restart")),
        "{text}"
    );
    assert!(run(folder, "part", &["--set", &set, "--restart"]).status.success());
    let history = |out: &str| fs::read(folder.join(out).join("history.csv")).unwrap();
    assert_eq!(history("part"), history("whole"));
}
