//! Inputs of a case's run: the scene and the files that it names.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::case::Case;
use super::proof::Inputs;
use kanagata_files::{Input, sha256_hex};
use kanagata_scene::read::is_path;

/// Folder of a case.
pub(super) fn folder_of(study: &Path, case: &str) -> PathBuf {
    study.join("cases").join(case)
}

/// Text of the scene file of a case.
pub(super) fn scene_text(case: &Case) -> Vec<u8> {
    // A value parsed from JSON can be serialised.
    serde_json::to_vec_pretty(&case.scene).unwrap_or_default()
}

/// Digests of files that many cases share. A file is read once.
#[derive(Debug, Default)]
pub(super) struct Digests {
    known: Mutex<HashMap<PathBuf, String>>,
}

impl Digests {
    /// SHA-256 of a file.
    fn of(&self, path: PathBuf) -> std::io::Result<String> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(digest) = known().get(&path) {
            return Ok(digest.clone());
        }
        let digest = sha256_hex(&kanagata_files::read(&path, Input::Mesh)?);
        known().insert(path, digest.clone());
        Ok(digest)
    }
}

/// Reads the inputs of `case` in the study folder `study`, which exists. Without `history`, the history that a case follows
/// is not among them.
///
/// # Errors
/// The key of a file that cannot be read, the reason, and the remedy.
pub(super) fn inputs(
    case: &Case,
    study: &Path,
    digests: &Digests,
    history: bool,
) -> Result<Inputs, String> {
    let folder = folder_of(&study.canonicalize().unwrap_or_else(|_| study.into()), &case.id);
    let mut all = Inputs::from([("scene".to_owned(), sha256_hex(&scene_text(case)))]);
    for (place, file, remedy) in files(case) {
        let follows = case.follows.is_some() && place == HISTORY;
        if follows && !history {
            continue;
        }
        let path = joined(&folder, Path::new(file));
        // A history changes while the study runs.
        let digest = if follows {
            kanagata_files::read(&path, Input::Mesh).map(|bytes| sha256_hex(&bytes))
        } else {
            digests.of(path.clone())
        };
        let digest = digest
            .map_err(|e| format!("{place}: cannot read {}: {e}; {remedy}", path.display()))?;
        all.insert(file.to_owned(), digest);
    }
    Ok(all)
}

/// The path of `file` in `folder`, which need not exist: `..` is resolved by name.
pub(super) fn joined(folder: &Path, file: &Path) -> PathBuf {
    let mut path = PathBuf::new();
    for part in folder.join(file).components() {
        match part {
            Component::ParentDir => _ = path.pop(),
            Component::CurDir => {}
            part => path.push(part),
        }
    }
    path
}

/// The path from the folder `from` to `to`, both absolute and without links.
pub(super) fn relative(from: &Path, to: &Path) -> PathBuf {
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(to.components().skip(shared)).collect();
    if path.as_os_str().is_empty() { ".".into() } else { path }
}

/// Key of the history whose increments a scene follows.
const HISTORY: &str = "solver.increments_of";

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
        files.push((HISTORY.into(), file, remedy));
    }
    files
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
        let now = || inputs(&one, folder.path(), &Digests::default(), true);
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
            assert_ne!(now().unwrap(), first, "{changed}");
            fs::write(file(changed), "1").unwrap();
        }
        assert_eq!(now().unwrap(), first);
        assert_eq!(inputs(&one, folder.path(), &Digests::default(), false).unwrap().len(), 3);
    }

    #[test]
    fn paths_between_folders_go_up_and_down_again() {
        let of = |from: &str, to: &str| relative(Path::new(from), Path::new(to));
        assert_eq!(of("/a/out/cases/x", "/a/models"), Path::new("../../../models"));
        assert_eq!(of("/a", "/a"), Path::new("."));
        assert_eq!(of("/a/b", "/c"), Path::new("../../c"));
        let back = joined(Path::new("/a/out/cases/x"), Path::new("../../../models/./die.json"));
        assert_eq!(back, Path::new("/a/models/die.json"));
        assert_eq!(joined(Path::new("/a"), Path::new("/b/c")), Path::new("/b/c"));
    }
}
