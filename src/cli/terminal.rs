//! Output to standard output and standard error. If the reader has closed the pipe (`kanagata audit ... | head`),
//! further lines are dropped, and the work continues to its end and its exit code. Lines lost for another reason (a full
//! disk) cause exit code 4 ([`lost`]).
//!
//! Output may contain text from outside the program. Its control characters are escaped, so that they neither move the
//! cursor nor start a line. A line break is kept only before two spaces, as in continued lines of messages.

use std::borrow::Cow;
use std::io::Write as _;
use std::sync::OnceLock;

/// Text escaped for a terminal.
pub(super) fn shown(text: &str) -> Cow<'_, str> {
    let continues = |at: usize| text[at + 1..].starts_with("  ");
    let plain = |(at, c): (usize, char)| !is_hidden(c) || c == '\n' && continues(at);
    if text.char_indices().all(plain) {
        return Cow::Borrowed(text);
    }
    let escaped = text.char_indices().map(|(at, c)| {
        if plain((at, c)) { Cow::Owned(c.to_string()) } else { Cow::Owned(escape(c)) }
    });
    Cow::Owned(escaped.collect())
}

fn escape(c: char) -> String {
    match c {
        '\n' | '\r' | '\t' => c.escape_default().to_string(),
        c => format!("\\u{{{:x}}}", u32::from(c)),
    }
}

/// Control characters, and characters that change the text direction or break lines.
fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Why standard output failed for a reason other than a closed pipe.
static LOST: OnceLock<String> = OnceLock::new();

/// Writes a line to standard output.
pub(super) fn put(line: &str) {
    if let Err(error) = writeln!(std::io::stdout(), "{line}")
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// Why [`put`] has lost a line, if it has.
pub(super) fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// Writes a line to standard output.
macro_rules! out {
    ($($part:tt)*) => {
        $crate::cli::terminal::put(&$crate::cli::terminal::shown(&format!($($part)*)))
    };
}

/// Writes the lines of a text of this program to standard output.
macro_rules! out_lines {
    ($text:expr) => {{
        for line in $text.to_string().lines() {
            $crate::cli::terminal::out!("{line}");
        }
    }};
}

/// Writes JSON, which has its own escapes, to standard output without escaping.
macro_rules! out_json {
    ($($part:tt)*) => {
        $crate::cli::terminal::put(&format!($($part)*))
    };
}

/// Writes a line to standard error.
macro_rules! err {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "{}", $crate::cli::terminal::shown(&format!($($part)*)));
    }};
}

pub(super) use {err, out, out_json, out_lines};

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn text_of_others_neither_moves_the_cursor_nor_begins_a_line() {
        assert_eq!(shown("no face\n  the state is in out"), "no face\n  the state is in out");
        assert_eq!(shown("a\u{1b}[2Jb\r\nerror: c"), "a\\u{1b}[2Jb\\r\\nerror: c");
        assert_eq!(shown("\u{9b}31m\u{202e}\t\u{7f}"), "\\u{9b}31m\\u{202e}\\t\\u{7f}");
        assert_eq!(shown("Blechdicke µ ≤ 1 mm"), "Blechdicke µ ≤ 1 mm");
    }
}
