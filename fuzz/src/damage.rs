//! Changes that keep a CAD text readable far into the reader: words for words, in IGES within their columns.

use libfuzzer_sys::fuzzer_mutate;

use crate::dice::Dice;

/// Which text it is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Text {
    /// Cards of 80 columns.
    Iges,
    /// Words in any place.
    Step,
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

/// Changes the input in place and gives its new length: one time in three libFuzzer's own way, else word by word.
/// `known`: a dictionary in libFuzzer's form, a word in quotes a line.
pub fn mutate(
    text: Text,
    known: &str,
    data: &mut [u8],
    size: usize,
    most: usize,
    seed: u32,
) -> usize {
    let mut dice = Dice(u64::from(seed));
    if size == 0 || dice.below(3) == 0 {
        return fuzzer_mutate(data, size, most);
    }
    let mut bytes = data[..size].to_vec();
    for _ in 0..=dice.below(4) {
        match dice.below(12) {
            0 => repeat_line(&mut bytes, &mut dice),
            1 => {
                let line = line_at(&bytes, dice.below(bytes.len()));
                bytes.drain(line);
            }
            _ => change_word(text, known, &mut bytes, &mut dice),
        }
    }
    let size = bytes.len().min(most);
    data[..size].copy_from_slice(&bytes[..size]);
    size
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
            words[dice.below(words.len())].trim_matches('"').as_bytes().to_vec()
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
    let letter = (text == Text::Iges).then(|| bytes[line.clone()].get(72).copied()).flatten();
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
