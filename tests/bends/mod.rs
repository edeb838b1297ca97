//! Studies of a strip that is bent: cases of a fraction of a second.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::fs;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::bend;

/// A study of bends: cases by the name of their tools' folder, with what each changes of the scene.
pub struct Bends {
    pub folder: tempfile::TempDir,
}

impl Bends {
    /// Largest increments of `share` of a stage; two to eleven of them go through the strip in a fraction of a second.
    pub fn new(cases: &[(&str, Value)], share: f64) -> Self {
        let bends = Self { folder: tempfile::tempdir().unwrap() };
        let mut scene = bend::scene("{tools}");
        scene["stages"] = json!([{
            "name": "bend", "drive": {"plane": {"travel_mm": 1.0}}, "largest_increment": share,
        }]);
        scene["output"] = json!({"vtu_every": 0, "checkpoint_every": 1});
        let options: Vec<Value> =
            cases.iter().map(|(name, change)| json!({"name": name, "change": change})).collect();
        let study = json!({
            "format": "kanagata-study", "version": 1, "name": "bends", "watch": "plane",
            "scene": scene, "choices": [{"name": "tools", "options": options}],
        });
        bends.put_study(&study);
        cases.iter().for_each(|(name, _)| bends.put_tools(name));
        bends
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn put_tools(&self, case: &str) {
        fs::create_dir_all(self.at(case)).unwrap();
        bend::write_tools(&self.at(case));
    }

    /// The folder of a case's run.
    pub fn run_of(&self, case: &str) -> PathBuf {
        self.at("out/cases").join(case).join("run")
    }

    pub fn arguments(&self) -> Vec<String> {
        let path = |name: &str| self.at(name).to_str().unwrap().to_owned();
        vec!["study".into(), path("study.json"), "-o".into(), path("out")]
    }

    /// Exit code, output and errors of the study.
    pub fn study(&self, options: &[&str]) -> (i32, String, String) {
        self.study_with(&[], options)
    }

    /// As [`Self::study`], with variables of the environment.
    pub fn study_with(
        &self,
        variables: &[(&str, String)],
        options: &[&str],
    ) -> (i32, String, String) {
        let mut command = assert_cmd::Command::cargo_bin("kanagata").unwrap();
        command.args(self.arguments()).arg("--accept-doubts").args(options);
        command.envs(variables.iter().map(|(name, value)| (*name, value)));
        let done = command.output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code().unwrap_or(-1), text(&done.stdout), text(&done.stderr))
    }

    /// Cases that a study has begun; it must end with `code`.
    pub fn begun(&self, options: &[&str], code: i32) -> String {
        let (found, text, errors) = self.study(options);
        assert_eq!(found, code, "{options:?}: {text}{errors}");
        let mut begun: Vec<&str> =
            text.lines().filter_map(|l| l.strip_suffix(": begins")).collect();
        begun.sort_unstable();
        begun.join(" ")
    }

    /// State and reason of a case in `study.csv`.
    pub fn row(&self, case: &str) -> (String, String) {
        let text = fs::read_to_string(self.at("out/study.csv")).unwrap();
        let column = |name: &str| text.lines().next().unwrap().split(',').position(|c| c == name);
        let row = text.lines().find(|l| l.starts_with(&format!("{case},"))).unwrap();
        let cells: Vec<&str> = row.split(',').collect();
        let reason = column("reason").unwrap();
        (cells[column("state").unwrap()].to_owned(), cells[reason..].join(","))
    }

    /// Twelve cases; two follow the increments of another.
    pub fn twelve(share: f64) -> Self {
        let names: Vec<String> = (0..12).map(|k| format!("c{k:02}")).collect();
        let change = |k: usize| json!({"blank": {"layers": 1 + k % 3, "thickness_mm": 0.9 + 0.02 * k as f64}});
        let cases: Vec<(&str, Value)> =
            names.iter().enumerate().map(|(k, name)| (name.as_str(), change(k))).collect();
        let bends = Self::new(&cases, share);
        let mut study = bends.file();
        study["follow"] = json!([{"of": "c01", "cases": ["c00", "c05"]}]);
        bends.put_study(&study);
        bends
    }

    pub fn file(&self) -> Value {
        serde_json::from_str(&fs::read_to_string(self.at("study.json")).unwrap()).unwrap()
    }

    pub fn put_study(&self, study: &Value) {
        fs::write(self.at("study.json"), study.to_string()).unwrap();
    }

    /// The final table, then the history of every case, after `study` in the folder `out`.
    pub fn results(&self) -> Vec<(String, String)> {
        let mut results =
            vec![("study.csv".to_owned(), fs::read_to_string(self.at("out/study.csv")).unwrap())];
        let mut cases: Vec<_> =
            fs::read_dir(self.at("out/cases")).unwrap().map(|e| e.unwrap().path()).collect();
        cases.sort();
        for case in cases {
            let name = case.file_name().unwrap().to_str().unwrap().to_owned();
            let history = fs::read_to_string(case.join("run/history.csv")).unwrap();
            results.push((name, history));
        }
        results
    }

    /// The results of a local study, after which its runs are removed and its prepared cases remain.
    pub fn local_results_kept(&self) -> Vec<(String, String)> {
        let (code, text, errors) = self.study(&["--jobs", "2"]);
        assert_eq!(code, 0, "{text}{errors}");
        let results = self.results();
        for case in fs::read_dir(self.at("out/cases")).unwrap() {
            fs::remove_dir_all(case.unwrap().path().join("run")).unwrap();
        }
        results
    }

    /// The results of a local study, after which the folder `out` is empty again.
    pub fn local_results(&self) -> Vec<(String, String)> {
        let (code, text, errors) = self.study(&["--jobs", "2"]);
        assert_eq!(code, 0, "{text}{errors}");
        let results = self.results();
        fs::remove_dir_all(self.at("out")).unwrap();
        results
    }
}
