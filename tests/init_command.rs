//! `kanagata init`: proposed scenes; `schema`, `completions` and `man`; errors for files of another kind.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use kanagata::prelude::{Progress, make_tools, make_tools_watched};
use kanagata::scene::read::{parse, read};
use kanagata::scene::set_value::SetValue;
use kanagata::scene::types::{BlankShape, Scene};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(path)
}

fn call(program: &str, folder: &Path, args: &[&str]) -> Output {
    let program = match program {
        "kanagata" => env!("CARGO_BIN_EXE_kanagata"),
        _ => env!("CARGO_BIN_EXE_kanagata-solve"),
    };
    Command::new(program).args(args).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn scene(path: &Path) -> Scene {
    parse(&fs::read(path).unwrap(), path).unwrap()
}

/// Runs `init` and returns the scene and what was printed.
fn init(folder: &Path, args: &[&str]) -> (Scene, String) {
    let mut all = vec!["init", "-o", "part/part.scene.json"];
    all.extend(args);
    let done = call("kanagata", folder, &all);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    (scene(&folder.join("part/part.scene.json")), text(&done.stdout))
}

/// Makes the tools of the scene, as the printed `kanagata run` does, and checks it. Returns the numbers of their patches.
fn make_and_check(folder: &Path, printed: &str) -> Vec<usize> {
    assert!(printed.contains("  kanagata run part/part.scene.json -o part/run"), "{printed}");
    let path = folder.join("part/part.scene.json");
    let made = make_tools(&path, &mut |_| ()).unwrap();
    assert!(made.iter().all(|m| m.is_new && m.tool.doubts().is_empty()), "{made:?}");
    let again = make_tools(&path, &mut |name| panic!("{name} is made again")).unwrap();
    assert!(again.iter().all(|m| !m.is_new && m.tool.doubts().is_empty()), "{again:?}");
    let done = call("kanagata-solve", folder, &["check", "part/part.scene.json"]);
    assert_ne!(done.status.code(), Some(2), "{}", text(&done.stderr));
    made.iter().map(|m| m.tool.patches()).collect()
}

fn tools_of(part: &str) -> [String; 3] {
    ["die", "holder", "punch"]
        .map(|name| fixture(&format!("{part}/{name}.stp")).to_str().unwrap().to_owned())
}

/// The channel's punch is 80 mm wide and 120 mm long about y = 0, die and holder are 160 mm long.
#[test]
fn a_strip_lies_where_all_tools_are_and_its_holder_presses_on_its_flange() {
    let folder = tempfile::tempdir().unwrap();
    let tools = tools_of("u-channel");
    let tools = tools.each_ref().map(String::as_str);
    let (scene, printed) = init(
        folder.path(),
        &[&["--kind", "u-draw", "--thickness", "1.2mm", "--tools"][..], &tools[..]].concat(),
    );
    let BlankShape::Rectangle { corner_mm, size_mm, elements } = &scene.blank.shape else {
        panic!("{:?}", scene.blank.shape)
    };
    assert_eq!((corner_mm[0], elements[1]), (0.0, 1));
    assert!((corner_mm[1] + 0.5 * size_mm[1]).abs() < 1e-6, "{corner_mm:?} {size_mm:?}");
    // 2 MPa on both halves of the strip beside the punch, in two digits.
    let pressed = 2.0 * size_mm[1] * (size_mm[0] - 40.0);
    let stages = serde_json::to_value(&scene.stages).unwrap();
    let force = stages[0]["drive"]["holder"]["force_n"].as_f64().unwrap();
    assert!((force / (2.0 * pressed) - 1.0).abs() < 0.1, "{force} on {pressed} mm2");
    assert!(printed.contains("die: below the sheet, 260.0 x 160.0 x"), "{printed}");
    assert!(printed.contains("blank: half of the sheet, "), "{printed}");
    make_and_check(folder.path(), &printed);
}

/// A punch whose file is in decimetres by mistake is 100 times as long.
#[test]
fn tools_of_different_units_are_named_with_their_sizes() {
    let folder = tempfile::tempdir().unwrap();
    let [die, holder, punch] = tools_of("u-channel");
    let original = fs::read_to_string(punch).unwrap();
    let small = folder.path().join("punch.stp");
    let warned = |unit: &str| {
        fs::write(&small, original.replace("SI_UNIT(.MILLI.,.METRE.)", unit)).unwrap();
        let tools = ["--tools", &die, &holder, small.to_str().unwrap()];
        let args = [&["init", "--overwrite", "--kind", "u-draw", "-o", "s.scene.json"], &tools[..]];
        text(&call("kanagata", folder.path(), &args.concat()).stderr)
    };
    let decimetres = warned("SI_UNIT(.DECI.,.METRE.)");
    assert!(decimetres.contains(" is 260.0 mm across and punch is 12000.0 mm"), "{decimetres}");
    assert!(decimetres.contains("check the units of their files"), "{decimetres}");
    assert!(!warned("SI_UNIT(.MILLI.,.METRE.)").contains("warning"));
}

/// The pan closes after 30 mm; `--set` of a smaller blank reaches fewer faces of the die.
#[test]
fn the_travel_closes_the_tools_and_tools_are_those_of_the_values_that_are_set() {
    let folder = tempfile::tempdir().unwrap();
    let tools = tools_of("pan");
    let tools = tools.each_ref().map(String::as_str);
    let (scene, printed) = init(folder.path(), &[&["--tools"][..], &tools[..]].concat());
    let stages = serde_json::to_value(&scene.stages).unwrap();
    // To tenths, on coarse tools.
    let travel = stages[1]["drive"]["punch"]["travel_mm"].as_f64().unwrap();
    assert!((29.85..=30.0).contains(&travel), "{printed}");
    let path = folder.path().join("part/part.scene.json");
    let made = |set: &[SetValue]| {
        let made = make_tools_watched(&path, set, &mut |_| (), &Progress::default()).unwrap();
        (made[0].is_new, made[0].tool.patches(), made[0].file.clone())
    };
    let (_, whole, own) = made(&[]);
    assert_eq!(own, "die.tool.json");
    let smaller = [SetValue::new("blank.shape.rectangle.size_mm", "[90, 65]").unwrap()];
    let (is_new, part, file) = made(&smaller);
    assert!(is_new && part < whole, "{part} of {whole}");
    assert!(file.starts_with("die-") && file != own, "{file}");
    // Neither overwrites the other.
    assert_eq!(made(&[]), (false, whole, own));
    assert_eq!(made(&smaller), (false, part, file));
}

/// Die, binder and punch of a square cup of 100 x 100 mm in one STEP file, drawn by 25 mm in the guide. The die has a
/// bottom at 75 mm.
#[test]
fn a_die_set_in_one_file_becomes_a_quarter_scene_whose_commands_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = fixture("bodies/die-set.stp");
    let args = ["--tools", file.to_str().unwrap(), "--thickness", "0.8mm"];
    let (scene, printed) = init(folder.path(), &args);
    let planes: Vec<(usize, f64)> =
        scene.symmetry.iter().map(|plane| (plane.normal.index(), plane.at_mm)).collect();
    assert_eq!(planes, [(0, 0.0), (1, 0.0)]);
    let tools: Vec<(&str, f64)> =
        scene.tools.iter().map(|tool| (tool.name.as_str(), tool.direction[2])).collect();
    assert_eq!(tools, [("die", 1.0), ("binder", -1.0), ("punch", -1.0)]);
    assert_eq!(scene.blank.thickness_mm, 0.8);
    let BlankShape::Rectangle { corner_mm, size_mm, .. } = &scene.blank.shape else {
        panic!("{:?}", scene.blank.shape)
    };
    assert_eq!(*corner_mm, [0.0, 0.0]);
    assert!(size_mm.iter().all(|s| (52.0..=110.0).contains(s)), "{size_mm:?}");
    assert_eq!(
        scene.stages.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(),
        ["clamp", "draw", "springback"]
    );
    assert_eq!(make_and_check(folder.path(), &printed).len(), 3);
    read(&folder.path().join("part/part.scene.json")).unwrap();
}

