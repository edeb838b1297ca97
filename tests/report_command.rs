//! `report`: the page of a run from its files, and `run --report`, which says when the run itself writes it.

mod bend;
mod page_data;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use page_data::{Arrays, plots, views};
use serde_json::Value;

/// The bend in a folder of its own.
struct Bend(tempfile::TempDir);

impl Bend {
    fn new() -> Self {
        let bend = Self(tempfile::tempdir().unwrap());
        bend::write_tools(bend.0.path());
        bend.write_scene(|_| ());
        bend
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes the scene with a change; a run of it takes a second.
    fn write_scene(&self, change: impl FnOnce(&mut Value)) {
        let mut scene = bend::scene("");
        scene["stages"][0]["largest_increment"] = 0.2.into();
        change(&mut scene);
        fs::write(self.at("bend.scene.json"), scene.to_string()).unwrap();
    }

    /// Runs the scene into `out` with more arguments: exit code and errors.
    fn run(&self, more: &[&str]) -> (i32, String) {
        let run = ["run", "bend.scene.json", "-q", "--accept-doubts", "-o", "out"];
        let (code, _, errors) = self.program(env!("CARGO_BIN_EXE_kanagata-solve"), &run, more);
        (code, errors)
    }

    /// `kanagata-solve report`: exit code, output and errors.
    fn report(&self, folder: &str) -> (i32, String, String) {
        self.program(env!("CARGO_BIN_EXE_kanagata-solve"), &["report"], &[folder])
    }

    fn program(&self, program: &str, first: &[&str], more: &[&str]) -> (i32, String, String) {
        let mut command = Command::new(program);
        let done = command.args(first).args(more).current_dir(self.0.path()).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code().unwrap_or(-1), text(&done.stdout), text(&done.stderr))
    }

    fn page(&self) -> String {
        fs::read_to_string(self.at("out/report.html")).unwrap()
    }

    /// Removes the page that the run has written, and writes it from its files: both must be the same.
    fn check_page_from_files(&self) {
        let of_run = self.page();
        fs::remove_file(self.at("out/report.html")).unwrap();
        let (code, text, errors) = self.report("out");
        assert_eq!((code, text.trim(), errors.as_str()), (0, "out/report.html", ""));
        let of_files = self.page();
        assert!(of_run == of_files, "{}", first_difference(&of_run, &of_files));
    }
}

/// The places of two texts where they begin to differ.
fn first_difference(a: &str, b: &str) -> String {
    let at = a.bytes().zip(b.bytes()).position(|(a, b)| a != b).unwrap_or(a.len().min(b.len()));
    let around = |text: &str| -> String {
        let bytes = &text.as_bytes()[at.saturating_sub(80)..(at + 80).min(text.len())];
        String::from_utf8_lossy(bytes).into_owned()
    };
    format!("{}\nand\n{}", around(a), around(b))
}

fn size_without_grids(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let size = |path: PathBuf| match path.is_dir() {
        true => size_without_grids(&path),
        false if path.extension().is_some_and(|e| e == "vtu") => 0,
        false => fs::metadata(&path).unwrap().len(),
    };
    entries.map(size).sum()
}

#[test]
fn a_page_from_the_files_of_a_run_is_the_page_of_the_run() {
    let bend = Bend::new();
    assert_eq!(bend.run(&["--set", "tools.plane.friction=0.05"]).0, 0);
    let page = bend.page();
    assert!(page.contains("in the last equilibrium with tools") && page.contains("plastic strain"));
    bend.check_page_from_files();
    // Without springback, and with patches that are excluded.
    bend.write_scene(|scene| drop(scene["stages"].as_array_mut().unwrap().pop()));
    assert_eq!(bend.run(&["--auto"]).0, 0);
    assert!(bend.page().contains("every element, at the end"));
    bend.check_page_from_files();
}

#[test]
fn a_page_is_written_on_request_where_runs_write_it_only_without_convergence() {
    let bend = Bend::new();
    assert_eq!(bend.run(&["--report", "failed"]).0, 0);
    assert!(!bend.at("out/report.html").exists());
    assert!(size_without_grids(&bend.at("out")) < 100_000);
    // The folder of a case contains the run folder, and either program writes the page.
    fs::create_dir(bend.at("case")).unwrap();
    fs::rename(bend.at("out"), bend.at("case/run")).unwrap();
    let kanagata = env!("CARGO_BIN_EXE_kanagata");
    let (code, text, errors) = bend.program(kanagata, &["report"], &["case"]);
    assert_eq!((code, text.trim(), errors.as_str()), (0, "case/run/report.html", ""));
    assert!(bend.at("case/run/report.html").exists());

    bend.write_scene(|scene| scene["solver"] = serde_json::json!({"increments": 3}));
    assert_eq!(bend.run(&["--report", "failed"]).0, 3);
    assert!(bend.page().contains("not converged"));
    bend.check_page_from_files();
}

