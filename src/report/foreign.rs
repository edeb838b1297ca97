//! Escaping of text from outside the program (file, scene, tool and material names) for pages and drawings.

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

/// Text escaped for plotly, which interprets tags as markup and has no entities for quotes.
fn in_plot(text: &str) -> String {
    visible_text(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Text escaped for a plotly template (`hovertemplate`), in which `%{...}` is substituted.
#[must_use]
pub fn in_template(text: &str) -> String {
    in_plot(text).replace("%{", "%&#123;")
}

/// Escapes all strings of a plotly trace or layout, in which plotly interprets tags as markup and links. Templates are
/// not changed.
pub fn escape_texts(value: &mut Value) {
    match value {
        Value::String(text) => *text = in_plot(text),
        Value::Array(items) => items.iter_mut().for_each(escape_texts),
        Value::Object(fields) => {
            let texts = fields.iter_mut().filter(|(key, _)| *key != "hovertemplate");
            texts.for_each(|(_, value)| escape_texts(value));
        }
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const NAME: &str = "<b onclick=\"x\">&'\u{7}\u{202e}\u{9b}\u{ffff}%{x}";

    #[test]
    fn hidden_characters_are_shown_and_markup_is_text() {
        assert_eq!(visible_text(NAME), "<b onclick=\"x\">&'\u{2407}\u{fffd}\u{fffd}\u{fffd}%{x}");
        let text = "&lt;b onclick=&quot;x&quot;&gt;&amp;&#39;\u{2407}\u{fffd}\u{fffd}\u{fffd}%{x}";
        assert_eq!(escaped(NAME), text);
        assert_eq!(in_template("a%{y}<"), "a%&#123;y}&lt;");
    }

    #[test]
    fn texts_of_a_trace_are_escaped_at_any_depth() {
        let template = "%{x}<extra>0</extra>";
        let mut trace = json!({"name": "<a>\"'", "y": ["<b>", 1], "t": {"text": "&"}, "hovertemplate": template});
        escape_texts(&mut trace);
        let expected = json!({"name": "&lt;a&gt;\"'", "y": ["&lt;b&gt;", 1], "t": {"text": "&amp;"}, "hovertemplate": template});
        assert_eq!(trace, expected);
    }
}
