//! Studies whose cases run elsewhere: a Slurm that is stood in for, and commands of a template. Whatever fails on the way,
//! tables and histories are those of a local study.
#![cfg(target_os = "linux")]

mod bend;
mod bends;
mod fake_slurm;

use std::fs;
use std::path::PathBuf;

use bends::Bends;
use fake_slurm::{FakeSlurm, Halted, ends_well, increments, until};
use serde_json::{Value, json};

#[test]
fn a_study_on_slurm_has_the_results_of_a_local_one() {
    let (bends, slurm) = (Bends::twelve(0.5), FakeSlurm::new());
    let local = bends.local_results();
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
    // Two ranks, the second of which waits for the first.
    assert_eq!(slurm.submissions(), 2);
    ends_well(slurm.study(&bends, &[]));
    assert_eq!(slurm.submissions(), 2, "what is done is not submitted");
}

#[test]
fn a_submission_that_is_lost_is_made_again() {
    let (bends, slurm) = (Bends::new(&[("a", json!({})), ("b", json!({}))], 0.5), FakeSlurm::new());
    let local = bends.local_results();
    slurm.set("forget", true);
    let text = ends_well(slurm.study(&bends, &[]));
    assert!(text.contains("a: its ticket is gone; submitted again"), "{text}");
    assert_eq!((slurm.submissions(), bends.results()), (2, local));
}

#[test]
fn a_case_without_progress_fails_after_some_tries() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.5), FakeSlurm::new());
    let local = bends.local_results();
    slurm.set("fail", true);
    let (code, text, _) = slurm.study(&bends, &["--max-tries", "2"]);
    assert_eq!((code, slurm.submissions()), (3, 2), "{text}");
    assert!(text.contains("Slurm says NODE_FAIL; submitted 2 times without progress"), "{text}");
    let (state, reason) = bends.row("a");
    assert!(state == "failed" && reason.contains("NODE_FAIL"), "{state} {reason}");
    let (_, status, _) = bends.study(&["--status"]);
    assert!(status.contains("a: failed") && status.contains("without progress"), "{status}");
    // It remains failed until it is asked for again.
    let (code, text, _) = slurm.study(&bends, &["--max-tries", "2"]);
    assert_eq!((code, slurm.submissions()), (3, 2), "{text}");
    slurm.set("fail", false);
    ends_well(slurm.study(&bends, &["--again"]));
    assert!(bends.results() == local);
}

#[test]
fn a_run_that_does_not_converge_is_not_tried_again() {
    let few = json!({"solver": {"increments": 2}});
    let (bends, slurm) = (Bends::new(&[("few", few), ("good", json!({}))], 0.5), FakeSlurm::new());
    let (code, text, errors) = slurm.study(&bends, &[]);
    assert_eq!((code, slurm.submissions()), (3, 1), "{text}{errors}");
    let (state, reason) = bends.row("few");
    assert!(state == "failed" && reason.contains("raise `solver.increments`"), "{reason}");
    assert_eq!(bends.row("good").0, "doubtful");
    let (code, _, _) = slurm.study(&bends, &[]);
    assert_eq!((code, slurm.submissions()), (3, 1));
}

#[test]
fn an_engine_without_answer_changes_nothing() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.5), FakeSlurm::new());
    let local = bends.local_results();
    slurm.set("down", true);
    let (code, text, errors) = slurm.study(&bends, &["--detach"]);
    assert_eq!(code, 4, "{text}{errors}");
    assert!(errors.contains("does not answer") && errors.contains("connect failure"), "{errors}");
    assert!(!bends.run_of("a").exists());
    slurm.set("down", false);
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
}

#[test]
fn a_submission_that_is_refused_ends_the_study() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.5), FakeSlurm::new());
    slurm.set("refuse", true);
    let (code, _, errors) = slurm.study(&bends, &[]);
    assert_eq!((code, slurm.submissions()), (2, 1));
    assert!(errors.contains("refuses the submission"), "{errors}");
    assert!(errors.contains("Memory specification can not be satisfied"), "{errors}");
    // What was never accepted costs no try.
    for _ in 0..3 {
        assert_eq!(slurm.study(&bends, &[]).0, 2);
    }
    slurm.set("refuse", false);
    ends_well(slurm.study(&bends, &[]));
}

