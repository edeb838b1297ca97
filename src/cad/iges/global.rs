//! The global section: delimiters, writer, unit, scale, resolution.

use super::token::{Delimiters, Token, integer, real, token};

/// Contents of the global section, with defaults.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Global {
    /// Delimiters, also of the parameter section.
    pub delimiters: Delimiters,
    /// Sending system and preprocessor.
    pub writer: String,
    /// Name of the unit in the file.
    pub unit: String,
    /// Millimetres in one unit.
    pub unit_mm: f64,
    /// Ratio of model space to real world.
    pub scale: f64,
    /// Smallest significant distance, in units.
    pub resolution: f64,
    /// Irregularities, as (code, text).
    pub remarks: Vec<(&'static str, String)>,
}

/// Unit flags 1 to 11 of field 14: name, millimetres. Flag 3 refers to the name.
const UNITS: [(&str, f64); 11] = [
    ("INCH", 25.4),
    ("MM", 1.0),
    ("", 0.0),
    ("FT", 304.8),
    ("MI", 1_609_344.0),
    ("M", 1000.0),
    ("KM", 1_000_000.0),
    ("MIL", 0.0254),
    ("UM", 0.001),
    ("CM", 10.0),
    ("UIN", 0.000_025_4),
];

/// Parses the text of the global section (72 columns per card).
pub(super) fn parse(text: &[u8]) -> Global {
    let (delimiters, fields) = fields(text);
    let fields = realigned(fields);
    let mut remarks = Vec::new();
    let real_at = |i: usize| match fields.get(i) {
        Some(Token::Word(word)) => real(word),
        _ => None,
    };
    let (unit, unit_mm) = unit(&fields, &mut remarks);
    let scale = real_at(12).unwrap_or(1.0);
    let scale = if scale > 0.0 {
        scale
    } else {
        remarks.push((
            "scale-ignored",
            format!("model space scale {scale} is not positive; 1 is used"),
        ));
        1.0
    };
    let writer = [4, 5]
        .iter()
        .map(|i| text_of(fields.get(*i)))
        .filter(|t| !t.is_empty())
        .collect::<Vec<_>>();
    Global {
        delimiters,
        writer: writer.join("; "),
        unit,
        unit_mm,
        scale,
        resolution: real_at(18).filter(|r| *r > 0.0).unwrap_or(0.0),
        remarks,
    }
}

/// Splits the section into fields; the first two define the delimiters.
fn fields(text: &[u8]) -> (Delimiters, Vec<Token<'_>>) {
    let mut delimiters = Delimiters::default();
    let text = text.trim_ascii_start();
    let mut rest = text;
    if let Some((byte, tail)) = delimiter(text) {
        delimiters.parameter = byte;
        rest = tail.trim_ascii_start().strip_prefix(&[byte]).unwrap_or(tail);
    } else {
        rest = rest.strip_prefix(&[delimiters.parameter]).unwrap_or(rest);
    }
    if let Some((byte, tail)) = delimiter(rest.trim_ascii_start()) {
        delimiters.record = byte;
        rest = tail;
    }
    let mut fields = vec![Token::Blank, Token::Blank];
    if let Some(tail) = rest.trim_ascii_start().strip_prefix(&[delimiters.parameter]) {
        rest = tail;
    }
    loop {
        let (after, found) = token(rest, delimiters);
        fields.push(found);
        match after.split_first() {
            Some((byte, tail)) if *byte == delimiters.parameter => rest = tail,
            _ => return (delimiters, fields),
        }
    }
}

/// Parses `1Hc` at the start of `text`: the character and the remaining text.
fn delimiter(text: &[u8]) -> Option<(u8, &[u8])> {
    match text {
        [b'1', b'H' | b'h', byte, rest @ ..] if !byte.is_ascii_alphanumeric() => {
            Some((*byte, rest))
        }
        _ => None,
    }
}

