//! The cases of a study: a scene for every combination of its choices, or for every row of its table.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::case::{CASES_MAX, Case};
use super::file::{Choice, Study};
use super::follow;
use super::inputs::{folder_of, relative};
use super::table_cases::TableRow;
use kanagata_scene::read::is_path;

/// Largest number of choices; more than 13 of two options each make too many cases. Twice the value would double the
/// memory for the lists of options of all cases.
pub(super) const CHOICES_MAX: usize = 32;

/// Base folders of the files that a study's scene names.
#[derive(Debug, Clone, Copy)]
pub struct Roots<'a> {
    /// Folder of tool files.
    pub tools: &'a Path,
    /// Folder of all other files: that of the study file.
    pub own: &'a Path,
}

/// The path of the folder `to` as seen from the folder of any case of the study folder `study`; both absolute, without
/// links. With it the scenes of a study are the same wherever the folders are mounted.
#[must_use]
pub fn from_case(study: &Path, to: &Path) -> PathBuf {
    relative(&folder_of(study, "case"), to)
}

/// The cases of `study` in the order of its table; of choices, the last one varies fastest. At most 10,000 are returned.
#[must_use]
pub fn cases(study: &Study, roots: &Roots<'_>, quick: bool) -> Vec<Case> {
    each_case(study, *roots, quick).collect()
}

/// An iterator over the cases of `study`, in the order of [`cases`].
pub(super) fn each_case<'a>(
    study: &'a Study,
    roots: Roots<'a>,
    quick: bool,
) -> impl Iterator<Item = Case> + 'a {
    let base = base_scene(study, quick);
    let base_of_rows = base.clone();
    let of_choices =
        combinations(study).into_iter().map(move |taken| case(study, &base, &roots, &taken));
    let of_rows = table_rows(study)
        .iter()
        .map(move |row| case_of_row(study, &base_of_rows, &roots, row, None));
    of_choices.chain(of_rows)
}

/// The base scene, with the changes of a coarse trial run if `quick`.
pub(super) fn base_scene(study: &Study, quick: bool) -> Value {
    let mut base = study.scene.clone();
    if let (true, Some(change)) = (quick, &study.quick) {
        merge(&mut base, change);
    }
    base
}

/// Names of the cases in order.
#[must_use]
pub fn ids(study: &Study) -> Vec<String> {
    let name = |(choice, &k): (&Choice, &usize)| choice.options[k].name.clone();
    let id = |taken: Vec<usize>| {
        study.choices.iter().zip(&taken).map(name).collect::<Vec<_>>().join("_")
    };
    let of_rows = table_rows(study).iter().map(|row| row.case.clone());
    combinations(study).into_iter().map(id).chain(of_rows).collect()
}

/// Rows of the table; none without one.
fn table_rows(study: &Study) -> &[TableRow] {
    study.rows.as_ref().map_or(&[], |table| &table.rows)
}

/// Option indices of every case; none with a table.
fn combinations(study: &Study) -> Vec<Vec<usize>> {
    if study.table.is_some() {
        return Vec::new();
    }
    let mut out = vec![Vec::new()];
    for choice in &study.choices {
        out = out
            .into_iter()
            .flat_map(|taken: Vec<usize>| {
                (0..choice.options.len()).map(move |k| [taken.as_slice(), &[k]].concat())
            })
            .take(CASES_MAX)
            .collect();
    }
    out
}

fn case(study: &Study, base: &Value, roots: &Roots<'_>, taken: &[usize]) -> Case {
    let mut scene = base.clone();
    let mut options = Vec::with_capacity(taken.len());
    for (choice, &k) in study.choices.iter().zip(taken) {
        let option = &choice.options[k];
        if let Some(change) = &option.change {
            merge(&mut scene, change);
        }
        options.push(option.name.clone());
    }
    for (choice, option) in study.choices.iter().zip(&options) {
        replace_mark(&mut scene, &format!("{{{}}}", choice.name), option);
    }
    let title = options.join(", ");
    complete(study, roots, scene, [options.join("_"), title], options)
}

