//! What a study asks of an engine: how often, with which options whatever the environment holds, and what it does where
//! runs or tasks are gone or done meanwhile.
#![cfg(target_os = "linux")]

mod bend;
mod bends;
mod fake_slurm;
mod skipping;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use bends::Bends;
use fake_slurm::{FakeSlurm, Halted, ends_well, until};
use serde_json::{Value, json};

const SOLVER: &str = env!("CARGO_BIN_EXE_kanagata-solve");
/// What tests of system calls need, and how to get it.
const STRACE: [&str; 2] = ["strace", "run `apt-get install strace` where processes may be traced"];

fn has_strace() -> bool {
    let mut trial = Command::new("strace");
    trial.args(["-f", "--seccomp-bpf", "-o", "/dev/null", "-e", "trace=mkdir", "true"]);
    trial.stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

fn one(share: f64) -> Bends {
    Bends::new(&[("a", json!({}))], share)
}

/// Bytes of all files of a folder but the lock, which names the process that had it last.
fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.is_file() && !path.ends_with("run.lock"));
    files.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

#[test]
fn a_run_that_a_duplicate_has_completed_is_kept() {
    if !has_strace() {
        return skipping::skip(STRACE);
    }
    let bends = one(0.5);
    ends_well(bends.study(&["--prepare"]));
    // The duplicate is held after it has found no run and made the folder, before it takes the lock. It continues when strace
    // is asked to end; its exit code and output are written to files.
    let hold = ["-e", "trace=mkdir", "-e", "inject=mkdir:delay_exit=3600000000:when=1"];
    let script = "(\"$@\" > \"$0.txt\" 2>&1; echo $? > \"$0\"); true";
    let code = bends.at("code");
    let mut duplicate = Command::new("strace");
    duplicate.args(["-I", "1", "-f", "-qq", "--seccomp-bpf", "-o", "/dev/null"]).args(hold);
    duplicate.args(["--", "sh", "-c", script]).arg(&code).args([SOLVER, "case"]);
    let mut duplicate = duplicate.arg(bends.at("out/cases/a")).spawn().unwrap();
    until("no folder", || bends.run_of("a").exists().then_some(()));
    assert!(!bends.run_of("a").join("run.json").exists());
    let done = Command::new(SOLVER).arg("case").arg(bends.at("out/cases/a")).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let complete = bytes(&bends.run_of("a"));
    assert!(complete.keys().any(|path| path.ends_with("run.json")));
    assert!(!code.exists());
    let process = duplicate.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &process]).status().unwrap().success());
    duplicate.wait().unwrap();
    let ended = until("it does not end", || {
        let text = fs::read_to_string(&code).ok()?;
        text.ends_with('\n').then(|| text.trim().to_owned())
    });
    let text = fs::read_to_string(bends.at("code.txt")).unwrap();
    assert_eq!(ended, "0", "{text}");
    assert!(text.contains("already done"), "{text}");
    assert!(bytes(&bends.run_of("a")) == complete);
}

#[test]
fn tasks_that_slurm_has_removed_need_not_be_cancelled() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    let local = bends.local_results();
    slurm.set("forget", true);
    ends_well(slurm.study(&bends, &["--detach"]));
    let text = ends_well(slurm.study(&bends, &["--cancel"]));
    assert!(text.contains("0 submitted cases asked to end"), "{text}");
    assert!(text.contains("1 others have ended, or slurm does not know them"), "{text}");
    assert!(!slurm.programs().contains(&"scancel".to_owned()));
    ends_well(slurm.study(&bends, &[]));
    assert_eq!((bends.results(), slurm.submissions()), (local, 2));
}

#[test]
fn tasks_that_slurm_removes_before_they_are_cancelled_are_no_error() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    let local = bends.local_results();
    slurm.set("hold", true);
    ends_well(slurm.study(&bends, &["--detach"]));
    slurm.set("purge", true);
    let text = ends_well(slurm.study(&bends, &["--cancel"]));
    assert!(text.contains("0 submitted cases asked to end"), "{text}");
    assert!(slurm.programs().contains(&"scancel".to_owned()), "it was listed");
    slurm.set("hold", false);
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
}

