//! `kanagata study` from end to end: what is run, what is not run again, what continues, what is refused.

mod bend;
mod bends;
mod command;

use std::fs;
use std::path::Path;

use bends::Bends;
use command::{fixture, kanagata};
use kanagata::run::build::BUILD;
use serde_json::json;

/// A page without what stands in its scripts.
fn markup(page: &str) -> String {
    let mut out = String::new();
    let mut rest = page;
    while let Some(at) = rest.find("<script") {
        let open = at + rest[at..].find('>').unwrap() + 1;
        out += &rest[..open];
        rest = &rest[open + rest[open..].find("</script>").unwrap()..];
    }
    out + rest
}

/// The page is whole by itself: it loads nothing from elsewhere.
fn check_page(page: &Path) {
    let text = fs::read_to_string(page).unwrap();
    assert!(text.trim_end().ends_with("</html>") && text.contains("<figure class=\"plot\""));
    let markup = markup(&text);
    for what in ["http:", "https:", "src=", "<link", "url(", "@import"] {
        assert!(!markup.contains(what), "{what} in {}", page.display());
    }
}

#[test]
fn cases_that_are_done_are_run_again_only_where_something_has_changed() {
    let bends = Bends::new(&[("a", json!({})), ("b", json!({}))], 0.5);
    assert_eq!(bends.begun(&["--jobs", "2"], 0), "a b");
    let states = (bends.row("a").0, bends.row("b").0);
    assert_eq!(states, ("doubtful".into(), "doubtful".into()));
    check_page(&bends.at("out/study.html"));
    assert_eq!(bends.begun(&[], 0), "");
    let tool = bends.at("b/plane.tool.json");
    let text = fs::read_to_string(&tool).unwrap();
    fs::write(&tool, format!("{text}\n")).unwrap();
    // A run of other inputs is kept until it may be lost.
    let (code, text, errors) = bends.study(&[]);
    assert!(code == 2 && !text.contains("begins"), "{text}");
    assert!(errors.contains("b: ../../../b/plane.tool.json has changed"), "{errors}");
    assert!(errors.contains("--renew") && !errors.contains("a: "), "{errors}");
    assert_eq!(bends.begun(&["--renew"], 0), "b");
    assert_eq!(bends.begun(&[], 0), "");
    let record = bends.run_of("a").join("run.json");
    let other = fs::read_to_string(&record).unwrap().replace(BUILD, "0.0.0 of another");
    fs::write(&record, other).unwrap();
    let (code, _, errors) = bends.study(&[]);
    assert!(code == 2 && errors.contains("its build is 0.0.0 of another"), "{errors}");
    fs::remove_dir_all(bends.at("out/cases/a")).unwrap();
    assert_eq!(bends.begun(&[], 0), "a");
    for file in ["out/study.csv", "out/cost.csv", "out/study.html"] {
        fs::remove_file(bends.at(file)).unwrap();
    }
    fs::remove_file(&tool).unwrap();
    // What it was run with cannot be told any more.
    assert_eq!(bends.begun(&["--collect"], 0), "");
    let (state, reason) = bends.row("b");
    assert!(state == "stale" && reason.contains("cannot be compared"), "{state} {reason}");
    assert!(bends.at("out/study.html").exists());
}

#[test]
fn a_name_in_full_runs_one_case_and_an_unknown_one_none() {
    let bends = Bends::new(&[("a", json!({})), ("a-2", json!({})), ("b", json!({}))], 0.5);
    let (code, _, errors) = bends.study(&["--only", "nosuch"]);
    assert_eq!(code, 2, "{errors}");
    assert!(errors.contains("--only: found 'nosuch'") && errors.contains("a, a-2, b"), "{errors}");
    assert!(!bends.at("out").exists());
    let (code, _, errors) = bends.study(&["--only", "a", "--collect"]);
    assert!(code == 2 && errors.contains("--collect"), "{errors}");
    assert_eq!(bends.study(&["--jobs", "0"]).0, 2);
    assert_eq!(bends.begun(&["--only", "a"], 0), "a");
    assert_eq!(bends.row("a-2").0, "waiting");
    assert_eq!(bends.begun(&["--only", "a-"], 0), "a-2");
    // From the study's folder, by its bare name.
    let mut here = assert_cmd::Command::cargo_bin("kanagata").unwrap();
    let done = here.current_dir(bends.folder.path()).args([
        "study",
        "study.json",
        "--accept-doubts",
        "-o",
        "out",
    ]);
    let done = done.output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success() && text.contains("b: begins"), "{text}");
    assert!(!text.contains("a: begins"), "{text}");
}

