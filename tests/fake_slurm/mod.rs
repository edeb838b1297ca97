//! A Slurm that is stood in for by the programs beside this file.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::fs;
use std::path::{Path, PathBuf};
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
        let slurm = ["--runner", "slurm", "--task-minutes", "0", "--threads", "1"];
        let more = variables.iter().map(|(name, value)| (*name, (*value).to_owned()));
        let variables: Vec<(&str, String)> = self.variables().into_iter().chain(more).collect();
        bends.study_with(&variables, &[&slurm, options].concat())
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
