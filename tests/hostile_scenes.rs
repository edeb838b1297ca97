//! Scenes with one hostile value each, every key of the schema among them: none may panic, abort, or end as if nothing were wrong.
//! `KANAGATA_BLESS=1` writes the table of outcomes, `docs/results/hostile-scenes.md`.

mod legitimate;
mod strip;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use legitimate::LEGITIMATE;
use rayon::prelude::*;
use serde_json::{Value, json};
use strip::scene_in;

/// No scene of a dozen elements takes this long: one that does goes on without end.
const ENDLESS: Duration = Duration::from_secs(120);

/// A strip of 35 elements, drawn 0.3 mm, and changes of it that use the keys it has not.
fn bases(folder: &Path) -> Vec<Value> {
    let file = scene_in(folder, |_, scene| {
        scene["blank"]["shape"]["rectangle"]["elements"] = json!([35, 1]);
        scene["blank"]["shape"]["rectangle"]["corner_mm"] = json!([0.0, 0.0]);
        scene["blank"]["element"] = json!({"solid-shell": {"points": 5, "membrane": true}});
        scene["blank"]["rolling_direction_deg"] = json!(0.0);
        scene["blank"]["z_mm"] = json!(0.0);
        scene["material"]["source"] = json!("a test");
        scene["material"]["backstresses"] = json!([{"c_mpa": 1000.0, "gamma": 10.0}]);
        scene["tools"][2]["side"] = json!("top");
        scene["tools"][1]["stop_mm"] = json!(5.0);
        scene["stages"][0]["drive"]["punch"] = json!({"travel_mm": [[0.5, 0.2], [1.0, 0.3]]});
        scene["stages"][0]["first_increment"] = json!(0.5);
        scene["stages"][0]["largest_increment"] = json!(0.5);
        scene["stages"][0]["load_share"] = json!(1.0);
        scene["solver"] = json!({
            "force_tolerance": 1e-6, "iterations": 25, "wanted_iterations": 6, "smallest_increment": 1e-3,
            "increments": 200, "increment_error": 0.05, "friction_transition": 1e-5, "contact": "exact"
        });
        scene["output"] = json!({"vtu_every": 10, "checkpoint_every": 5,
            "sections": [{"normal": "y", "at_mm": 0.5}]});
    });
    let strip: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    let with = |change: &dyn Fn(&mut Value)| {
        let mut scene = strip.clone();
        change(&mut scene);
        scene
    };
    let hardening = |law: Value| with(&|scene| scene["material"]["hardening"] = law.clone());
    let criterion = |law: Value| with(&|scene| scene["material"]["yield"] = law.clone());
    let drive = |way: Value| with(&|scene| scene["stages"][0]["drive"]["punch"] = way.clone());
    let shape = |shape: Value| with(&|scene| scene["blank"]["shape"] = shape.clone());
    let refine = |entry: Value| with(&|scene| scene["blank"]["refine"] = json!([entry]));
    let nine = [1.0; 9];
    fs::write(
        folder.join("blank.obj"),
        "v 0 0 0\nv 35 0 0\nv 70 0 0\nv 0 1 0\nv 35 1 0\nv 70 1 0\nf 1 2 5 4\nf 2 3 6 5\n",
    )
    .unwrap();
    vec![
        strip.clone(),
        hardening(json!({"law": "voce", "sigma0": 200.0, "q": 100.0, "b": 5.0})),
        hardening(json!({"law": "swift-voce", "weight": 0.5, "k": 500.0, "eps0": 0.004, "n": 0.2,
            "sigma0": 200.0, "q": 100.0, "b": 5.0})),
        hardening(json!({"law": "ludwik", "sigma0": 200.0, "k": 400.0, "n": 0.5})),
        hardening(
            json!({"law": "table", "strain": [0.0, 0.1, 1.0], "stress": [200.0, 300.0, 400.0]}),
        ),
        criterion(
            json!({"criterion": "hill48", "f": 0.5, "g": 0.5, "h": 0.5, "l": 1.5, "m": 1.5, "n": 1.5}),
        ),
        criterion(json!({"criterion": "hill48-r", "r0": 1.5, "r45": 1.2, "r90": 1.8})),
        criterion(json!({"criterion": "hosford", "exponent": 8.0})),
        criterion(
            json!({"criterion": "yld2004-18p", "exponent": 8.0, "first": nine, "second": nine}),
        ),
        drive(json!({"advance_mm": 0.3})),
        drive(json!({"force_n": 20.0})),
        drive(json!({"spring": {"stiffness_n_per_mm": 100.0, "force_n": 20.0}})),
        drive(json!({"release": true})),
        drive(json!({"absent": true})),
        shape(json!({"quarter_disc": {"radius_mm": 60.0, "core": 2, "rings": 2}})),
        shape(json!({"disc": {"radius_mm": 60.0, "core": 1, "rings": 1}})),
        shape(json!({"mesh": {"file": "blank.obj", "state": "drop"}})),
        with(&|scene| {
            scene["symmetry"] = json!([{"normal": "x", "at_mm": 0.0}]);
            scene["blank"]["rolling_direction"] = json!([1.0, 0.0, 0.0]);
        }),
        with(&|scene| {
            let region = json!({"box": {"min_mm": [-1.0, -1.0, -1.0], "max_mm": [1.0, 2.0, 2.0]}});
            scene["holds"][1] = json!({"where": region, "axes": ["x"]});
            scene["loads"][0]["where"] = json!({"beyond_radius_mm": 69.0});
            scene["solver"]["contact"] = json!({"penalty": {"stiffness": 1.0}});
        }),
        with(&|scene| scene["solver"]["contact"] = json!({"augmented": {"stiffness": 1.0}})),
        with(&|scene| scene["solver"]["increments_of"] = json!("history.csv")),
        with(&|scene| {
            let points = [[-0.2, 0.55], [0.0, 0.32], [0.3, 0.42]];
            scene["material"]["forming_limit"] =
                json!({"law": "points", "strain": "engineering", "points": points});
            scene["quality"] = json!({"max_thinning": 0.9, "max_thickening": 0.9,
                "min_thickness_mm": 0.01, "flc_margin": 0.01, "max_springback_mm": 100.0});
            let release = json!({"release": true});
            let drive = json!({"die": release, "holder": release, "punch": release});
            let stages = scene["stages"].as_array_mut().unwrap();
            stages.push(json!({"name": "springback", "drive": drive}));
        }),
        with(&|scene| {
            // Of a mesh file, which a sequence refuses after its values: others would take minutes of runs.
            scene["blank"]["shape"] = json!({"mesh": {"file": "blank.obj", "state": "drop"}});
            scene["accuracy"] = json!({"force": 0.5, "thickness": 0.5, "draw_in": 0.5,
                "draw_in_mm": 1.0, "springback": 0.5, "springback_mm": 1.0});
            let release = json!({"release": true});
            let drive = json!({"die": release, "holder": release, "punch": release});
            let stages = scene["stages"].as_array_mut().unwrap();
            stages.push(json!({"name": "springback", "drive": drive}));
        }),
        with(&|scene| {
            scene["material"]["forming_limit"] = json!({"law": "keeler-brazier", "n": 0.2});
        }),
        with(&|scene| {
            scene["tools"][0]["cad"] = json!({"file": "die.igs", "tol_mm": 0.01, "bodies": ["1"],
                "faces": ["!3-9"], "layers": ["tool*"], "colours": ["red"], "offset_mm": 0.8, "flip": true});
        }),
        with(&|scene| {
            scene["tools"][0]["cad"] = json!({"file": "die.igs", "sheet_surface": "upper"});
        }),
        with(&|scene| {
            let law = json!({"law": "abspoel-scholting", "a80_percent": 38.0,
                "a80_min_percent": 36.0, "r": 1.6});
            scene["material"]["forming_limit"] = law;
        }),
        refine(json!({"level": 1, "where": {"all": true}})),
        refine(
            json!({"level": 1, "where": {"box": {"min_mm": [20.0, 0.0], "max_mm": [30.0, 1.0]}}}),
        ),
        refine(json!({"level": 1, "where": {"beyond_radius_mm": 60.0}})),
        refine(json!({"level": 1,
            "where": {"ring": {"centre_mm": [30.0, 0.0], "radii_mm": [2.0, 5.0]}}})),
        refine(json!({"level": 1,
            "where": {"polygon_mm": [[20.0, -1.0], [30.0, -1.0], [30.0, 2.0]]}})),
        refine(json!({"levels": "0".repeat(30) + "12100"})),
    ]
}

