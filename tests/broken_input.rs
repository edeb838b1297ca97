//! Broken input: a message with file, place, cause and remedy, the right exit code, never a panic.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use assert_cmd::Command;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

struct Outcome {
    code: i32,
    stderr: String,
}

fn run(program: &str, arguments: &[&str], configure: impl Fn(&mut Command)) -> Outcome {
    let mut command = Command::cargo_bin(program).unwrap();
    command.args(arguments);
    configure(&mut command);
    let output = command.output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!stderr.contains("panicked"), "{program} {arguments:?}: {stderr}");
    Outcome { code: output.status.code().unwrap_or(-1), stderr }
}

fn expect(outcome: &Outcome, code: i32, words: &[&str]) {
    assert_eq!(outcome.code, code, "{}", outcome.stderr);
    for word in words {
        assert!(outcome.stderr.contains(word), "'{word}' is not in: {}", outcome.stderr);
    }
}

fn folder_with(name: &str, bytes: &[u8]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let text = path.to_string_lossy().into_owned();
    (folder, text)
}

#[test]
fn an_empty_file_is_no_cad() {
    for name in ["empty.igs", "empty.stp"] {
        let (_folder, path) = folder_with(name, b"");
        let outcome = run("kanagata", &["inspect", &path], |_| {});
        expect(&outcome, 2, &[name, "an empty file", "export the model as IGES 5.3 or STEP"]);
    }
}

#[test]
fn a_compressed_file_is_named_as_such() {
    for bytes in [&b"\x1f\x8b\x08\x00\x00\x00"[..], &b"PK\x03\x04\x14\x00"[..]] {
        let (_folder, path) = folder_with("die.stp", bytes);
        let outcome = run("kanagata", &["inspect", &path], |_| {});
        expect(&outcome, 2, &["die.stp", "a compressed file (gzip or zip)"]);
    }
}

#[test]
fn a_file_that_is_not_there_is_an_io_error() {
    let outcome = run("kanagata", &["inspect", "no-such-file.igs"], |_| {});
    expect(&outcome, 4, &["no-such-file.igs"]);
}

#[test]
fn truncated_files_are_refused_or_survived_with_words() {
    for name in ["cross/die.igs", "forming/cross_die_AP214.stp"] {
        let whole = fs::read(fixture(name)).unwrap();
        for share in [0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99] {
            let cut = &whole[..(whole.len() as f64 * share) as usize];
            let (_folder, path) = folder_with("cut.cad", cut);
            let outcome =
                run("kanagata", &["convert", &path, "-o", &format!("{path}.tool.json")], |_| {});
            assert!([0, 2].contains(&outcome.code), "{name} {share}: {}", outcome.stderr);
            assert!(
                outcome.code == 2 || outcome.stderr.contains("warning"),
                "{name} {share}: {}",
                outcome.stderr
            );
            let message = outcome.stderr.contains("cut.cad") || outcome.stderr.contains("warning");
            assert!(message, "{name} {share}: {}", outcome.stderr);
        }
    }
}

#[test]
fn a_wrong_unit_flag_is_not_guessed() {
    let text = String::from_utf8(fs::read(fixture("cross/die.igs")).unwrap()).unwrap();
    let wrong = text.replacen(",1.,2,2HMM,", ",1.,77,2HXX,", 1);
    assert_ne!(text, wrong);
    let (_folder, path) = folder_with("unit.igs", wrong.as_bytes());
    let outcome = run("kanagata", &["convert", &path, "-o", &format!("{path}.tool.json")], |_| {});
    expect(&outcome, 2, &["unit.igs", "unit flag", "correct the unit in the file"]);
    let outcome = run("kanagata", &["inspect", &path], |_| {});
    assert_eq!(outcome.code, 0, "inspect shows what there is: {}", outcome.stderr);
}

#[test]
fn faces_that_lie_on_each_other_by_the_hundred_are_no_tool() {
    for command in [&["convert"][..], &["convert", "--tol", "0.1mm"], &["mesh"]] {
        let cad = fixture("fuzz/faces-on-each-other.stp").to_string_lossy().into_owned();
        let (folder, _) = folder_with("x", b"");
        let out = folder.path().join("x.out").to_string_lossy().into_owned();
        let args = [&command[..1], &[&*cad, "-o", &out], &command[1..]].concat();
        let outcome = run("kanagata", &args, |_| {});
        expect(
            &outcome,
            2,
            &["faces-on-each-other.stp", "coincident faces", "remove the duplicates"],
        );
    }
}

