//! Inputs of a case's run, and proof of completion by its `run.json`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::case::Case;
use super::manifest::State;
use crate::files::sha256_hex;
use crate::report::record::{RunRecord, Verdict};
use crate::run::PROGRAM;
use crate::scene::read::is_path;

/// SHA-256 of the scene and of the files it names, by name as in the scene, as in `run.json`.
pub(super) type Inputs = BTreeMap<String, String>;

/// Folder of a case.
pub(super) fn folder_of(study: &Path, case: &str) -> PathBuf {
    study.join("cases").join(case)
}

/// Text of the scene file of a case.
pub(super) fn scene_text(case: &Case) -> Vec<u8> {
    // A value parsed from JSON can be serialised.
    serde_json::to_vec_pretty(&case.scene).unwrap_or_default()
}

/// Reads the inputs of `case` in the study folder `study`.
///
/// # Errors
/// The key of a file that cannot be read, the reason, and the remedy.
pub(super) fn inputs(case: &Case, study: &Path) -> Result<Inputs, String> {
    let folder = folder_of(study, &case.id);
    let mut all = Inputs::from([("scene".to_owned(), sha256_hex(&scene_text(case)))]);
    for (place, file, remedy) in files(case) {
        let path = match file.strip_prefix("../") {
            // The folder of the case may not exist yet.
            Some(other) => study.join("cases").join(other),
            None => folder.join(file),
        };
        let bytes = crate::files::read(&path, crate::files::Input::Mesh)
            .map_err(|e| format!("{place}: cannot read {}: {e}; {remedy}", path.display()))?;
        all.insert(file.to_owned(), sha256_hex(&bytes));
    }
    Ok(all)
}

/// Files named by the scene: key, file, and remedy if it is missing.
fn files(case: &Case) -> Vec<(String, &str, String)> {
    let scene = &case.scene;
    let tools = scene.get("tools").and_then(Value::as_array).into_iter().flatten();
    let mut files: Vec<_> = tools
        .enumerate()
        .filter_map(|(k, tool)| {
            let remedy = "make the tool files, and name the folder that they are in";
            Some((format!("tools[{k}].file"), tool.get("file")?.as_str()?, remedy.to_owned()))
        })
        .collect();
    if let Some(file) = scene.pointer("/blank/shape/mesh/file").and_then(Value::as_str) {
        let remedy = "a mesh of the blank stands relative to the study file".to_owned();
        files.push(("blank.shape.mesh.file".into(), file, remedy));
    }
    if let Some(file) = scene.get("material").and_then(Value::as_str).filter(|m| is_path(m)) {
        let remedy = "a material card stands relative to the study file".to_owned();
        files.push(("material".into(), file, remedy));
    }
    if let Some(file) = scene.pointer("/solver/increments_of").and_then(Value::as_str) {
        let remedy = match &case.follows {
            Some(other) => format!("remove cases/{other}/run to have {other} run again"),
            None => "a history stands relative to the study file".to_owned(),
        };
        files.push(("solver.increments_of".into(), file, remedy));
    }
    files
}

/// SHA-256 of the inputs and of the program version.
pub(super) fn digest(inputs: &Inputs) -> String {
    let mut all = PROGRAM.as_bytes().to_vec();
    all.extend(inputs.iter().flat_map(|(name, sha)| format!("\n{name}\n{sha}").into_bytes()));
    sha256_hex(&all)
}

/// Whether the folder of the case contains a run.
pub(super) fn has_run(case: &Case, study: &Path) -> bool {
    folder_of(study, &case.id).join("run/run.json").exists()
}

/// Outcome of the run in the case's folder, if it has ended with these inputs and this program version.
pub(super) fn completed_run(
    case: &Case,
    study: &Path,
    inputs: &Inputs,
) -> Option<(State, Option<String>)> {
    let text = crate::files::read(
        &folder_of(study, &case.id).join("run/run.json"),
        crate::files::Input::Description,
    )
    .ok()?;
    let record = RunRecord::parse(&text).ok()?;
    if record.program != PROGRAM || record.inputs != *inputs {
        return None;
    }
    match record.verdict {
        Verdict::Completed | Verdict::Doubtful => Some((State::Done, None)),
        Verdict::NotConverged => Some((State::Failed, record.message)),
        Verdict::Running | Verdict::Stopped => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn case(scene: Value, follows: Option<&str>) -> Case {
        let follows = follows.map(str::to_owned);
        Case { id: "a".into(), options: vec!["a".into()], follows, scene }
    }

    #[test]
    fn every_file_that_a_scene_names_counts() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).display().to_string();
        let scene = serde_json::json!({
            "tools": [{"file": file("die.json")}],
            "blank": {"shape": {"mesh": {"file": file("blank.inp")}}},
            "solver": {"increments_of": "../b/run/history.csv"},
        });
        let one = case(scene, Some("b"));
        let now = || inputs(&one, folder.path());
        let message = now().unwrap_err();
        assert!(
            message.contains("tools[0].file") && message.contains("make the tool files"),
            "{message}"
        );
        fs::write(file("die.json"), "1").unwrap();
        assert!(now().unwrap_err().contains("blank.shape.mesh.file"));
        fs::write(file("blank.inp"), "1").unwrap();
        let message = now().unwrap_err();
        assert!(message.contains("increments_of") && message.contains("cases/b/run"), "{message}");
        let history = folder_of(folder.path(), "b").join("run");
        fs::create_dir_all(&history).unwrap();
        fs::write(history.join("history.csv"), "1").unwrap();
        let first = now().unwrap();
        assert_eq!(first.len(), 4);
        for changed in ["die.json", "blank.inp"] {
            fs::write(file(changed), "2").unwrap();
            assert_ne!(digest(&now().unwrap()), digest(&first), "{changed}");
            fs::write(file(changed), "1").unwrap();
        }
        assert_eq!(digest(&now().unwrap()), digest(&first));
    }
}