/// Pointers of all values in a scene that have no values in them, and of those that have.
fn places(value: &Value, at: &str, out: &mut Vec<String>) {
    if !at.is_empty() {
        out.push(at.to_owned());
    }
    match value {
        Value::Object(members) => {
            members.iter().for_each(|(key, v)| places(v, &format!("{at}/{key}"), out))
        }
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(k, v)| places(v, &format!("{at}/{k}"), out));
        }
        _ => {}
    }
}

/// Hostile values in place of one.
fn hostile(value: &Value) -> Vec<Value> {
    match value {
        Value::Number(_) => {
            vec![json!(0), json!(-1), json!(1e300), json!(-1e300), json!("NaN"), json!(1e-300)]
        }
        Value::String(_) => vec![json!(""), json!(3), json!("\u{1b}[2J\r\n")],
        Value::Array(_) => vec![json!([]), json!("x")],
        Value::Object(_) => vec![json!({}), json!([1])],
        Value::Bool(_) => vec![json!(false), json!("true")],
        Value::Null => vec![json!(1)],
    }
}

/// A scene with one hostile value.
struct Case {
    place: String,
    value: Value,
    scene: Value,
}

/// One case a place of the schema and value, of the first scene that has the place.
fn cases(bases: &[Value]) -> Vec<Case> {
    let mut seen = BTreeSet::new();
    let mut out = Vec::new();
    for base in bases {
        let mut all = Vec::new();
        places(base, "", &mut all);
        for place in all {
            // Members of lists are alike; of the first scene all keys are taken, of the others what is new.
            let is_index =
                |part: &&str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
            let parts = place.split('/').map(|part| if is_index(&part) { "#" } else { part });
            let key = parts.collect::<Vec<_>>().join("/");
            if !seen.insert(key) {
                continue;
            }
            for value in hostile(base.pointer(&place).unwrap()) {
                let mut scene = base.clone();
                *scene.pointer_mut(&place).unwrap() = value.clone();
                out.push(Case { place: place.clone(), value, scene });
            }
        }
    }
    out
}

