//! Every exit code of the programs, each from what it stands for.

mod strip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use kanagata::run::lock::{Attempt, file_in, take};
use serde_json::{Value, json};
use strip::scene_in;

fn solve(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command.args(arguments).current_dir(folder).output().unwrap()
}

/// The strip in 35 elements, drawn 0.3 mm, changed.
fn scene(folder: &Path, change: impl FnOnce(&mut Value)) -> PathBuf {
    scene_in(folder, |_, scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([35, 1]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(0.3);
        scene["stages"][0]["first_increment"] = json!(0.1);
        change(scene);
    })
}

fn code(arguments: &[&str], change: impl FnOnce(&mut Value)) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), change);
    let mut all = vec![arguments[0], file.to_str().unwrap()];
    all.extend(&arguments[1..]);
    let done = solve(&all, folder.path());
    (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
}

#[test]
fn zero_one_two_and_three() {
    let run = ["run", "-q", "-o", "out"];
    assert_eq!(code(&run, |_| {}), (Some(0), String::new()));
    let no_friction = |scene: &mut Value| {
        scene["tools"][0].as_object_mut().unwrap().remove("friction");
    };
    assert_eq!(code(&run, no_friction).0, Some(1));
    assert_eq!(code(&["check"], no_friction).0, Some(1));
    assert_eq!(code(&["check", "--accept-doubts"], no_friction).0, Some(0));
    assert_eq!(code(&run, |scene| scene["version"] = json!(2)).0, Some(2));
    assert_eq!(code(&["run"], |_| {}).0, Some(2));
    let (three, said) = code(&run, |scene| {
        let crush = json!({"holder": {"travel_mm": 1.2}});
        scene["stages"] = json!([{"name": "crush", "drive": crush, "largest_increment": 0.1}]);
        scene["solver"] = json!({"iterations": 5});
    });
    assert_eq!(three, Some(3), "{said}");
}

#[test]
fn two_for_a_folder_that_another_process_works_in() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let Attempt::Acquired(_lock) = take(&file_in(&out), false).unwrap() else {
        panic!("a folder of our own")
    };
    let file = scene(folder.path(), |_| {});
    let done = solve(&["run", file.to_str().unwrap(), "-q", "-o", "out"], folder.path());
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.code() == Some(2) && said.contains("works in this folder"), "{said}");
}

#[test]
fn four_for_files_that_are_not_there_or_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(solve(&["check", "none.json"], folder.path()).status.code(), Some(4));
    fs::write(folder.path().join("file"), "").unwrap();
    let file = scene(folder.path(), |_| {});
    let run = ["run", file.to_str().unwrap(), "-q", "-o", "file/out"];
    let done = solve(&run, folder.path());
    assert_eq!(done.status.code(), Some(4), "{}", String::from_utf8_lossy(&done.stderr));
}

#[cfg(unix)]
#[test]
fn five_when_a_signal_stops_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path(), |scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([70, 4]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(15.0);
    });
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    let run = command.arg("run").arg(&file).args(["-q", "-o", "out"]).current_dir(folder.path());
    let mut child = run.spawn().unwrap();
    let under_way = folder.path().join("out/history.csv");
    while !under_way.exists() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before it was stopped");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(5));
    let record: Value =
        serde_json::from_slice(&fs::read(folder.path().join("out/run.json")).unwrap()).unwrap();
    assert_eq!(record["verdict"], "stopped");
}

#[test]
fn the_codes_are_in_the_help_of_both_programs_and_in_the_readme() {
    let readme = include_str!("../README.md");
    for program in [env!("CARGO_BIN_EXE_kanagata"), env!("CARGO_BIN_EXE_kanagata-solve")] {
        let help = Command::new(program).arg("--help").output().unwrap();
        let help = String::from_utf8(help.stdout).unwrap();
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for (code, words) in [
            (0, "done"),
            (1, "doubtful result or limit exceeded"),
            (2, "bad usage or input"),
            (3, "not converged"),
            (4, "a file could not be read or written"),
            (5, "stopped by a signal"),
        ] {
            assert!(help.contains(&format!("{code} {words}")), "{code}: {help}");
            assert!(readme.contains(&format!("| {code} | {words}")), "{code}: README");
        }
    }
}
