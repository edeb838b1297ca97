//! What users of terminals and pipes expect: progress with the time left, colours, `-` for standard streams.

#[path = "skipping/mod.rs"]
mod skipping;

use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use assert_cmd::Command;
use kanagata::prelude::{Cad, ConvertSettings, OffsetRequest};
use kanagata::progress::{Progress, Report};
use serde_json::Value;

fn fixture(path: &str) -> String {
    format!("{}/fixtures/{path}", env!("CARGO_MANIFEST_DIR"))
}

fn program(name: &str) -> Command {
    let mut command = Command::cargo_bin(name).unwrap();
    command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").env("TERM", "xterm");
    command
}

fn kanagata(args: &[&str]) -> Command {
    let mut command = program("kanagata");
    command.args(args);
    command
}

/// Exit code, standard output and standard error.
fn ended(mut command: Command) -> (i32, String, String) {
    let done = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (done.status.code().unwrap(), text(done.stdout), text(done.stderr))
}

/// Progress on a pseudo-terminal.
#[cfg(unix)]
mod progress {
    use super::*;
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use std::io::Read as _;
    use std::process::{Command, Stdio};

    /// What a command writes to a terminal as its standard error.
    fn on_terminal(args: &[&str]) -> String {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let name = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let slave = fs::OpenOptions::new().read(true).write(true).open(name).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_kanagata"))
            .args(args)
            .env("TERM", "xterm")
            .stdout(Stdio::null())
            .stderr(slave)
            .spawn()
            .unwrap();
        let reader = std::thread::spawn(move || {
            let (mut terminal, mut bytes, mut part) =
                (fs::File::from(master), Vec::new(), [0; 4096]);
            // The end of the other side is an error on Linux.
            while let Ok(count @ 1..) = terminal.read(&mut part) {
                bytes.extend_from_slice(&part[..count]);
            }
            bytes
        });
        assert!(child.wait().unwrap().success());
        String::from_utf8_lossy(&reader.join().unwrap()).into_owned()
    }

    #[test]
    fn a_search_and_an_audit_show_their_stage_and_the_time_left_on_a_terminal_only() {
        let folder = tempfile::tempdir().unwrap();
        let tool = folder.path().join("die.tool.json");
        let (tool, cad) = (tool.to_str().unwrap(), fixture("forming/cross_die_144.igs"));
        let convert = [
            "convert",
            &cad,
            "-o",
            tool,
            "--sheet-side",
            "+z",
            "--tol",
            "0.0005mm",
            "--threads",
            "1",
        ];
        if openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).is_err() {
            return skipping::skip(["pseudo-terminals", "mount /dev/pts"]);
        }
        let shown = on_terminal(&convert);
        assert!(shown.contains("search for the fewest patches, at most "), "{shown:?}");
        assert!(shown.contains(" left") && shown.contains(" %"), "{shown:?}");
        let audit = ["audit", tool, "--cad", &cad, "--samples", "128", "--threads", "1"];
        let shown = on_terminal(&audit);
        assert!(shown.contains("audit, points") && shown.contains(" patches"), "{shown:?}");
        assert!(shown.contains(" left"), "{shown:?}");

        let quiet = on_terminal(&[&audit[..], &["-q"]].concat());
        assert_eq!(quiet, "");
        let (code, _, errors) = ended(kanagata(&audit));
        assert_eq!((code, errors.as_str()), (0, ""));
    }
}