#[test]
fn a_tool_file_with_an_unknown_key_has_line_and_column() {
    let text =
        br#"{"format":"kanagata-tool","version":1,"name":"x","kind":"nagata","colour":"red"}"#;
    let (_folder, path) = folder_with("x.tool.json", text);
    let cad = fixture("cross/die.igs");
    let outcome = run("kanagata", &["audit", &path, "--cad", &cad.to_string_lossy()], |_| {});
    expect(&outcome, 2, &["x.tool.json", "line 1", "colour", "kanagata convert"]);
}

#[test]
fn a_scene_whose_tool_file_is_missing_names_key_and_remedy() {
    let scene = fs::read(fixture("cross/cross.scene.json")).unwrap();
    let (folder, path) = folder_with("x.scene.json", &scene);
    let out = folder.path().join("out").to_string_lossy().into_owned();
    for arguments in [vec!["check", &path], vec!["run", &path, "-o", &out]] {
        let outcome = run("kanagata-solve", &arguments, |_| {});
        expect(
            &outcome,
            2,
            &["x.scene.json", "tools[0].file", "die.tool.json", "kanagata convert"],
        );
    }
    assert!(!folder.path().join("out").exists(), "nothing is made for a scene that cannot run");
}

#[test]
fn a_missing_gmsh_is_named_with_the_remedy() {
    let cad = fixture("cross/die.igs");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("die.msh").to_string_lossy().into_owned();
    let arguments = ["mesh", &cad.to_string_lossy(), "-o", &out, "--mesher", "gmsh"];
    let outcome = run("kanagata", &arguments, |c| {
        c.env("PATH", folder.path()).env_remove("KANAGATA_GMSH");
    });
    expect(&outcome, 2, &["gmsh", "install"]);
    assert!(!Path::new(&out).exists());
}

/// It runs in a folder of its own, where such a path leads nowhere.
#[cfg(unix)]
#[test]
fn a_gmsh_named_by_a_relative_path_is_that_of_the_current_folder() {
    use std::os::unix::fs::PermissionsExt as _;
    let cad = fixture("cross/die.igs");
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    let program = folder.path().join("bin/gmsh");
    fs::write(&program, "#!/bin/sh\necho the stand-in was started\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let arguments = ["mesh", &cad.to_string_lossy(), "-o", "die.msh", "--mesher", "gmsh"];
    let started = |more: &[&str], variable: &str, value: &str| {
        let outcome = run("kanagata", &[&arguments[..], more].concat(), |c| {
            c.current_dir(&folder).env_remove("KANAGATA_GMSH").env(variable, value);
        });
        expect(&outcome, 2, &["the stand-in was started"]);
    };
    for named in ["bin/gmsh", "./bin/gmsh", "bin/../bin/gmsh"] {
        started(&["--gmsh", named], "KANAGATA_GMSH", "no/such/gmsh");
        started(&[], "KANAGATA_GMSH", named);
    }
    started(&[], "PATH", "bin:/usr/bin:/bin");
}

#[test]
fn options_of_gmsh_are_refused_with_the_built_in_mesher() {
    let cad = fixture("cross/die.igs").to_string_lossy().into_owned();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("die.msh").to_string_lossy().into_owned();
    for option in [["--gmsh-algorithm", "frontal-quads"], ["--gmsh-limit", "20"]] {
        for command in ["mesh", "convert"] {
            let arguments = [command, &cad, "-o", &out, option[0], option[1]];
            let outcome = run("kanagata", &arguments, |_| {});
            expect(&outcome, 2, &[option[0], "--mesher gmsh", "leave the option out"]);
        }
    }
    let arguments = ["mesh", &cad, "-o", &out, "--mesher", "gmsh", "--gmsh-algorithm", "finest"];
    expect(&run("kanagata", &arguments, |_| {}), 2, &["finest", "bamg", "frontal-delaunay"]);
}

#[test]
fn usage_errors_have_exit_code_2() {
    assert_eq!(run("kanagata", &["convert"], |_| {}).code, 2);
    assert_eq!(run("kanagata-solve", &["fly"], |_| {}).code, 2);
    let cad = fixture("cross/die.igs");
    let arguments = ["convert", &cad.to_string_lossy(), "-o", "/nonexistent/x.tool.json"];
    assert_eq!(run("kanagata", &arguments, |_| {}).code, 4, "an output folder that is not there");
}

#[test]
fn an_audit_above_its_limit_has_exit_code_1() {
    let cad = fixture("cross/die.igs");
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("die.tool.json").to_string_lossy().into_owned();
    let cad = cad.to_string_lossy().into_owned();
    let made = run("kanagata", &["convert", &cad, "-o", &tool, "--arc-divisions", "2"], |_| {});
    assert_eq!(made.code, 0, "{}", made.stderr);
    assert_eq!(run("kanagata", &["audit", &tool, "--cad", &cad, "--tol", "1e-4"], |_| {}).code, 1);
    assert_eq!(run("kanagata", &["audit", &tool, "--cad", &cad, "--tol", "5"], |_| {}).code, 0);
}

/// `kanagata ... | head`: who reads may go at any time; the work is done all the same.
#[test]
fn a_reader_that_goes_away_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let tool = folder.path().join("die.tool.json");
    let cad = fixture("cross/die.igs");
    let started = |arguments: &[&std::ffi::OsStr]| {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_kanagata"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let ended = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&ended.stderr).into_owned();
        Outcome { code: ended.status.code().unwrap_or(-1), stderr }
    };
    let made = started(&["convert".as_ref(), cad.as_os_str(), "-o".as_ref(), tool.as_os_str()]);
    expect(&made, 0, &[]);
    assert!(tool.exists() && !made.stderr.contains("panicked"), "{}", made.stderr);
    let limit = ["--cad".as_ref(), cad.as_os_str(), "--tol".as_ref(), "1e-4".as_ref()];
    let audited = started(&[&["audit".as_ref(), tool.as_os_str()], &limit[..]].concat());
    expect(&audited, 1, &[]);
    assert!(!audited.stderr.contains("panicked"), "{}", audited.stderr);
}

