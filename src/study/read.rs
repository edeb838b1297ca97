//! Reads and checks a study of any kind.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::StudyError;
use super::file::Study;
use super::patches::{self, PatchStudy};
use super::stability::StabilityStudy;
use super::table_cases::{self, CaseTable};
use super::validate;
use kanagata_files::FileKind;
use kanagata_scene::comments::without_comments;

/// Content of a study file.
#[derive(Debug, Clone, PartialEq)]
pub enum Description {
    /// Solver runs (`kanagata-study`).
    Forming(Study),
    /// Maps of the convergence of methods (`kanagata-stability`).
    Stability(StabilityStudy),
    /// Patches over accuracy (`kanagata-patches`).
    Patches(PatchStudy),
}

/// Reads a study; its kind follows from its `format`.
///
/// # Errors
/// [`StudyError`] names file, key, what was found and what is allowed.
pub fn read(path: &Path) -> Result<Description, StudyError> {
    let bytes = kanagata_files::read(path, kanagata_files::Input::Description)
        .map_err(|source| StudyError::Io { path: path.to_path_buf(), source })?;
    let mut description = parse(&bytes, path)?;
    if let Description::Forming(study) = &mut description
        && let Some(file) = table_file(study, path)
    {
        study.rows = Some(read_table(&file)?);
        validate::check(study, path)?;
    }
    Ok(description)
}

/// The file of the table of a study that is read from `path`.
#[must_use]
pub fn table_file(study: &Study, path: &Path) -> Option<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    study.table.as_ref().map(|table| folder.join(table))
}

fn read_table(path: &Path) -> Result<CaseTable, StudyError> {
    let text = kanagata_files::read_text(path, kanagata_files::Input::Description)
        .map_err(|source| StudyError::Io { path: path.to_path_buf(), source })?;
    table_cases::parse(&text).map_err(|(place, found, allowed)| StudyError::Value {
        path: path.to_path_buf(),
        place,
        found,
        allowed,
    })
}

/// Parses a study and checks it without reading other files, so that the cases of a table are neither known nor checked.
/// `path` is for messages.
///
/// # Errors
/// [`StudyError::Value`].
pub fn parse(bytes: &[u8], path: &Path) -> Result<Description, StudyError> {
    let fault = |e: serde_json::Error, allowed: &str| {
        let other = FileKind::other_than(FileKind::Study, bytes, path.to_path_buf());
        other.map_or_else(
            || StudyError::Value {
                path: path.to_path_buf(),
                place: format!("line {}, column {}", e.line(), e.column()),
                found: e.to_string(),
                allowed: allowed.into(),
            },
            StudyError::Kind,
        )
    };
    let text = without_comments(bytes);
    let value: Value = serde_json::from_slice(&text).map_err(|e| fault(e, "JSON"))?;
    if value.get("format").and_then(Value::as_str) == Some("kanagata-stability") {
        let study = serde_json::from_slice(&text)
            .map_err(|e| fault(e, "the keys and values of schemas/stability.schema.json"))?;
        return Ok(Description::Stability(study));
    }
    if value.get("format").and_then(Value::as_str) == Some("kanagata-patches") {
        let study = serde_json::from_slice(&text)
            .map_err(|e| fault(e, "the keys and values of schemas/patches.schema.json"))?;
        patches::check(&study, path)?;
        return Ok(Description::Patches(study));
    }
    let study = serde_json::from_slice(&text)
        .map_err(|e| fault(e, "the keys and values of schemas/study.schema.json"))?;
    validate::check(&study, path)?;
    Ok(Description::Forming(study))
}