/// Conversions report to a receiver, which changes no result.
#[test]
fn the_library_reports_its_stages_to_a_receiver() {
    let seen = Arc::new(Mutex::new(Vec::<Report>::new()));
    let kept = Arc::clone(&seen);
    let progress = Progress::new(move |report| kept.lock().unwrap().push(*report));
    let unwatched = ConvertSettings {
        sheet_side: Some([0.0, 0.0, -1.0]),
        offset: Some(OffsetRequest::Towards(0.5)),
        ..ConvertSettings::within(0.02)
    };
    let watched = ConvertSettings { progress, ..unwatched.clone() };
    let cad = Cad::read(fixture("forming/hemi_punch_144.igs")).unwrap();
    let [one, other] = [&watched, &unwatched].map(|settings| cad.convert(settings).unwrap());
    assert_eq!(one.model(), other.model());
    let seen = seen.lock().unwrap();
    let stages = |name: &str| seen.iter().filter(|r| r.stage == name).copied().collect::<Vec<_>>();
    for name in ["offset, self-intersections", "offset, surfaces", "audit, points"] {
        let reports = stages(name);
        assert!(reports.iter().any(|r| r.done == r.total && r.total > 0), "{name}: {reports:?}");
    }
    let search = stages("search for the fewest patches");
    assert!(search.len() > 10 && search.iter().all(|r| r.is_limit && r.done <= r.total));
}

#[test]
fn a_quiet_command_prints_no_summary_and_still_prints_doubts_and_json() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("die.tool.json");
    let (tool, cad) = (tool.to_str().unwrap(), fixture("forming/cross_die_144.igs"));
    let (code, out, errors) = ended(kanagata(&["convert", &cad, "-o", tool, "-q"]));
    assert_eq!((code, out.as_str(), errors.as_str()), (0, "", ""));
    let audit = ["audit", tool, "--cad", &cad, "--tol", "1e-6mm", "-q", "--json", "-"];
    let (code, out, errors) = ended(kanagata(&audit));
    assert_eq!(code, 1);
    assert!(errors.contains("doubt tolerance-exceeded"), "{errors}");
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["within_tolerance"], false);
}

#[test]
fn colours_follow_the_argument_then_the_variables() {
    const RED: &str = "\u{1b}[1;31merror\u{1b}[0m: ";
    let missing = |extra: &[&str]| kanagata(&[&["inspect", "no-such.igs"], extra].concat());
    let errors = |command: Command| ended(command).2;
    assert!(errors(missing(&[])).starts_with("error: "));
    assert!(errors(missing(&["--color", "always"])).starts_with(RED));
    let mut forced = missing(&[]);
    forced.env("CLICOLOR_FORCE", "1");
    assert!(errors(forced).starts_with(RED));
    let mut both = missing(&[]);
    both.env("CLICOLOR_FORCE", "1").env("NO_COLOR", "1");
    assert!(errors(both).starts_with("error: "));
    let mut never = missing(&["--color=never"]);
    never.env("CLICOLOR_FORCE", "1");
    assert!(errors(never).starts_with("error: "));
    // Errors of arguments and help follow too.
    let wrong = |color: &str| errors(kanagata(&["--color", color, "inspect"]));
    assert!(wrong("always").contains('\u{1b}') && !wrong("never").contains('\u{1b}'));
    let mut solve = program("kanagata-solve");
    solve.args(["check", "no-such.scene.json", "--color", "always"]);
    assert!(errors(solve).starts_with(RED));
}

#[test]
fn cad_and_tools_go_through_pipes() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let cad = fixture("forming/cross_die_144.igs");
    let convert = |input: &str, output: &str| {
        let mut command =
            kanagata(&["convert", input, "-o", output, "--sheet-side", "+z", "--name", "die"]);
        command.write_stdin(fs::read(&cad).unwrap());
        command
    };
    let (code, _, errors) = ended(convert(&cad, &at("file.tool.json")));
    assert_eq!(code, 0, "{errors}");
    let (code, piped, errors) = ended(convert("-", "-"));
    assert_eq!(code, 0, "{errors}");
    assert!(errors.contains(" patches, "), "the summary is on standard error: {errors}");
    // The same tool, but for the name of the CAD file.
    let named = piped.replace("<stdin>", "cross_die_144.igs");
    assert_eq!(named, fs::read_to_string(at("file.tool.json")).unwrap());

    let mut audit = kanagata(&["audit", "-", "--cad", &cad, "--json", "-"]);
    audit.write_stdin(piped.clone());
    let (code, out, _) = ended(audit);
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &json["tool_file"]), (0, &Value::from("<stdin>")));
    let mut back = kanagata(&["convert", "-", "--to", "bezier", "-o", "-"]);
    back.write_stdin(piped);
    let tool: Value = serde_json::from_str(&ended(back).1).unwrap();
    assert_eq!(tool["kind"], "bezier");

    let mut inspect = kanagata(&["inspect", "-", "--json"]);
    inspect.write_stdin(fs::read(&cad).unwrap());
    let facts: Value = serde_json::from_str(&ended(inspect).1).unwrap();
    let of_file: Value =
        serde_json::from_str(&ended(kanagata(&["inspect", &cad, "--json"])).1).unwrap();
    assert_eq!(facts["faces"], of_file["faces"]);
}

