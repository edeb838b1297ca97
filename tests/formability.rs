//! The verdict on the part: margin to the forming limit, zones, limits of quality, onset of necking.

mod strip;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use kanagata::report::vtu_read;
use serde_json::{Value, json};
use strip::scene_in;

/// The strip drawn 3 mm and stretched by 175 N to strains of some per cent, then released by all tools, with a limit
/// curve `height` high, and changed.
fn drawn(folder: &Path, height: f64, change: impl FnOnce(&mut Value)) -> PathBuf {
    scene_in(folder, |_, scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([70, 1]);
        scene["stages"][0]["drive"]["punch"]["travel_mm"] = json!(3.0);
        scene["loads"][0]["force_n"] = json!([175.0, 0.0, 0.0]);
        let release = json!({"release": true});
        let drive = json!({"die": release, "holder": release, "punch": release});
        let springback = json!({"name": "springback", "drive": drive, "load_share": 0.0});
        scene["stages"].as_array_mut().unwrap().push(springback);
        let points = json!([[-0.2, height + 0.2], [0.0, height], [0.3, height + 0.1]]);
        scene["material"]["forming_limit"] =
            json!({"law": "points", "strain": "logarithmic", "points": points});
        change(scene);
    })
}

fn solve(command: &str, scene: &Path) -> Output {
    let mut solve = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    solve.arg(command).arg(scene);
    if command == "run" {
        solve.args(["--report", "failed", "-o"]).arg(scene.parent().unwrap().join("run"));
    }
    solve.output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the scene: exit code, terminal, record.
fn run(scene: &Path) -> (Option<i32>, String, Value) {
    let done = solve("run", scene);
    let record = scene.parent().unwrap().join("run/run.json");
    let record = serde_json::from_slice(&fs::read(record).unwrap()).unwrap();
    (done.status.code(), text(&done.stdout) + &text(&done.stderr), record)
}

fn codes(record: &Value) -> Vec<&str> {
    let doubts = record["doubts"].as_array().unwrap();
    doubts.iter().map(|doubt| doubt["code"].as_str().unwrap()).collect()
}

#[test]
fn a_part_within_its_limits_passes_and_its_record_agrees_with_its_grid() {
    let folder = tempfile::tempdir().unwrap();
    let limits = json!({"max_thinning": 0.5, "max_thickening": 0.5, "min_thickness_mm": 0.4,
        "flc_margin": 0.1, "max_springback_mm": 60.0});
    let scene = drawn(folder.path(), 0.3, |scene| scene["quality"] = limits.clone());
    let (code, said, record) = run(&scene);
    assert_eq!((code, codes(&record)), (Some(0), vec![]), "{said}");
    assert!(said.contains("formability: maximum thinning "), "{said}");
    assert!(said.contains("smallest margin to the forming limit 0."), "{said}");
    assert_eq!(record["quality"], limits);

    // The record is of the last equilibrium with tools, as the grid of that increment has it.
    let found = &record["formability"];
    let increment = record["springback"]["from_increment"].as_u64().unwrap();
    assert_eq!(found["increment"], increment);
    let grid = folder.path().join(format!("run/steps/{increment:06}.vtu"));
    let cells = vtu_read::read(&grid).unwrap().cell_data;
    let values = |name: &str| &cells.iter().find(|array| array.name == name).unwrap().values;
    let (thinning, margins) = (values("thinning_percent"), values("forming_limit_margin"));
    let largest = thinning.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = margins.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(found["thinning"]["percent"], largest);
    assert_eq!(found["margin"]["margin"], smallest);
    let element = found["margin"]["element"].as_u64().unwrap() as usize;
    assert_eq!(margins[element], smallest);
    // Plane strain, which the strip is held in: the margin is that of the major strain.
    let (major, minor) = (values("major_strain")[element], values("minor_strain")[element]);
    assert!(minor.abs() < 1e-12, "{minor}");
    assert!((smallest - (1.0 - major / 0.3)).abs() < 1e-9, "{smallest} {major}");
    // Elements of equal area: shares are those of their number.
    let zones = values("forming_zone");
    for (number, zone) in [
        (1.0, "crack"),
        (2.0, "risk"),
        (3.0, "safe"),
        (4.0, "insufficient_stretch"),
        (5.0, "wrinkling_tendency"),
        (6.0, "thickening"),
        (7.0, "strong_wrinkling"),
    ] {
        let count = zones.iter().filter(|zone| **zone == number).count();
        let share = found["zones"][zone].as_f64().unwrap();
        assert!((share - count as f64 / zones.len() as f64).abs() < 1e-9, "{zone}: {share}");
    }
    assert_eq!(found["zones"].get("not_judged"), None);
    assert!((found["area_mm2"].as_f64().unwrap() - 70.0).abs() < 1e-9);
}

#[test]
fn each_limit_that_is_exceeded_ends_with_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let strict = json!({"max_thinning": 0.01, "min_thickness_mm": 0.795, "flc_margin": 0.98,
        "max_springback_mm": 1e-3});
    let scene = drawn(folder.path(), 0.3, |scene| scene["quality"] = strict);
    let (code, said, record) = run(&scene);
    let expected =
        ["forming-limit-margin", "thinning-exceeded", "thickness-too-small", "springback-exceeded"];
    assert_eq!((code, codes(&record)), (Some(1), expected.to_vec()), "{said}");
    assert_eq!(record["verdict"], "doubtful");
    for code in expected {
        assert!(said.contains(&format!("doubt {code}: ")), "{said}");
    }
}

