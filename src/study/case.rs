//! One case of a study.

use serde_json::Value;

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Options taken, joined by `_`.
    pub id: String,
    /// Option of every choice.
    pub options: Vec<String>,
    /// The case whose increments it takes.
    pub follows: Option<String>,
    /// Its scene.
    pub scene: Value,
}
