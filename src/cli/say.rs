//! Lines on standard output and standard error. Who reads them may have gone (`kanagata audit ... | head`): what is left to
//! say is then dropped, and the work continues to its end and its exit code. Lines that are lost for another reason (a full disk) end
//! with exit code 4 ([`lost`]).
//!
//! What is printed may hold text that others wrote. Control characters in it are escaped, so that it neither moves the cursor
//! nor begins a line of its own: a line break stays only before two spaces, as the continued lines of messages have them.

use std::borrow::Cow;
use std::io::Write as _;
use std::sync::OnceLock;

/// Text as it is shown on a terminal.
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

/// Control characters, and those that change the direction of text or break lines.
fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Why standard output did not take a line, where its reader has not simply gone: what was asked for is not there.
static LOST: OnceLock<String> = OnceLock::new();

/// Puts a line on standard output.
pub(super) fn put(line: &str) {
    if let Err(error) = writeln!(std::io::stdout(), "{line}")
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// Why a line was lost that [`put`] should have written.
pub(super) fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// A line on standard output.
macro_rules! out {
    ($($part:tt)*) => {
        $crate::cli::say::put(&$crate::cli::say::shown(&format!($($part)*)))
    };
}

/// Lines on standard output, of a table that is the program's own.
macro_rules! out_lines {
    ($text:expr) => {{
        for line in $text.to_string().lines() {
            $crate::cli::say::out!("{line}");
        }
    }};
}

/// Text of a program's own making on standard output as it is: JSON, which has escapes of its own.
macro_rules! out_json {
    ($($part:tt)*) => {
        $crate::cli::say::put(&format!($($part)*))
    };
}

/// A line on standard error.
macro_rules! err {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "{}", $crate::cli::say::shown(&format!($($part)*)));
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
