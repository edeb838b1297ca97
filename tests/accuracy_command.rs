//! `kanagata-solve run --accuracy`: a sequence of runs on the U-draw, its estimates against a fine run, and how it ends.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The U-draw with its first 5 mm only, in a folder of its own.
fn scene() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/u-draw");
    for file in std::fs::read_dir(from).unwrap().flatten() {
        std::fs::copy(file.path(), folder.path().join(file.file_name())).unwrap();
    }
    let path = folder.path().join("u-draw.scene.json");
    let mut scene = json(&path);
    scene["stages"][0]["drive"]["punch"]["travel_mm"] = 5.into();
    std::fs::write(&path, scene.to_string()).unwrap();
    (folder, path)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn run(scene: &Path, output: &Path, options: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["--threads", "1", "run"])
        .arg(scene)
        .arg("-o")
        .arg(output)
        .args(options)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Estimated error by quantity, and what was allowed.
fn errors(record: &Value) -> Vec<(String, f64, Option<f64>)> {
    let quantities = record["accuracy"]["quantities"].as_array().unwrap();
    let one = |q: &Value| {
        (
            q["name"].as_str().unwrap().to_owned(),
            q["error"].as_f64().unwrap(),
            q["allowed"].as_f64(),
        )
    };
    quantities.iter().map(one).collect()
}

