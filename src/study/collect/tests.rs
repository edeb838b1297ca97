use std::fs;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::*;
use crate::cases::{Roots, cases};
use crate::inputs::{Digests, inputs};
use crate::states::states;

/// A study of three models in a folder: the first two done, the third not started.
struct Made {
    folder: tempfile::TempDir,
    study: Study,
    cases: Vec<Case>,
    /// States that the folder does not show.
    other: States,
}

impl Made {
    fn new(checks: Value) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for model in ["fine", "coarse", "later"] {
            let tool = json!({"patches": [1, 2], "provenance": {"shape_error_mm": 0.1}});
            fs::create_dir(folder.path().join(model)).unwrap();
            fs::write(folder.path().join(model).join("die.tool.json"), tool.to_string()).unwrap();
        }
        let study: Study = serde_json::from_value(json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "punch", "reference": "fine",
            "scene": {"blank": 1, "tools": [{"file": "{model}/die.tool.json"}]},
            "choices": [{"name": "model", "options": [
                {"name": "fine", "method": "smooth"}, {"name": "coarse", "method": "smooth"}, {"name": "later"}
            ]}],
            "checks": checks
        }))
        .unwrap();
        let roots = Roots { tools: folder.path(), own: folder.path() };
        let cases = cases(&study, &roots, false);
        for (case, force) in cases.iter().zip([10.0, 12.0]) {
            put_run(case, folder.path(), force);
        }
        Self { folder, study, cases, other: States::default() }
    }

    fn collect(&self) -> Vec<(Check, Outcome)> {
        self.findings().checks
    }

    fn findings(&self) -> Findings {
        collect(&self.study, &self.cases, &self.states(), self.folder.path()).unwrap()
    }

    fn states(&self) -> States {
        let mut states = states(&self.cases, self.folder.path());
        states.extend(self.other.clone());
        states
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A cell of `study.csv` or `cost.csv`.
    fn cell(&self, case: &str, column: &str) -> String {
        let text = fs::read_to_string(self.path("study.csv")).unwrap();
        let is_cost = !text.lines().next().unwrap().split(',').any(|head| head == column);
        let text = if is_cost { fs::read_to_string(self.path("cost.csv")).unwrap() } else { text };
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let head = cells(text.lines().next().unwrap());
        let row = text.lines().map(cells).find(|r| r[0] == case).unwrap();
        row[head.iter().position(|h| h == column).unwrap()].clone()
    }
}

fn put_run(case: &Case, study: &Path, force: f64) {
    let run = &folder_of(study, &case.id).join("run");
    fs::create_dir_all(run).unwrap();
    let inputs = inputs(case, study, &Digests::default(), true).unwrap();
    let record = json!({
        "format": "kanagata-run", "version": 2, "program": "", "build": kanagata_run::build::BUILD, "name": "", "verdict": "completed",
        "increments": 3, "iterations": 6, "step_cuts": 0, "wall_s": 9.0, "cpu_s": force, "peak_mb": 5.0,
        "timings_s": {"search": 3.0, "factor": 0.4 * force}, "factorisations": 8, "threads": 1, "unknowns": 3, "force_error": 1e-12,
        "energy_error": 1e-3, "volume_error": 1e-15, "penetration_mm": 0.0, "inputs": inputs,
        "springback": {"largest_mm": 0.5, "rms_mm": 0.25, "force_n": 40.0, "energy_nmm": 7.0}
    });
    fs::write(run.join("run.json"), record.to_string()).unwrap();
    let row = |n: u8| format!("{n},{n},{}\n", force * f64::from(n));
    let history =
        format!("increment,punch_travel_mm,punch_force_n\n{}{}{}", row(1), row(2), row(3));
    fs::write(run.join("history.csv"), history).unwrap();
}

