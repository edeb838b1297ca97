//! Tokens of the global and parameter sections: numbers, Hollerith strings, defaults. Nothing is copied.

use nom::bytes::complete::{tag_no_case, take, take_till, take_while};
use nom::character::complete::digit1;
use nom::{IResult, Parser};

/// The two delimiters a file has chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Delimiters {
    /// Between parameters, `,` by default.
    pub parameter: u8,
    /// After the last parameter of a record, `;` by default.
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
    /// Nothing between two delimiters: the default.
    Blank,
    /// A number, a logical or a bare word, without blanks around it.
    Word(&'a [u8]),
    /// Content of a Hollerith string.
    Text(&'a [u8]),
}

/// The parameter at the head of `input`; what follows begins with a delimiter or is empty.
///
/// A Hollerith whose count does not lead to a delimiter is taken to end at the next one.
pub(super) fn token(input: &[u8], delimiters: Delimiters) -> (&[u8], Token<'_>) {
    let trimmed = input.trim_ascii_start();
    if trimmed.first().is_some_and(u8::is_ascii_digit)
        && let Ok((after, text)) = hollerith(trimmed)
    {
        let next = after.trim_ascii_start();
        if next.first().is_none_or(|b| delimiters.ends(*b)) {
            return (next, Token::Text(text));
        }
        let body = head_after_h(trimmed);
        let (rest, text) = until_delimiter(body, delimiters);
        return (rest, Token::Text(text.trim_ascii_end()));
    }
    let (rest, word) = until_delimiter(trimmed, delimiters);
    let word = word.trim_ascii_end();
    if word.is_empty() {
        return (rest, Token::Blank);
    }
    if let Some(body) = broken_hollerith(word) {
        return (rest, Token::Text(body));
    }
    (rest, Token::Word(word))
}

/// `nHtext`.
fn hollerith(input: &[u8]) -> IResult<&[u8], &[u8]> {
    let (rest, (digits, _)) = (digit1, tag_no_case("H")).parse(input)?;
    let count = digits
        .iter()
        .try_fold(0usize, |n, d| n.checked_mul(10)?.checked_add(usize::from(d - b'0')));
    take(count.unwrap_or(usize::MAX))(rest)
}

/// What stands behind the `H` of a Hollerith whose count is wrong.
fn head_after_h(input: &[u8]) -> &[u8] {
    let digits = input.iter().take_while(|b| b.is_ascii_digit()).count();
    input.get(digits + 1..).unwrap_or_default()
}

/// Content of a Hollerith whose count leads past the end of the text.
fn broken_hollerith(word: &[u8]) -> Option<&[u8]> {
    let digits = word.iter().take_while(|b| b.is_ascii_digit()).count();
    (digits > 0 && word.get(digits).is_some_and(|b| b.eq_ignore_ascii_case(&b'H')))
        .then(|| head_after_h(word))
}

fn until_delimiter(input: &[u8], delimiters: Delimiters) -> (&[u8], &[u8]) {
    let found: IResult<&[u8], &[u8]> = take_till(|b| delimiters.ends(b))(input);
    found.unwrap_or((&[], input))
}

/// All parameters of a record, up to its record delimiter or the end of `input`. The flag says whether the
/// delimiter was there.
pub(super) fn record(input: &[u8], delimiters: Delimiters) -> (Vec<Token<'_>>, bool) {
    let mut tokens = Vec::with_capacity(input.len() / 8 + 1);
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

/// A real: integers, a bare point at either end, `E`, `e`, `D` or `d` exponents, blanks inside (a number cut by
/// the end of a card). `None` for anything else and for what no double can hold.
pub(super) fn real(word: &[u8]) -> Option<f64> {
    let plain: IResult<&[u8], &[u8]> =
        take_while(|b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'E' | b'e'))(
            word,
        );
    let value = match plain {
        Ok(([], text)) => parse(text),
        _ => None,
    };
    value.or_else(|| spelled(word)).filter(|v| v.is_finite())
}

/// The slow spellings: `D` exponents, blanks inside, Fortran's `1.5-3`.
fn spelled(word: &[u8]) -> Option<f64> {
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

/// An integer; reals without a fraction are taken too.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok().and_then(|t| t.parse().ok()).or_else(|| {
        let value = real(word)?;
        #[allow(clippy::cast_possible_truncation)]
        (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
    })
}