/// Variables that hide tasks, replace what a script asks for, or keep a program waiting.
const HIDING: [(&str, &str); 13] = [
    ("SQUEUE_FORMAT", "%i"),
    ("SQUEUE_FORMAT2", "jobid"),
    ("SQUEUE_STATES", "CG"),
    ("SQUEUE_USERS", "nobody"),
    ("SCANCEL_INTERACTIVE", "1"),
    ("SBATCH_WAIT", "1"),
    ("SBATCH_TIMELIMIT", "1"),
    ("SBATCH_MEM_PER_NODE", "1M"),
    ("SBATCH_MEM_PER_CPU", "1M"),
    ("SBATCH_SIGNAL", "KILL@1"),
    ("SBATCH_JOB_NAME", "mine"),
    ("SBATCH_ERROR", "/dev/null"),
    ("SBATCH_CLUSTERS", "other"),
];

#[test]
fn variables_of_slurm_hide_no_task_and_replace_no_request() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    let local = bends.local_results();
    let own = [("SBATCH_ACCOUNT", "forming"), ("SBATCH_PARTITION", "long"), ("SBATCH_QOS", "low")];
    let variables = [&HIDING[..], &own].concat();
    ends_well(slurm.study_with(&bends, &variables, &[]));
    assert!(bends.results() == local);
    assert_eq!(slurm.submissions(), 1, "its task was always listed");
    for (option, value) in [("account", "forming"), ("partition", "long"), ("qos", "low")] {
        assert_eq!(slurm.asked(option), [value]);
    }
    for (option, value) in
        [("signal", "B:TERM@60"), ("time", "5"), ("mem-per-cpu", ""), ("wait", ""), ("error", "")]
    {
        assert_eq!(slurm.asked(option), [value], "{option}");
    }
    let case: Value =
        serde_json::from_slice(&fs::read(bends.at("out/cases/a/case.json")).unwrap()).unwrap();
    let expected = (1.3 * case["expected"]["memory_mb"].as_f64().unwrap()).ceil();
    assert_eq!(slurm.asked("mem"), [format!("{expected}M")]);
    // Options count more than variables.
    fs::remove_dir_all(bends.at("out")).unwrap();
    let mut study = bends.file();
    study["slurm"] = json!({"account": "study", "options": ["--qos=high --mem-per-cpu=2G"]});
    bends.put_study(&study);
    ends_well(slurm.study_with(&bends, &variables, &["--partition", "short", "--sbatch=--time=7"]));
    for (option, value) in
        [("account", "study"), ("partition", "short"), ("qos", "high"), ("time", "7")]
    {
        assert_eq!(slurm.asked(option)[1], value, "{option}");
    }
    // Slurm refuses two options for memory.
    assert_eq!([&slurm.asked("mem-per-cpu")[1], &slurm.asked("mem")[1]], ["2G", ""]);
}

#[test]
fn values_with_spaces_are_one_argument_and_what_is_no_option_is_refused() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    let mut study = bends.file();
    study["slurm"] = json!({"account": "metal forming", "options": ["--comment \"two words\""]});
    bends.put_study(&study);
    ends_well(slurm.study(&bends, &["--sbatch=--partition='so long'"]));
    for (option, value) in
        [("account", "metal forming"), ("comment", "two words"), ("partition", "so long")]
    {
        assert_eq!(slurm.asked(option), [value]);
    }
    for (given, why) in [
        ("long", "\"long\" belongs to no option"),
        ("--comment=two words", "\"words\" belongs to no option"),
        ("--array=0-3", "--array=0-3 is set by the study"),
    ] {
        let (code, _, errors) = slurm.study(&bends, &["--again", "--sbatch", given]);
        assert_eq!((code, slurm.submissions()), (2, 1), "{errors}");
        assert!(errors.contains(why) && errors.contains("quotes around values"), "{errors}");
    }
}

