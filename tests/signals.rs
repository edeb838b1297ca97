//! SIGTERM and SIGINT end the programs within seconds, whatever they are at, and leave nothing behind.
#![cfg(unix)]

mod strip;

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use serde_json::{Value, json};
use strip::scene_in;

/// Time in which a program that gets a signal ends [s].
const END_S: u64 = 5;
/// Time in which anything else must have happened [s].
const WAIT_S: u64 = 300;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// Starts a program whose temporary files go to the folder `tmp` of `folder`, which is its current one.
fn start(program: &str, arguments: &[&str], folder: &Path) -> Child {
    fs::create_dir_all(folder.join("tmp")).unwrap();
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder).env("TMPDIR", folder.join("tmp"));
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until `look` finds something while the program is at work.
fn until<T>(child: &mut Child, what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert_eq!(child.try_wait().unwrap(), None, "it ended before {what}");
        assert!(begun.elapsed() < Duration::from_secs(WAIT_S), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn pid(number: u32) -> Pid {
    Pid::from_raw(i32::try_from(number).unwrap()).unwrap()
}

/// Sends a signal: how the program ends, and what it says on standard error.
fn ended_by(signal: Signal, child: Child) -> (ExitStatus, String) {
    kill_process(pid(child.id()), signal).unwrap();
    let sent = Instant::now();
    let done = child.wait_with_output().unwrap();
    let (took, said) = (sent.elapsed(), String::from_utf8_lossy(&done.stderr).into_owned());
    println!("{signal:?}: {:.2} s after it", took.as_secs_f64());
    assert!(took < Duration::from_secs(END_S), "{took:?}: {said}");
    (done.status, said)
}

fn json_of(path: &Path) -> Option<Value> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Names of the files of a folder that are hidden or temporary.
fn litter(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).into_iter().flatten();
    let names = names.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|name| name.ends_with(".tmp") || name.starts_with("kanagata-")).collect()
}

/// The strip as a sheet of 3360 elements, drawn in increments of this share of the stage.
fn sheet(folder: &Path, travel_mm: f64, increment: f64) -> PathBuf {
    scene_in(folder, |_, scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([140, 24]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(travel_mm);
        scene["stages"][0]["first_increment"] = json!(increment);
        scene["stages"][0]["largest_increment"] = json!(increment);
    })
}

/// The number of increments in `history.csv`.
fn increments(out: &Path) -> usize {
    fs::read_to_string(out.join("history.csv"))
        .unwrap_or_default()
        .lines()
        .count()
        .saturating_sub(1)
}

#[test]
fn a_run_of_a_larger_sheet_ends_within_an_iteration_and_continues_from_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let scene = sheet(folder.path(), 15.0, 0.002);
    let (scene, out) = (scene.to_str().unwrap(), folder.path().join("out"));
    let mut done = 0;
    for (signal, more, pause_ms) in [
        (Signal::TERM, &[][..], 400),
        (Signal::INT, &["--restart"], 150),
        (Signal::TERM, &["--restart"], 0),
    ] {
        let arguments = [&["run", scene, "-q", "-o", "out"][..], more].concat();
        let mut run = start(env!("CARGO_BIN_EXE_kanagata-solve"), &arguments, folder.path());
        until(&mut run, "an increment more", || (increments(&out) > done + 1).then_some(()));
        // Somewhere in the iterations of the next one.
        std::thread::sleep(Duration::from_millis(pause_ms));
        let (status, said) = ended_by(signal, run);
        assert_eq!(status.code(), Some(5), "{said}");
        let record = json_of(&out.join("run.json")).unwrap();
        assert_eq!(record["verdict"], "stopped");
        let now = kanagata::run::status::status(&out).unwrap();
        assert!(now.increment > done, "{} after {done}", now.increment);
        assert_eq!(now.checkpoint.unwrap().increment, now.increment);
        assert!(now.restart.is_some_and(|restart| restart.folder == out && !restart.auto));
        assert_eq!(litter(&out), Vec::<String>::new());
        assert_eq!(litter(&folder.path().join("tmp")), Vec::<String>::new());
        done = now.increment;
    }
}