/// Quarter tools in three IGES files, whose normals may look either way.
#[test]
fn quarter_tools_in_several_files_end_at_the_planes() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["die", "holder", "punch"].map(|name| fixture(&format!("cross/{name}.igs")));
    let mut args = vec!["--tools"];
    args.extend(files.iter().map(|f| f.to_str().unwrap()));
    let (scene, printed) = init(folder.path(), &args);
    let tools: Vec<(&str, f64)> =
        scene.tools.iter().map(|tool| (tool.name.as_str(), tool.direction[2])).collect();
    assert_eq!(tools, [("die", 1.0), ("holder", -1.0), ("punch", -1.0)]);
    assert_eq!(scene.symmetry.len(), 2);
    assert_eq!(make_and_check(folder.path(), &printed).len(), 3);
}

/// A die with an opening and a ball: tools of revolution, drawn from a disc.
#[test]
fn tools_of_revolution_give_a_disc_and_paths_relative_to_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    for (name, file, side) in [("die", "round_die", "+z"), ("punch", "hemi_punch", "-z")] {
        let file = fixture(&format!("forming/{file}_AP214.stp"));
        let side = format!("--sheet-side={side}");
        let output = format!("tools/{name}.tool.json");
        fs::create_dir_all(folder.path().join("tools")).unwrap();
        let args = ["convert", file.to_str().unwrap(), "-o", &output, &side, "--tol", "0.05mm"];
        assert_eq!(call("kanagata", folder.path(), &args).status.code(), Some(0));
    }
    let (scene, _) = init(
        folder.path(),
        &[
            "--tools",
            "tools/punch.tool.json",
            "tools/die.tool.json",
            "--material",
            "aa5754-o-coer2018",
        ],
    );
    assert_eq!(scene.tools[0].file, "../tools/punch.tool.json");
    assert_eq!(scene.tools[1].direction, [0.0, 0.0, 1.0]);
    let BlankShape::QuarterDisc { radius_mm, .. } = scene.blank.shape else {
        panic!("{:?}", scene.blank.shape)
    };
    assert!((50.0..=80.0).contains(&radius_mm), "{radius_mm}");
    let written = fs::read_to_string(folder.path().join("part/part.scene.json")).unwrap();
    assert!(written.contains("open below the punch"), "{written}");
    assert_eq!(scene.stages.last().unwrap().name, "springback");
    let check = call("kanagata-solve", folder.path(), &["check", "part/part.scene.json"]);
    assert!(check.status.code() != Some(2), "{}", text(&check.stderr));
}