#[test]
fn a_run_of_inputs_that_changed_meanwhile_is_kept_until_it_may_be_lost() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.002), FakeSlurm::new());
    ends_well(slurm.study(&bends, &["--detach"]));
    let halted = Halted::at_work(&bends, "a");
    let mut study = bends.file();
    study["scene"]["blank"]["thickness_mm"] = 0.9.into();
    bends.put_study(&study);
    let (code, text) = slurm.study_until(&bends, "a: runs", || drop(halted));
    assert_eq!((code, slurm.submissions()), (3, 1), "{text}");
    assert!(text.contains("its run is of other inputs: scene has changed"), "{text}");
    let (code, _, errors) = slurm.study(&bends, &[]);
    assert!(code == 2 && errors.contains("a: scene has changed"), "{errors}");
    ends_well(slurm.study(&bends, &["--renew"]));
    assert_eq!(slurm.submissions(), 2);
}

#[test]
fn followers_wait_for_a_leader_that_runs_without_a_ticket() {
    let (bends, slurm) = (Bends::twelve(0.01), FakeSlurm::new());
    let local = bends.local_results();
    ends_well(bends.study(&["--prepare"]));
    let mut leader = std::process::Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    let mut leader = leader.arg("case").arg(bends.at("out/cases/c01")).spawn().unwrap();
    until("it does not run", || increments(&bends, "c01").filter(|n| *n > 1));
    ends_well(slurm.study(&bends, &[]));
    leader.wait().unwrap();
    // The others, and those that follow: as often as there are ranks.
    assert!(slurm.submissions() <= 3, "{}", slurm.submissions());
    assert!(bends.results() == local);
}

#[test]
fn tickets_that_are_lost_cost_no_results() {
    let (bends, slurm) = (Bends::twelve(0.02), FakeSlurm::new());
    let local = bends.local_results();
    ends_well(slurm.study(&bends, &["--detach"]));
    until("nothing runs", || increments(&bends, "c01").filter(|n| *n > 0));
    fs::remove_file(bends.at("out/runner.json")).unwrap();
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
}

#[test]
fn cases_that_are_cancelled_continue_from_their_checkpoints() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.002), FakeSlurm::new());
    let local = bends.local_results();
    ends_well(slurm.study(&bends, &["--detach"]));
    let halted = Halted::at_work(&bends, "a");
    // Another runner would not know of it.
    let (code, _, errors) = bends.study(&[]);
    assert!(code == 2 && errors.contains("submitted with the runner slurm"), "{errors}");
    ends_well(slurm.study(&bends, &["--cancel"]));
    drop(halted);
    until("it continues", || {
        let text = fs::read_to_string(bends.run_of("a").join("run.json")).ok()?;
        text.contains("\"stopped\"").then_some(())
    });
    let stopped = increments(&bends, "a").unwrap();
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
    assert!(increments(&bends, "a").unwrap() > stopped && slurm.submissions() == 2);
}

#[test]
fn inputs_that_change_in_the_queue_are_named() {
    let (bends, slurm) = (Bends::new(&[("a", json!({}))], 0.5), FakeSlurm::new());
    slurm.set("forget", true);
    ends_well(slurm.study(&bends, &["--detach"]));
    let tool = bends.at("a/plane.tool.json");
    let text = fs::read_to_string(&tool).unwrap();
    fs::write(&tool, format!("{text}\n")).unwrap();
    let case = bends.at("out/cases/a");
    let mut solve = assert_cmd::Command::cargo_bin("kanagata-solve").unwrap();
    let done = solve.arg("case").arg(&case).output().unwrap();
    let errors = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{errors}");
    assert!(errors.contains("a/plane.tool.json has changed"), "{errors}");
    let (code, text, _) = bends.study_with(&[], &["--status"]);
    assert_eq!(code, 0, "{text}");
}

#[test]
fn commands_of_a_template_run_cases_on_hosts() {
    let bends = Bends::twelve(0.5);
    let local = bends.local_results();
    let hosts = bends.at("hosts");
    let template = format!(
        "sh -c 'echo {{host}} {{threads}} >> {} && cd {{dir}} && {{case}}'",
        hosts.display()
    );
    let options = ["--runner", "command", "--hosts", "one,two:2", "--submit", &template];
    ends_well(bends.study(&options));
    assert!(bends.results() == local);
    let hosts = fs::read_to_string(hosts).unwrap();
    assert_eq!(hosts.lines().count(), 12);
    assert!(hosts.contains("one 1") && hosts.contains("two 1"), "{hosts}");
    let (code, _, errors) =
        bends.study(&["--runner", "command", "--submit", "run {nosuch} {case}"]);
    assert!(code == 2 && errors.contains("found {nosuch}; allowed: {case}"), "{errors}");
    let (code, _, errors) = bends.study(&["--runner", "command", "--submit", "run it"]);
    assert!(code == 2 && errors.contains("{case}"), "{errors}");
}

