//! Changes that keep a text readable far into its reader: words for words, in IGES within their columns, in JSON also values
//! for values.

use super::dice::Dice;

/// Which text it is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Text {
    /// Cards of 80 columns.
    Iges,
    /// Words in any place.
    Words,
    /// Cards or words, by the first of them.
    Cad,
    /// Nested values.
    Json,
    /// A line of JSON before bytes.
    Checkpoint,
}

/// Numbers that hurt.
const NUMBERS: [&[u8]; 22] = [
    b"0",
    b"-1",
    b"1",
    b"2",
    b"3",
    b"4",
    b"7",
    b"0.",
    b"1.",
    b"-1.",
    b"0.5",
    b"1E-9",
    b"1E-320",
    b"1E9",
    b"1E30",
    b"1E300",
    b"-1E300",
    b"1E400",
    b"NaN",
    b"65536",
    b"2147483647",
    b"",
];

/// Changes one to four words, values or lines of a text. `known`: a dictionary in libFuzzer's form, a word in quotes a line.
pub fn damage(text: Text, known: &str, bytes: &mut Vec<u8>, dice: &mut Dice) {
    // What follows the first line of a checkpoint is numbers: mostly kept.
    let first = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
    let kept = text == Text::Checkpoint && dice.below(8) > 0;
    let rest = if kept { bytes.split_off(first) } else { Vec::new() };
    let nested = matches!(text, Text::Json | Text::Checkpoint);
    for _ in 0..=dice.below(4) {
        if bytes.is_empty() {
            break;
        }
        match dice.below(12) {
            0..6 if nested => change_value(bytes, dice),
            0 => repeat_line(bytes, dice),
            1 => {
                let line = line_at(bytes, dice.below(bytes.len()));
                bytes.drain(line);
            }
            _ => change_word(text, known, bytes, dice),
        }
    }
    bytes.extend(rest);
}

/// The line around a place, with its end.
fn line_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(|&b| b == b'\n').map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |k| at + k + 1);
    start..end
}

fn repeat_line(bytes: &mut Vec<u8>, dice: &mut Dice) {
    let from = line_at(bytes, dice.below(bytes.len()));
    let to = line_at(bytes, dice.below(bytes.len())).start;
    let line = bytes[from].to_vec();
    bytes.splice(to..to, line);
}

fn in_word(b: &u8) -> bool {
    b.is_ascii_alphanumeric() || b"#_.+-$*".contains(b)
}

/// The first word at or behind a place.
fn word_at(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let at = at + bytes[at..].iter().position(in_word)?;
    let start = bytes[..at].iter().rposition(|b| !in_word(b)).map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|b| !in_word(b)).map_or(bytes.len(), |k| at + k);
    Some(start..end)
}

/// The JSON value that begins at or behind a place: up to its own end, or that of the text.
fn value_at(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let begins = |b: &u8| b"[{\"-".contains(b) || b.is_ascii_alphanumeric();
    let from = at + bytes[at..].iter().position(begins)?;
    let (mut depth, mut quoted, mut k) = (0usize, false, from);
    while k < bytes.len() {
        match bytes[k] {
            b'\\' if quoted => k += 1,
            b'"' => {
                quoted = !quoted;
                if !quoted && depth == 0 {
                    return Some(from..k + 1);
                }
            }
            _ if quoted => {}
            b'[' | b'{' => depth += 1,
            b']' | b'}' if depth <= 1 => {
                return Some(from..if depth == 1 { k + 1 } else { k });
            }
            b']' | b'}' => depth -= 1,
            b',' | b':' | b' ' | b'\n' if depth == 0 => return Some(from..k),
            _ => {}
        }
        k += 1;
    }
    Some(from..bytes.len())
}

/// A JSON value becomes another of the file, an empty one, or a list with a value more or less.
fn change_value(bytes: &mut Vec<u8>, dice: &mut Dice) {
    const EMPTY: [&[u8]; 8] = [b"null", b"[]", b"{}", b"\"\"", b"true", b"0", b"-1", b"[0,0]"];
    let Some(old) = value_at(bytes, dice.below(bytes.len())) else { return };
    let comma = bytes[old.end..].iter().take_while(|b| b.is_ascii_whitespace() || **b == b',');
    let behind = old.end + comma.count();
    match dice.below(5) {
        0 => drop(bytes.splice(old, EMPTY[dice.below(EMPTY.len())].iter().copied())),
        1 => drop(bytes.drain(old.start..behind)),
        2 => {
            let mut again = bytes[old.clone()].to_vec();
            again.push(b',');
            bytes.splice(old.start..old.start, again);
        }
        _ => {
            if let Some(new) = value_at(bytes, dice.below(bytes.len())) {
                let new = bytes[new].to_vec();
                bytes.splice(old, new);
            }
        }
    }
}

/// References, names, enumerations, numbers.
fn class(word: &[u8]) -> u8 {
    match word {
        [b'#', ..] => 0,
        [b, ..] if b.is_ascii_alphabetic() => 1,
        [b'.', b, ..] if b.is_ascii_alphabetic() => 2,
        _ => 3,
    }
}

/// A word becomes another of the file, most often of its own class, or one of the dictionary, or a number.
fn change_word(text: Text, known: &str, bytes: &mut Vec<u8>, dice: &mut Dice) {
    let Some(old) = word_at(bytes, dice.below(bytes.len())) else { return };
    let same = class(&bytes[old.clone()]);
    let new = match dice.below(6) {
        0 => NUMBERS[dice.below(NUMBERS.len())].to_vec(),
        1 => {
            let words: Vec<&str> = known.lines().filter(|l| l.starts_with('"')).collect();
            words
                .get(dice.below(words.len()))
                .map_or("", |w| w.trim_matches('"'))
                .as_bytes()
                .to_vec()
        }
        _ => {
            let other = |_| word_at(bytes, dice.below(bytes.len())).map(|w| bytes[w].to_vec());
            let found =
                (0..20).filter_map(other).find(|w| class(w) == same && *w != bytes[old.clone()]);
            found.unwrap_or_default()
        }
    };
    let line = line_at(bytes, old.start);
    let column = old.start - line.start;
    let letter = matches!(text, Text::Iges | Text::Cad)
        .then(|| bytes[line.clone()].get(72).copied())
        .flatten();
    match letter {
        Some(b'D') if column < 72 => {
            let field = line.start + column / 8 * 8;
            let new = &new[..new.len().min(8)];
            bytes[field..field + 8].fill(b' ');
            bytes[field + 8 - new.len()..field + 8].copy_from_slice(new);
        }
        Some(b'P' | b'G') if old.end <= line.start + 64 => {
            let mut card = bytes[line.start..line.start + 64].to_vec();
            card.splice(column..old.end - line.start, new);
            card.resize(64, b' ');
            bytes[line.start..line.start + 64].copy_from_slice(&card);
        }
        _ => drop(bytes.splice(old, new)),
    }
}
