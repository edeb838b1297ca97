//! Checks the values of a forming study before anything runs.

use std::path::Path;

use serde_json::Value;

use super::StudyError;
use super::case::{CASES_MAX, Case, NAME_MAX, allowed_words, is_word};
use super::cases::{CASE_MARK, CHOICES_MAX, Roots, each_case, ids};
use super::file::Study;
use super::follow;
use super::table_check;
use kanagata_scene::error::Fault;
use kanagata_scene::read::check_value;

/// Checks a study and the scene of every case, without and with `--quick`. Of a study whose table is not read, only what
/// does not depend on its cases is checked.
///
/// # Errors
/// [`StudyError::Value`].
pub(super) fn check(study: &Study, path: &Path) -> Result<(), StudyError> {
    let all = [version, sources, names, marks, table_check::values, references, scenes];
    let is_unread = study.table.is_some() && study.rows.is_none();
    let checks = if is_unread { &all[..2] } else { &all[..] };
    checks.iter().try_for_each(|of| of(study)).map_err(|(place, found, allowed)| {
        StudyError::Value { path: path.to_path_buf(), place, found, allowed }
    })
}

fn version(study: &Study) -> Result<(), Fault> {
    match study.version {
        1 => Ok(()),
        other => Err(("version".into(), other.to_string(), "1".into())),
    }
}

/// Checks that the cases are those of choices or of a table.
fn sources(study: &Study) -> Result<(), Fault> {
    let fault = |found: &str, allowed: &str| Err(("choices".into(), found.into(), allowed.into()));
    match (study.choices.is_empty(), &study.table) {
        (true, None) => fault("none", "at least one choice, or the file of a `table`"),
        (false, Some(_)) => fault("choices and a `table`", "one of the two"),
        _ => Ok(()),
    }
}

/// Checks the names of choices and options, and the number of cases. Those of a table are checked where it is read.
fn names(study: &Study) -> Result<(), Fault> {
    if study.table.is_some() {
        return Ok(());
    }
    let choices: Vec<&str> = study.choices.iter().map(|c| c.name.as_str()).collect();
    if choices.len() > CHOICES_MAX {
        let found = format!("{} choices", choices.len());
        return Err(("choices".into(), found, format!("1 to {CHOICES_MAX}")));
    }
    check_names("choices", &choices)?;
    for (k, choice) in study.choices.iter().enumerate() {
        let options: Vec<&str> = choice.options.iter().map(|o| o.name.as_str()).collect();
        check_names(&format!("choices[{k}].options"), &options)?;
    }
    let counts = study.choices.iter().map(|c| c.options.len());
    let count = counts.fold(1usize, usize::saturating_mul);
    if count > CASES_MAX {
        let found = format!("{count} cases");
        return Err(("choices".into(), found, format!("at most {CASES_MAX}: fewer options")));
    }
    Ok(())
}

/// Checks that the names of the list at `place` are unique and can be parts of file names.
fn check_names(place: &str, names: &[&str]) -> Result<(), Fault> {
    for (k, name) in names.iter().enumerate() {
        let place = format!("{place}[{k}].name");
        if !is_word(name) {
            let short: String = name.chars().take(NAME_MAX + 1).collect();
            return Err((place, format!("'{short}'"), allowed_words()));
        }
        if names[..k].contains(name) {
            return Err((place, format!("'{name}' once more"), "a name of its own".into()));
        }
    }
    if names.is_empty() {
        return Err((place.to_owned(), "none".into(), "at least one".into()));
    }
    Ok(())
}

/// Checks that every `{NAME}` belongs to a choice. Of a table only `{case}` is one.
fn marks(study: &Study) -> Result<(), Fault> {
    let choices: Vec<String> = match &study.table {
        Some(_) => vec![CASE_MARK.to_owned()],
        None => study.choices.iter().map(|c| format!("{{{}}}", c.name)).collect(),
    };
    let changes = study.choices.iter().enumerate().flat_map(|(k, choice)| {
        let changes = choice.options.iter().enumerate();
        changes.filter_map(move |(j, option)| {
            Some((format!("choices[{k}].options[{j}].change"), option.change.as_ref()?))
        })
    });
    let quick = study.quick.iter().map(|q| ("quick".to_owned(), q));
    let scene = std::iter::once(("scene".to_owned(), &study.scene));
    let cells = table_check::places(study);
    for (place, value) in scene.chain(quick).chain(changes).chain(cells) {
        if let Some((place, mark)) = unknown_mark(value, place, &choices) {
            let name = if study.table.is_some() { "the case's" } else { "a choice's" };
            let allowed = format!("{}: {name} name in braces", choices.join(", "));
            return Err((place, format!("'{mark}'"), allowed));
        }
    }
    Ok(())
}

