//! Scenes in TOML: the same keys and values as in JSON.

use std::borrow::Cow;
use std::path::Path;

use super::error::SceneError;
use kanagata_files::standard::is_stdin;

/// Whether a scene is in TOML: by the end of its name, or, from standard input, unless it begins as JSON.
pub(super) fn is_toml(bytes: &[u8], path: &Path) -> bool {
    if is_stdin(path) {
        return !matches!(bytes.trim_ascii_start().first(), None | Some(b'{' | b'/'));
    }
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// The JSON text of a scene.
///
/// # Errors
/// [`SceneError::Syntax`] with line and column for text that is no TOML.
pub(super) fn json_text<'b>(bytes: &'b [u8], path: &Path) -> Result<Cow<'b, [u8]>, SceneError> {
    if !is_toml(bytes, path) {
        return Ok(Cow::Borrowed(bytes));
    }
    let fault = |at: usize, found: String| {
        let before = &bytes[..at.min(bytes.len())];
        let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        SceneError::Syntax {
            path: path.to_path_buf(),
            line: before.iter().filter(|b| **b == b'\n').count() + 1,
            column: before.len() - start + 1,
            found,
        }
    };
    let text = std::str::from_utf8(bytes)
        .map_err(|e| fault(e.valid_up_to(), "bytes that are not UTF-8".into()))?;
    let value: serde_json::Value = toml::from_str(text)
        .map_err(|e| fault(e.span().map_or(0, |span| span.start), e.message().to_owned()))?;
    Ok(Cow::Owned(value.to_string().into_bytes()))
}
