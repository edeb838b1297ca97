//! What a reader survived and tells the user.

/// How much a [`Diagnostic`] matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Repaired or skipped: the model may differ from what its author meant.
    Warning,
}

/// Something the reader survived and tells the user.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnostic {
    /// How much it matters.
    pub severity: Severity,
    /// Short stable kebab-case name of the kind, for example `entity-skipped`.
    pub code: &'static str,
    /// Where: `line 12 (D7, entity 128)` or `#45 (ADVANCED_FACE)`; empty for the whole file.
    pub place: String,
    /// What was found, what was done.
    pub text: String,
}