/// The first string in `value` with a placeholder not in `known`: its key and the placeholder.
fn unknown_mark(value: &Value, place: String, known: &[String]) -> Option<(String, String)> {
    match value {
        Value::String(text) => {
            let marks = text.match_indices('{').filter_map(|(from, _)| {
                let to = text[from..].find('}')?;
                Some(&text[from..=from + to])
            });
            let mark = marks.into_iter().find(|m| !known.iter().any(|k| k == m))?;
            Some((place, mark.to_owned()))
        }
        Value::Array(list) => list
            .iter()
            .enumerate()
            .find_map(|(k, value)| unknown_mark(value, format!("{place}[{k}]"), known)),
        Value::Object(object) => object
            .iter()
            .find_map(|(key, value)| unknown_mark(value, format!("{place}.{key}"), known)),
        _ => None,
    }
}

/// Checks that all named cases exist.
fn references(study: &Study) -> Result<(), Fault> {
    let cases = ids(study);
    let reference = study.reference.iter().map(|r| ("reference".to_owned(), r));
    let checked = study.checks.iter().enumerate().flat_map(|(k, check)| {
        let named = check.cases.iter().chain(&check.against);
        named.map(move |case| (format!("checks[{k}]"), case))
    });
    let followed = study.follow.iter().enumerate().flat_map(|(k, follow)| {
        let named = follow.cases.iter().chain(std::iter::once(&follow.of));
        named.map(move |case| (format!("follow[{k}]"), case))
    });
    for (place, case) in reference.chain(checked).chain(followed) {
        if !cases.contains(case) {
            let allowed = match &study.table {
                Some(table) => format!("a case of {table}"),
                None => "a case: one option of every choice, joined by '_'".into(),
            };
            return Err((place, format!("'{case}'"), allowed));
        }
    }
    let allowed = "at most one case to follow, and none that follows it";
    follow::fault(study).map_or(Ok(()), |(place, found)| Err((place, found, allowed.into())))
}

/// Checks the scene of every case as the solver does.
fn scenes(study: &Study) -> Result<(), Fault> {
    let roots = Roots { tools: Path::new(""), own: Path::new("") };
    for quick in [false, true] {
        // One scene at a time: all together may take far more memory than the file.
        let checked = |mut case: Case| {
            let fault = fault_in(study, &case);
            case.scene = Value::Null;
            (case, fault)
        };
        let (all, faults): (Vec<Case>, Vec<Option<Fault>>) =
            each_case(study, roots, quick).map(checked).unzip();
        if let Some(k) = faults.iter().position(Option::is_some) {
            let bad: Vec<bool> = faults.iter().map(Option::is_some).collect();
            let (key, found, allowed) = faults.into_iter().nth(k).flatten().unwrap_or_default();
            let with = if quick { " with `quick`" } else { "" };
            let is_valid = |case: &Case| fault_in(study, case).is_none();
            let all_bad = bad.iter().all(|b| *b);
            let origin = table_check::fault_origin(study, quick, (k, all_bad), &is_valid)
                .unwrap_or_else(|| fault_origin(study, &all, k, &bad));
            let place = format!("{origin}{with}");
            let key = if key.is_empty() { key } else { format!(": {key}") };
            return Err((format!("{place}{key}"), found, allowed));
        }
    }
    Ok(())
}

fn fault_in(study: &Study, case: &Case) -> Option<Fault> {
    let scene = match check_value(&case.scene) {
        Ok(scene) => scene,
        Err(fault) => return Some(fault),
    };
    let tools: Vec<&str> = scene.tools.iter().map(|t| t.name.as_str()).collect();
    let watched = tools.contains(&study.watch.as_str());
    (!watched).then(|| ("watch".into(), format!("'{}'", study.watch), tools.join(", ")))
}