/// The case of a row of the table, with the column `without` left out. Values that cannot be set are left out too; the check
/// of the study refuses them.
pub(super) fn case_of_row(
    study: &Study,
    base: &Value,
    roots: &Roots<'_>,
    row: &TableRow,
    without: Option<usize>,
) -> Case {
    let mut scene = base.clone();
    for (k, set) in row.values.iter().enumerate() {
        if let Some(set) = set.as_ref().filter(|_| without != Some(k)) {
            let _ = set.apply(&mut scene);
        }
    }
    replace_mark(&mut scene, CASE_MARK, &row.case);
    complete(study, roots, scene, [row.case.clone(), row.case.clone()], row.cells.clone())
}

/// Placeholder of the name of a case of a table.
pub(super) const CASE_MARK: &str = "{case}";

/// The case of a scene with its values: paths of files, followed case and name are set.
fn complete(
    study: &Study,
    roots: &Roots<'_>,
    mut scene: Value,
    [id, title]: [String; 2],
    options: Vec<String>,
) -> Case {
    for tool in scene.get_mut("tools").and_then(Value::as_array_mut).into_iter().flatten() {
        put_under(roots.tools, tool.get_mut("file"));
    }
    for file in ["/blank/shape/mesh/file", "/solver/increments_of"] {
        put_under(roots.own, scene.pointer_mut(file));
    }
    if scene.get("material").and_then(Value::as_str).is_some_and(is_path) {
        put_under(roots.own, scene.get_mut("material"));
    }
    let follows = follow::of(study, &id).map(str::to_owned);
    if let Some(other) = &follows {
        let history = follow::history_of(other);
        if scene.get("solver").is_none() {
            put(&mut scene, "solver", Value::Object(serde_json::Map::new()));
        }
        if let Some(solver) = scene.get_mut("solver") {
            put(solver, "increments_of", history.into());
        }
    }
    put(&mut scene, "name", format!("{}: {title}", study.name).into());
    Case { id, options, follows, scene }
}

/// Sets a member of an object. Other values are unchanged and refused by the check of the scene.
fn put(into: &mut Value, key: &str, value: Value) {
    if let Value::Object(object) = into {
        object.insert(key.to_owned(), value);
    }
}

/// Joins the name of a file to `folder`.
fn put_under(folder: &Path, file: Option<&mut Value>) {
    if let Some(file) = file
        && let Some(name) = file.as_str()
    {
        *file = folder.join(name).display().to_string().into();
    }
}

/// The cases selected by `wanted`: a complete name selects one case, a part of a name all cases that contain it. An
/// empty list selects all.
///
/// # Errors
/// The first name that no case contains.
pub fn chosen(ids: &[String], wanted: &[String]) -> Result<BTreeSet<String>, String> {
    if wanted.is_empty() {
        return Ok(ids.iter().cloned().collect());
    }
    let mut chosen = BTreeSet::new();
    for name in wanted {
        let in_full = ids.contains(name);
        let fits = |id: &&String| if in_full { *id == name } else { id.contains(name.as_str()) };
        let mut found = ids.iter().filter(fits).peekable();
        if found.peek().is_none() {
            return Err(name.clone());
        }
        chosen.extend(found.cloned());
    }
    Ok(chosen)
}

/// JSON merge patch (RFC 7386).
fn merge(into: &mut Value, change: &Value) {
    let Value::Object(changes) = change else {
        *into = change.clone();
        return;
    };
    if !into.is_object() {
        *into = Value::Object(serde_json::Map::new());
    }
    let Value::Object(object) = into else { return };
    for (key, value) in changes {
        if value.is_null() {
            object.remove(key);
        } else {
            merge(object.entry(key.clone()).or_insert(Value::Null), value);
        }
    }
}