/// Exit code and stderr; none where it was ended after too long.
fn run(arguments: &[&str], folder: &Path, log: &Path) -> (Option<i32>, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
        .args(["--threads", "1"])
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(log).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if start.elapsed() > ENDLESS {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    (code, fs::read_to_string(log).unwrap_or_default())
}

/// What became of a scene: `check` first, then `run` where that finds nothing to refuse.
fn outcome(case: &Case, folder: &Path, number: usize) -> (&'static str, String) {
    let name = |what: &str| format!("{number}.{what}");
    fs::write(folder.join(name("scene.json")), case.scene.to_string()).unwrap();
    let log = folder.join(name("log"));
    let word = |code: Option<i32>, said: &str| match code {
        Some(0) => "completed",
        Some(1) => "doubtful",
        Some(2) => "refused",
        Some(3) => "not converged",
        Some(4) => "file error",
        _ if said.contains("panicked") => "PANIC",
        None => "ENDLESS OR ABORTED",
        Some(_) => "UNKNOWN EXIT CODE",
    };
    let first = |said: &str| said.lines().next().unwrap_or_default().to_owned();
    let (code, said) = run(&["check", &name("scene.json")], folder, &log);
    let checked = word(code, &said);
    if !matches!(checked, "completed" | "doubtful") {
        return (checked, first(&said));
    }
    let output = name("run");
    let (code, said) = run(&["run", &name("scene.json"), "-q", "-o", &output], folder, &log);
    let _ = fs::remove_dir_all(folder.join(output));
    (word(code, &said), first(&said))
}

#[test]
fn no_hostile_value_completes_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let bases = bases(folder.path());
    let cases = cases(&bases);
    let keys = keys_of_the_schema();
    let tried: BTreeSet<&str> = cases.iter().flat_map(|case| case.place.split('/')).collect();
    let missing: Vec<&String> = keys.iter().filter(|key| !tried.contains(key.as_str())).collect();
    assert!(missing.is_empty(), "keys of the schema without a hostile value: {missing:?}");
    assert!(cases.len() >= 300, "{} scenes", cases.len());
    let done = Mutex::new(Vec::new());
    cases.par_iter().enumerate().for_each(|(k, case)| {
        let found = outcome(case, folder.path(), k);
        done.lock().unwrap().push((k, found));
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|(k, _)| *k);
    let rows: Vec<[String; 4]> = done
        .iter()
        .map(|(k, (word, said))| {
            let case = &cases[*k];
            let told = said.replace(folder.path().to_str().unwrap(), "").replace('|', "\\|");
            [case.place.clone(), case.value.to_string(), (*word).to_owned(), told]
        })
        .collect();
    if std::env::var_os("KANAGATA_BLESS").is_some() {
        write_table(&rows);
    }
    let legitimate =
        |row: &[String; 4]| LEGITIMATE.contains(&row[0].as_str()) && !row[1].contains("e+300");
    let bad: Vec<_> = rows
        .iter()
        .filter(|row| match row[2].as_str() {
            "refused" | "doubtful" | "not converged" | "file error" => false,
            "completed" => !legitimate(row),
            _ => true,
        })
        .collect();
    assert!(bad.is_empty(), "{} of {}: {bad:#?}", bad.len(), rows.len());
}

fn keys_of_the_schema() -> BTreeSet<String> {
    fn walk(value: &Value, out: &mut BTreeSet<String>) {
        if let Some(members) = value["properties"].as_object() {
            out.extend(members.keys().cloned());
        }
        match value {
            Value::Object(members) => members.values().for_each(|v| walk(v, out)),
            Value::Array(values) => values.iter().for_each(|v| walk(v, out)),
            _ => {}
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/scene.schema.json");
    let mut out = BTreeSet::new();
    walk(&serde_json::from_slice(&fs::read(path).unwrap()).unwrap(), &mut out);
    out
}

fn write_table(rows: &[[String; 4]]) {
    let count = |word: &str| rows.iter().filter(|row| row[2] == word).count();
    let mut text = format!(
        "# Scenes with one hostile value\n\n{} scenes, each a sound one with one value replaced (`cargo test --test hostile_scenes`; \
         every key of `schemas/scene.schema.json` at least once): {} refused by `check` or `run` (exit code 2), {} doubtful (1), {} not \
         converged (3), {} file not found (4), {} completed, as the value is legitimate there. No panic, no abort, no run without end.\n\n\
         | key | value | outcome | first line |\n|---|---|---|---|\n",
        rows.len(),
        count("refused"),
        count("doubtful"),
        count("not converged"),
        count("file error"),
        count("completed")
    );
    for [place, value, word, said] in rows {
        let said: String = said.chars().filter(|c| !c.is_control()).take(160).collect();
        text += &format!("| `{place}` | `{value}` | {word} | {said} |\n");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results/hostile-scenes.md");
    fs::write(path, text).unwrap();
}