/// Origin of the fault of case `k`: the base scene if all cases have one, otherwise the options that no valid case has,
/// or all its options.
fn fault_origin(study: &Study, all: &[Case], k: usize, bad: &[bool]) -> String {
    let case = &all[k];
    if bad.iter().all(|b| *b) {
        return format!("scene of every case (first {})", case.id);
    }
    let options = || study.choices.iter().zip(&case.options).enumerate();
    let text = |(_, (choice, option)): (_, (&super::file::Choice, &String))| {
        format!("{} = {option}", choice.name)
    };
    let only_in_bad = |j: usize, option: &String| {
        all.iter().zip(bad).all(|(other, bad)| *bad || other.options[j] != *option)
    };
    let mut by: Vec<String> =
        options().filter(|(j, (_, option))| only_in_bad(*j, option)).map(text).collect();
    if by.is_empty() {
        by = options().map(text).collect();
    }
    format!("scene of the case {} (by {})", case.id, by.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study() -> Value {
        serde_json::json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "die",
            "scene": {
                "format": "kanagata-scene", "version": 1, "name": "",
                "blank": {
                    "shape": {"rectangle": {"size_mm": [10.0, 10.0], "elements": [2, 2]}},
                    "thickness_mm": 1.0
                },
                "material": "mild-steel-neto2012",
                "tools": [{"name": "die", "file": "{model}/die.json", "direction": [0, 0, 1]}],
                "stages": [{"name": "draw", "drive": {"die": {"travel_mm": 1.0}}}],
            },
            "choices": [
                {"name": "model", "options": [{"name": "a"}, {"name": "b"}]},
                {"name": "layers", "options": [
                    {"name": "1"}, {"name": "2", "change": {"blank": {"layers": 2}}}
                ]},
            ],
        })
    }

    fn fault(change: impl Fn(&mut Value)) -> String {
        let mut value = study();
        change(&mut value);
        let study = serde_json::from_value(value).unwrap();
        check(&study, Path::new("s.json")).map_or_else(|e| e.to_string(), |()| String::new())
    }

    fn holds(message: &str, words: &[&str]) {
        assert!(words.iter().all(|w| message.contains(w)), "{message}: {words:?}");
    }

    #[test]
    fn names_are_names_of_their_own() {
        assert_eq!(fault(|_| ()), "");
        let twice = fault(|s| s["choices"][0]["options"][1]["name"] = "a".into());
        holds(&twice, &["s.json, choices[0].options[1].name", "'a' once more"]);
        let twice = fault(|s| s["choices"][1]["name"] = "model".into());
        holds(&twice, &["choices[1].name", "'model' once more"]);
        holds(&fault(|s| s["choices"] = serde_json::json!([])), &["choices: found none"]);
        holds(&fault(|s| s["choices"][0]["options"] = serde_json::json!([])), &["options: found"]);
        holds(&fault(|s| s["choices"][0]["name"] = "a/b".into()), &["'a/b'", "letters, digits"]);
        let many: Vec<Value> =
            (0..101).map(|k| serde_json::json!({"name": k.to_string()})).collect();
        let many = fault(|s| {
            s["choices"][0]["options"] = many.clone().into();
            s["choices"][1]["options"] = many.clone().into();
        });
        holds(&many, &["10201 cases", "at most 10000"]);
    }

    #[test]
    fn marks_stand_for_choices() {
        let wrong = fault(|s| s["scene"]["tools"][0]["file"] = "{modle}/die.json".into());
        holds(&wrong, &["scene.tools[0].file", "'{modle}'", "{model}, {layers}"]);
        let change = serde_json::json!({"name": "x {Model}"});
        let wrong = fault(|s| s["choices"][1]["options"][0]["change"] = change.clone());
        holds(&wrong, &["choices[1].options[0].change.name", "'{Model}'"]);
        holds(&fault(|s| s["quick"] = serde_json::json!({"name": "{}"})), &["quick.name", "'{}'"]);
    }

    #[test]
    fn scenes_of_all_cases_are_read_and_faults_named_by_case_and_option() {
        let key = serde_json::json!({"blank": {"layerz": 2}});
        let wrong = fault(|s| s["choices"][1]["options"][1]["change"] = key.clone());
        holds(&wrong, &["s.json, scene of the case a_2 (by layers = 2)", "layerz", "allowed"]);
        assert!(!wrong.contains("`quick`"), "{wrong}");
        let wrong = fault(|s| s["quick"] = key.clone());
        holds(&wrong, &["every case", "with `quick`", "layerz"]);
        let none = serde_json::json!({"blank": {"layers": 0}});
        let wrong = fault(|s| s["choices"][0]["options"][1]["change"] = none.clone());
        // The option 2 of layers corrects it.
        holds(&wrong, &["the case b_1 (by model = b, layers = 1): blank", "at least 1"]);
        holds(&fault(|s| s["scene"]["material"] = "cheese".into()), &["material", "cheese"]);
        holds(&fault(|s| s["watch"] = "punch".into()), &["watch: found 'punch'", "allowed: die"]);
    }

    #[test]
    fn cases_that_are_named_are_there() {
        holds(&fault(|s| s["reference"] = "a".into()), &["reference: found 'a'", "joined by '_'"]);
        let follow = serde_json::json!([{"of": "a_1", "cases": ["a_1"]}]);
        holds(&fault(|s| s["follow"] = follow.clone()), &["follow[0].cases", "follows itself"]);
    }
}
