//! Runs that are killed, stopped and gone on with end as runs that nobody touched.

mod bend;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// The bend in the folder, with a checkpoint after every increment.
fn write_scene(folder: &Path) {
    bend::write_tools(folder);
    let scene = bend::scene("");
    fs::write(folder.join("bend.scene.json"), scene.to_string()).unwrap();
}

fn command(folder: &Path, out: &str, restart: bool) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    command
        .arg("run")
        .arg(folder.join("bend.scene.json"))
        .args(["-q", "--accept-doubts"])
        .arg("-o")
        .arg(folder.join(out));
    if restart {
        command.arg("--restart");
    }
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Runs the scene into `out` and kills it when it has two checkpoints.
fn kill_with_checkpoints(folder: &Path) {
    let mut child = command(folder, "out", false).arg("--overwrite").spawn().unwrap();
    while !folder.join("out/checkpoint-1.bin").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

fn finished(output: &Output) -> bool {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!text.contains("panicked"), "{text}");
    output.status.success()
}

/// All that a run leaves, but for times and charts made of them.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = vec!["history.csv".into(), "iterations.csv".into(), "run.pvd".into()];
    for inner in ["steps", "tools"] {
        let grids = fs::read_dir(folder.join(inner)).unwrap();
        files
            .extend(grids.map(|e| format!("{inner}/{}", e.unwrap().file_name().to_string_lossy())));
    }
    files.sort();
    let mut results: Vec<(String, Vec<u8>)> =
        files.into_iter().map(|f| (f.clone(), fs::read(folder.join(f)).unwrap())).collect();
    // Strain paths are in no grid: the record has what they came to.
    let record = fs::read(folder.join("run.json")).unwrap();
    let record: serde_json::Value = serde_json::from_slice(&record).unwrap();
    for key in ["formability", "files"] {
        results.push((key.into(), record[key].to_string().into_bytes()));
    }
    results
}

/// Every file of the folder is whole: JSON and CSV end where they should.
fn check_whole(folder: &Path) {
    if let Ok(text) = fs::read_to_string(folder.join("run.json")) {
        serde_json::from_str::<serde_json::Value>(&text).unwrap();
    }
    if let Ok(text) = fs::read_to_string(folder.join("history.csv")) {
        let columns = |line: &str| line.split(',').count();
        let first = text.lines().next().map(columns);
        assert!(text.ends_with('\n') && text.lines().all(|l| Some(columns(l)) == first));
    }
}

#[test]
fn a_run_killed_again_and_again_ends_as_one_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    assert!(finished(&command(folder, "whole", false).output().unwrap()));
    let kills: usize = std::env::var("KANAGATA_KILLS").map_or(12, |n| n.parse().unwrap());
    let mut seed = 1u64;
    let mut killed = 0;
    while killed < kills {
        let mut restart = false;
        loop {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let mut command = command(folder, "killed", restart);
            // A run that was killed after its results were complete is repeated too.
            let child = if restart { command.spawn() } else { command.arg("--overwrite").spawn() };
            let mut child = child.unwrap();
            std::thread::sleep(Duration::from_millis(20 + (seed >> 33) % 400));
            let _ = child.kill();
            let output = child.wait_with_output().unwrap();
            check_whole(&folder.join("killed"));
            if finished(&output) {
                break;
            }
            killed += 1;
            let saved = folder.join("killed/checkpoint-0.bin").exists();
            restart = saved;
        }
        let [whole, killed] = ["whole", "killed"].map(|f| results(&folder.join(f)));
        let names = |r: &[(String, Vec<u8>)]| r.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
        assert_eq!(names(&whole), names(&killed));
        let differs = whole.iter().zip(&killed).find(|(a, b)| a != b);
        assert!(differs.is_none(), "{:?}", differs.map(|(a, _)| &a.0));
    }
}

