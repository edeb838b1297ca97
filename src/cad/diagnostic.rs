//! Messages about problems that a reader handled.

/// Severity of a [`Diagnostic`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// For information.
    Note,
    /// Repaired or skipped: the model may differ from the author's intent.
    Warning,
}

/// A problem that the reader handled and reports.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnostic {
    /// Severity.
    pub severity: Severity,
    /// Stable kebab-case code, for example `entity-skipped`.
    pub code: &'static str,
    /// Location: `line 12 (D7, entity 128)` or `#45 (ADVANCED_FACE)`; empty for the entire file.
    pub place: String,
    /// Finding and action.
    pub text: String,
}
