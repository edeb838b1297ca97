//! The study file, version 1.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::checks::Check;

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
