//! Keys of JSON files that are ignored: `$schema`, and keys that start with `_comment`.

/// The text with ignored members replaced by blanks, so that lines and columns do not change. Invalid JSON is left to
/// the parser. The time is linear in the length.
#[must_use]
pub fn without_comments(text: &[u8]) -> Vec<u8> {
    let mut out = text.to_vec();
    let mut at = 0;
    // Position of the comma before the current member, for each open object and array.
    let mut open: Vec<Level> = Vec::new();
    while at < text.len() {
        match text[at] {
            b'{' => open.push(Level { object: true, key_next: true, comma: None }),
            b'[' => open.push(Level { object: false, key_next: false, comma: None }),
            b'}' | b']' => {
                open.pop();
            }
            b',' => {
                if let Some(level) = open.last_mut() {
                    (level.comma, level.key_next) = (Some(at), level.object);
                }
            }
            b'"' => {
                let end = string_end(text, at);
                let level = open.last_mut().filter(|level| level.key_next);
                if let Some(level) = level {
                    level.key_next = false;
                    if is_comment(&text[at + 1..end.max(at + 2) - 1])
                        && let Some(member) = member_end(text, end)
                    {
                        at = blank(&mut out, level, at, member);
                        continue;
                    }
                }
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    out
}

/// An open object or array.
struct Level {
    object: bool,
    /// Whether the next string is a key.
    key_next: bool,
    comma: Option<usize>,
}

fn is_comment(key: &[u8]) -> bool {
    key == b"$schema" || key.starts_with(b"_comment")
}

/// Position after the string that starts at `at`.
fn string_end(text: &[u8], at: usize) -> usize {
    let mut k = at + 1;
    while k < text.len() {
        match text[k] {
            b'\\' => k += 1,
            b'"' => return k + 1,
            _ => {}
        }
        k += 1;
    }
    text.len()
}

/// Position of the `,` or `}` after the value of the member whose key ends at `key_end`; `None` if the text ends before.
fn member_end(text: &[u8], key_end: usize) -> Option<usize> {
    let (mut k, mut depth) = (key_end, 0usize);
    while k < text.len() {
        match text[k] {
            b'"' => {
                k = string_end(text, k);
                continue;
            }
            b'{' | b'[' => depth += 1,
            b',' | b'}' | b']' if depth == 0 => return Some(k),
            b'}' | b']' => depth -= 1,
            _ => {}
        }
        k += 1;
    }
    None
}

/// Blanks the member from `start` to `end` and one adjacent comma. Returns where to continue.
fn blank(out: &mut [u8], level: &mut Level, start: usize, end: usize) -> usize {
    let wipe = |out: &mut [u8], from: usize, to: usize| {
        out[from..to].iter_mut().filter(|b| !b.is_ascii_whitespace()).for_each(|b| *b = b' ');
    };
    wipe(out, start, end);
    if out.get(end) == Some(&b',') {
        wipe(out, end, end + 1);
        level.key_next = true;
        return end + 1;
    }
    if let Some(comma) = level.comma {
        wipe(out, comma, comma + 1);
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn read(text: &str) -> Value {
        let left = without_comments(text.as_bytes());
        assert_eq!(left.len(), text.len());
        serde_json::from_slice(&left).unwrap()
    }

    #[test]
    fn comments_go_wherever_they_stand() {
        assert_eq!(read(r#"{"$schema": "s.json", "a": 1}"#), json!({"a": 1}));
        assert_eq!(read(r#"{"a": 1, "_comment": "x, \"}{"}"#), json!({"a": 1}));
        assert_eq!(
            read(r#"{"a": 1, "_comment1": [1, {"b": 2}], "_comment2": {}, "c": 3}"#),
            json!({"a": 1, "c": 3})
        );
        assert_eq!(read(r#"{"_comment": 1}"#), json!({}));
        assert_eq!(read(r#"{"_comment": 1, "_comment2": 2}"#), json!({}));
        assert_eq!(read(r#"{"a": 1, "_comment": 1, "_comment2": 2}"#), json!({"a": 1}));
        assert_eq!(
            read(r#"[{"_comment": null, "a": ["_comment", 1]}]"#),
            json!([{"a": ["_comment", 1]}])
        );
        assert_eq!(
            read(r#"{"a": "$schema", "b": "_comment"}"#),
            json!({"a": "$schema", "b": "_comment"})
        );
    }

    #[test]
    fn text_that_is_cut_off_is_left_to_its_reader() {
        let whole = r#"{"a": 1, "_comment": [1, {"b": "x"}], "c": 3}"#;
        for end in 0..whole.len() {
            let left = without_comments(&whole.as_bytes()[..end]);
            assert!(serde_json::from_slice::<Value>(&left).is_err(), "{end}");
        }
        for odd in ["\"", "{\"", "{\"\\", "]]]", "{,}", "{\"_comment\""] {
            let _ = without_comments(odd.as_bytes());
        }
    }
}