#[test]
fn results_of_other_tools_are_stale_and_take_part_in_nothing() {
    let checks = json!([
        {"says": "forces agree", "figure": "force_rms", "at_most": 0.3},
        {"says": "volume balances", "figure": "volume_error", "at_most": 1e-12},
        {"says": "no late peak", "figure": "late_force_excess", "cases": ["coarse"], "at_most": 0.3},
        {"says": "time is the same", "figure": "seconds_over_reference", "at_most": 1.3},
        {"says": "so is an iteration's", "figure": "iteration_in_factorisations_over_reference", "at_most": 1.1}
    ]);
    let made = Made::new(checks);
    for (_, outcome) in made.collect() {
        assert!(matches!(outcome, Outcome::Holds { .. }), "{outcome:?}");
    }
    assert_eq!(made.cell("coarse", "state"), "done");
    assert_eq!(made.cell("coarse", "force_rms_to_reference"), "0.20000");
    let late = made.collect().swap_remove(2).1;
    assert!(matches!(&late, Outcome::Holds { case, value }
        if case == "coarse at 3.0 mm" && (value - 0.2).abs() < 1e-12));
    fs::write(made.path("coarse/die.tool.json"), "{}").unwrap();
    let checks = made.collect();
    assert_eq!(made.cell("coarse", "state"), "stale");
    assert!(made.cell("coarse", "reason").contains("die.tool.json has changed"));
    for column in ["force_rms_to_reference", "force_end_n", "iterations", "springback_mm"] {
        assert_eq!(made.cell("coarse", column), "", "{column}");
    }
    assert!(matches!(&checks[0].1, Outcome::Holds { case, .. } if case == "fine"));
    assert_eq!(checks[2].1, Outcome::Open);
    let drawing = fs::read_to_string(made.path("force.svg")).unwrap();
    assert!(drawing.contains("fine") && !drawing.contains("coarse"));
    // Without the reference nothing is compared; without a tool nothing is known.
    fs::remove_file(made.path("fine/die.tool.json")).unwrap();
    assert_eq!(made.collect()[0].1, Outcome::Open);
    assert!(made.cell("fine", "reason").contains("cannot be compared"));
}

#[test]
fn who_follows_a_stale_case_is_stale_too() {
    let mut made = Made::new(json!([]));
    made.cases[1].follows = Some("fine".into());
    made.collect();
    assert_eq!(made.cell("coarse", "state"), "done");
    fs::write(made.path("fine/die.tool.json"), "{}").unwrap();
    made.collect();
    assert_eq!(made.cell("coarse", "state"), "stale");
    assert!(made.cell("coarse", "reason").contains("follows fine"));
}

#[test]
fn cases_that_were_not_run_have_no_numbers() {
    let mut made = Made::new(json!([]));
    made.collect();
    assert_eq!(made.cell("later", "state"), "waiting");
    let reason = Some("did not converge".to_owned());
    made.other.insert("later".into(), Entry::new(State::Failed, reason));
    made.collect();
    assert_eq!(made.cell("later", "state"), "failed");
    assert_eq!(made.cell("later", "reason"), "did not converge");
    for column in
        ["travel_mm", "force_max_n", "force_end_n", "minimum_thickness_mm", "draw_in_dx_mm"]
    {
        assert_eq!(made.cell("later", column), "", "{column}");
    }
    assert_eq!(made.cell("later", "patches"), "2");
    assert_eq!(made.cell("later", "method"), "later");
}

#[test]
fn costs_and_balances_are_in_the_table_and_drawn() {
    let made = Made::new(json!([]));
    made.collect();
    for (column, expected) in [
        ("search_and_projection_s", "3.00"),
        ("factor_s", "4.80"),
        ("other_s", "1.20"),
        ("volume_error", "1.0e-15"),
        ("energy_error", "1.0e-3"),
        ("springback_rms_mm", "0.2500"),
        ("released_force_n", "40"),
        ("method", "smooth"),
    ] {
        assert_eq!(made.cell("coarse", column), expected, "{column}");
    }
    for drawing in ["time", "springback", "error-against-time", "shape-error-against-patches"] {
        assert!(made.path(drawing).with_extension("svg").exists(), "{drawing}");
    }
    let page = fs::read_to_string(made.path("study.html")).unwrap();
    assert!(page.contains("Total time by phase") && page.contains("search and projection"));
}