#[test]
fn tasks_are_asked_for_on_the_cluster_that_has_them() {
    let (bends, slurm) = (one(0.002), FakeSlurm::new());
    let local = bends.local_results();
    let mut study = bends.file();
    study["slurm"] = json!({"options": ["-M a,b"]});
    bends.put_study(&study);
    ends_well(slurm.study(&bends, &["--detach"]));
    let tickets = fs::read_to_string(bends.at("out/runner.json")).unwrap();
    assert!(tickets.contains("\"cluster\": \"b\""), "{tickets}");
    let halted = Halted::at_work(&bends, "a");
    // Without the study, and whatever the environment holds.
    let out = bends.at("out");
    let mut cancel = Command::new(env!("CARGO_BIN_EXE_kanagata"));
    cancel.arg("study").arg(&out).arg("--cancel").env("SLURM_CLUSTERS", "a");
    let done = cancel.envs(slurm.variables()).output().unwrap();
    let text = String::from_utf8_lossy(&[&done.stdout[..], &done.stderr].concat()).into_owned();
    assert!(done.status.success() && text.contains("1 submitted cases asked to end"), "{text}");
    assert_eq!(slurm.cancelled(), ["-M b 101_0"]);
    drop(halted);
    until("it continues", || {
        let text = fs::read_to_string(bends.run_of("a").join("run.json")).ok()?;
        text.contains("\"stopped\"").then_some(())
    });
    // A command without the option finds them as well.
    study["slurm"] = json!({});
    bends.put_study(&study);
    ends_well(slurm.study(&bends, &[]));
    assert!(bends.results() == local);
}

#[test]
fn cases_that_follow_others_are_submitted_to_their_cluster() {
    let (bends, slurm) = (Bends::twelve(0.5), FakeSlurm::new());
    let local = bends.local_results();
    ends_well(slurm.study_with(&bends, &[("SBATCH_CLUSTERS", "a,b")], &[]));
    assert!(bends.results() == local);
    assert_eq!(slurm.asked("clusters"), ["a,b", "b"]);
}

#[test]
fn an_engine_that_does_not_end_tickets_says_so() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    // It accepts the case, runs nothing, and knows its ticket for ever.
    let engine = ["--runner", "command", "--submit", "sh -c 'echo job' {case}", "--poll", "true"];
    ends_well(bends.study(&[&engine[..], &["--detach"]].concat()));
    let (code, _, errors) = bends.study(&[&engine[..], &["--cancel"]].concat());
    assert!(code == 2 && errors.contains("has not ended all submitted cases"), "{errors}");
    assert!(errors.contains("no command is given") && errors.contains("--end"), "{errors}");
    let end = ["--end", "false {ticket}", "--cancel"];
    let (code, _, errors) = bends.study(&[&engine[..], &end].concat());
    assert!(code == 4 && errors.contains("`false job`: exit status: 1"), "{errors}");
    fs::remove_dir_all(bends.at("out")).unwrap();
    // The controller of Slurm is down.
    slurm.set("hold", true);
    ends_well(slurm.study(&bends, &["--detach"]));
    slurm.set("down", true);
    let (code, _, errors) = slurm.study(&bends, &["--cancel"]);
    assert!(code == 4 && errors.contains("connect failure"), "{errors}");
}

#[test]
fn tickets_that_cannot_be_read_are_reported() {
    let (bends, slurm) = (one(0.5), FakeSlurm::new());
    let cancel = || slurm.study(&bends, &["--cancel"]);
    fs::create_dir(bends.at("out")).unwrap();
    let (code, _, errors) = cancel();
    assert!(code == 4 && errors.contains("order.json"), "{errors}");
    slurm.set("hold", true);
    ends_well(slurm.study(&bends, &["--detach"]));
    fs::write(bends.at("out/runner.json"), "{").unwrap();
    let (code, _, errors) = cancel();
    assert!(code == 2 && errors.contains("runner.json"), "{errors}");
    slurm.set("hold", false);
    let text = ends_well(slurm.study(&bends, &[]));
    assert!(text.contains("tickets of submitted cases are lost"), "{text}");
}

