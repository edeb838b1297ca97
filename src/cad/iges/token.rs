//! Tokens of the global and parameter sections: numbers, Hollerith strings, defaults. No text is copied.

use nom::bytes::complete::{tag_no_case, take};
use nom::character::complete::digit1;
use nom::{IResult, Parser};

/// The delimiters of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Delimiters {
    /// Parameter delimiter, `,` by default.
    pub parameter: u8,
    /// Record delimiter, `;` by default.
    pub record: u8,
}

impl Default for Delimiters {
    fn default() -> Self {
        Self { parameter: b',', record: b';' }
    }
}

impl Delimiters {
    fn ends(self, byte: u8) -> bool {
        byte == self.parameter || byte == self.record
    }
}

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// Empty field: the default.
    Blank,
    /// A number, a logical or an unquoted word, without surrounding blanks.
    Word(&'a [u8]),
    /// Content of a Hollerith string.
    Text(&'a [u8]),
}

/// The parameter at the start of `input`; the remaining text begins with a delimiter or is empty.
///
/// A Hollerith string whose count does not end at a delimiter ends at the next one.
pub(super) fn token(input: &[u8], delimiters: Delimiters) -> (&[u8], Token<'_>) {
    let trimmed = input.trim_ascii_start();
    if begins_as_hollerith(trimmed) {
        return text(trimmed, delimiters);
    }
    let (rest, word) = until_delimiter(trimmed, delimiters);
    let word = word.trim_ascii_end();
    (rest, if word.is_empty() { Token::Blank } else { Token::Word(word) })
}

/// True for digits followed by an `H`.
fn begins_as_hollerith(input: &[u8]) -> bool {
    let behind = input.iter().find(|b| !b.is_ascii_digit());
    behind.is_some_and(|b| b.eq_ignore_ascii_case(&b'H')) && input[0].is_ascii_digit()
}

/// A Hollerith string; one with a wrong count ends at the next delimiter.
fn text(input: &[u8], delimiters: Delimiters) -> (&[u8], Token<'_>) {
    if let Ok((after, text)) = hollerith(input) {
        let next = after.trim_ascii_start();
        if next.first().is_none_or(|b| delimiters.ends(*b)) {
            return (next, Token::Text(text));
        }
        let (rest, text) = until_delimiter(head_after_h(input), delimiters);
        return (rest, Token::Text(text.trim_ascii_end()));
    }
    // The count exceeds the remaining text.
    let (rest, word) = until_delimiter(input, delimiters);
    let word = word.trim_ascii_end();
    (
        rest,
        if begins_as_hollerith(word) { Token::Text(head_after_h(word)) } else { Token::Word(word) },
    )
}

/// `nHtext`.
fn hollerith(input: &[u8]) -> IResult<&[u8], &[u8]> {
    let (rest, (digits, _)) = (digit1, tag_no_case("H")).parse(input)?;
    let count = digits
        .iter()
        .try_fold(0usize, |n, d| n.checked_mul(10)?.checked_add(usize::from(d - b'0')));
    take(count.unwrap_or(usize::MAX))(rest)
}

/// Text after the `H` of a Hollerith string with a wrong count.
fn head_after_h(input: &[u8]) -> &[u8] {
    let digits = input.iter().take_while(|b| b.is_ascii_digit()).count();
    input.get(digits + 1..).unwrap_or_default()
}

fn until_delimiter(input: &[u8], delimiters: Delimiters) -> (&[u8], &[u8]) {
    let end = input.iter().position(|b| delimiters.ends(*b)).unwrap_or(input.len());
    let (word, rest) = input.split_at(end);
    (rest, word)
}

/// All parameters of a record, up to its record delimiter or the end of `input`. The flag is true when the delimiter
/// was present.
pub(super) fn record(input: &[u8], delimiters: Delimiters) -> (Vec<Token<'_>>, bool) {
    let mut tokens = Vec::with_capacity((input.len() / 8 + 1).min(16_384));
    let mut rest = input;
    loop {
        let (after, found) = token(rest, delimiters);
        match after.split_first() {
            Some((byte, tail)) if *byte == delimiters.parameter => {
                tokens.push(found);
                rest = tail;
            }
            Some(_) => {
                tokens.push(found);
                return (tokens, true);
            }
            None => {
                if found != Token::Blank {
                    tokens.push(found);
                }
                return (tokens, false);
            }
        }
    }
}

/// A real: integers, a decimal point at either end, `E`, `e`, `D` or `d` exponents, embedded blanks (a number split at
/// the end of a card). `None` for anything else and for values outside the range of a double.
pub(super) fn real(word: &[u8]) -> Option<f64> {
    // The other spellings Rust accepts, `inf` and `nan`, are not finite.
    let value = parse(word).filter(|v| v.is_finite());
    value.or_else(|| parse_rare_spelling(word)).filter(|v| v.is_finite())
}

/// Rare spellings: `D` exponents, embedded blanks, Fortran's `1.5-3`.
fn parse_rare_spelling(word: &[u8]) -> Option<f64> {
    let mut buffer = [0u8; 64];
    let mut used = 0usize;
    let mut exponent = false;
    for &byte in word.iter().filter(|b| !b.is_ascii_whitespace()) {
        let last = used.checked_sub(1).and_then(|i| buffer.get(i).copied());
        let put: &[u8] = match byte {
            b'D' | b'd' | b'E' | b'e' => b"E",
            b'+' | b'-' if !exponent && last.is_some_and(|l| l.is_ascii_digit() || l == b'.') => {
                &[b'E', byte]
            }
            b'0'..=b'9' | b'.' | b'+' | b'-' => &[byte],
            _ => return None,
        };
        exponent |= put[0] == b'E';
        for b in put {
            *buffer.get_mut(used)? = *b;
            used += 1;
        }
    }
    parse(&buffer[..used])
}

fn parse(text: &[u8]) -> Option<f64> {
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// An integer; reals without a fractional part are accepted.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok().and_then(|t| t.parse().ok()).or_else(|| {
        let value = real(word)?;
        #[allow(clippy::cast_possible_truncation)]
        (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_in_every_spelling_and_nothing_else() {
        let table: [(&str, Option<f64>); 24] = [
            ("1", Some(1.0)),
            ("-3.", Some(-3.0)),
            (".5", Some(0.5)),
            ("+.5E+1", Some(5.0)),
            ("1.D3", Some(1000.0)),
            ("1.5d-3", Some(0.0015)),
            ("6.E-3", Some(0.006)),
            ("1.5-3", Some(0.0015)),
            ("1.5+3", Some(1500.0)),
            ("12 34.5", Some(1234.5)),
            ("-0.", Some(-0.0)),
            ("1E-400", Some(0.0)),
            ("1E400", None),
            ("-1D400", None),
            ("NaN", None),
            ("inf", None),
            ("infinity", None),
            ("E5", None),
            ("1.2.3", None),
            ("--1", None),
            ("1E", None),
            (".", None),
            ("0x10", None),
            ("1_000", None),
        ];
        for (text, wanted) in table {
            assert_eq!(real(text.as_bytes()), wanted, "{text}");
        }
        assert_eq!(real(&[b'9'; 200]), Some(1e200));
        assert_eq!(real(&[b'9'; 400]), None);
    }

    #[test]
    fn integers_may_be_written_as_whole_reals() {
        for (text, wanted) in [
            ("7", Some(7)),
            ("-7", Some(-7)),
            ("7.", Some(7)),
            ("7.5", None),
            ("1D20", None),
            ("T", None),
        ] {
            assert_eq!(integer(text.as_bytes()), wanted, "{text}");
        }
    }

    #[test]
    fn records_split_whatever_their_strings_and_ends() {
        let standard = Delimiters::default();
        let other = Delimiters { parameter: b'/', record: b'#' };
        let text = |t: &'static str| Token::Text(t.as_bytes());
        let word = |t: &'static str| Token::Word(t.as_bytes());
        let table: [(&str, Delimiters, Vec<Token<'_>>, bool); 11] = [
            ("110,1.,2;", standard, vec![word("110"), word("1."), word("2")], true),
            ("110,,;comment, more;", standard, vec![word("110"), Token::Blank, Token::Blank], true),
            ("110 , 1. ,2", standard, vec![word("110"), word("1."), word("2")], false),
            (
                "308,0,5Ha,b;c,1;",
                standard,
                vec![word("308"), word("0"), text("a,b;c"), word("1")],
                true,
            ),
            ("308/0/3Ha/b#", other, vec![word("308"), word("0"), text("a/b")], true),
            ("1,3Habcd,2;", standard, vec![word("1"), text("abcd"), word("2")], true),
            ("1,9Hab,2;", standard, vec![word("1"), text("ab"), word("2")], true),
            ("1,99999999999999999999Hab;", standard, vec![word("1"), text("ab")], true),
            ("1,0H,2;", standard, vec![word("1"), text(""), word("2")], true),
            ("1,2hab ;", standard, vec![word("1"), text("ab")], true),
            (";", standard, vec![Token::Blank], true),
        ];
        for (source, delimiters, wanted, closed) in table {
            assert_eq!(record(source.as_bytes(), delimiters), (wanted, closed), "{source}");
        }
        assert_eq!(record(b"   ", standard), (Vec::new(), false));
    }
}
