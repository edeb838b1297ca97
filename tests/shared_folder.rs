//! Run folders that several hosts share: one run at a time works in a folder, and a run that has lost it writes nothing.
#![cfg(target_os = "linux")]

mod skipping;
mod strip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use kanagata::report::record::Process;
use kanagata::run::lock;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use strip::scene_in;

const SOLVER: &str = env!("CARGO_BIN_EXE_kanagata-solve");
/// Time in which anything must have happened [s].
const WAIT_S: u64 = 300;
/// Prefix of a command without locks of the system, as on some network file systems.
const WITHOUT_FLOCK: [&str; 11] = [
    "strace",
    "-f",
    "-qq",
    "--seccomp-bpf",
    "-o",
    "/dev/null",
    "-e",
    "trace=flock",
    "-e",
    "inject=flock:error=ENOSYS",
    "--",
];

/// A scene of many increments.
fn scene(folder: &Path) -> PathBuf {
    scene_in(folder, |_, scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([70, 12]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(15.0);
        scene["stages"][0]["first_increment"] = json!(0.002);
        scene["stages"][0]["largest_increment"] = json!(0.002);
    })
}

/// Starts `run` in the folder `out` of `folder`; its messages go to the file `HOST.txt`, its lines to `HOST.lines`.
fn start(program: &[&str], host: &str, more: &[&str], folder: &Path) -> Child {
    let file = |ending: &str| fs::File::create(folder.join(format!("{host}.{ending}"))).unwrap();
    let mut command = Command::new(program[0]);
    command.args(&program[1..]).args(["run", "changed.scene.json", "--lines", "-o", "out"]);
    command.args(more).current_dir(folder).stdin(Stdio::null());
    command.stdout(file("lines")).stderr(file("txt")).spawn().unwrap()
}

/// Starts `run` on a "host" of this name, without locks of the system.
fn start_on(host: &str, more: &[&str], folder: &Path) -> Child {
    let script = "echo \"$0\" > /proc/sys/kernel/hostname && exec \"$@\"";
    let hosted = ["unshare", "--uts", "sh", "-c", script, host];
    start(&[&hosted[..], &WITHOUT_FLOCK, &[SOLVER]].concat(), host, more, folder)
}

fn said(host: &str, folder: &Path) -> String {
    fs::read_to_string(folder.join(format!("{host}.txt"))).unwrap()
}

/// Waits until something is found.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(WAIT_S), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn signal(process: u32, signal: Signal) {
    kill_process(Pid::from_raw(process.cast_signed()).unwrap(), signal).unwrap();
}

/// The process named in the lock file.
fn owner(folder: &Path) -> Option<Process> {
    serde_json::from_slice(&fs::read(folder.join("out/run.lock")).ok()?).ok()
}

/// Number of lines of a file, without its first one.
fn rows(path: &Path) -> usize {
    fs::read_to_string(path).unwrap_or_default().lines().count().saturating_sub(1)
}