#[test]
fn templates_of_every_kind_are_scenes() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["cup", "pan", "u-draw", "bend"] {
        let (scene, _) = init(folder.path(), &["--kind", kind, "--overwrite"]);
        assert_eq!(scene.tools.len(), if kind == "bend" { 2 } else { 3 }, "{kind}");
        assert_eq!(scene.holds.is_empty(), matches!(kind, "cup" | "pan"), "{kind}");
    }
    let again =
        call("kanagata", folder.path(), &["init", "-o", "part/part.scene.json", "--kind", "cup"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--overwrite"), "{}", text(&again.stderr));
}

#[test]
fn tools_on_one_side_and_a_single_tool_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = fixture("forming/round_die_AP214.stp");
    for (name, side) in [("a", "+z"), ("b", "+z")] {
        let output = format!("{name}.tool.json");
        let side = format!("--sheet-side={side}");
        call("kanagata", folder.path(), &["convert", file.to_str().unwrap(), "-o", &output, &side]);
    }
    let of = |args: &[&str]| {
        let done = call("kanagata", folder.path(), args);
        assert_eq!(done.status.code(), Some(2));
        text(&done.stderr)
    };
    let both = of(&["init", "-o", "s.scene.json", "--tools", "a.tool.json", "b.tool.json"]);
    assert!(both.contains("all tools (a, b) lie below the sheet"), "{both}");
    assert!(
        of(&["init", "-o", "s.scene.json", "--tools", "a.tool.json"]).contains("found 1 tools")
    );
    assert!(!folder.path().join("s.scene.json").exists());
}

#[test]
fn a_file_of_another_kind_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let [step, scene, study] =
        ["bodies/press.stp", "dome/dome.scene.json", "studies/cross-tool.json"].map(fixture);
    let [step, scene, study] = [&step, &scene, &study].map(|path| path.to_str().unwrap());
    for (program, args, found) in [
        ("kanagata-solve", &["check", step][..], "found a STEP file; allowed: a scene"),
        ("kanagata-solve", &["run", study, "-o", "run"], "found a study; allowed: a scene"),
        ("kanagata", &["study", scene, "-o", "study"], "found a scene; allowed: a study"),
        ("kanagata", &["audit", step, "--cad", step], "found a STEP file; allowed: a tool file"),
        ("kanagata", &["inspect", scene], "a scene; export the model"),
    ] {
        let done = call(program, folder.path(), args);
        let error = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{error}");
        assert!(error.contains(found), "{error}");
        assert!(args[0] == "inspect" || error.contains("  try: "), "{error}");
    }
}

#[test]
fn schemas_completions_and_manual_pages_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let schema = call("kanagata", folder.path(), &["schema", "scene"]);
    let value: serde_json::Value = serde_json::from_slice(&schema.stdout).unwrap();
    assert!(value["properties"]["blank"].is_object());
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        for program in ["kanagata", "kanagata-solve"] {
            let args = ["completions", shell, "--program", program];
            let script = text(&call("kanagata", folder.path(), &args).stdout);
            let option = if program == "kanagata" { "sheet-side" } else { "accept-doubts" };
            assert!(script.contains(option), "{shell} {program}");
        }
    }
    let done = call("kanagata", folder.path(), &["man", "-o", "man1"]);
    assert_eq!(done.status.code(), Some(0));
    for (name, has) in [
        ("kanagata", "completions"),
        ("kanagata-convert", "sheet\\-side"),
        ("kanagata-solve-run", "accept\\-doubts"),
    ] {
        let page = fs::read_to_string(folder.path().join(format!("man1/{name}.1"))).unwrap();
        assert!(page.contains(".TH") && page.contains(has), "{name}: {page}");
    }
    let version = text(&call("kanagata", folder.path(), &["--version"]).stdout);
    assert!(version.contains(env!("CARGO_PKG_VERSION")) && version.contains("pages"), "{version}");
}