#[test]
fn scenes_cards_and_schemas_go_through_pipes() {
    let strip = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/strip");
    let check = |text: String| {
        let mut command = program("kanagata-solve");
        command.args(["check", "-", "--json", "--accept-doubts"]);
        command.current_dir(&strip).write_stdin(text);
        ended(command)
    };
    let json = fs::read_to_string(strip.join("strip.scene.json")).unwrap();
    let (code, out, errors) = check(json.clone());
    assert_eq!(code, 0, "{errors}");
    let of_json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(of_json["scene"], "<stdin>");
    let (code, _, errors) = check("[blank\n".into());
    assert_eq!(code, 2);
    assert!(errors.contains("<stdin>"), "{errors}");

    let (code, card, _) = ended(kanagata(&["material", "show", "mild-steel-neto2012", "--json"]));
    assert_eq!(code, 0);
    let mut again = kanagata(&["material", "show", "-", "--json"]);
    again.write_stdin(card.clone());
    assert_eq!(ended(again).1, card, "the card that is printed is read again as it is");

    let printed = ended(kanagata(&["schema", "scene", "-o", "-"])).1;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/scene.schema.json");
    assert_eq!(printed, fs::read_to_string(file).unwrap());
    let (code, scene, _) = ended(kanagata(&["init", "--kind", "cup", "-o", "-"]));
    assert!(code == 0 && scene.contains("\"blank\""), "{scene}");
}

#[test]
fn streams_are_refused_where_a_name_is_needed() {
    let cad = fixture("forming/cross_die_144.igs");
    for args in [
        &["mesh", &cad, "-o", "-"][..],
        &["split", &cad, "-o", "-"],
        &["run", "-", "-o", "out"],
        &["run", "a.scene.json", "-o", "-"],
    ] {
        let (code, _, errors) = ended(kanagata(args));
        assert_eq!(code, 2, "{errors}");
        assert!(errors.contains("have no name"), "{errors}");
    }
    let (code, _, errors) = ended(kanagata(&["audit", "-", "--cad", "-"]));
    assert_eq!(code, 2);
    assert!(errors.contains("standard input for one of them"), "{errors}");
}

/// A failed run leaves nothing that a script takes for its result.
#[test]
fn a_refused_run_leaves_no_metrics_of_an_earlier_one_and_says_whose_results_stay() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let metrics = folder.path().join("metrics.json");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/strip/strip.scene.json");
    let run = |set: &str| {
        let mut command = program("kanagata-solve");
        command.arg("run").arg(&scene).arg("-o").arg(&out).arg("--metrics").arg(&metrics);
        command.args(["--set", set, "--report", "failed", "--accept-doubts", "-q"]);
        ended(command)
    };
    let (code, _, errors) = run("tools.die.friction=0.1");
    assert_eq!(code, 0, "{errors}");
    assert!(metrics.is_file());
    let record = fs::read(out.join("run.json")).unwrap();
    let (code, _, errors) = run("tools.die.friction=-1");
    assert_eq!(code, 2, "{errors}");
    assert!(!metrics.exists());
    assert!(errors.contains("holds the results of an earlier run, not of this one"), "{errors}");
    assert_eq!(fs::read(out.join("run.json")).unwrap(), record);
}