#[test]
fn a_case_that_fails_is_a_row_with_its_reason() {
    let few = json!({"solver": {"increments": 2}});
    let bends = Bends::new(&[("few", few), ("good", json!({})), ("lost", json!({}))], 0.5);
    fs::remove_dir_all(bends.at("lost")).unwrap();
    assert_eq!(bends.begun(&[], 3), "few good");
    let (state, reason) = bends.row("few");
    assert!(state == "failed" && reason.contains("raise `solver.increments`"), "{reason}");
    let (state, reason) = bends.row("lost");
    assert!(state == "failed" && reason.contains("tools[0].file"), "{reason}");
    assert!(reason.contains("lost/post.tool.json"), "{reason}");
    assert_eq!(bends.row("good"), ("doubtful".into(), String::new()));
    let (code, text, errors) = bends.study(&[]);
    assert!(code == 3 && !text.contains("begins"), "{text}");
    assert!(errors.contains("--tools gives their folder"), "{errors}");
    assert!(text.contains("lost: failed: tools[0].file"), "{text}");
    assert_eq!(bends.begun(&["--again"], 3), "few");
    bends.put_tools("lost");
    assert_eq!(bends.begun(&[], 3), "lost");
    assert_eq!(bends.row("lost").0, "doubtful");
}

#[test]
fn runs_on_several_classes_of_processors_are_noted_on_terminal_and_page() {
    let bends = Bends::new(&[("a", json!({})), ("b", json!({}))], 0.5);
    assert_eq!(bends.begun(&[], 0), "a b");
    let path = bends.run_of("b").join("run.json");
    let mut record: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    record["cpu"] = "of another class".into();
    fs::write(&path, record.to_string()).unwrap();
    let (code, _, errors) = bends.study(&["--collect"]);
    let note = "Runs were computed on several classes of processors: of another class (b)";
    assert!(code == 0 && errors.contains(&format!("note: {note}")), "{errors}");
    let page = fs::read_to_string(bends.at("out/study.html")).unwrap();
    assert!(markup(&page).contains(note));
}

#[test]
fn what_has_no_meaning_or_is_mistyped_is_refused_before_anything_runs() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("out");
    let to = folder.to_str().unwrap();
    for (file, format) in [("patches", "kanagata-patches"), ("stability", "kanagata-stability")] {
        let file = fixture(&format!("studies/{file}.json"));
        for option in [&["--only", "x"][..], &["--quick"], &["--collect"], &["--jobs", "1"]] {
            let (code, _, errors) = kanagata(&[&["study", &file, "-o", to], option].concat());
            assert_eq!(code, 2, "{errors}");
            assert!(errors.contains(format) && errors.contains(option[0]), "{errors}");
            assert!(errors.contains("allowed: -o"), "{errors}");
        }
    }
    let bends = Bends::new(&[("a", json!({})), ("b", json!({"blank": {"layerz": 1}}))], 0.5);
    let (code, _, errors) = bends.study(&[]);
    assert_eq!(code, 2);
    for word in ["study.json", "the case b", "tools = b", "layerz"] {
        assert!(errors.contains(word), "{word}: {errors}");
    }
    let text = fs::read_to_string(bends.at("study.json")).unwrap();
    fs::write(bends.at("study.json"), text.replace("{tools}", "{tolls}")).unwrap();
    let (code, _, errors) = bends.study(&[]);
    assert!(code == 2 && errors.contains("'{tolls}'") && errors.contains("{tools}"), "{errors}");
    let (code, _, errors) = bends.study(&["--tools", "nosuch"]);
    assert!(code == 2 && !errors.contains("nosuch"), "the study file comes first: {errors}");
    assert!(!folder.exists() && !bends.at("out").exists());
}

