//! The commands of pages of the guide, run in their order by a shell, with coarser sheets where a page takes minutes.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Shell scripts of a page: fenced blocks of `bash`, and indented commands with their continued lines.
fn scripts(page: &str) -> Vec<String> {
    let (mut out, mut fenced, mut open) = (Vec::<String>::new(), None::<bool>, false);
    for line in page.lines() {
        if let Some(language) = line.strip_prefix("```") {
            fenced = if fenced.is_some() { None } else { Some(language == "bash") };
            if fenced == Some(true) {
                out.push(String::new());
            }
            open = false;
            continue;
        }
        let command = match fenced {
            Some(true) => line,
            Some(false) => continue,
            None => match line.strip_prefix("    ") {
                Some(code) if open || code.starts_with("kanagata") || code.starts_with("mkdir") => {
                    if !open {
                        out.push(String::new());
                    }
                    open = code.ends_with('\\');
                    code
                }
                _ => continue,
            },
        };
        if let Some(last) = out.last_mut() {
            last.push_str(command);
            last.push('\n');
        }
    }
    out
}

/// Runs scripts in `folder`. The programs may end with a doubt (1), and with nothing worse.
fn run(folder: &Path, scripts: &[String]) {
    let programs = Path::new(env!("CARGO_BIN_EXE_kanagata")).parent().unwrap();
    for name in ["fixtures", "examples"] {
        let there = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let _ = std::os::unix::fs::symlink(there, folder.join(name));
    }
    for script in scripts {
        let guarded = format!(
            "set -eu\nguard() {{ local code=0; \"$@\" || code=$?; [ $code -le 1 ] || exit $code; }}\n\
             kanagata() {{ guard '{0}/kanagata' \"$@\"; }}\n\
             kanagata-solve() {{ guard '{0}/kanagata-solve' \"$@\"; }}\n{script}",
            programs.display()
        );
        let done =
            Command::new("bash").arg("-c").arg(guarded).current_dir(folder).output().unwrap();
        let told = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "{script}\n{}{told}", String::from_utf8_lossy(&done.stdout));
    }
}

fn page(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide").join(name);
    std::fs::read_to_string(path).unwrap()
}

fn record(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path.join("run.json")).unwrap()).unwrap()
}

#[test]
fn getting_started_and_its_study_are_run_as_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let started = scripts(&page("getting-started.md"));
    assert!(started.len() >= 8, "{started:#?}");
    run(folder.path(), &started);
    let study: Vec<String> = scripts(&page("studies.md"))
        .into_iter()
        .filter(|script| script.contains("points.study.json"))
        .map(|script| script.replace("\"core\": 12, \"rings\": 28", "\"core\": 6, \"rings\": 14"))
        .collect();
    assert_eq!(study.len(), 1);
    run(folder.path(), &study);
    for file in ["run/report.html", "study/study.html"] {
        assert!(folder.path().join("out/dome").join(file).exists(), "{file}");
    }
}

/// A sequence of runs with its estimated errors, and its status.
#[test]
fn the_accuracy_of_the_page_is_reached() {
    let folder = tempfile::tempdir().unwrap();
    let all = scripts(&page("accuracy.md"));
    assert!(all.len() == 1 && all[0].contains("--accuracy 10%"), "{all:#?}");
    run(folder.path(), &all);
    let accuracy = record(&folder.path().join("out/u-draw"))["accuracy"].take();
    assert_eq!(accuracy["end"], "reached");
    for quantity in accuracy["quantities"].as_array().unwrap() {
        assert!(quantity["error"].as_f64() <= quantity["allowed"].as_f64(), "{quantity}");
    }
}

#[test]
fn the_strip_of_the_page_on_formability_has_a_margin_to_its_limit() {
    let folder = tempfile::tempdir().unwrap();
    let all = scripts(&page("formability.md"));
    assert_eq!(all.len(), 2, "{all:#?}");
    run(folder.path(), &all);
    let record = record(&folder.path().join("out/strip-limit"));
    assert!(record["formability"]["margin"]["margin"].as_f64().unwrap() > 0.1, "{record:#}");
}

/// `init`, and `run` with tools from CAD.
#[test]
fn the_scene_that_is_proposed_is_run() {
    let folder = tempfile::tempdir().unwrap();
    let all = scripts(&page("scenes.md"));
    let [init, made] = &all[..] else { panic!("{all:#?}") };
    assert!(init.contains("kanagata init") && made.contains("kanagata run"), "{all:#?}");
    run(folder.path(), &all);
    for file in ["cup.scene.json", "die.tool.json", "run/report.html"] {
        assert!(folder.path().join("out/cup").join(file).exists(), "{file}");
    }
}