/// The page opens with the verdict and the answers of the cases; all columns and the cost are folded behind the set-up.
#[test]
fn the_page_opens_with_the_verdict_and_folds_the_cost() {
    let made = Made::new(json!([
        {"says": "forces agree", "figure": "force_rms", "at_most": 0.1},
        {"says": "volume balances", "figure": "volume_error", "at_most": 1e-12}
    ]));
    let path = folder_of(made.folder.path(), "fine").join("run/run.json");
    let mut record: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let place = json!({"percent": 21.5, "element": 3, "at_mm": [1.0, 2.0, 3.0]});
    record["quality"] = json!({"max_thinning": 0.2});
    record["formability"] = json!({
        "increment": 3, "area_mm2": 1.0, "thinning": place, "thickening": place,
        "margin": {"margin": 0.125, "major": 0.3, "minor": 0.0, "limit_major": 0.4, "element": 3,
            "at_mm": [1.0, 2.0, 3.0], "turned": false},
        "zones": {"insufficient_stretch": 1.0, "wrinkling_tendency": 0.0, "thickening": 0.0,
            "strong_wrinkling": 0.0},
        "turned_paths": {"angle_deg": 30.0, "elements": 0, "share": 0.0, "largest_deg": 0.0}
    });
    fs::write(&path, record.to_string()).unwrap();
    made.collect();
    for (column, expected) in
        [("quality", "exceeded"), ("thinning_percent", "21.50"), ("forming_limit_margin", "0.125")]
    {
        assert_eq!(made.cell("fine", column), expected);
        assert_eq!(made.cell("coarse", column), "");
    }
    let page = fs::read_to_string(made.path("study.html")).unwrap();
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text}"));
    let verdict = "<p class=\"outcome failed\">2 of 3 cases are done (1 waiting); 1 of 2 expectations hold.</p>";
    let parts =
        ["What it is expected to show", "<h2>Cases", "21.50", "Total time", "Set-up", "cost.csv"];
    let places: Vec<usize> = [verdict].iter().chain(&parts).map(|text| at(text)).collect();
    assert!(places.is_sorted(), "{places:?}");
    // A column without values is left out of the answers.
    let cases = page.split("<h2>Cases").nth(1).unwrap().split("</table>").next().unwrap();
    assert!(cases.contains("forming_limit_margin") && !cases.contains("<th>reason</th>"));
}

#[test]
fn methods_are_lines_and_the_best_are_ringed() {
    let made = Made::new(json!([]));
    let mut rows: Vec<Row<'_>> = made
        .cases
        .iter()
        .map(|case| row(&made.study, case, made.states().get(&case.id), made.folder.path()))
        .collect();
    rows[0].shape_error = Some(0.01);
    let error = ("shape", "Shape error", "mm", (|r, _| r.shape_error) as chart_set::Number);
    let cost = ("time", "time", "s", (|_, record| Some(record.cpu_s)) as chart_set::Number);
    let chart = chart_set::against(&rows, &error, &cost);
    assert_eq!(chart.lines.len(), 2);
    assert_eq!(chart.lines[0].name, "smooth");
    assert_eq!(chart.lines[0].points, [(10.0, 0.01), (12.0, 0.1)]);
    assert!(chart.lines[1].marks_only && chart.lines[1].points == [(10.0, 0.01)]);
}

#[test]
fn curves_are_compared_over_their_common_travel() {
    let text = "increment,stage,punch_travel_mm,punch_force_n\n1,clamp,0,5\n2,draw,1,10\n3,draw,3,30\n4,release,3,0\n";
    let a = curve(text, "punch").unwrap();
    assert_eq!(a, [(1.0, 10.0), (3.0, 30.0)]);
    assert!(curve(text, "die").is_none() && curve("", "punch").is_none());
    let b: Vec<(f64, f64)> = [(1.0, 11.0), (2.0, 22.0), (4.0, 44.0)].into();
    assert!((curves::force_rms(&b, &a).unwrap() - 0.1).abs() < 1e-12);
    assert!((curves::force_rms(&a, &a).unwrap()).abs() < 1e-15);
    assert!(curves::force_rms(&a, &[]).is_none());
    // A peak in the middle is not late.
    let c = [(1.0, 10.0), (1.5, 90.0), (2.0, 20.0), (2.5, 28.0), (3.0, 30.0)];
    let (travel, excess) = curves::late_excess(&c, &a).unwrap();
    assert!((travel - 2.5).abs() < 0.01 && (excess - 0.1).abs() < 2e-3, "{travel} {excess}");
}

