//! Escaping of text from outside the program (file, scene, tool and material names) for pages and drawings.

#[cfg(feature = "pages")]
use serde_json::Value;

/// The replacement of a character that is invisible, invalid in XML, or changes the direction of the text after it.
fn visible(c: char) -> char {
    match c {
        '\n' | '\t' => c,
        '\0'..='\u{1f}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or('\u{fffd}'),
        '\u{200e}'
        | '\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2066}'..='\u{2069}'
        | '\u{fffe}'
        | '\u{ffff}' => '\u{fffd}',
        c if c.is_control() => '\u{fffd}',
        c => c,
    }
}

/// Text without invisible characters: control characters become their pictures, others U+FFFD. Markup is unchanged.
#[must_use]
pub fn visible_text(text: &str) -> String {
    text.chars().map(visible).collect()
}

/// Text escaped for HTML and XML, attributes included.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars().map(visible) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// A value as JSON inside a script element. A `<` in a string could end the script or open a comment, and is written as an
/// escape; JSON has none outside strings.
#[cfg(feature = "pages")]
pub(super) fn json_text(value: &Value) -> String {
    let text = value.to_string();
    text.replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "pages")]
    use serde_json::json;

    const NAME: &str = "<b onclick=\"x\">&'\u{7}\u{202e}\u{9b}\u{ffff}%{x}";

    #[test]
    fn hidden_characters_are_shown_and_markup_is_text() {
        assert_eq!(visible_text(NAME), "<b onclick=\"x\">&'\u{2407}\u{fffd}\u{fffd}\u{fffd}%{x}");
        let text = "&lt;b onclick=&quot;x&quot;&gt;&amp;&#39;\u{2407}\u{fffd}\u{fffd}\u{fffd}%{x}";
        assert_eq!(escaped(NAME), text);
    }

    #[cfg(feature = "pages")]
    #[test]
    fn json_in_a_page_ends_no_script() {
        let value = json!({"a": "</script><!--\u{2028}", "b": 1.5});
        let text = json_text(&value);
        assert!(!text.contains('<') && !text.contains('\u{2028}'), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), value);
    }
}