#[test]
fn a_stopped_run_has_a_page_on_request_until_it_continues() {
    let bend = Bend::new();
    bend.write_scene(|scene| scene["stages"][0]["largest_increment"] = 0.02.into());
    let run = ["run", "bend.scene.json", "-q", "--tied", "-o", "out"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(run)
        .current_dir(bend.0.path())
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !bend.at("out/checkpoint-0.bin").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let (code, _, errors) = bend.report("out");
    assert!(code == 2 && errors.contains("works in out") && errors.contains("status"), "{errors}");
    drop(child.stdin.take());
    assert_eq!(child.wait().unwrap().code(), Some(5));
    let (code, _, errors) = bend.report("out");
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(bend.page().contains("stopped") && bend.page().contains("The formed sheet"));
    assert_eq!(bend.run(&["--restart", "--report", "failed"]).0, 0);
    assert!(!bend.at("out/report.html").exists());
    assert_eq!(bend.report("out").0, 0);
    assert!(bend.page().contains("in the last equilibrium with tools"));
}

#[test]
fn parts_that_files_do_not_give_are_named() {
    let bend = Bend::new();
    assert_eq!(bend.run(&[]).0, 0);
    let whole = bend.page();
    let lacks = |words: &[&str]| {
        let (code, _, errors) = bend.report("out");
        assert!(code == 0 && words.iter().all(|w| errors.contains(w)), "{words:?}: {errors}");
        assert!(bend.page().contains("Not on this page: "));
        bend.page()
    };
    // The sheet does not need the scene; its numbers are rounded to six digits.
    bend.write_scene(|scene| scene["name"] = "other".into());
    let page = lacks(&["final positions of the tools", "scene has changed since the run"]);
    for plot in [1, 2] {
        assert_eq!(plots(&page)[plot], plots(&whole)[plot], "{plot}");
    }
    let sheet = |page: &str| {
        let (view, arrays) = (views(page).swap_remove(0), Arrays::of(page));
        let part = &view["parts"][0];
        let fields = part["fields"].as_array().unwrap().iter().map(|field| &field["values"]);
        let of = part["points"].as_array().unwrap().iter().chain(fields);
        of.flat_map(|what| arrays.read(what)).collect::<Vec<f64>>()
    };
    let (of_files, of_scene) = (sheet(&page), sheet(&whole));
    // Places, thickness, thinning, springback and waves of 17 by 2 points; plastic strain and margin of 16 elements.
    assert_eq!((of_files.len(), of_scene.len()), (7 * 34 + 32, 7 * 34 + 32));
    let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-5 || a.is_nan() && b.is_nan();
    assert!(of_files.iter().zip(&of_scene).all(same));
    bend.write_scene(|_| ());
    let record: Value =
        serde_json::from_slice(&fs::read(bend.at("out/run.json")).unwrap()).unwrap();
    let held = record["springback"]["from_increment"].as_u64().unwrap();
    fs::remove_file(bend.at(&format!("out/steps/{held:06}.vtu"))).unwrap();
    let page = lacks(&["strains in the last equilibrium with tools", "is missing"]);
    assert!(page.contains("The formed sheet") && !page.contains("Forming limit diagram"));
    fs::write(bend.at("out/steps/last.vtu"), "<VTKFile").unwrap();
    lacks(&["thickness, strains and formed sheet", "last.vtu, XML"]);
    fs::remove_file(bend.at("out/steps/last.vtu")).unwrap();
    let page = lacks(&["thickness, strains and formed sheet (steps/last.vtu is missing)"]);
    assert!(!page.contains("The formed sheet") && page.contains("Force against travel"));
}

#[test]
fn a_folder_that_is_no_run_is_refused() {
    let bend = Bend::new();
    for folder in [".", "nosuch", "bend.scene.json"] {
        let (code, text, errors) = bend.report(folder);
        assert_eq!((code, text.as_str()), (2, ""), "{folder}: {errors}");
        assert!(errors.contains("no run.json") && errors.contains("try: "), "{folder}: {errors}");
    }
    for (file, content) in [("run.json", "{}"), ("run.json", "[[[")] {
        fs::create_dir_all(bend.at("out")).unwrap();
        fs::write(bend.at("out").join(file), content).unwrap();
        let (code, _, errors) = bend.report("out");
        assert!(code == 2 && errors.contains("run.json"), "{errors}");
    }
    assert_eq!(bend.run(&["--overwrite"]).0, 0);
    fs::write(bend.at("out/history.csv"), "increment\n1\n").unwrap();
    let (code, _, errors) = bend.report("out");
    assert!(code == 2 && errors.contains("history.csv"), "{errors}");
}
