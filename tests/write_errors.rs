//! Outputs that cannot be written whole: an error that names the file, exit code 4, and what was there stays as it was.
#![cfg(unix)]

mod strip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::json;
use strip::scene_in;

const KANAGATA: &str = env!("CARGO_BIN_EXE_kanagata");
const SOLVE: &str = env!("CARGO_BIN_EXE_kanagata-solve");

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// Runs a program in `folder` that may write files of `blocks` times 512 bytes (in some shells 1024).
fn limited(blocks: usize, program: &str, arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -f {blocks}; exec \"$0\" \"$@\""), program]);
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).output().unwrap()
}

/// Asserts that it ends with an error about the file `name`.
fn refuses(done: &Output, name: &str) {
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(4), "{name}: {said}");
    let words = ["cannot write", name, "ulimit -f"];
    assert!(words.iter().all(|word| said.contains(word)), "{name}: {said}");
    assert!(!said.contains("panicked"), "{said}");
}

/// Names of the files in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn tools_meshes_and_audits_are_whole_or_not_there() {
    let inputs = tempfile::tempdir().unwrap();
    let tool = inputs.path().join("die.tool.json");
    let cad = fixture("cross/die.igs");
    let (tool, cad) = (tool.to_str().unwrap(), cad.to_str().unwrap());
    let made = Command::new(KANAGATA).args(["convert", cad, "-o", tool]).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let audit = ["audit", tool, "--cad", cad];
    let cases: [(&str, Vec<&str>); 7] = [
        ("out.tool.json", vec!["convert", cad, "-o", "out.tool.json"]),
        ("out.msh", vec!["mesh", cad, "-o", "out.msh"]),
        ("out.vtu", vec!["mesh", cad, "-o", "out.vtu"]),
        ("out.json", [&audit[..], &["--json", "out.json"]].concat()),
        ("out.html", [&audit[..], &["--html", "out.html"]].concat()),
        ("out-audit.vtu", [&audit[..], &["--vtu", "out-audit.vtu"]].concat()),
        ("out.svg", [&audit[..], &["--map", "out.svg"]].concat()),
    ];
    for (name, arguments) in cases {
        let folder = tempfile::tempdir().unwrap();
        refuses(&limited(1, KANAGATA, &arguments, folder.path()), name);
        assert_eq!(names(folder.path()), Vec::<String>::new(), "{name}");
        // An older file stays.
        fs::write(folder.path().join(name), "older").unwrap();
        refuses(&limited(1, KANAGATA, &arguments, folder.path()), name);
        assert_eq!(names(folder.path()), [name]);
        assert_eq!(fs::read(folder.path().join(name)).unwrap(), b"older");
    }
}

/// Of a run: its tools before it begins, a step within it, and its report at the end.
#[test]
fn a_run_whose_files_do_not_fit_names_the_first_and_leaves_no_part_of_it() {
    for (blocks, elements, name) in
        [(1, [35, 1], "run.json"), (60, [400, 4], "steps/"), (95, [35, 1], "report.html")]
    {
        let folder = tempfile::tempdir().unwrap();
        let scene = scene_in(folder.path(), |_, scene| {
            scene["blank"]["shape"]["rectangle"]["elements"] = json!(elements);
            scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(0.05);
            scene["stages"][0]["first_increment"] = json!(0.1);
            scene["output"] = json!({"vtu_every": 1, "checkpoint_every": 0});
        });
        let run = ["run", scene.to_str().unwrap(), "-q", "-o", "out"];
        let done = limited(blocks, SOLVE, &run, folder.path());
        refuses(&done, name);
        let out = folder.path().join("out");
        for part in ["", "steps", "tools"] {
            let found = if out.join(part).is_dir() { names(&out.join(part)) } else { Vec::new() };
            assert!(!found.iter().any(|file| file.ends_with(".tmp")), "{name}: {found:?}");
        }
        assert!(!out.join("report.html").exists());
    }
}

/// `/dev/full` takes nothing: a table that is not there is no success.
#[test]
fn a_full_standard_output_is_an_error() {
    let cad = fixture("cross/die.igs");
    let cases: [(&str, Vec<&str>); 2] = [
        (KANAGATA, vec!["inspect", cad.to_str().unwrap(), "--json"]),
        (KANAGATA, vec!["material", "list"]),
    ];
    let Ok(full) = fs::File::options().write(true).open("/dev/full") else { return };
    for (program, arguments) in cases {
        let mut command = Command::new(program);
        let done = command.args(&arguments).stdout(full.try_clone().unwrap()).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(4), "{arguments:?}: {said}");
        assert!(said.contains("cannot write standard output"), "{said}");
    }
}
