//! The study file, version 1.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::StudyError;
use super::checks::Check;
use super::patches::{self, PatchStudy};
use super::stability::StabilityStudy;
use super::validate;
use crate::scene::comments::without_comments;

/// One scene in many variants: every combination of the choices is a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// `kanagata-study`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// The scene that the choices change. `{NAME}` in a text stands for the option taken of the choice NAME; tool files
    /// are relative to the folder given with `--tools`, a mesh of the blank and a history to the study.
    pub scene: Value,
    /// What is varied.
    pub choices: Vec<Choice>,
    /// Changes for a quick look (`--quick`).
    #[serde(default)]
    pub quick: Option<Value>,
    /// Tool whose force and travel are charted.
    pub watch: String,
    /// Case the others are compared with: the options taken, in the order of the choices, joined by `_`.
    #[serde(default)]
    pub reference: Option<String>,
    /// Whose increments cases take instead of choosing their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub follow: Vec<Follow>,
    /// What the study is expected to show.
    #[serde(default)]
    pub checks: Vec<Check>,
}

/// Cases whose increments end where those of another case ended (`solver.increments_of` of a scene), so that they differ
/// from it by what is varied and not by their steps. They are run when it is done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Follow {
    /// The case whose increments are taken.
    pub of: String,
    /// Cases that take them; a case follows one other at most, and none that follows it.
    pub cases: Vec<String>,
}

/// The constant that marks a study file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-study`
    #[serde(rename = "kanagata-study")]
    Study,
}

/// One thing that is varied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Name, for `{NAME}` and the columns of the table.
    pub name: String,
    /// Its options.
    pub options: Vec<ChoiceOption>,
}

/// One option of a choice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChoiceOption {
    /// Name: letters, digits, `-` and `.`.
    pub name: String,
    /// The method that it is one of, for the charts of accuracy against cost: cases of the same methods are one line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Changes of the scene: objects are merged, null removes, everything else replaces.
    #[serde(default)]
    pub change: Option<Value>,
}

/// What a study file describes.
#[derive(Debug, Clone, PartialEq)]
pub enum Description {
    /// Runs of the solver (`kanagata-study`).
    Forming(Study),
    /// Maps of where methods fail (`kanagata-stability`).
    Stability(StabilityStudy),
    /// Patches against accuracy (`kanagata-patches`).
    Patches(PatchStudy),
}

/// Reads a study of any kind, told by its `format`.
///
/// # Errors
/// [`StudyError`] names file, key, what was found and what is allowed.
pub fn read(path: &Path) -> Result<Description, StudyError> {
    let bytes = crate::files::read(path, crate::files::Input::Description)
        .map_err(|source| StudyError::Io { path: path.to_path_buf(), source })?;
    parse(&bytes, path)
}

/// The study in the bytes of a file, checked as far as no other file is needed; `path` is for messages.
///
/// # Errors
/// [`StudyError::Value`].
pub fn parse(bytes: &[u8], path: &Path) -> Result<Description, StudyError> {
    let fault = |e: serde_json::Error, allowed: &str| StudyError::Value {
        path: path.to_path_buf(),
        place: format!("line {}, column {}", e.line(), e.column()),
        found: e.to_string(),
        allowed: allowed.into(),
    };
    let bytes = without_comments(bytes);
    let value: Value = serde_json::from_slice(&bytes).map_err(|e| fault(e, "JSON"))?;
    if value.get("format").and_then(Value::as_str) == Some("kanagata-stability") {
        let study = serde_json::from_slice(&bytes)
            .map_err(|e| fault(e, "the keys and values of schemas/stability.schema.json"))?;
        return Ok(Description::Stability(study));
    }
    if value.get("format").and_then(Value::as_str) == Some("kanagata-patches") {
        let study = serde_json::from_slice(&bytes)
            .map_err(|e| fault(e, "the keys and values of schemas/patches.schema.json"))?;
        patches::check(&study, path)?;
        return Ok(Description::Patches(study));
    }
    let study = serde_json::from_slice(&bytes)
        .map_err(|e| fault(e, "the keys and values of schemas/study.schema.json"))?;
    validate::check(&study, path)?;
    Ok(Description::Forming(study))
}
