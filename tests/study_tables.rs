//! Studies whose cases are the rows of a table.

mod bend;
mod command;

use std::fs;
use std::path::PathBuf;

use command::{fixture, kanagata};
use serde_json::{Value, json};

/// The study of `examples/strip`: three values in columns, a case without changes, and charts by case.
#[test]
fn every_row_of_a_table_is_a_case() {
    let strip = PathBuf::from(fixture("../examples/strip"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let study = |options: &[&str]| {
        let file = strip.join("table.study.json");
        let first = ["study", file.to_str().unwrap(), "-o", out.to_str().unwrap()];
        kanagata(&[&first[..], &["--accept-doubts"], options].concat())
    };
    let (code, text, errors) = study(&["--only", "hard"]);
    assert!(code == 0 && text.contains("hard: done") && !text.contains("base:"), "{text}{errors}");
    let (code, text, errors) = study(&["--jobs", "2"]);
    assert!(code == 0 && text.contains("4 cases, 0 of those"), "{text}{errors}");
    assert!(!text.contains("hard: begins"), "{text}");

    let table = fs::read_to_string(out.join("study.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split(',').collect()).collect();
    let given = fs::read_to_string(strip.join("table.csv")).unwrap();
    for (row, given) in rows.iter().zip(given.lines()) {
        assert_eq!(row[..6].join(","), given);
    }
    let column = rows[0].iter().position(|head| *head == "force_max_n").unwrap();
    let force = |row: usize| rows[row][column].parse::<f64>().unwrap();
    let [base, low_friction, high_force, hard] = [1, 2, 3, 4].map(force);
    assert!(low_friction < base && base < high_force && base < hard, "{table}");
    let scene = fs::read(out.join("cases/high-force/case.scene.json")).unwrap();
    let scene: Value = serde_json::from_slice(&scene).unwrap();
    assert_eq!(scene["stages"][0]["drive"]["holder"]["force_n"], 300);
    assert_eq!(scene["tools"][0]["friction"], 0.12);
    assert_eq!(scene["name"], "Strip: friction, holder force and hardening: high-force");
    let page = fs::read_to_string(out.join("study.html")).unwrap();
    assert!(page.contains("\"name\":\"low-friction\""));
}

#[test]
fn a_wrong_table_is_refused_with_file_row_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (file, out) = (at("study.json"), at("out"));
    fs::create_dir(at("a")).unwrap();
    bend::write_tools(&at("a"));
    let mut scene = bend::scene("{case}");
    scene["stages"].as_array_mut().unwrap().truncate(1);
    scene["stages"][0]["largest_increment"] = 0.5.into();
    let mut study = json!({
        "format": "kanagata-study", "version": 1, "name": "bends", "watch": "plane",
        "scene": scene, "table": "cases.csv",
    });
    fs::write(&file, study.to_string()).unwrap();
    let run = || {
        let [file, out] = [&file, &out].map(|path| path.to_str().unwrap());
        kanagata(&["study", file, "-o", out, "--accept-doubts"])
    };
    let (code, _, errors) = run();
    assert!(code == 4 && errors.contains("cases.csv"), "{errors}");
    for (table, words) in [
        ("case,blank.layers\na,0\n", &["row 2, column blank.layers (case a)", "at least 1"][..]),
        ("case,tools.none.friction\na,0\n", &["column tools.none.friction", "plane"]),
        ("case\na\na\n", &["cases.csv, row 3, column case", "once more"]),
    ] {
        fs::write(at("cases.csv"), table).unwrap();
        let (code, _, errors) = run();
        assert!(code == 2 && words.iter().all(|w| errors.contains(w)), "{errors}");
        assert!(!out.exists());
    }
    fs::write(at("cases.csv"), "case,blank.layers\na,\n").unwrap();
    let (code, text, errors) = run();
    assert!(code == 0 && text.contains("a: done"), "{text}{errors}");
    // The table of results would replace that of the cases.
    fs::copy(at("cases.csv"), at("out/study.csv")).unwrap();
    study["table"] = "out/study.csv".into();
    fs::write(&file, study.to_string()).unwrap();
    let (code, _, errors) = run();
    assert!(code == 2 && errors.contains("study.csv is the file"), "{errors}");
}