/// Replaces `mark` in all strings.
fn replace_mark(value: &mut Value, mark: &str, by: &str) {
    match value {
        Value::String(text) => *text = text.replace(mark, by),
        Value::Array(list) => list.iter_mut().for_each(|v| replace_mark(v, mark, by)),
        Value::Object(object) => object.values_mut().for_each(|v| replace_mark(v, mark, by)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_combination_is_a_scene_of_its_own() {
        let study: Study = serde_json::from_value(serde_json::json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "punch",
            "scene": {"blank": {"layers": 2, "z_mm": 1}, "tools": [{"file": "{model}/die.json"}]},
            "choices": [
                {"name": "model", "options": [{"name": "a"}, {"name": "b"}]},
                {"name": "layers", "options": [
                    {"name": "1", "change": {"blank": {"layers": 1, "z_mm": null}}},
                    {"name": "2"}
                ]}
            ],
            "quick": {"blank": {"layers": 9}}
        }))
        .unwrap();
        let roots = Roots { tools: Path::new("t"), own: Path::new("own") };
        let found = cases(&study, &roots, false);
        let ids: Vec<&str> = found.iter().map(|c| c.id.as_str()).collect();
        assert_eq!(ids, ["a_1", "a_2", "b_1", "b_2"]);
        assert_eq!(found[2].scene["blank"], serde_json::json!({"layers": 1}));
        assert_eq!(found[3].scene["blank"], serde_json::json!({"layers": 2, "z_mm": 1}));
        assert_eq!(found[2].scene["tools"][0]["file"], "t/b/die.json");
        assert_eq!(found[2].scene["name"], "s: b, 1");
        assert_eq!(cases(&study, &roots, true)[1].scene["blank"]["layers"], 9);
    }

    #[test]
    fn files_of_a_scene_are_under_the_folders_they_belong_to() {
        let study: Study = serde_json::from_value(serde_json::json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "punch",
            "scene": {
                "blank": {"shape": {"mesh": {"file": "{mesh}.inp"}}},
                "tools": [{"file": "die.json"}, {"file": "/far/punch.json"}],
                "solver": {"increments_of": "other/history.csv"}
            },
            "choices": [{"name": "mesh", "options": [{"name": "fine"}]}],
        }))
        .unwrap();
        let roots = Roots { tools: Path::new("t"), own: Path::new("own") };
        let scene = &cases(&study, &roots, false)[0].scene;
        assert_eq!(scene["tools"][0]["file"], "t/die.json");
        assert_eq!(scene["tools"][1]["file"], "/far/punch.json");
        assert_eq!(scene["blank"]["shape"]["mesh"]["file"], "own/fine.inp");
        assert_eq!(scene["solver"]["increments_of"], "own/other/history.csv");
    }

    #[test]
    fn a_name_in_full_chooses_one_case_and_a_part_all_that_hold_it() {
        let ids = ["St-85", "St-85-Bezier", "Unst-9"].map(String::from);
        let choose = |wanted: &[&str]| {
            let wanted: Vec<String> = wanted.iter().map(|w| (*w).to_owned()).collect();
            chosen(&ids, &wanted).map(|found| found.into_iter().collect::<Vec<_>>().join(" "))
        };
        assert_eq!(choose(&["St-85"]).unwrap(), "St-85");
        assert_eq!(choose(&["St-8"]).unwrap(), "St-85 St-85-Bezier");
        assert_eq!(choose(&["St-85", "Un"]).unwrap(), "St-85 Unst-9");
        assert_eq!(choose(&[]).unwrap(), "St-85 St-85-Bezier Unst-9");
        assert_eq!(choose(&["St-85", "nosuch"]).unwrap_err(), "nosuch");
    }

    #[test]
    fn every_case_of_the_studies_that_come_with_it_is_a_scene() {
        use crate::read::{Description, read};
        let folder =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/studies");
        let out = tempfile::tempdir().unwrap();
        let file = out.path().join("scene.json");
        let (mut scenes, own) = (0, Path::new("t"));
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let description = read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let Description::Forming(study) = description else { continue };
            for quick in [false, true] {
                for case in cases(&study, &Roots { tools: own, own }, quick) {
                    std::fs::write(&file, case.scene.to_string()).unwrap();
                    let checked = kanagata_scene::read::scene_of(&file);
                    assert!(checked.is_ok(), "{} {}: {:?}", path.display(), case.id, checked.err());
                    scenes += 1;
                }
            }
        }
        assert!(scenes >= 40, "{scenes} scenes");
    }
}
