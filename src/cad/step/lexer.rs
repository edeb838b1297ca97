//! Tokens of ISO 10303-21: one nom parser per kind, selected by the first byte.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_until, take_while, take_while1};
use nom::character::complete::char;
use nom::combinator::{map, map_opt, opt, recognize, value};
use nom::error::{Error, ErrorKind};
use nom::multi::many0_count;
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};

/// A token; text is borrowed from the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Token<'a> {
    /// `#12`.
    Id(u64),
    /// `CARTESIAN_POINT`, `ENDSEC`, `ISO-10303-21`, `!USER_DEFINED`.
    Keyword(&'a str),
    /// A whole number; one too large for 64 bits is a real.
    Integer(i64),
    /// A real number, finite.
    Real(f64),
    /// Text between quotes, with escapes not decoded.
    Text(&'a [u8]),
    /// Text between dots.
    Enumeration(&'a str),
    /// `"0A7F"`, or `<resource>`: ignored.
    Opaque,
    /// `$`
    Missing,
    /// `*`
    Derived,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// `=`
    Equals,
    /// `;`
    Semicolon,
    /// `&` of `&SCOPE` in the first edition.
    Ampersand,
}

/// Skips white space, comments and print controls (`\N\`, `\F\`).
pub fn blank(input: &[u8]) -> &[u8] {
    let rest = input.trim_ascii_start();
    match rest.first() {
        Some(b'/' | b'\\' | 0 | 0x0b) => {}
        _ => return rest,
    }
    let comment = (tag("/*"), take_until("*/"), tag("*/"));
    let control = alt((tag("\\N\\"), tag("\\F\\")));
    let white = take_while1(|c: u8| c <= b' ');
    let mut gap = many0_count(alt((value((), white), value((), comment), value((), control))));
    let result: IResult<&[u8], usize> = gap.parse(rest);
    result.map_or(rest, |(rest, _)| rest)
}

/// The next token; the input of an error is its location.
pub fn token(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let Some((&first, rest)) = input.split_first() else { return keyword(input) };
    let one = |token| Ok((rest, token));
    match first {
        b'#' => id(input, rest),
        b'\'' => text(input),
        b'.' if rest.first().is_some_and(u8::is_ascii_digit) => number(input),
        b'.' => enumeration(input),
        b'0'..=b'9' | b'+' | b'-' => number(input),
        b'"' => map(delimited(char('"'), take_while(|c| c != b'"'), char('"')), |_| Token::Opaque)
            .parse(input),
        b'<' => map(delimited(char('<'), take_while(|c| c != b'>'), char('>')), |_| Token::Opaque)
            .parse(input),
        b'$' => one(Token::Missing),
        b'*' => one(Token::Derived),
        b'(' => one(Token::Open),
        b')' => one(Token::Close),
        b',' => one(Token::Comma),
        b'=' => one(Token::Equals),
        b';' => one(Token::Semicolon),
        b'&' => one(Token::Ampersand),
        _ => keyword(input),
    }
}

/// Number of leading digits.
fn digits(text: &[u8]) -> usize {
    text.iter().take_while(|b| b.is_ascii_digit()).count()
}

fn broken(input: &[u8]) -> nom::Err<Error<&[u8]>> {
    nom::Err::Error(Error::new(input, ErrorKind::Digit))
}

/// The number after a `#`.
fn id<'a>(input: &'a [u8], behind: &'a [u8]) -> IResult<&'a [u8], Token<'a>> {
    let (digits, rest) = behind.split_at(digits(behind));
    let append = |n: u64, d: &u8| n.checked_mul(10)?.checked_add(u64::from(d - b'0'));
    let whole = digits.iter().try_fold(0, append).filter(|_| !digits.is_empty());
    whole.map(|n| (rest, Token::Id(n))).ok_or_else(|| broken(input))
}

fn name(input: &[u8]) -> IResult<&[u8], &str> {
    let letters = take_while1(|c: u8| c.is_ascii_alphanumeric() || c == b'_' || c == b'-');
    map_opt(letters, |name| std::str::from_utf8(name).ok()).parse(input)
}

fn keyword(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    map(preceded(opt(char('!')), name), Token::Keyword).parse(input)
}

fn enumeration(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    map(delimited(char('.'), name, char('.')), Token::Enumeration).parse(input)
}

/// `'It''s'`: a doubled quote is part of the string.
fn text(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let plain = take_while1(|c| c != b'\'');
    let inside = recognize(many0_count(alt((plain, tag("''")))));
    map(delimited(char('\''), inside, char('\'')), Token::Text).parse(input)
}

/// Sign, digits, point and digits, exponent: all optional, except for the digits of an exponent.
fn number(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let behind = |at: usize| input.get(at..).unwrap_or(&[]);
    let sign = |at: usize| usize::from(matches!(input.get(at), Some(b'+' | b'-')));
    let mut end = sign(0);
    end += digits(behind(end));
    let mut whole = true;
    if input.get(end) == Some(&b'.') {
        whole = false;
        end += 1 + digits(behind(end + 1));
    }
    if matches!(input.get(end), Some(b'e' | b'E' | b'd' | b'D')) {
        let from = end + 1 + sign(end + 1);
        let power = digits(behind(from));
        if power > 0 {
            (whole, end) = (false, from + power);
        }
    }
    let (text, rest) = input.split_at(end);
    real(text, whole).map(|token| (rest, token)).ok_or_else(|| broken(input))
}

/// Value of a number's text, `whole` without point and exponent; `None` when it is not finite (1E400) or has no digit.
fn real(text: &[u8], whole: bool) -> Option<Token<'static>> {
    let text = std::str::from_utf8(text).ok()?;
    if whole && let Ok(whole) = text.parse() {
        return Some(Token::Integer(whole));
    }
    let number: f64 = match text.parse() {
        Ok(number) => number,
        Err(_) => text.replace(['d', 'D'], "E").parse().ok()?,
    };
    number.is_finite().then_some(Token::Real(number))
}