#[cfg(target_os = "linux")]
mod processes {
    use super::*;
    use kanagata::run::lock;
    use kanagata::run::status::{State, Status, status};
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant, SystemTime};

    /// A study that would run for a minute.
    fn long() -> Bends {
        Bends::new(&[("a", json!({}))], 0.001)
    }

    fn begin(bends: &Bends) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        command.args(bends.arguments()).stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().unwrap()
    }

    fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(found) = look() {
                return found;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "{what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits until the run is at work and has done some increments more than `before`.
    fn at_work(bends: &Bends, before: usize) -> Status {
        until("no run at work", || {
            let now = status(&bends.run_of("a")).ok()?;
            let works = now.state == State::Running && now.increment > before + 1;
            (works && now.checkpoint.is_some()).then_some(now)
        })
    }

    fn signal(process: u32, name: &str) {
        let done = Command::new("kill").args([name, &process.to_string()]).status().unwrap();
        assert!(done.success());
    }

    /// When the run was begun: its tools are written then, and not when it continues.
    fn begun_at(bends: &Bends) -> SystemTime {
        fs::metadata(bends.run_of("a").join("tools/plane.vtu")).unwrap().modified().unwrap()
    }

    /// Has the study continue by some increments.
    fn continue_by_some(bends: &Bends, before: &Status) {
        let mut study = begin(bends);
        at_work(bends, before.increment);
        signal(study.id(), "-TERM");
        assert_eq!(study.wait().unwrap().code(), Some(5));
    }

    #[test]
    fn a_study_that_is_asked_to_end_leaves_checkpoints_and_continues() {
        let bends = long();
        let mut study = begin(&bends);
        at_work(&bends, 0);
        assert!(bends.at("out/order.json").exists(), "written before the first case begins");
        let (code, _, errors) = bends.study(&[]);
        assert!(code == 2 && errors.contains("works in this folder"), "{errors}");
        let (begun, seen) = (begun_at(&bends), Instant::now());
        signal(study.id(), "-TERM");
        assert_eq!(study.wait().unwrap().code(), Some(5));
        assert!(seen.elapsed() < Duration::from_secs(20));
        let stopped = status(&bends.run_of("a")).unwrap();
        assert_eq!(stopped.state, State::Stopped);
        assert!(stopped.checkpoint.as_ref().is_some_and(|c| c.increment == stopped.increment));
        continue_by_some(&bends, &stopped);
        assert_eq!(begun_at(&bends), begun);
    }

    #[test]
    fn a_study_that_is_killed_takes_its_solver_with_it_and_goes_on() {
        let bends = long();
        let mut study = begin(&bends);
        at_work(&bends, 0);
        let begun = begun_at(&bends);
        study.kill().unwrap();
        study.wait().unwrap();
        let run = lock::file_in(&bends.run_of("a"));
        until("the solver continues", || lock::holder(&run).unwrap().is_none().then_some(()));
        let stopped = status(&bends.run_of("a")).unwrap();
        assert_eq!(stopped.state, State::Stopped);
        continue_by_some(&bends, &stopped);
        assert_eq!(begun_at(&bends), begun);
    }

    #[test]
    fn a_solver_that_was_left_behind_gives_way() {
        let bends = long();
        let mut study = begin(&bends);
        let before = at_work(&bends, 0);
        signal(study.id(), "-TERM");
        study.wait().unwrap();
        let solver = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
            command.arg("run").arg(bends.at("out/cases/a/case.scene.json")).arg("-o");
            command.arg(bends.run_of("a")).args(["-q", "--restart"]);
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
            command
        };
        let mut left = solver().spawn().unwrap();
        let now = at_work(&bends, before.increment);
        let second = solver().output().unwrap();
        let said = String::from_utf8_lossy(&second.stderr);
        assert_eq!(second.status.code(), Some(2), "{said}");
        assert!(said.contains("works in this folder") && said.contains("-o"), "{said}");
        assert!(said.contains(&format!("process {}", left.id())), "{said}");
        let begun = begun_at(&bends);
        let mut study = begin(&bends);
        let run = lock::file_in(&bends.run_of("a"));
        until("the solver stays", || {
            let holder = lock::holder(&run).unwrap();
            holder.and_then(|h| h.process).filter(|process| process.id != left.id())
        });
        at_work(&bends, now.increment);
        signal(study.id(), "-TERM");
        assert_eq!(study.wait().unwrap().code(), Some(5));
        assert_eq!(left.wait().unwrap().code(), Some(5), "it leaves a checkpoint");
        assert_eq!(begun_at(&bends), begun);
    }
}