/// The collection of steps names grids that are there and whole.
fn check_collection(folder: &Path) -> usize {
    let Ok(text) = fs::read_to_string(folder.join("run.pvd")) else { return 0 };
    assert!(text.trim_end().ends_with("</VTKFile>"));
    let mut reader = quick_xml::Reader::from_str(&text);
    let mut steps = 0;
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Empty(tag) if tag.name().as_ref() == b"DataSet" => {
                let file = tag.try_get_attribute("file").unwrap().unwrap();
                let grid = folder.join(file.unescape_value().unwrap().as_ref());
                let grid = kanagata::report::vtu_read::read(&grid).unwrap();
                assert!(!grid.cells.is_empty());
                steps += 1;
            }
            quick_xml::events::Event::Eof => break steps,
            _ => {}
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_tells_at_any_time_how_its_run_stands() {
    use kanagata::run::status::{State, status};
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    let out = folder.join("out");
    let mut child = command(folder, "out", false).spawn().unwrap();
    let mut seen = 0;
    while seen < 4 {
        std::thread::sleep(Duration::from_millis(5));
        let Ok(now) = status(&out) else { continue };
        assert_eq!((now.state, now.restart), (State::Running, None));
        assert!(now.increment >= seen && now.stages == 2);
        assert!(check_collection(&out) > 0 || now.increment == 0);
        seen = now.increment;
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let killed = status(&out).unwrap();
    assert_eq!((killed.state, killed.stage.as_deref()), (State::Killed, Some("bend")));
    check_collection(&out);
    let plane = killed.tools.iter().find(|t| t.name == "plane").unwrap();
    assert!(plane.travel_mm > 0.0 && plane.force_n > 0.0, "{plane:?}");
    assert!(killed.checkpoint.is_some_and(|c| c.increment + 1 >= killed.increment));
    // The command that it names goes on; a signal stops it, and the command is named again.
    let go_on = || {
        let printed = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
            .args(["status", "--json"])
            .arg(&out)
            .output()
            .unwrap();
        let now: serde_json::Value = serde_json::from_slice(&printed.stdout).unwrap();
        let text = now["restart"].as_str().unwrap();
        let words: Vec<String> = text.split(' ').skip(1).map(str::to_owned).collect();
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
        command.args(words).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let mut child = go_on().spawn().unwrap();
    while status(&out)
        .map_or(true, |s| s.state != State::Running || s.increment <= killed.increment)
    {
        std::thread::sleep(Duration::from_millis(2));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(5));
    assert_eq!(status(&out).unwrap().state, State::Stopped);
    let lines =
        go_on().args(["--lines", "--accept-doubts"]).stdout(Stdio::piped()).output().unwrap();
    assert!(finished(&lines));
    let text = String::from_utf8(lines.stdout).unwrap();
    let done = status(&out).unwrap();
    assert_eq!((done.state, done.restart, done.time), (State::Finished, None, 2.0));
    assert!(text.lines().any(|l| Some(l) == done.last_line.as_deref()), "{text}");
    assert!(check_collection(&out) > 2);
    let printed = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["status", "--json"])
        .arg(&out)
        .output()
        .unwrap();
    let printed: serde_json::Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert_eq!(
        (&printed["state"], &printed["increment"]),
        (&"finished".into(), &done.increment.into())
    );
}

/// A patch far from the sheet is left out, and no result knows it.
#[test]
fn leaving_out_what_is_beyond_reach_changes_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    let path = folder.join("plane.tool.json");
    let mut plane: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for (key, more) in [
        ("vertices", serde_json::json!([[60.0, -1.0, 1.0], [60.0, 3.0, 1.0]])),
        ("normals", serde_json::json!([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])),
        (
            "patches",
            serde_json::json!([{"vertices": [2, 5, 7, 6], "normals": [2, 5, 7, 6], "face": 0}]),
        ),
    ] {
        let all = plane[key].as_array_mut().unwrap();
        all.extend(more.as_array().unwrap().iter().cloned());
    }
    fs::write(&path, plane.to_string()).unwrap();
    assert!(finished(&command(folder, "whole", false).output().unwrap()));
    assert!(finished(&command(folder, "auto", false).arg("--auto").output().unwrap()));
    let record = |out: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.join(out).join("run.json")).unwrap()).unwrap()
    };
    let left_out = serde_json::json!([{"tool": "plane", "patches": 1, "of": 3}]);
    assert_eq!(
        (&record("auto")["left_out"], &record("whole")["left_out"]),
        (&left_out, &serde_json::Value::Null)
    );
    let [whole, auto] = ["whole", "auto"].map(|out| results(&folder.join(out)));
    assert_eq!(whole.len(), auto.len());
    let differs = whole.iter().zip(&auto).find(|(a, b)| a != b);
    assert!(differs.is_none(), "{:?}", differs.map(|(a, _)| &a.0));
    let check = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["check", "--auto"])
        .arg(folder.join("bend.scene.json"))
        .output()
        .unwrap();
    let text = String::from_utf8(check.stdout).unwrap();
    for line in
        ["unknowns", "memory", "expected", "1 of 3 patches of plane", "auto       excludes 1"]
    {
        assert!(text.contains(line), "{line}: {text}");
    }
    // The radius of 5 mm has more than six elements.
    assert!(!text.contains("coarse for the radius"), "{text}");
}

/// Sheet and tools are symmetric about y = 1: two elements across have halves, one has none.
#[test]
fn symmetry_is_told_where_the_mesh_has_halves() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    let path = folder.join("bend.scene.json");
    let told = || {
        let out = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
            .arg("check")
            .arg(&path)
            .output()
            .unwrap();
        String::from_utf8(out.stdout).unwrap()
    };
    let text = told();
    assert!(text.contains("unknowns") && !text.contains("symmetric about"), "{text}");
    let scene = fs::read_to_string(&path).unwrap();
    let two = scene.replace("[16,1]", "[16,2]");
    assert_ne!(scene, two);
    fs::write(&path, two).unwrap();
    let text = told();
    assert!(text.contains("symmetric about y = 1.0000"), "{text}");
    // 17 x 2 columns of three nodes.
    assert!(text.contains("have 306 unknowns"), "{text}");
}

