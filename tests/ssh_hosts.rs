//! Studies over ssh on two hosts with other names and other mount points (`tools/ssh-hosts`): tables and histories are
//! those of a local study.
#![cfg(target_os = "linux")]

mod bend;
mod bends;
mod skipping;

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use bends::Bends;
use serde_json::{Value, json};

/// What these tests need, and how to get it.
const HOSTS: [&str; 2] = [
    "two hosts with ssh",
    "run as root on a Debian system with namespaces whose packages can be had (tools/ssh-hosts install)",
];
/// Runs a case on a host: its shell replaces the variable with the mount point there.
const SUBMIT: &str = "ssh {host} cd $STUDY/out && {case}";

/// Two hosts that share the folder of a study.
struct Hosts {
    folder: tempfile::TempDir,
    variables: Vec<(String, String)>,
}

impl Hosts {
    /// Starts them; `None` where they cannot run.
    fn start(bends: &Bends) -> Option<Self> {
        let folder = tempfile::Builder::new().prefix("k").tempdir_in("/tmp").unwrap();
        let [at, shared] = [folder.path(), bends.folder.path()].map(|p| p.to_str().unwrap());
        for arguments in [vec!["install"], vec!["start", at, shared]] {
            let done = Command::new(tool_path()).args(&arguments).output().unwrap();
            let text = text(&done);
            if done.status.code() == Some(3) {
                println!("{text}");
                return None;
            }
            assert!(done.status.success(), "{arguments:?}: {text}");
        }
        let text = fs::read_to_string(folder.path().join("env")).unwrap();
        let pair = |line: &str| {
            line.split_once('=').map(|(name, value)| (name.to_owned(), value.to_owned()))
        };
        Some(Self { variables: text.lines().filter_map(pair).collect(), folder })
    }

    fn study(&self, bends: &Bends, options: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        command.args(bends.arguments()).arg("--accept-doubts").args(options);
        command.envs(self.variables.iter().cloned());
        command
    }

    /// Runs a line of a shell on a host.
    fn ssh(&self, host: &str, line: &str) -> String {
        let mut ssh = Command::new(self.folder.path().join("bin/ssh"));
        let done = ssh.args([host, line]).envs(self.variables.iter().cloned()).output().unwrap();
        assert!(done.status.success(), "{host}: {}", text(&done));
        text(&done)
    }

    /// Runs lines with GNU parallel on both hosts, in the folder `out` of each one's mount point.
    fn parallel(&self, lines: &[&str]) {
        let mut command = Command::new(self.folder.path().join("bin/parallel"));
        // What parallel puts in for {} is one quoted word.
        command.args(["--sshlogin", "1/host1,2/host2", "cd \"$STUDY/out\" && eval {}"]);
        command.envs(self.variables.iter().cloned());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        child.stdin.take().unwrap().write_all((lines.join("\n") + "\n").as_bytes()).unwrap();
        let done = child.wait_with_output().unwrap();
        assert!(done.status.success(), "{lines:?}: {}", text(&done));
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        let _ = Command::new(tool_path()).arg("stop").arg(self.folder.path()).output();
    }
}

fn tool_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/ssh-hosts")
}

fn text(done: &Output) -> String {
    String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned()
}

/// Standard output of a command that must end with `code`.
fn output(mut command: Command, code: i32) -> String {
    let done = command.output().unwrap();
    assert_eq!(done.status.code(), Some(code), "{}", text(&done));
    String::from_utf8(done.stdout).unwrap()
}

fn record(bends: &Bends, case: &str) -> Option<Value> {
    serde_json::from_slice(&fs::read(bends.run_of(case).join("run.json")).ok()?).ok()
}

/// Host name in the record of a run.
fn host(record: &Value) -> String {
    record["process"]["host"].as_str().unwrap().split(' ').next().unwrap().to_owned()
}