/// Decodes the escapes of a string: `''`, `\\`, `\X\hh`, `\X2\hhhh\X0\`, `\X4\hhhhhhhh\X0\`, `\S\c`. Bytes that are not
/// UTF-8 are read as ISO 8859-1; line ends are removed.
#[must_use]
pub fn decode(raw: &[u8]) -> String {
    let text: Vec<char> = match std::str::from_utf8(raw) {
        Ok(text) => text.chars().collect(),
        Err(_) => raw.iter().map(|&b| char::from(b)).collect(),
    };
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_slice();
    while let Some((&first, after)) = rest.split_first() {
        rest = match (first, after) {
            ('\'', ['\'', tail @ ..]) | ('\\', ['\\', tail @ ..]) => {
                out.push(first);
                tail
            }
            ('\\', ['X', '\\', high, low, tail @ ..]) => {
                out.extend(hex(&[*high, *low]));
                tail
            }
            ('\\', ['X', '2', '\\', tail @ ..]) => wide(tail, 4, &mut out),
            ('\\', ['X', '4', '\\', tail @ ..]) => wide(tail, 8, &mut out),
            ('\\', ['S', '\\', c, tail @ ..]) => {
                out.extend(char::from_u32(u32::from(*c).saturating_add(128)));
                tail
            }
            ('\\', ['P', _, '\\', tail @ ..]) => tail,
            ('\n' | '\r', tail) => tail,
            (c, tail) => {
                out.push(c);
                tail
            }
        };
    }
    out
}

fn hex(digits: &[char]) -> Option<char> {
    let digits: String = digits.iter().collect();
    u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32)
}

/// Groups of `width` hex digits up to the closing `\X0\`.
fn wide<'t>(mut rest: &'t [char], width: usize, out: &mut String) -> &'t [char] {
    loop {
        if let ['\\', 'X', '0', '\\', tail @ ..] = rest {
            return tail;
        }
        let Some((group, tail)) = rest.split_at_checked(width) else { return rest };
        let Some(c) = hex(group) else { return rest };
        out.push(c);
        rest = tail;
    }
}
