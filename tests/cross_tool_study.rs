//! The paper's study, `fixtures/studies/cross-tool.json` with `--quick`: three of its tool models by the recipes of
//! `fixtures/cross/models`, run by the real programs. What it is expected to show holds; times, which are those of the
//! machine, are not asked.

mod command;

use std::path::Path;

use command::{fixture, kanagata};
use serde_json::Value;

const MODELS: [&str; 3] = ["Bezier-AO", "St-QN-210", "St-QN-210-Bezier"];

/// Makes the three tools of a model in a folder of its name.
fn make(folder: &Path, model: &str) {
    let text = std::fs::read_to_string(fixture("cross/models/models.json")).unwrap();
    let recipes: Value = serde_json::from_str(&text).unwrap();
    let recipe = recipes["models"].as_array().unwrap().iter().find(|m| m["name"] == model).unwrap();
    std::fs::create_dir_all(folder.join(model)).unwrap();
    for (tool, of) in recipes["tools"].as_object().unwrap() {
        let file = |model: &str| folder.join(model).join(format!("{tool}.tool.json"));
        let path = |model: &str| file(model).to_str().unwrap().to_owned();
        let (cad, side) = (of["cad"].as_str().unwrap(), of["sheet_side"].as_str().unwrap());
        let cad = fixture(&format!("cross/{cad}"));
        let mut words: Vec<String> = match recipe["from"].as_str() {
            Some(source) => vec!["convert".into(), path(source), "--to".into(), "bezier".into()],
            None => vec!["convert".into(), cad, format!("--sheet-side={side}")],
        };
        words.extend(["-o".into(), path(model)]);
        let options = recipe[tool]["options"].as_array().into_iter().flatten();
        words.extend(options.map(|option| option.as_str().unwrap().to_owned()));
        let (code, _, errors) = kanagata(&words.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(code, 0, "{words:?}: {errors}");
    }
}

/// A column of `study.csv` by case.
fn column(csv: &str, name: &str) -> Vec<(String, String)> {
    let place = csv.lines().next().unwrap().split(',').position(|head| head == name).unwrap();
    let cell = |line: &str, k: usize| line.split(',').nth(k).unwrap().to_owned();
    csv.lines().skip(1).map(|line| (cell(line, 0), cell(line, place))).collect()
}

#[test]
fn the_quick_study_shows_what_it_is_expected_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    MODELS.iter().for_each(|model| make(folder.path(), model));
    let (study, tools, out) = (fixture("studies/cross-tool.json"), path(""), path("out"));
    let mut words = vec!["study", &study, "--tools", &tools, "-o", &out, "--quick"];
    words.extend(MODELS.iter().flat_map(|model| ["--only", model]));
    let (code, text, errors) = kanagata(&words);
    println!("{text}");
    assert!(code <= 1, "{text}{errors}");
    let state = |state: &str| text.lines().filter(|l| l.trim_start().starts_with(state)).count();
    let about_time = |line: &&str| line.contains("time");
    let failed = text.lines().filter(|l| l.trim_start().starts_with("DOES NOT HOLD"));
    assert_eq!(failed.filter(|line| !about_time(line)).collect::<Vec<_>>(), [""; 0]);
    // In force, in thickness, the converted model, four balances.
    assert!(state("holds") >= 7, "{text}");
    let csv = std::fs::read_to_string(path("out/study.csv")).unwrap();
    for (case, state) in column(&csv, "state") {
        // The coarse sheet of the quick study is doubtful, and says so.
        let expected = if MODELS.contains(&case.as_str()) { "doubtful" } else { "waiting" };
        assert_eq!(state, expected, "{case}");
    }
    for (case, travel) in column(&csv, "travel_mm") {
        assert!(!MODELS.contains(&case.as_str()) || travel == "30.000", "{case}: {travel}");
    }
    for chart in ["force.svg", "thickness-dx.svg", "time.svg", "error-against-patches.svg"] {
        assert!(Path::new(&path("out")).join(chart).exists(), "{chart}");
    }
}