/// Realigns the fields after a wrong Hollerith count removed or created a delimiter. Field 14, the unit flag, is the
/// integer between a real (13) and a string (15).
fn realigned(mut fields: Vec<Token<'_>>) -> Vec<Token<'_>> {
    let fits = |fields: &[Token<'_>], shift: isize| {
        let at = |i: isize| usize::try_from(i + shift).ok().and_then(|i| fields.get(i));
        let flag = match at(13) {
            Some(Token::Word(w)) => integer(w).is_some_and(|n| (1..=11).contains(&n)),
            _ => false,
        };
        let name = matches!(at(14), Some(Token::Text(t)) if by_name(t).is_some());
        let scale = matches!(at(12), Some(Token::Word(w)) if real(w).is_some_and(|s| s > 0.0));
        flag && name && scale
    };
    if fits(&fields, 0) {
        return fields;
    }
    for shift in [-1isize, -2, -3, 1, 2, 3] {
        if fits(&fields, shift) {
            if shift < 0 {
                for _ in 0..-shift {
                    fields.insert(2, Token::Blank);
                }
            } else {
                fields.drain(2..2 + shift.unsigned_abs());
            }
            return fields;
        }
    }
    fields
}

fn unit(fields: &[Token<'_>], remarks: &mut Vec<(&'static str, String)>) -> (String, f64) {
    let flag = match fields.get(13) {
        Some(Token::Word(word)) => integer(word),
        _ => None,
    };
    let name = text_of(fields.get(14));
    let named = by_name(name.as_bytes());
    let flagged = flag
        .and_then(|n| usize::try_from(n - 1).ok())
        .and_then(|i| UNITS.get(i))
        .filter(|(name, _)| !name.is_empty());
    match (flagged, named) {
        (Some((_, mm)), named) => {
            if let Some(other) = named
                && (other - mm).abs() > 1e-12 * mm
            {
                remarks.push((
                    "unit-conflict",
                    format!(
                        "unit flag {} and unit name {name} differ; the flag is used",
                        flag.unwrap_or(0)
                    ),
                ));
            }
            let unit_name = flagged.map_or("", |(n, _)| n);
            (if named == Some(*mm) { name } else { unit_name.to_owned() }, *mm)
        }
        (None, Some(mm)) => (name, mm),
        (None, None) => {
            if flag.is_some() || !name.is_empty() {
                remarks.push(("unit-unknown", unknown_unit(flag, &name)));
            }
            ("INCH".to_owned(), 25.4)
        }
    }
}

/// Message: the unit is unknown and inch is used.
fn unknown_unit(flag: Option<i64>, name: &str) -> String {
    format!(
        "unit flag {} with name \"{name}\" is not an IGES unit; the default, inch, is used",
        flag.map_or_else(|| "blank".to_owned(), |n| n.to_string())
    )
}

/// Millimetres of a unit given by name.
fn by_name(name: &[u8]) -> Option<f64> {
    let name = name.trim_ascii().to_ascii_uppercase();
    Some(match name.as_slice() {
        b"IN" | b"INCH" | b"INCHES" | b"\"" => 25.4,
        b"MM" | b"MILLIMETER" | b"MILLIMETRE" | b"MILLIMETERS" | b"MILLIMETRES" => 1.0,
        b"FT" | b"FOOT" | b"FEET" => 304.8,
        b"MI" | b"MILE" | b"MILES" => 1_609_344.0,
        b"M" | b"METER" | b"METRE" | b"METERS" | b"METRES" => 1000.0,
        b"KM" | b"KILOMETER" | b"KILOMETRE" => 1_000_000.0,
        b"MIL" | b"MILS" => 0.0254,
        b"UM" | b"MICRON" | b"MICRONS" | b"MICROMETER" | b"MICROMETRE" => 0.001,
        b"CM" | b"CENTIMETER" | b"CENTIMETRE" => 10.0,
        b"UIN" | b"MICROINCH" => 0.000_025_4,
        _ => return None,
    })
}

fn text_of(token: Option<&Token<'_>>) -> String {
    match token {
        Some(Token::Text(text) | Token::Word(text)) => {
            String::from_utf8_lossy(text).trim().to_owned()
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: &str = "4HSYST,3HPRE,32,38,6,308,15,3HREC";

    #[test]
    fn units_by_flag_and_name_with_any_delimiters() {
        let table: [(&str, &str, f64, &[&str]); 12] = [
            ("2,2HMM", "MM", 1.0, &[]),
            ("1,4HINCH", "INCH", 25.4, &[]),
            ("6,1HM", "M", 1000.0, &[]),
            ("10,2HCM", "CM", 10.0, &[]),
            ("8,3HMIL", "MIL", 0.0254, &[]),
            ("3,2HFT", "FT", 304.8, &[]),
            ("3,2HXX", "INCH", 25.4, &["unit-unknown"]),
            (",2HMM", "MM", 1.0, &[]),
            (",", "INCH", 25.4, &[]),
            ("6,", "M", 1000.0, &[]),
            ("6,2HMM", "M", 1000.0, &["unit-conflict"]),
            ("77,2HCM", "CM", 10.0, &[]),
        ];
        for (fields, unit, mm, codes) in table {
            let heads: [(&str, u8, u8); 4] = [
                ("1H,,1H;,", b',', b';'),
                (",,", b',', b';'),
                (",1H;,", b',', b';'),
                ("1H/,1H#,", b'/', b'#'),
            ];
            for (head, parameter, record) in heads {
                let text = format!("3HABC,5Ha.igs,{REST},1.,{fields},1,0.5,5H20260,0.01,9.,;");
                let text =
                    if parameter == b'/' { text.replace(',', "/").replace(';', "#") } else { text };
                let head = if parameter == b'/' { "1H//1H#/" } else { head };
                let global = parse(format!("{head}{text}").as_bytes());
                assert_eq!(global.delimiters, Delimiters { parameter, record }, "{head}{text}");
                assert_eq!((global.unit.as_str(), global.unit_mm), (unit, mm), "{head}{text}");
                let found: Vec<_> = global.remarks.iter().map(|r| r.0).collect();
                assert_eq!(found, codes, "{head}{text}");
                assert_eq!((global.resolution, global.writer.as_str()), (0.01, "SYST; PRE"));
            }
        }
    }

    #[test]
    fn a_wrong_count_before_the_unit_does_not_shift_it() {
        for name in ["9Ha.igs", "2Ha.igs", "14Ha.igs"] {
            let global =
                parse(format!(",,3HABC,{name},{REST},1.,6,1HM,1,0.5,5H20260,0.01;").as_bytes());
            assert_eq!((global.unit_mm, global.resolution), (1000.0, 0.01), "{name}");
        }
    }

    #[test]
    fn scale_must_be_positive() {
        let of = |scale: &str| parse(format!(",,3HABC,5Ha.igs,{REST},{scale},2,2HMM;").as_bytes());
        assert_eq!((of("0.5").scale, of("").scale), (0.5, 1.0));
        assert_eq!((of("-2.").scale, of("-2.").remarks[0].0), (1.0, "scale-ignored"));
    }
}
