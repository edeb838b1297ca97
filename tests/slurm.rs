//! Studies on a Slurm of this machine (`tools/slurm`): whatever happens to solvers, controller and nodes, tables and
//! histories are those of a local study.
#![cfg(target_os = "linux")]

mod bend;
mod bends;
mod skipping;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bends::Bends;
use serde_json::{Value, json};

/// What these tests need, and how to get it.
const SLURM: [&str; 2] =
    ["Slurm", "run as root on a Debian system whose packages can be had (tools/slurm install)"];

/// Variables that hide tasks, or replace what a script or an option asks for by what the nodes do not have.
const HIDING: [(&str, &str); 11] = [
    ("SQUEUE_FORMAT", "%i"),
    ("SQUEUE_FORMAT2", "jobid"),
    ("SQUEUE_STATES", "CG"),
    ("SQUEUE_USERS", "nobody"),
    ("SBATCH_WAIT", "1"),
    ("SBATCH_MEM_PER_CPU", "900000"),
    ("SBATCH_CPUS_PER_GPU", "1"),
    ("SBATCH_ERROR", "/nosuch/errors"),
    ("SBATCH_PARTITION", "nosuch"),
    ("SBATCH_JOB_NAME", "mine"),
    ("SBATCH_ARRAY_INX", "0-99"),
];

/// Slurm with two nodes of two processors in a folder of its own.
struct Slurm {
    folder: PathBuf,
    _parent: tempfile::TempDir,
    variables: Vec<(String, String)>,
}

impl Slurm {
    /// Starts it; `None` where it cannot run.
    fn start() -> Option<Self> {
        let tool = |arguments: &[&str]| {
            let done = Command::new(tool_path()).args(arguments).output().unwrap();
            let text =
                String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned();
            (done.status.code().unwrap_or(-1), text)
        };
        let parent = tempfile::Builder::new().prefix("k").tempdir_in("/tmp").unwrap();
        let folder = parent.path().join("s");
        for arguments in [vec!["install"], vec!["start", folder.to_str().unwrap()]] {
            let (code, text) = tool(&arguments);
            if code == 3 {
                println!("{text}");
                return None;
            }
            assert_eq!(code, 0, "{arguments:?}: {text}");
        }
        let text = fs::read_to_string(folder.join("env")).unwrap();
        let pair = |line: &str| {
            line.split_once('=').map(|(name, value)| (name.to_owned(), value.to_owned()))
        };
        Some(Self { folder, _parent: parent, variables: text.lines().filter_map(pair).collect() })
    }

    fn tool(&self, command: &str) {
        let done = Command::new(tool_path()).arg(command).arg(&self.folder).output().unwrap();
        assert!(done.status.success(), "{command}: {}", String::from_utf8_lossy(&done.stderr));
    }

    /// Output of a program of Slurm.
    fn output(&self, words: &[&str]) -> String {
        let mut command = Command::new(words[0]);
        // The program is looked up in the path of the child.
        let path = self.variables.iter().find(|(name, _)| name == "PATH").map(|(_, value)| value);
        let found = path.and_then(|path| {
            std::env::split_paths(path).map(|p| p.join(words[0])).find(|p| p.is_file())
        });
        if let Some(found) = found {
            command = Command::new(found);
        }
        let done = command.args(&words[1..]).envs(self.variables.iter().cloned()).output().unwrap();
        String::from_utf8_lossy(&done.stdout).into_owned()
    }

    fn command(&self, bends: &Bends, options: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        command.args(bends.arguments()).arg("--accept-doubts");
        command.args(["--runner", "slurm", "--task-minutes", "0", "--threads", "1"]).args(options);
        command.envs(self.variables.iter().cloned());
        command
    }

    /// Output of a study that must end with `code`.
    fn study(&self, bends: &Bends, options: &[&str], code: i32) -> String {
        let done = self.command(bends, options).output().unwrap();
        let text = String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned();
        assert_eq!(done.status.code(), Some(code), "{text}");
        text
    }

    fn begin(&self, bends: &Bends) -> Child {
        self.command(bends, &[]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        let _ = Command::new(tool_path()).arg("stop").arg(&self.folder).output();
    }
}

fn tool_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/slurm")
}

/// Polls until `look` finds something.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn record(bends: &Bends, case: &str) -> Option<Value> {
    serde_json::from_slice(&fs::read(bends.run_of(case).join("run.json")).ok()?).ok()
}

fn wait_well(mut study: Child) -> String {
    use std::io::Read as _;
    let mut text = String::new();
    study.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    assert_eq!(study.wait().unwrap().code(), Some(0), "{text}");
    text
}

#[test]
fn whatever_happens_on_slurm_the_results_are_those_of_a_local_study() {
    let Some(mut slurm) = Slurm::start() else { return skipping::skip(SLURM) };

    let twelve = Bends::twelve(0.5);
    let local = twelve.local_results();
    slurm.study(&twelve, &[], 0);
    assert!(twelve.results() == local, "twelve cases");

    fs::remove_dir_all(twelve.at("out")).unwrap();
    let plain = slurm.variables.clone();
    slurm.variables.extend(HIDING.map(|(name, value)| (name.to_owned(), value.to_owned())));
    // Slurm refuses two options for memory, and takes a word that is no option for the script.
    let more = ["--partition", "debug", "--sbatch=--mem-per-cpu=50M --comment=\"two words\""];
    let text = slurm.study(&twelve, &more, 0);
    assert!(!text.contains("submitted again"), "variables that hide tasks: {text}");
    assert!(twelve.results() == local, "variables that hide tasks");
    slurm.variables = plain;

    // Long enough to be hit at work.
    let long = Bends::new(&[("a", json!({}))], 0.002);
    let local = long.local_results();
    let again = || fs::remove_dir_all(long.at("out")).unwrap();

    let study = slurm.begin(&long);
    let process =
        until("no solver", || record(&long, "a").filter(|r| r["increments"].as_u64() > Some(5)));
    let id = process["process"]["id"].as_u64().unwrap().to_string();
    assert!(Command::new("kill").args(["-9", &id]).status().unwrap().success());
    let text = wait_well(study);
    assert!(text.contains("submitted again"), "a solver killed by signal 9: {text}");
    assert!(long.results() == local, "a solver killed by signal 9");
    again();

    slurm.study(&long, &["--detach"], 0);
    slurm.tool("kill-controller");
    slurm.tool("start-controller");
    slurm.study(&long, &[], 0);
    assert!(long.results() == local, "the controller killed right after the submission");
    again();

    let queue = Bends::twelve(0.05);
    let of_queue = queue.local_results();
    let study = slurm.begin(&queue);
    until("no solver", || record(&queue, "c01"));
    // Tasks that run there keep running, the others start on the other node.
    slurm.output(&["scontrol", "update", "NodeName=node1", "State=DRAIN", "Reason=test"]);
    wait_well(study);
    assert!(queue.results() == of_queue, "a node drained");
    slurm.output(&["scontrol", "update", "NodeName=node1", "State=RESUME"]);

    slurm.study(&long, &["--detach"], 0);
    until("no solver", || record(&long, "a").filter(|r| r["increments"].as_u64() > Some(5)));
    slurm.study(&long, &["--cancel"], 0);
    let stopped =
        until("it continues", || record(&long, "a").filter(|r| r["verdict"] == "stopped"));
    slurm.study(&long, &[], 0);
    assert!(record(&long, "a").unwrap()["increments"].as_u64() > stopped["increments"].as_u64());
    assert!(long.results() == local, "cancelled and continued");
}