#[test]
fn an_engine_of_a_template_is_asked_for_its_tickets() {
    let bends = Bends::new(&[("a", json!({})), ("b", json!({}))], 0.5);
    let local = bends.local_results();
    let submit = "sh -c '{case} > {dir}/{name}.log 2>&1 & echo job $!'";
    let options = [
        "--runner",
        "command",
        "--submit",
        submit,
        "--poll",
        "kill -0 {ticket}",
        "--end",
        "kill {ticket}",
    ];
    ends_well(bends.study(&[&options[..], &["--detach"]].concat()));
    ends_well(bends.study(&options));
    assert!(bends.results() == local);
}

#[test]
fn what_would_be_submitted_is_printed() {
    let (bends, slurm) = (Bends::twelve(0.5), FakeSlurm::new());
    let mut study = bends.file();
    study["slurm"] = json!({"account": "forming", "partition": "long", "options": ["--qos=low"]});
    bends.put_study(&study);
    let text = ends_well(slurm.study(&bends, &["--emit", "--partition", "short"]));
    for line in
        ["--account=forming", "--partition=short", "--qos=low", "--signal=B:TERM@60", "--mem="]
    {
        assert!(text.contains(&format!("#SBATCH {line}")), "{line}: {text}");
    }
    assert!(!text.contains("partition=long") && slurm.submissions() == 0);
    let lines = ends_well(bends.study(&["--runner", "command", "--submit", "{case}", "--emit"]));
    assert_eq!(lines.lines().count(), 12);
    // The commands by themselves do what the study does, in their order.
    let local = bends.local_results_kept();
    for line in lines.lines() {
        let done = std::process::Command::new("sh")
            .args(["-c", line])
            .current_dir(bends.at("out"))
            .output()
            .unwrap();
        assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
    }
    assert_eq!(bends.begun(&[], 0), "");
    assert!(bends.results() == local);
}

#[test]
fn prepared_cases_are_run_by_their_own_command() {
    let bends = Bends::twelve(0.5);
    let local = bends.local_results();
    ends_well(bends.study(&["--prepare"]));
    let order: Value =
        serde_json::from_slice(&fs::read(bends.at("out/order.json")).unwrap()).unwrap();
    assert_eq!(order["ranks"][1], json!(["c00", "c05"]));
    let case: Value =
        serde_json::from_slice(&fs::read(bends.at("out/cases/c00/case.json")).unwrap()).unwrap();
    assert_eq!(case["follows"], "c01");
    assert!(case["expected"]["memory_mb"].as_f64().unwrap() > 1.0, "{case}");
    let text = case.to_string();
    assert!(
        !text.contains(bends.folder.path().to_str().unwrap()),
        "no path of this machine: {text}"
    );
    let solve = |folders: &[PathBuf]| {
        let mut solve = assert_cmd::Command::cargo_bin("kanagata-solve").unwrap();
        let done = solve.arg("case").args(folders).output().unwrap();
        let text = String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned();
        (done.status.code().unwrap(), text)
    };
    let folder = |name: &str| bends.at("out/cases").join(name);
    let (code, text) = solve(&[folder("c00")]);
    assert!(code == 5 && text.contains("waits for c01"), "{text}");
    // In another place they are the same cases.
    let moved = bends.at("moved");
    fs::create_dir(&moved).unwrap();
    for name in ["out", "c01", "c02"] {
        fs::rename(bends.at(name), moved.join(name)).unwrap();
    }
    let there = |name: &str| moved.join("out/cases").join(name);
    let (code, text) = solve(&[there("c01"), there("c02")]);
    assert_eq!(code, 0, "{text}");
    let (code, text) = solve(&[there("c01")]);
    assert!(code == 0 && text.contains("already done"), "{text}");
    for name in ["out", "c01", "c02"] {
        fs::rename(moved.join(name), bends.at(name)).unwrap();
    }
    let begun = bends.begun(&[], 0);
    assert!(!begun.contains("c01") && !begun.contains("c02") && begun.contains("c00"), "{begun}");
    assert!(bends.results() == local);
}