#[test]
fn a_doubt_about_many_cases_is_given_once_with_their_names() {
    let made = Made::new(json!([]));
    let put = |case: &str, code: &str, value: f64, limit: f64| {
        let path = folder_of(made.folder.path(), case).join("run/run.json");
        let mut record: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        record["doubts"] = json!([{
            "code": code, "where": "sheet", "value": value, "limit": limit, "text": "It is lost."
        }]);
        fs::write(&path, record.to_string()).unwrap();
    };
    // Above a maximum, below a minimum, and above a limit of zero: the second is worse.
    for (code, values, limit) in [
        ("energy-balance", [2.0, 3.0], 1.0),
        ("thickness-below-half", [0.45, 0.2], 0.5),
        ("unstable-equilibrium", [1.0, 4.0], 0.0),
    ] {
        for (case, value) in ["fine", "coarse"].into_iter().zip(values) {
            put(case, code, value, limit);
        }
        let doubts = made.findings().doubts;
        let texts: Vec<&str> = doubts.iter().map(|doubt| doubt.text.as_str()).collect();
        assert_eq!(texts, ["coarse: It is lost. The same doubt applies to fine."], "{code}");
    }
}

#[test]
fn runs_of_several_builds_or_processors_are_noted_with_their_cases() {
    let mut made = Made::new(json!([]));
    let put = |case: &str, key: &str, value: &str| {
        let path = folder_of(made.folder.path(), case).join("run/run.json");
        let mut record: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        record[key] = value.into();
        fs::write(&path, record.to_string()).unwrap();
    };
    put("fine", "cpu", "x86-v4");
    // What is unknown is no other class.
    assert!(made.findings().notes.is_empty());
    put("coarse", "cpu", "x86-v3");
    let notes = made.findings().notes;
    assert_eq!(notes.len(), 1);
    assert!(notes[0].contains("processors: x86-v3 (coarse); x86-v4 (fine)."), "{notes:?}");
    put("coarse", "build", "0.1.0 of another");
    let notes = made.findings().notes;
    let builds = format!("0.1.0 of another (coarse); {} (fine)", kanagata_run::build::BUILD);
    assert!(notes.len() == 1 && notes[0].contains(&builds), "{notes:?}");
    let page = fs::read_to_string(made.path("study.html")).unwrap();
    let (before, after) = page.split_once("<section class=\"notes\">").unwrap();
    assert!(after.contains(&builds) && !before.contains("<h2>Cases"), "before the tables");
    // A case that is not done takes no part.
    put("coarse", "build", kanagata_run::build::BUILD);
    made.other.insert("coarse".into(), Entry::new(State::Failed, None));
    assert!(made.findings().notes.is_empty());
}

#[test]
fn results_that_cannot_be_read_are_noted_with_their_cases() {
    let made = Made::new(json!([]));
    assert!(made.findings().notes.is_empty());
    let file = |case: &str, name: &str| folder_of(made.folder.path(), case).join("run").join(name);
    fs::write(file("fine", HISTORY), "increment,die_travel_mm,die_force_n\n1,1,5\n").unwrap();
    fs::create_dir(file("coarse", "steps")).unwrap();
    fs::write(file("coarse", SHEET), "<VTKFile>").unwrap();
    let notes = made.findings().notes;
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains(": history.csv (fine); steps/last.vtu (coarse)."), "{notes:?}");
    fs::remove_file(file("coarse", HISTORY)).unwrap();
    let notes = made.findings().notes;
    assert!(notes[0].contains("history.csv (fine, coarse);"), "{notes:?}");
}