#[test]
fn variables_of_slurm_do_not_keep_tasks_from_being_cancelled() {
    let (bends, slurm) = (one(0.002), FakeSlurm::new());
    ends_well(slurm.study_with(&bends, &HIDING, &["--detach"]));
    let halted = Halted::at_work(&bends, "a");
    let text = ends_well(slurm.study_with(&bends, &HIDING, &["--cancel"]));
    assert!(text.contains("1 submitted cases asked to end"), "{text}");
    drop(halted);
    until("it continues", || {
        let text = fs::read_to_string(bends.run_of("a").join("run.json")).ok()?;
        text.contains("\"stopped\"").then_some(())
    });
}

#[test]
fn an_engine_is_asked_once_for_all_cases() {
    let names: Vec<String> = (0..40).map(|k| format!("c{k:02}")).collect();
    let cases: Vec<_> = names.iter().map(|name| (name.as_str(), json!({}))).collect();
    let (bends, slurm) = (Bends::new(&cases, 0.5), FakeSlurm::new());
    let start = Instant::now();
    ends_well(slurm.study(&bends, &[]));
    let seconds = start.elapsed().as_secs_f64();
    let calls = |name: &str| slurm.programs().iter().filter(|call| *call == name).count();
    let [submissions, questions] = ["sbatch", "squeue"].map(calls);
    assert_eq!((submissions, calls("scancel"), calls("scontrol")), (1, 0, 0));
    // One question at every interval of two seconds.
    assert!(
        questions >= 1 && questions as f64 <= seconds / 2.0 + 1.0,
        "{questions} in {seconds} s"
    );
}

/// Calls of the system for files of a study that is given again, when all its cases are done.
fn file_calls(bends: &Bends) -> Vec<String> {
    let trace = bends.at("trace");
    let calls = "trace=execve,open,openat,creat,rename,renameat,renameat2,mkdir,mkdirat";
    let mut study = Command::new("strace");
    study.args(["-f", "-qq", "--seccomp-bpf", "-s", "4096", "-e", calls, "-o"]).arg(&trace);
    study.args(["--", env!("CARGO_BIN_EXE_kanagata")]).args(bends.arguments());
    let done = study.arg("--accept-doubts").output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    fs::read_to_string(trace).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn a_case_that_is_done_costs_one_reading_of_its_record() {
    if !has_strace() {
        return skipping::skip(STRACE);
    }
    let [mut written, mut counts] = [Vec::new(), Vec::new()];
    for count in [2, 8] {
        let names: Vec<String> = (0..count).map(|k| format!("c{k}")).collect();
        let cases: Vec<_> = names.iter().map(|name| (name.as_str(), json!({}))).collect();
        let bends = Bends::new(&cases, 0.5);
        ends_well(bends.study(&[]));
        let calls = file_calls(&bends);
        let of = |parts: &[&str]| {
            let all = |line: &&String| parts.iter().all(|part| line.contains(part));
            calls.iter().filter(all).count()
        };
        assert_eq!(of(&["execve("]), 1, "no other program is started");
        assert_eq!(of(&["/run/run.json", "O_RDONLY"]), count);
        assert_eq!(of(&["/cases/", "O_CREAT"]) + of(&["/cases/", "rename"]), 0);
        written.push(of(&["O_CREAT"]));
        counts.push(of(&["rename"]));
    }
    // Tables, charts, page, order: as many for any number of cases.
    assert!(written[0] > 0 && written[0] == written[1], "{written:?}");
    assert!(counts[0] > 0 && counts[0] == counts[1], "{counts:?}");
}