#[test]
fn what_is_cut_off_or_other_text_is_told_so_by_inspect() {
    let whole = fs::read_to_string(fixture("cross/die.igs")).unwrap();
    let is_kept = |line: &&str| !matches!(line.as_bytes().get(72), Some(b'P' | b'T'));
    let cut: String = whole.lines().filter(is_kept).map(|line| format!("{line}\n")).collect();
    let (_folder, path) = folder_with("cut.igs", cut.as_bytes());
    let outcome = run("kanagata", &["inspect", &path], |_| {});
    expect(&outcome, 2, &["cut.igs, line ", "no parameter section (P)", "export the model again"]);
    let (_folder, path) = folder_with("notes.igs", "# 金型: Maße in Zoll\n".as_bytes());
    let outcome = run("kanagata", &["inspect", &path], |_| {});
    expect(
        &outcome,
        2,
        &["notes.igs", "no S section in column 73", "text that begins with \"# 金型"],
    );
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let die = fs::read(fixture("cross/die.igs")).unwrap();
    let (folder, cad) = folder_with("die.igs", &die);
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (tool, beside) = (path("die.tool.json"), path("./die.igs"));
    expect(&run("kanagata", &["convert", &cad, "-o", &tool], |_| {}), 0, &[]);
    let made = fs::read(&tool).unwrap();
    let audit = ["audit", &tool, "--cad", &cad];
    let commands = [
        vec!["convert", &cad, "-o", &beside],
        vec!["convert", &tool, "-o", &tool, "--to", "bezier"],
        vec!["mesh", &cad, "-o", &cad],
        [&audit[..], &["--json", &cad]].concat(),
        [&audit[..], &["--html", &tool]].concat(),
        [&audit[..], &["--vtu", &beside]].concat(),
        [&audit[..], &["--map", &tool]].concat(),
    ];
    for command in commands {
        expect(
            &run("kanagata", &command, |_| {}),
            2,
            &["that this command reads", "any other file"],
        );
        assert!(fs::read(&cad).unwrap() == die && fs::read(&tool).unwrap() == made, "{command:?}");
    }
}