/// The first command; the others need packages that tools/examples installs and runs.
#[test]
fn values_are_set_and_results_written_as_the_page_on_parameters_says() {
    let folder = tempfile::tempdir().unwrap();
    let all = scripts(&page("parameters.md"));
    assert!(all[0].contains("--metrics out/run-7.json"), "{all:#?}");
    run(folder.path(), &all[..1]);
    let metrics = std::fs::read(folder.path().join("out/run-7.json")).unwrap();
    let metrics: Value = serde_json::from_slice(&metrics).unwrap();
    assert!(metrics["thickness_min_mm"].as_f64().unwrap() < 1.2, "{metrics:#}");
    assert_eq!(record(&folder.path().join("out/run-7"))["set"][0], "tools.die.friction=0.08");
}

/// Die, binder and punch of one STEP file, and then a punch that is made from the die: the part is the same.
#[test]
fn a_die_set_is_run_with_its_punch_and_with_one_made_from_the_die() {
    let folder = tempfile::tempdir().unwrap();
    let coarse =
        |script: String| script.replace("\"elements\": [80, 80]", "\"elements\": [20, 20]");
    let all: Vec<String> = scripts(&page("die-set.md")).into_iter().map(coarse).collect();
    let [.., offset] = &all[..] else { panic!("{all:?}") };
    assert!(offset.contains("--offset") && all.len() >= 5, "{all:#?}");
    run(folder.path(), &all);
    let again = "kanagata-solve run out/die-set/cup.scene.json -o out/die-set/again".to_owned();
    run(folder.path(), &[again]);
    let [own, made] =
        ["run", "again"].map(|name| record(&folder.path().join("out/die-set").join(name)));
    let thinnest = |record: &Value| record["thickness"]["minimum_mm"].as_f64().unwrap();
    let off = (thinnest(&own) - thinnest(&made)).abs();
    assert!(off < 0.01, "{} with its punch, {} with the offset", thinnest(&own), thinnest(&made));
    assert!(thinnest(&own) < 0.79, "{}", thinnest(&own));
}

/// Die, punch and holder of a pan to a verdict on formability, with elements longer than those of the page.
#[test]
fn the_pan_of_the_page_is_judged() {
    let folder = tempfile::tempdir().unwrap();
    let coarse =
        |script: String| script.replace("\"elements\": [34, 28]", "\"elements\": [22, 18]");
    let all: Vec<String> = scripts(&page("pan.md")).into_iter().map(coarse).collect();
    let [inspect, init, edits, made] = &all[..] else { panic!("{all:#?}") };
    assert!(inspect.contains("kanagata inspect") && init.contains("kanagata init"), "{all:#?}");
    assert!(edits.contains("[22, 18]") && made.contains("kanagata run"), "{all:#?}");
    run(folder.path(), &all);
    let out = folder.path().join("out/pan");
    for file in ["die.tool.json", "run/report.html"] {
        assert!(out.join(file).exists(), "{file}");
    }
    let record = record(&out.join("run"));
    let thickness = record["thickness"]["minimum_mm"].as_f64().unwrap();
    assert!((thickness - 0.96).abs() < 0.01, "{thickness}");
    let margin = record["formability"]["margin"]["margin"].as_f64().unwrap();
    assert!((margin - 0.87).abs() < 0.04, "{margin}");
    // Both limits of quality are kept.
    let doubts = record["doubts"].as_array().unwrap();
    let is_of_mesh = |doubt: &Value| doubt["code"] == "penetration-on-faces";
    assert!(doubts.iter().all(is_of_mesh), "{doubts:#?}");
}

/// Die, punch and holder of a channel to its angles after springback, as the page states them.
#[test]
fn the_u_channel_of_the_page_has_its_angles_after_springback() {
    let folder = tempfile::tempdir().unwrap();
    let all = scripts(&page("u-channel.md"));
    let [inspect, scene, made] = &all[..] else { panic!("{all:#?}") };
    assert!(inspect.contains("kanagata inspect") && scene.contains("channel.scene.json"));
    assert!(made.contains("kanagata run"), "{all:#?}");
    run(folder.path(), &all);
    let record = record(&folder.path().join("out/u-channel/run"));
    let wall = &record["sections"][0]["walls"][0];
    let stated = [
        ("released_wall_deg", 110.9, 1.0),
        ("released_flange_deg", 80.4, 1.0),
        ("curl_radius_mm", 109.0, 12.0),
    ];
    for (key, stated, tolerance) in stated {
        let found = wall[key].as_f64().unwrap();
        assert!((found - stated).abs() < tolerance, "{key}: {found}, {stated} on the page");
    }
    let thickness = record["thickness"]["minimum_mm"].as_f64().unwrap();
    assert!((thickness - 1.168).abs() < 0.005, "{thickness}");
}