#[test]
fn a_part_beyond_its_limit_curve_is_doubtful_without_limits_of_quality() {
    let folder = tempfile::tempdir().unwrap();
    let scene = drawn(folder.path(), 0.01, |_| {});
    let (code, said, record) = run(&scene);
    assert_eq!((code, codes(&record)), (Some(1), vec!["forming-limit-exceeded"]), "{said}");
    let margin = record["formability"]["margin"]["margin"].as_f64().unwrap();
    assert!(margin < 0.0 && record["formability"]["zones"]["crack"].as_f64().unwrap() > 0.0);
    let doubt = &record["doubts"][0];
    assert!((doubt["value"].as_f64().unwrap() - (1.0 - margin)).abs() < 1e-12);
    assert!(said.contains("The sheet cracks: "), "{said}");
}

#[test]
fn without_a_forming_limit_the_other_zones_are_given() {
    let folder = tempfile::tempdir().unwrap();
    let scene = drawn(folder.path(), 0.3, |scene| {
        scene["material"].as_object_mut().unwrap().remove("forming_limit");
    });
    let (code, said, record) = run(&scene);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("no forming limit in the material card"), "{said}");
    let found = &record["formability"];
    assert!(found["zones"].get("crack").is_none() && found.get("margin").is_none(), "{found}");
    let zones = found["zones"].as_object().unwrap();
    let sum: f64 = zones.values().map(|share| share.as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-12 && zones.contains_key("not_judged"), "{found}");
}

#[test]
fn limits_that_cannot_be_judged_are_refused_with_a_remedy() {
    let cases: [(Value, &str, [&str; 2]); 2] = [
        (
            json!({"flc_margin": 0.1}),
            "forming_limit",
            ["material 'steel' has no `forming_limit`", "Give the card a `forming_limit`"],
        ),
        (
            json!({"max_springback_mm": 1.0}),
            "springback",
            ["no stage releases all tools", "Add a last stage"],
        ),
    ];
    for (quality, without, expected) in cases {
        let folder = tempfile::tempdir().unwrap();
        let scene = drawn(folder.path(), 0.3, |scene| {
            scene["quality"] = quality;
            match without {
                "springback" => drop(scene["stages"].as_array_mut().unwrap().pop()),
                key => drop(scene["material"].as_object_mut().unwrap().remove(key)),
            }
        });
        for command in ["check", "run"] {
            let done = solve(command, &scene);
            let said = text(&done.stdout) + &text(&done.stderr);
            assert_eq!(done.status.code(), Some(2), "{command}: {said}");
            assert!(expected.iter().all(|part| said.contains(part)), "{command}: {said}");
        }
    }
}

