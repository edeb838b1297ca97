//! A Slurm that is stood in for by the programs beside this file.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::bends::Bends;

/// A folder in which `tests/fake_slurm` keeps its state.
pub struct FakeSlurm {
    folder: tempfile::TempDir,
}

impl FakeSlurm {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Asks for a fault, or ends it.
    pub fn set(&self, fault: &str, present: bool) {
        if present {
            fs::write(self.at(fault), "").unwrap();
        } else {
            fs::remove_file(self.at(fault)).unwrap();
        }
    }

    /// Number of calls of sbatch.
    pub fn submissions(&self) -> usize {
        fs::read_to_string(self.at("calls")).unwrap_or_default().lines().count()
    }

    /// Names of the programs that were called.
    pub fn programs(&self) -> Vec<String> {
        let text = fs::read_to_string(self.at("programs")).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    /// Arguments of the calls of scancel.
    pub fn cancelled(&self) -> Vec<String> {
        let text = fs::read_to_string(self.at("cancelled")).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    /// Values of an option that counted, by submission.
    pub fn asked(&self, option: &str) -> Vec<String> {
        let text = fs::read_to_string(self.at("asked")).unwrap_or_default();
        let value = |line: &str| line.strip_prefix(&format!("{option}=")).map(str::to_owned);
        text.lines().filter_map(value).collect()
    }

    pub fn variables(&self) -> [(&'static str, String); 2] {
        let fake = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fake_slurm");
        let path = format!("{}:{}", fake.display(), std::env::var("PATH").unwrap());
        [("FAKE_SLURM", self.folder.path().display().to_string()), ("PATH", path)]
    }

    /// Exit code, output and errors of a study with this Slurm.
    pub fn study(&self, bends: &Bends, options: &[&str]) -> (i32, String, String) {
        self.study_with(bends, &[], options)
    }

    /// As [`Self::study`], with variables of the environment.
    pub fn study_with(
        &self,
        bends: &Bends,
        variables: &[(&str, &str)],
        options: &[&str],
    ) -> (i32, String, String) {
        let more = variables.iter().map(|(name, value)| (*name, (*value).to_owned()));
        let variables: Vec<(&str, String)> = self.variables().into_iter().chain(more).collect();
        bends.study_with(&variables, &[&OPTIONS, options].concat())
    }

    /// Exit code and output of a study; when it has printed `line`, `then` is called.
    pub fn study_until(&self, bends: &Bends, line: &str, then: impl FnOnce()) -> (i32, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        command.args(bends.arguments()).arg("--accept-doubts").args(OPTIONS);
        command.envs(self.variables()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut study = command.spawn().unwrap();
        let mut output = BufReader::new(study.stdout.take().unwrap());
        let mut text = String::new();
        while !text.lines().any(|own| own == line) {
            assert!(output.read_line(&mut text).unwrap() > 0, "no line {line:?}: {text}");
        }
        then();
        output.read_to_string(&mut text).unwrap();
        (study.wait().unwrap().code().unwrap_or(-1), text)
    }
}

/// Options of every study with this Slurm.
const OPTIONS: [&str; 6] = ["--runner", "slurm", "--task-minutes", "0", "--threads", "1"];

/// A solver that stands still in the middle of its run until this is dropped. A signal reaches it afterwards.
pub struct Halted {
    process: String,
}

impl Halted {
    /// Halts the solver of a case after its first increments.
    pub fn at_work(bends: &Bends, case: &str) -> Self {
        let record = || -> Option<Value> {
            serde_json::from_slice(&fs::read(bends.run_of(case).join("run.json")).ok()?).ok()
        };
        let record =
            until("it does not run", || record().filter(|r| r["increments"].as_u64() > Some(1)));
        let halted = Self { process: record["process"]["id"].to_string() };
        halted.signal("-STOP");
        // A process that stands still has not ended.
        until("it does not stand still", || {
            let text = fs::read_to_string(format!("/proc/{}/stat", halted.process)).ok()?;
            text.contains("(kanagata-solve) T").then_some(())
        });
        halted
    }

    fn signal(&self, name: &str) {
        let done = Command::new("kill").args([name, &self.process]).status().unwrap();
        assert!(done.success(), "{name} of {}", self.process);
    }
}

impl Drop for Halted {
    fn drop(&mut self) {
        let _ = Command::new("kill").args(["-CONT", &self.process]).status();
    }
}

/// Polls until `look` finds something.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Increments of the run of a case.
pub fn increments(bends: &Bends, case: &str) -> Option<u64> {
    let text = fs::read(bends.run_of(case).join("run.json")).ok()?;
    serde_json::from_slice::<Value>(&text).ok()?["increments"].as_u64()
}

/// Output of a study that must end with exit code 0.
pub fn ends_well((code, text, errors): (i32, String, String)) -> String {
    assert_eq!(code, 0, "{text}{errors}");
    text
}
