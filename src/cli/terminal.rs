//! Output to standard output and standard error. If the reader has closed the pipe (`kanagata audit ... | head`),
//! further lines are dropped, and the work continues to its end and its exit code. Lines lost for another reason (a full
//! disk) cause exit code 4 ([`lost`]).
//!
//! Output may contain text from outside the program. Its control characters are escaped, so that they neither move the
//! cursor nor start a line. A line break is kept only before two spaces, as in continued lines of messages.

use std::borrow::Cow;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use indicatif::ProgressBar;

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

/// The bar on the terminal, above which lines are written.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);
/// Whether the lines of [`out!`] are dropped.
static SILENT: AtomicBool = AtomicBool::new(false);
/// Whether the lines of [`out!`] go to standard error, as standard output is for a file.
static TO_ERROR: AtomicBool = AtomicBool::new(false);
/// Whether standard output and standard error are coloured.
static COLORS: [AtomicBool; 2] = [AtomicBool::new(false), AtomicBool::new(false)];
/// Words at the begin of a line, with their colours (SGR parameters).
const COLORED_WORDS: [(&str, &str); 6] = [
    ("error", "1;31"),
    ("warning", "1;33"),
    ("doubt", "1;33"),
    ("note", "1;36"),
    ("try", "1;32"),
    ("auto", "1;32"),
];

fn current_bar() -> Option<ProgressBar> {
    BAR.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Writes all further lines above `bar`.
pub(super) fn begin_bar(bar: &ProgressBar) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.clone());
}

/// Removes `bar` from the terminal.
pub(super) fn end_bar(bar: &ProgressBar) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = None;
    bar.finish_and_clear();
}

/// Drops all further lines of [`out!`]; JSON, warnings and errors are still written.
pub(super) fn silence() {
    SILENT.store(true, Ordering::Relaxed);
}

/// Sends all further lines of [`out!`] to standard error.
pub(super) fn keep_stdout_for_a_file() {
    TO_ERROR.store(true, Ordering::Relaxed);
}

/// Colours the level of messages on standard output, on standard error.
pub(super) fn set_colors(out: bool, error: bool) {
    COLORS[0].store(out, Ordering::Relaxed);
    COLORS[1].store(error, Ordering::Relaxed);
}

/// A line with its level coloured, where it begins with one.
fn colored(line: Cow<'_, str>) -> Cow<'_, str> {
    let start = line.len() - line.trim_start().len();
    let word = |(word, _): &&(&str, &str)| {
        let rest = line[start..].strip_prefix(word);
        rest.is_some_and(|rest| rest.starts_with([':', ' ']))
    };
    let Some((word, sgr)) = COLORED_WORDS.iter().find(word) else { return line };
    let (before, after) = (&line[..start], &line[start + word.len()..]);
    Cow::Owned(format!("{before}\u{1b}[{sgr}m{word}\u{1b}[0m{after}"))
}

/// The line as it is written to standard output (0) or standard error (1).
fn dressed(line: &str, stream: usize) -> Cow<'_, str> {
    let line = shown(line);
    if COLORS[stream].load(Ordering::Relaxed) { colored(line) } else { line }
}

/// Writes with the bar out of the way.
fn above_bar<T>(write: impl FnOnce() -> T) -> T {
    match current_bar() {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Writes a line of a summary to standard output, unless it is silenced.
pub(super) fn put_summary(line: &str) {
    if SILENT.load(Ordering::Relaxed) {
        return;
    }
    if TO_ERROR.load(Ordering::Relaxed) {
        put_error(line);
    } else {
        put(&dressed(line, 0));
    }
}

/// Writes a line to standard error.
pub(super) fn put_error(line: &str) {
    let _ = above_bar(|| writeln!(std::io::stderr(), "{}", dressed(line, 1)));
}

/// Writes a line to standard output.
pub(super) fn put(line: &str) {
    if let Err(error) = above_bar(|| writeln!(std::io::stdout(), "{line}"))
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
        $crate::cli::terminal::put_summary(&format!($($part)*))
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
    ($($part:tt)*) => {
        $crate::cli::terminal::put_error(&format!($($part)*))
    };
}

pub(super) use {err, out, out_json, out_lines};

#[cfg(test)]
mod tests {
    use super::{colored, shown};

    #[test]
    fn the_level_of_a_message_is_coloured_and_nothing_else() {
        let of = |line: &'static str| colored(line.into()).into_owned();
        assert_eq!(of("error: no face"), "\u{1b}[1;31merror\u{1b}[0m: no face");
        assert_eq!(of("  doubt      a"), "  \u{1b}[1;33mdoubt\u{1b}[0m      a");
        for plain in ["2 doubts: a", "  errors 3", "noted: b", "a note: c"] {
            assert_eq!(of(plain), plain);
        }
    }

    #[test]
    fn text_of_others_neither_moves_the_cursor_nor_begins_a_line() {
        assert_eq!(shown("no face\n  the state is in out"), "no face\n  the state is in out");
        assert_eq!(shown("a\u{1b}[2Jb\r\nerror: c"), "a\\u{1b}[2Jb\\r\\nerror: c");
        assert_eq!(shown("\u{9b}31m\u{202e}\t\u{7f}"), "\\u{9b}31m\\u{202e}\\t\\u{7f}");
        assert_eq!(shown("Blechdicke µ ≤ 1 mm"), "Blechdicke µ ≤ 1 mm");
    }
}