#[test]
fn values_out_of_range_are_refused_with_their_key() {
    for (change, expected) in [
        (json!({"quality": {"max_thinning": 20}}), "quality.max_thinning: found 20; allowed"),
        (json!({"quality": {"flc_margin": 1.0}}), "quality.flc_margin: found 1; allowed"),
        (json!({"quality": {"min_thickness_mm": 0}}), "quality.min_thickness_mm: found 0"),
        (json!({"quality": {"max_springback_mm": -1}}), "quality.max_springback_mm: found -1"),
        (json!({"quality": {"max_thining": 0.2}}), "max_thining"),
        (
            json!({"forming_limit": {"law": "points", "strain": "engineering",
                "points": [[0.0, 30.0], [10.0, 35.0]]}}),
            "forming_limit.points[0]: found [0, 30]; allowed: minor and major strain as ratios",
        ),
        (
            json!({"forming_limit": {"law": "keeler-brazier", "n": -0.1}}),
            "forming_limit.n: found -0.1",
        ),
        (json!({"forming_limit": {"law": "keeler"}}), "keeler-brazier"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let scene = drawn(folder.path(), 0.3, |scene| match change.get("quality") {
            Some(quality) => scene["quality"] = quality.clone(),
            None => scene["material"]["forming_limit"] = change["forming_limit"].clone(),
        });
        let done = solve("check", &scene);
        let said = text(&done.stdout) + &text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

/// The notched coupon is pulled past its maximum force: the record names the increment of that force in the history,
/// and a place in the notch.
#[test]
fn a_notched_coupon_necks_after_its_maximum_force() {
    let folder = tempfile::tempdir().unwrap();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/neck");
    for name in ["coupon.inp", "grip.tool.json"] {
        fs::copy(fixture.join(name), folder.path().join(name)).unwrap();
    }
    let scene = fs::read_to_string(fixture.join("neck.scene.json")).unwrap();
    let mut scene: Value = serde_json::from_str(&scene).unwrap();
    scene["material"]["forming_limit"] = json!({"law": "keeler-brazier"});
    let path = folder.path().join("neck.scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    let (code, said, record) = run(&path);
    assert_eq!(code, Some(1), "{said}");
    let codes = codes(&record);
    assert!(codes.contains(&"localised-necking"), "{said}");
    assert!(codes.contains(&"forming-limit-exceeded"), "{said}");
    let necking = &record["necking"];
    assert_eq!(necking["kind"], "band");
    let history = fs::read_to_string(folder.path().join("run/history.csv")).unwrap();
    let mut lines = history.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = columns.iter().position(|name| *name == "grip_force_n").unwrap();
    let rows: Vec<(u64, f64)> = lines
        .map(|line| line.split(',').collect::<Vec<_>>())
        .filter(|fields| fields[1] == "pull")
        .map(|fields| (fields[0].parse().unwrap(), fields[column].parse::<f64>().unwrap().abs()))
        .collect();
    let (increment, force) =
        rows.iter().copied().fold((0, 0.0), |best, row| if row.1 > best.1 { row } else { best });
    let maximum = &necking["maximum_force"];
    assert_eq!(maximum["increment"], increment, "{necking}");
    assert_eq!(maximum["tool"], "grip");
    assert!((maximum["force_n"].as_f64().unwrap() / force - 1.0).abs() < 1e-9);
    let first = necking["first_increment"].as_u64().unwrap();
    assert!(first > increment && first < rows.last().unwrap().0, "{necking}");
    let x = necking["at_mm"][0].as_f64().unwrap();
    assert!(x.abs() < 5.0, "the notch is at x = 0: {necking}");
    assert!(said.contains("after the maximum force of grip ("), "{said}");
}