/// The results are complete then: what is missing afterwards is the page, whole or not there.
#[test]
fn a_run_that_is_stopped_while_its_report_is_written_keeps_its_results() {
    let folder = tempfile::tempdir().unwrap();
    let scene = sheet(folder.path(), 0.02, 0.5);
    let out = folder.path().join("out");
    let arguments = ["run", scene.to_str().unwrap(), "-q", "-o", "out"];
    let mut run = start(env!("CARGO_BIN_EXE_kanagata-solve"), &arguments, folder.path());
    until(&mut run, "a verdict", || {
        let record = json_of(&out.join("run.json"))?;
        (record["verdict"] == "completed" || record["verdict"] == "doubtful").then_some(())
    });
    let (status, said) = ended_by(Signal::TERM, run);
    println!("exit code {:?}", status.code());
    // A fast machine may have written it by then.
    match status.code() {
        Some(5) => assert!(said.contains("the results are complete"), "{said}"),
        code => assert!(matches!(code, Some(0 | 1)) && out.join("report.html").exists(), "{said}"),
    }
    let page = fs::read_to_string(out.join("report.html"));
    assert!(page.is_err() || page.is_ok_and(|text| text.ends_with("</html>\n")));
    assert_eq!(litter(&out), Vec::<String>::new());
    let now = kanagata::run::status::status(&out).unwrap();
    assert_eq!(now.state, kanagata::run::status::State::Finished);
    assert!(out.join("steps/last.vtu").exists() || increments(&out) > 0);
}

#[test]
fn a_mesh_and_a_conversion_under_way_end_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let cad = fixture("s-rail/die.step");
    let full = fixture("forming/cross_die_full_144.igs");
    let (cad, full) = (cad.to_str().unwrap(), full.to_str().unwrap());
    let finest = ["--max-size-mm", "0.1"];
    let cases: [&[&str]; 3] = [
        &[&["mesh", cad, "-o", "out.msh"], &finest[..]].concat(),
        &[&["convert", cad, "-o", "out.tool.json", "--sheet-side", "+z"], &finest[..]].concat(),
        // In the midst of the search.
        &["convert", full, "-o", "out.tool.json", "--sheet-side", "+z", "--tol", "1e-6mm"],
    ];
    for (arguments, signal) in cases.into_iter().zip([Signal::TERM, Signal::INT, Signal::TERM]) {
        let mut made = start(env!("CARGO_BIN_EXE_kanagata"), arguments, folder.path());
        let begun = Instant::now();
        until(&mut made, "a second of work", || (begun.elapsed().as_millis() > 1000).then_some(()));
        let (status, said) = ended_by(signal, made);
        assert_eq!(status.code(), Some(5), "{arguments:?}: {said}");
        assert!(said.contains("stopped by a signal"), "{said}");
        let left = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name());
        assert_eq!(left.collect::<Vec<_>>(), ["tmp"]);
        assert_eq!(litter(&folder.path().join("tmp")), Vec::<String>::new());
    }
}

/// Whether a process is at work; one that has ended and waits for its parent is not.
fn is_at_work(number: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{number}/stat"));
    let ended = |stat: String| {
        stat.rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X']))
    };
    test_kill_process(pid(number)).is_ok() && !stat.is_ok_and(ended)
}

#[test]
fn gmsh_ends_with_all_that_it_has_started_and_its_folder_goes() {
    for (command, out, signal) in
        [("mesh", "out.msh", Signal::TERM), ("convert", "out.tool.json", Signal::INT)]
    {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("gmsh");
        let numbers = folder.path().join("numbers");
        // Deaf to requests, with a child of its own.
        let script = format!(
            "#!/bin/sh\ntrap '' TERM INT\nsleep 300 &\necho $$ $! > '{0}.new'\nmv '{0}.new' '{0}'\nwait\nsleep 300\n",
            numbers.display()
        );
        fs::write(&program, script).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let cad = fixture("cross/die.igs");
        let arguments =
            [command, cad.to_str().unwrap(), "-o", out, "--mesher", "gmsh", "--gmsh", "./gmsh"];
        let mut made = start(env!("CARGO_BIN_EXE_kanagata"), &arguments, folder.path());
        let started = until(&mut made, "gmsh", || fs::read_to_string(&numbers).ok());
        let started: Vec<u32> = started.split_whitespace().map(|n| n.parse().unwrap()).collect();
        assert!(started.len() == 2 && started.iter().all(|n| is_at_work(*n)), "{started:?}");
        assert_eq!(litter(&folder.path().join("tmp")).len(), 1, "the folder that gmsh works in");
        let (status, said) = ended_by(signal, made);
        assert_eq!(status.code(), Some(5), "{said}");
        let begun = Instant::now();
        while started.iter().any(|n| is_at_work(*n)) {
            assert!(begun.elapsed() < Duration::from_secs(END_S), "{started:?} are still there");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(litter(&folder.path().join("tmp")), Vec::<String>::new());
        assert!(!folder.path().join(out).exists());
    }
}