#[test]
fn a_sequence_reaches_its_accuracy_and_its_estimates_cover_a_fine_run() {
    let (folder, scene) = scene();
    let output = folder.path().join("out");
    let done = run(&scene, &output, &["--accuracy", "force=10%,thickness=1%,draw-in=0.2mm"]);
    let printed = text(&done.stdout);
    assert!(done.status.success(), "{printed}{}", text(&done.stderr));
    assert!(
        printed.contains("estimated errors from") && printed.contains("run 1, mesh:"),
        "{printed}"
    );
    let record = json(&output.join("run.json"));
    for (name, error, allowed) in errors(&record) {
        assert!(error > 0.0 && error <= allowed.unwrap(), "{name}: {error} {allowed:?}");
    }
    let runs = record["accuracy"]["runs"].as_array().unwrap();
    assert!(runs.len() >= 4, "{}", runs.len());
    // Forces within 10 %: increments have 3 % of the work.
    let allowed = "solver.increment_error=0.03";
    assert!(runs[0]["set"].to_string().contains(allowed), "{runs:?}");
    assert!(text(&std::fs::read(output.join("report.html")).unwrap()).contains("Estimated errors"));

    // A run with twice the elements, four layers of nine points and short increments.
    let last = runs.last().unwrap();
    let elements = last["set"].as_array().unwrap().iter().filter_map(Value::as_str);
    let elements =
        elements.filter_map(|s| s.strip_prefix("blank.shape.rectangle.elements=[")).next();
    let count: usize = elements.unwrap().split(',').next().unwrap().parse().unwrap();
    let fine = folder.path().join("fine");
    let mesh = format!("blank.shape.rectangle.elements=[{},1]", 2 * count);
    let set = [
        "--set",
        &mesh,
        "--set",
        "blank.layers=4",
        "--set",
        r#"blank.element={"solid-shell":{"points":9}}"#,
    ];
    let more = ["--set", "stages.0.largest_increment=0.02", "--accept-doubts"];
    let done = run(&scene, &fine, &[&set[..], &more[..]].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    let fine = json(&fine.join("run.json"));
    let thickness = |record: &Value| record["thickness"]["minimum_mm"].as_f64().unwrap();
    let off = (thickness(&record) - thickness(&fine)).abs();
    let (_, error, _) = errors(&record).into_iter().find(|q| q.0 == "thickness").unwrap();
    assert!(off <= 1.5 * error, "minimum thickness off by {off}, estimated {error}");
}

#[test]
fn a_sequence_uses_the_runs_that_are_there_and_repeats_them_on_request() {
    let (folder, scene) = scene();
    let output = folder.path().join("out");
    let asked = ["--accuracy", "20%"];
    let first = run(&scene, &output, &asked);
    assert!(first.status.success(), "{}{}", text(&first.stdout), text(&first.stderr));
    let before = json(&output.join("run.json"));
    // The last run is lost: only it is repeated, with the same results.
    let last = before["accuracy"]["runs"].as_array().unwrap().last().unwrap()["folder"].clone();
    std::fs::remove_dir_all(output.join(last.as_str().unwrap())).unwrap();
    let second = run(&scene, &output, &asked);
    let printed = text(&second.stdout);
    let known = printed.lines().filter(|line| line.ends_with("(done before)")).count();
    let all = before["accuracy"]["runs"].as_array().unwrap().len();
    assert_eq!(known, all - 1, "{printed}");
    let values = |record: &Value| errors(record).iter().map(|q| q.1).collect::<Vec<f64>>();
    assert_eq!(values(&before), values(&json(&output.join("run.json"))));
    let again = run(&scene, &output, &[&asked[..], &["--overwrite"]].concat());
    assert!(again.status.success() && !text(&again.stdout).contains("done before"));
}

#[test]
fn a_sequence_without_time_is_doubtful_and_says_why() {
    let (folder, scene) = scene();
    let output = folder.path().join("out");
    let ended = run(&scene, &output, &["--accuracy", "0.1%", "--budget", "1s"]);
    assert_eq!(ended.status.code(), Some(1), "{}", text(&ended.stderr));
    assert!(text(&ended.stderr).contains("doubt accuracy-not-reached"), "{}", text(&ended.stderr));
    let record = json(&output.join("run.json"));
    assert_eq!(record["accuracy"]["end"], "time");
    assert_eq!(record["verdict"], "doubtful");
    assert!(!record["accuracy"]["unmeasured"].as_array().unwrap().is_empty());
}

#[test]
fn a_quantity_that_the_scene_does_not_have_is_refused_and_files_of_others_are_kept() {
    let (folder, scene) = scene();
    let output = folder.path().join("out");
    let refused = run(&scene, &output, &["--accuracy", "force=20%,springback=5%"]);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
    assert!(text(&refused.stderr).contains("no stage releases all tools"));
    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    std::fs::write(other.join("history.csv"), "of another program").unwrap();
    let refused = run(&scene, &other, &["--accuracy", "20%"]);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
    assert_eq!(std::fs::read_to_string(other.join("history.csv")).unwrap(), "of another program");
}

#[test]
fn accuracies_that_cannot_be_judged_are_refused_and_single_runs_are_doubtful() {
    let (folder, path) = scene();
    let output = folder.path().join("out");
    for (accuracy, expected) in [
        (serde_json::json!({"springback_mm": 0.1}), "no stage releases all tools"),
        (serde_json::json!({}), "at least one of force"),
        (serde_json::json!({"force": 0.9}), "0.0001 to 0.5"),
    ] {
        let mut scene = json(&path);
        scene["accuracy"] = accuracy;
        std::fs::write(&path, scene.to_string()).unwrap();
        let refused = run(&path, &output, &[]);
        assert_eq!(refused.status.code(), Some(2), "{expected}: {}", text(&refused.stderr));
        assert!(text(&refused.stderr).contains(expected), "{}", text(&refused.stderr));
    }
    let refused = run(&path, &output, &["--budget", "1s"]);
    assert_eq!(refused.status.code(), Some(2));
    // The library runs a scene once: the result is doubtful.
    let mut scene = json(&path);
    scene["accuracy"] = serde_json::json!({"force": 0.1});
    std::fs::write(&path, scene.to_string()).unwrap();
    let plan = kanagata::scene::read(&path).unwrap();
    let options = kanagata::run::RunOptions::default();
    let record = kanagata::run::run(&plan, &path, &output, &options, &mut |_| {}).unwrap();
    assert!(record.doubts.iter().any(|doubt| doubt.code.as_str() == "accuracy-not-reached"));
}