/// Whether processes can be on another "host" and without locks here.
fn has_tools() -> bool {
    let script = "echo trial > /proc/sys/kernel/hostname && exec \"$@\"";
    let mut trial = Command::new("unshare");
    trial.args(["--uts", "sh", "-c", script, "sh"]).args(WITHOUT_FLOCK).arg("true");
    trial.stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

#[test]
fn one_of_two_hosts_works_in_a_folder_without_flock() {
    if !has_tools() {
        let remedy = "run as root, with `apt-get install strace util-linux`";
        return skipping::skip(["unshare and strace", remedy]);
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let mut runs = ["one", "two"].map(|host| (host, start_on(host, &[], folder)));
    let (refused, code) = until("a refused run", || {
        let ended = |(k, (_, run)): (usize, &mut (_, Child))| {
            run.try_wait().unwrap().map(|status| (k, status.code()))
        };
        runs.iter_mut().enumerate().find_map(ended)
    });
    let (winner, loser) = (runs[1 - refused].0, runs[refused].0);
    let message = said(loser, folder);
    assert_eq!(code, Some(2), "{message}");
    let process = until("an increment", || {
        (rows(&folder.join("out/history.csv")) > 0).then(|| owner(folder)).flatten()
    });
    assert_eq!(lock::host_name(&process), Some(winner));
    let who = format!("process {} on {winner} (last heartbeat ", process.id);
    for part in [&who, "works in this folder", "5 minutes", "--break-lock"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    // From this host, which is a third one.
    let status = ["status", "out", "--json"];
    let status = Command::new(SOLVER).args(status).current_dir(folder).output().unwrap();
    let status: Value = serde_json::from_slice(&status.stdout).unwrap();
    assert_eq!((&status["state"], &status["host"]), (&json!("running"), &json!(winner)));
    assert!(status["heartbeat_s"].as_f64().unwrap() < 60.0, "{status}");
    // A third run breaks the lock: the first one ends.
    let mut third = start(&[SOLVER], "third", &["--break-lock", "--overwrite"], folder);
    let former = &mut runs[1 - refused].1;
    let code = until("the end of the former run", || former.try_wait().unwrap()).code();
    assert_eq!(code, Some(4), "{}", said(winner, folder));
    let message = said(winner, folder);
    assert!(message.contains("has lost its folder (process "), "{message}");
    assert!(message.contains(&third.id().to_string()), "{message}");
    assert_eq!(owner(folder).unwrap().id, third.id());
    // It is alive on this host: its lock is not broken.
    let mut fourth = start(&[SOLVER], "fourth", &["--break-lock", "--overwrite"], folder);
    let message = fourth.wait().map(|_| said("fourth", folder)).unwrap();
    assert!(message.contains(&format!("`kill {}`", third.id())), "{message}");
    assert!(!message.contains("--break-lock"), "{message}");
    signal(third.id(), Signal::TERM);
    assert_eq!(third.wait().unwrap().code(), Some(5));
}

/// Whether the run has printed, recorded and summarised the same increments, so that it is within the next one.
fn is_between_records(folder: &Path) -> bool {
    let record: Option<Value> = fs::read(folder.join("out/run.json"))
        .ok()
        .and_then(|text| serde_json::from_slice(&text).ok());
    let recorded = record.and_then(|record| record["increments"].as_u64()).unwrap_or_default();
    let printed = rows(&folder.join("this.lines"));
    printed > 0
        && printed == rows(&folder.join("out/history.csv"))
        && usize::try_from(recorded).unwrap() == printed
}

fn is_stopped(process: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    stat.rsplit_once(')').is_some_and(|(_, rest)| rest.trim_start().starts_with('T'))
}

/// Names and contents of the result files of a run.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for inner in ["out", "out/steps"] {
        let files = fs::read_dir(folder.join(inner)).unwrap().map(|entry| entry.unwrap().path());
        found.extend(files.filter(|path| path.is_file()).map(|path| {
            let text = fs::read(&path).unwrap();
            (path, text)
        }));
    }
    found.sort();
    found
}

#[test]
fn a_run_that_has_lost_its_folder_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    scene(folder);
    let mut run = start(&[SOLVER], "this", &[], folder);
    until("a run within an increment", || {
        assert_eq!(run.try_wait().unwrap(), None, "{}", said("this", folder));
        signal(run.id(), Signal::STOP);
        until("the stop", || is_stopped(run.id()).then_some(()));
        let between = is_between_records(folder);
        if !between {
            signal(run.id(), Signal::CONT);
        }
        between.then_some(())
    });
    let own = owner(folder).unwrap();
    let other = Process { id: 4711, host: "there 0-0 pid:[1]".into(), ..own };
    fs::write(folder.join("out/new"), serde_json::to_vec(&other).unwrap()).unwrap();
    fs::rename(folder.join("out/new"), folder.join("out/run.lock")).unwrap();
    let before = results(folder);
    signal(run.id(), Signal::CONT);
    assert_eq!(run.wait().unwrap().code(), Some(4));
    let message = said("this", folder);
    assert!(message.contains("process 4711 on there holds the lock now"), "{message}");
    assert!(results(folder) == before, "a file has changed");
    assert_eq!(owner(folder), Some(other));
}