/// Host names in the records of all cases.
fn hosts(bends: &Bends) -> BTreeSet<String> {
    let cases = fs::read_dir(bends.at("out/cases")).unwrap();
    let names = cases.map(|case| case.unwrap().file_name().into_string().unwrap());
    names.map(|name| host(&record(bends, &name).unwrap())).collect()
}

/// Waits until the run of the case `a` has `count` increments.
fn until_increment(bends: &Bends, study: &mut Child, count: u64) -> Value {
    let start = Instant::now();
    loop {
        if let Some(found) = record(bends, "a").filter(|r| r["increments"].as_u64() >= Some(count))
        {
            return found;
        }
        assert!(study.try_wait().unwrap().is_none(), "the study has ended");
        assert!(start.elapsed() < Duration::from_secs(120), "no run with {count} increments");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn hosts_with_other_mount_points_have_the_results_of_a_local_study() {
    let bends = Bends::twelve(0.5);
    let Some(on) = Hosts::start(&bends) else { return skipping::skip(HOSTS) };
    let local = bends.local_results();
    let both = BTreeSet::from(["host1", "host2"].map(String::from));
    let own = bends.folder.path().to_str().unwrap();
    assert_ne!(on.ssh("host1", "echo $STUDY"), on.ssh("host2", "echo $STUDY"));
    for host in &both {
        assert_eq!(on.ssh(host, "hostname").trim(), host);
        assert_eq!(on.ssh(host, &format!("ls {own}")), "", "no other path to the study's files");
    }

    output(on.study(&bends, &["--prepare"]), 0);
    let emit = ["--runner", "command", "--submit", "{case}", "--emit"];
    let lines = output(on.study(&bends, &emit), 0);
    let order: Value =
        serde_json::from_slice(&fs::read(bends.at("out/order.json")).unwrap()).unwrap();
    let first = order["ranks"][0].as_array().unwrap().len();
    let lines: Vec<&str> = lines.lines().collect();
    assert!(lines.len() == 12 && lines[first].ends_with("cases/c00"), "{lines:?}");
    on.parallel(&lines[..first]);
    on.parallel(&lines[first..]);
    assert_eq!(hosts(&bends), both);
    assert_eq!(bends.begun(&[], 0), "", "all are done");
    assert_eq!(bends.results(), local, "GNU parallel");
    fs::remove_dir_all(bends.at("out")).unwrap();

    let options = ["--runner", "command", "--hosts", "host1,host2:2", "--submit", SUBMIT];
    output(on.study(&bends, &options), 0);
    assert_eq!(hosts(&bends), both);
    assert_eq!(bends.results(), local, "a template with ssh");
}

#[test]
fn a_study_over_ssh_that_is_stopped_continues_from_checkpoints_of_the_host() {
    let bends = Bends::new(&[("a", json!({}))], 0.002);
    let Some(on) = Hosts::start(&bends) else { return skipping::skip(HOSTS) };
    let local = bends.local_results();
    let on_host =
        |host| on.study(&bends, &["--runner", "command", "--hosts", host, "--submit", SUBMIT]);

    let mut study = on_host("host2").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    until_increment(&bends, &mut study, 20);
    let mut status = Command::new(env!("CARGO_BIN_EXE_kanagata"));
    status.arg("study").arg(bends.at("out")).arg("--status");
    let text = output(status, 0);
    assert!(text.contains("a: running on host2, increment "), "{text}");

    let id = study.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    let done = study.wait_with_output().unwrap();
    let text = String::from_utf8(done.stdout).unwrap();
    assert_eq!(done.status.code(), Some(5), "{text}");
    assert!(!text.contains("submitted again"), "{text}");
    // The study ends after its solver.
    let stopped = record(&bends, "a").unwrap();
    assert_eq!((stopped["verdict"].as_str(), host(&stopped)), (Some("stopped"), "host2".into()));
    let reached = stopped["increments"].as_u64().unwrap();
    assert!((20..500).contains(&reached), "{reached}");

    // The next command runs it on the other host.
    output(on_host("host1"), 0);
    assert!(bends.results() == local);
    assert_eq!(host(&record(&bends, "a").unwrap()), "host1");
}
