//! The study file, version 1.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::checks::Check;
use super::table_cases::CaseTable;

/// Variants of a scene: every combination of the choices is a case, or every row of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// `kanagata-study`.
    pub format: FormatTag,
    /// File version: 1.
    pub version: u32,
    /// Name, for reports.
    pub name: String,
    /// The base scene. `{NAME}` in a string is replaced by the option of the choice NAME; with a table, `{case}` by the name
    /// of the case. Tool files are relative to the folder given with `--tools`, a mesh of the blank and a history to the
    /// study.
    pub scene: Value,
    /// The varied quantities. Exactly one of `choices` and `table` is given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
    /// A CSV file with a case in each row, relative to the study. The first column, `case`, is the name of the case. The
    /// head of every other column is the path of a value of the scene, as in `run --set`; empty cells change nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<String>,
    /// Content of the table; `None` until it is read.
    #[serde(skip)]
    pub rows: Option<CaseTable>,
    /// Changes for a coarse trial run (`--quick`).
    #[serde(default)]
    pub quick: Option<Value>,
    /// Tool whose force and travel are plotted.
    pub watch: String,
    /// Reference case: its options in the order of the choices, joined by `_`, or its name in the table.
    #[serde(default)]
    pub reference: Option<String>,
    /// Cases that follow the increments of another case.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub follow: Vec<Follow>,
    /// Expected results.
    #[serde(default)]
    pub checks: Vec<Check>,
    /// Options of Slurm's jobs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slurm: Option<SlurmOptions>,
}

/// Options of the jobs of a study on a cluster with Slurm; those of the command line count more.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlurmOptions {
    /// Account.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub account: Option<String>,
    /// Partition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partition: Option<String>,
    /// Other options of `sbatch`, with their dashes, split as by a shell: `--comment="two words"`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub options: Vec<String>,
}

impl Study {
    /// Names of what the cases vary: the choices, or the columns of the table.
    #[must_use]
    pub fn varied(&self) -> Vec<String> {
        match &self.rows {
            Some(table) => table.columns.clone(),
            None => self.choices.iter().map(|choice| choice.name.clone()).collect(),
        }
    }
}

/// Cases whose increments end where those of another case ended (`solver.increments_of` of a scene). They then differ
/// from it only by what is varied, not by their steps. They run after it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Follow {
    /// The case whose increments are followed.
    pub of: String,
    /// Cases that follow it. A case follows at most one other, and not in a cycle.
    pub cases: Vec<String>,
}

/// The format tag of a study file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-study`
    #[serde(rename = "kanagata-study")]
    Study,
}

/// A varied quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Name, for `{NAME}` and the column of the table.
    pub name: String,
    /// The options.
    pub options: Vec<ChoiceOption>,
}

/// One option of a choice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChoiceOption {
    /// Name: letters, digits, `-` and `.`.
    pub name: String,
    /// Method of the option, for charts of accuracy over cost: cases of the same methods form one line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Changes of the scene (JSON merge patch): objects are merged, null removes, other values replace.
    #[serde(default)]
    pub change: Option<Value>,
}
