//! Tokens of ISO 10303-21: one nom parser a kind, told apart by their first byte.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_until, take_while, take_while1};
use nom::character::complete::{char, digit1, one_of};
use nom::combinator::{map, map_opt, opt, recognize, value};
use nom::multi::many0_count;
use nom::sequence::{delimited, pair, preceded};
use nom::{IResult, Parser};

/// A token; text borrows from the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Token<'a> {
    /// `#12`.
    Id(u64),
    /// `CARTESIAN_POINT`, `ENDSEC`, `ISO-10303-21`, `!USER_DEFINED`.
    Keyword(&'a str),
    /// A whole number, as a real too large for 64 bits is one as well.
    Integer(i64),
    /// A real number, finite.
    Real(f64),
    /// What stands between the quotes, escapes not yet decoded.
    Text(&'a [u8]),
    /// What stands between the dots.
    Enumeration(&'a str),
    /// `"0A7F"`, or `<resource>`: skipped over, never used.
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
    /// `&` of the `&SCOPE` of the first edition.
    Ampersand,
}

/// Passes over white space, comments and print controls (`\N\`, `\F\`).
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

/// The next token; the error's input is where it broke.
pub fn token(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let first = input.first().copied().unwrap_or(b' ');
    match first {
        b'#' => map(preceded(char('#'), map_opt(digit1, whole)), Token::Id).parse(input),
        b'\'' => text(input),
        b'.' if input.get(1).is_some_and(u8::is_ascii_digit) => number(input),
        b'.' => enumeration(input),
        b'0'..=b'9' | b'+' | b'-' => number(input),
        b'"' => map(delimited(char('"'), take_while(|c| c != b'"'), char('"')), |_| Token::Opaque)
            .parse(input),
        b'<' => map(delimited(char('<'), take_while(|c| c != b'>'), char('>')), |_| Token::Opaque)
            .parse(input),
        b'$' => value(Token::Missing, char('$')).parse(input),
        b'*' => value(Token::Derived, char('*')).parse(input),
        b'(' => value(Token::Open, char('(')).parse(input),
        b')' => value(Token::Close, char(')')).parse(input),
        b',' => value(Token::Comma, char(',')).parse(input),
        b'=' => value(Token::Equals, char('=')).parse(input),
        b';' => value(Token::Semicolon, char(';')).parse(input),
        b'&' => value(Token::Ampersand, char('&')).parse(input),
        _ => keyword(input),
    }
}

fn whole(digits: &[u8]) -> Option<u64> {
    std::str::from_utf8(digits).ok()?.parse().ok()
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

/// `'It''s'`: a doubled quote stays inside.
fn text(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let plain = take_while1(|c| c != b'\'');
    let inside = recognize(many0_count(alt((plain, tag("''")))));
    map(delimited(char('\''), inside, char('\'')), Token::Text).parse(input)
}

fn number(input: &[u8]) -> IResult<&[u8], Token<'_>> {
    let digits = || take_while(|c: u8| c.is_ascii_digit());
    let exponent = (one_of("eEdD"), opt(one_of("+-")), digit1);
    let fraction = pair(char('.'), digits());
    let shape = recognize((opt(one_of("+-")), digits(), opt(fraction), opt(exponent)));
    map_opt(shape, real).parse(input)
}

/// The value of a number's text; `None` when it is not finite (1E400) or holds no digit.
fn real(text: &[u8]) -> Option<Token<'static>> {
    let text = std::str::from_utf8(text).ok()?;
    if !text.contains(['.', 'e', 'E', 'd', 'D'])
        && let Ok(whole) = text.parse()
    {
        return Some(Token::Integer(whole));
    }
    let number: f64 = match text.parse() {
        Ok(number) => number,
        Err(_) => text.replace(['d', 'D'], "E").parse().ok()?,
    };
    number.is_finite().then_some(Token::Real(number))
}

/// A string's text with its escapes decoded: `''`, `\\`, `\X\hh`, `\X2\hhhh\X0\`, `\X4\hhhhhhhh\X0\`,
/// `\S\c`; bytes that are not UTF-8 are taken as ISO 8859-1. Line ends inside are dropped.
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
