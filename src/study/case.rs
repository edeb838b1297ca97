//! A case of a study.

use serde_json::Value;

/// A case of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Names of its options, joined by `_`.
    pub id: String,
    /// The option of every choice.
    pub options: Vec<String>,
    /// The case whose increments it follows.
    pub follows: Option<String>,
    /// The scene of the case.
    pub scene: Value,
}