/// The same strip from a mesh file, its material from a card file.
fn name_files(folder: &Path) {
    let node = |k: usize| format!("v {} {} 0\n", 1.25 * (k / 2) as f64, 2 * (k % 2));
    let quad = |k: usize| format!("f {} {} {} {}\n", 2 * k + 1, 2 * k + 3, 2 * k + 4, 2 * k + 2);
    let mesh = (0..34).map(node).chain((0..16).map(quad));
    fs::write(folder.join("blank.obj"), mesh.collect::<String>()).unwrap();
    let card = "src/solver/material/cards/mild-steel-neto2012.json";
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join(card), folder.join("steel.json")).unwrap();
    let path = folder.join("bend.scene.json");
    let mut scene: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    scene["blank"]["shape"] = serde_json::json!({"mesh": {"file": "blank.obj"}});
    scene["material"] = "steel.json".into();
    fs::write(path, scene.to_string()).unwrap();
}

#[test]
fn what_cannot_be_gone_on_with_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    let message = |output: Output| {
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    name_files(folder);
    let none = message(command(folder, "out", true).output().unwrap());
    assert!(
        none.contains("no checkpoint to continue from") && none.contains("--restart"),
        "{none}"
    );
    kill_with_checkpoints(folder);
    let path = folder.join("bend.scene.json");
    let scene = fs::read_to_string(&path).unwrap();
    fs::write(&path, scene.replace("\"friction\":0.1", "\"friction\":0.2")).unwrap();
    let changed = message(command(folder, "out", true).output().unwrap());
    assert!(changed.contains("`scene` has changed"), "{changed}");
    fs::write(&path, scene).unwrap();
    for file in ["blank.obj", "steel.json"] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        fs::write(folder.join(file), format!("{text}\n")).unwrap();
        let changed = message(command(folder, "out", true).output().unwrap());
        assert!(changed.contains(&format!("`{file}` has changed")), "{changed}");
        fs::write(folder.join(file), text).unwrap();
    }
    for file in ["out/checkpoint-0.bin", "out/checkpoint-1.bin"] {
        let mut bytes = fs::read(folder.join(file)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(folder.join(file), bytes).unwrap();
    }
    let broken = message(command(folder, "out", true).output().unwrap());
    assert!(broken.contains("digest is wrong"), "{broken}");
}

#[test]
fn steps_that_were_removed_are_not_named_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    kill_with_checkpoints(folder);
    fs::remove_dir_all(folder.join("out/steps")).unwrap();
    assert!(finished(&command(folder, "out", true).output().unwrap()));
    assert!(check_collection(&folder.join("out")) > 0);
}

/// Files of others are not replaced unasked.
#[test]
fn a_folder_in_which_no_run_was_is_left_as_it_is() {
    for foreign in ["history.csv", "tools/cad.vtu", "run.json"] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write_scene(folder);
        fs::create_dir_all(folder.join("out/tools")).unwrap();
        fs::write(folder.join("out").join(foreign), "mine").unwrap();
        let refused = command(folder, "out", false).output().unwrap();
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains(foreign) && said.contains("--overwrite"), "{said}");
        assert_eq!(fs::read_to_string(folder.join("out").join(foreign)).unwrap(), "mine");
        assert!(!folder.join("out/run.lock").exists());
    }
}

/// A stopped run of the same inputs is thrown away only knowingly, everything else with a line that says so.
#[test]
fn a_run_that_can_be_gone_on_with_is_not_replaced_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_scene(folder);
    kill_with_checkpoints(folder);
    let loud = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
        command.arg("run").arg(folder.join("bend.scene.json")).arg("-o").arg(folder.join("out"));
        let output = command.arg("--accept-doubts").args(more).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let before = results(&folder.join("out"));
    let (code, said) = loud(&[]);
    assert_eq!(code, Some(2), "{said}");
    for words in ["checkpoint of increment", "--restart`", "--overwrite", "-o", "run of the same"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert_eq!(results(&folder.join("out")), before);
    assert!(folder.join("out/checkpoint-1.bin").exists());
    let (code, said) = loud(&["--overwrite"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("earlier run are replaced") && said.contains("not finished"), "{said}");
    let done = results(&folder.join("out"));
    let (code, said) = loud(&[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("is done and was not repeated (--overwrite repeats it)"), "{said}");
    assert_eq!(results(&folder.join("out")), done);
    let (code, said) = loud(&["--overwrite"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("increments, finished"), "{said}");
    // Of other inputs: the scene that is edited and run again in the same folder.
    kill_with_checkpoints(folder);
    let path = folder.join("bend.scene.json");
    let scene = fs::read_to_string(&path).unwrap();
    fs::write(&path, scene.replace("\"friction\":0.1", "\"friction\":0.2")).unwrap();
    let (code, said) = loud(&[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("not finished (`scene` has changed since)"), "{said}");
}
