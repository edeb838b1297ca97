//! A case of a study.

use serde_json::Value;

/// Largest number of cases.
pub(super) const CASES_MAX: usize = 10_000;
/// Largest length of the name of a choice, an option or a case of a table. Names are inserted into texts of the scene, and
/// the options of a case name its folder. Twice the value would double the length of a scene made of placeholders only.
pub(super) const NAME_MAX: usize = 64;

/// Whether a name can be a part of file names and of texts.
pub(super) fn is_word(name: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
    let begins = name.starts_with(|c: char| c.is_ascii_alphanumeric());
    begins && name.len() <= NAME_MAX && name.chars().all(fits)
}

/// The names that [`is_word`] allows.
pub(super) fn allowed_words() -> String {
    format!("up to {NAME_MAX} letters, digits, '-' and '.', the first a letter or digit")
}

/// A case of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Names of its options, joined by `_`; in a table, the first cell of its row.
    pub id: String,
    /// The option of every choice, or the cells of its row after the first.
    pub options: Vec<String>,
    /// The case whose increments it follows.
    pub follows: Option<String>,
    /// The scene of the case.
    pub scene: Value,
}
