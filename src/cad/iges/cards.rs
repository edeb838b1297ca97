//! Cards: the physical lines of the file, sorted into sections, for any line ending and width.
//!
//! Columns 1-72 hold data, column 73 the section letter, columns 74-80 the sequence number. In the parameter section
//! columns 1-64 are data and 66-72 point back to the directory entry.

/// Columns of parameter data on a card.
const PARAMETER_COLUMNS: usize = 64;

/// The sections of a file, each as contiguous text.
#[derive(Debug, Default)]
pub(super) struct Cards<'a> {
    /// Global section, 72 columns per card.
    pub global: Vec<u8>,
    /// Directory cards.
    pub directory: Vec<Card<'a>>,
    /// Parameter data of all cards, 64 columns each (65 where data extends into column 65).
    pub parameters: Vec<u8>,
    /// Offset of each parameter card in `parameters`, and the fields behind its data.
    pub parameter_cards: Vec<ParameterCard>,
    /// Number of cards without a section letter, treated as continuations.
    pub unlettered: usize,
    /// Line of the first card without a section letter.
    pub first_unlettered: usize,
    /// The file has a T section.
    pub terminated: bool,
    /// The file begins as a compressed or binary file.
    pub other_form: bool,
    /// Number of cards in the start section.
    pub start: usize,
}

/// One card of the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Card<'a> {
    /// Columns 1-72 (or fewer).
    pub text: &'a [u8],
    /// Columns 74-80 as a number, 0 when there is none.
    pub sequence: u32,
    /// Line in the file, from 1.
    pub line: usize,
}

/// The fields behind the data of a parameter card.
#[derive(Debug, Clone, Copy)]
pub(super) struct ParameterCard {
    /// Offset of its first column in `Cards::parameters`.
    pub offset: usize,
    /// Directory entry of the card (0: none).
    pub back: u32,
    /// Sequence number (0: none).
    pub sequence: u32,
    /// Line in the file, from 1.
    pub line: usize,
}

/// Sorts the lines of `bytes` into sections.
pub(super) fn split(bytes: &[u8]) -> Cards<'_> {
    let mut cards = Cards { parameters: Vec::with_capacity(bytes.len()), ..Cards::default() };
    let lines: Vec<&[u8]> = Lines::new(bytes).collect();
    let runs_on = column_65_holds_data(&lines);
    let mut section = b' ';
    for (line, text) in (1..).zip(lines) {
        let lettered = letter(text);
        match lettered {
            Some(found) => section = found,
            None if text.iter().all(u8::is_ascii_whitespace) => continue,
            None => {
                if cards.unlettered == 0 {
                    cards.first_unlettered = line;
                }
                cards.unlettered += 1;
            }
        }
        let sequence = text.get(73..).map_or(0, |tail| number(&tail[..tail.len().min(7)]));
        match section {
            b'S' => cards.start += 1,
            b'G' => push_padded(&mut cards.global, head(text, 72), 72),
            b'D' if lettered.is_some() || bare_directory_card(text) => {
                cards.directory.push(Card { text: head(text, 72), sequence, line });
            }
            b'P' => push_parameter_card(&mut cards, text, sequence, line, runs_on),
            b'T' => cards.terminated = true,
            b'B' | b'C' => cards.other_form = true,
            _ => {}
        }
        if section == b'T' {
            break;
        }
    }
    cards
}

fn push_parameter_card(
    cards: &mut Cards<'_>,
    text: &[u8],
    sequence: u32,
    line: usize,
    runs_on: bool,
) {
    let offset = cards.parameters.len();
    let back = text.get(65..72.min(text.len())).map_or(0, number);
    cards.parameter_cards.push(ParameterCard { offset, back, sequence, line });
    push_padded(&mut cards.parameters, head(text, PARAMETER_COLUMNS), PARAMETER_COLUMNS);
    if let Some(&byte) = text.get(PARAMETER_COLUMNS)
        && runs_on
        && !byte.is_ascii_whitespace()
    {
        cards.parameters.push(byte);
    }
}

/// True when column 65 of a parameter card contains more than a blank or the leading zero of a wide pointer.
fn column_65_holds_data(lines: &[&[u8]]) -> bool {
    lines.iter().any(|text| {
        text.get(64).is_some_and(|b| !b.is_ascii_whitespace() && *b != b'0')
            && letter(text) == Some(b'P')
    })
}

/// A directory card truncated before column 73.
fn bare_directory_card(text: &[u8]) -> bool {
    text.len() >= PARAMETER_COLUMNS && number(head(text, 8)) > 0
}

fn head(text: &[u8], columns: usize) -> &[u8] {
    &text[..text.len().min(columns)]
}

fn push_padded(to: &mut Vec<u8>, text: &[u8], columns: usize) {
    to.extend_from_slice(text);
    to.resize(to.len() + columns.saturating_sub(text.len()), b' ');
}

/// Section letter in column 73, if present.
fn letter(text: &[u8]) -> Option<u8> {
    let found = text.get(72)?.to_ascii_uppercase();
    b"SGDPTBC".contains(&found).then_some(found)
}

/// A right-justified number; 0 for blanks and anything else.
pub(super) fn number(text: &[u8]) -> u32 {
    let text = text.trim_ascii();
    let digits = text.iter().all(u8::is_ascii_digit);
    if digits {
        text.iter().fold(0, |n: u32, d| n.saturating_mul(10).saturating_add(u32::from(d - b'0')))
    } else {
        0
    }
}

/// Lines with any line ending, or unterminated 80-byte records.
struct Lines<'a> {
    rest: &'a [u8],
    /// Remainder of a run of unterminated records.
    records: &'a [u8],
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        Self { rest: bytes, records: &[] }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<Self::Item> {
        if !self.records.is_empty() {
            let (record, rest) = self.records.split_at(self.records.len().min(80));
            self.records = rest;
            return Some(record);
        }
        if self.rest.is_empty() {
            return None;
        }
        let (text, rest) = self.rest.split_at(line_end(self.rest));
        let feed = if rest.starts_with(b"\r\n") { 2 } else { rest.len().min(1) };
        self.rest = &rest[feed..];
        if text.len() > 160 && letter(text).is_some() && letter(&text[80..]).is_some() {
            self.records = &text[80..];
            return Some(&text[..80]);
        }
        Some(text)
    }
}

/// Position of the first line feed or carriage return, or the end; scans eight bytes at a time.
fn line_end(bytes: &[u8]) -> usize {
    const ONES: u64 = u64::from_ne_bytes([1; 8]);
    const HIGH: u64 = u64::from_ne_bytes([0x80; 8]);
    // A zero byte of `x` sets its high bit; a byte above it may be set as well, but none without a zero byte.
    let zero = |x: u64| x.wrapping_sub(ONES) & !x & HIGH;
    let ends = |b: &u8| matches!(b, b'\n' | b'\r');
    let mut at = 0;
    for chunk in bytes.as_chunks::<8>().0 {
        let word = u64::from_ne_bytes(*chunk);
        let found = zero(word ^ (ONES * u64::from(b'\n'))) | zero(word ^ (ONES * u64::from(b'\r')));
        if found != 0 {
            break;
        }
        at += 8;
    }
    at + bytes[at..].iter().position(ends).unwrap_or(bytes.len() - at)
}
