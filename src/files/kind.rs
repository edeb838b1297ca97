//! What a file is, by its first bytes: a file of another kind than expected is named in the error.

use std::fmt;
use std::path::PathBuf;

/// Number of bytes that are looked at.
const HEAD_BYTES: usize = 4096;

/// A kind of file that its first bytes tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// STEP (ISO 10303-21).
    Step,
    /// IGES with fixed-length records.
    Iges,
    /// A mesh: gmsh, VTK, Abaqus or STL.
    Mesh,
    /// `kanagata-scene`.
    Scene,
    /// `kanagata-tool`.
    Tool,
    /// `kanagata-study`, `kanagata-stability` or `kanagata-patches`.
    Study,
    /// `run.json` of a run.
    Run,
    /// `case.json` of a study.
    Case,
    /// The report of an audit.
    Audit,
    /// gzip or zip.
    Compressed,
    /// HTML.
    Page,
    /// No bytes.
    Empty,
    /// Bytes that are no text.
    Binary,
}

/// Values of the key `format` of JSON files.
const FORMATS: [(&str, FileKind); 8] = [
    ("kanagata-scene", FileKind::Scene),
    ("kanagata-tool", FileKind::Tool),
    ("kanagata-study", FileKind::Study),
    ("kanagata-stability", FileKind::Study),
    ("kanagata-patches", FileKind::Study),
    ("kanagata-run", FileKind::Run),
    ("kanagata-case", FileKind::Case),
    ("kanagata-audit", FileKind::Audit),
];

/// First bytes of files.
const STARTS: [(&[u8], FileKind); 10] = [
    (&[0x1f, 0x8b], FileKind::Compressed),
    (b"PK\x03\x04", FileKind::Compressed),
    (b"$MeshFormat", FileKind::Mesh),
    (b"# vtk DataFile", FileKind::Mesh),
    (b"*Heading", FileKind::Mesh),
    (b"*HEADING", FileKind::Mesh),
    (b"*NODE", FileKind::Mesh),
    (b"*Node", FileKind::Mesh),
    (b"<!DOCTYPE html", FileKind::Page),
    (b"<html", FileKind::Page),
];

impl FileKind {
    /// The kind of a file with these bytes; `None` for text that is of no known kind.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.is_empty() {
            return Some(Self::Empty);
        }
        let head = &bytes[..bytes.len().min(HEAD_BYTES)];
        let has = |what: &[u8]| head.windows(what.len()).any(|w| w == what);
        let text = head.trim_ascii_start();
        let started = STARTS.iter().find(|(start, _)| text.starts_with(start)).map(|(_, k)| *k);
        let json = || if text.starts_with(b"{") { json_kind(head) } else { None };
        if let Some(kind) = started.or_else(json) {
            return Some(kind);
        }
        if has(b"ISO-10303-21") {
            return Some(Self::Step);
        }
        if has_iges_cards(head) {
            return Some(Self::Iges);
        }
        if has(b"<VTKFile") || text.starts_with(b"solid ") && has(b"facet normal") {
            return Some(Self::Mesh);
        }
        let is_text = |b: &u8| !b.is_ascii_control() || b.is_ascii_whitespace();
        (!head.iter().all(is_text)).then_some(Self::Binary)
    }

    /// An error for a file of another kind than `expected`; `None` if the bytes are of that kind, or of no known one.
    #[must_use]
    pub fn other_than(expected: Self, bytes: &[u8], path: PathBuf) -> Option<WrongKind> {
        let found = Self::of(bytes).filter(|found| *found != expected)?;
        Some(WrongKind { path, found, expected })
    }
}

/// Whether a line has the letter of a start or global section in column 73. Records may stand without line ends. In text
/// that begins as JSON a sequence number must follow the letter.
fn has_iges_cards(head: &[u8]) -> bool {
    let is_json = head.trim_ascii_start().starts_with(b"{");
    let numbered = |line: &[u8]| {
        let number = line.get(73..80).unwrap_or_default().trim_ascii();
        !number.is_empty() && number.iter().all(u8::is_ascii_digit)
    };
    let is_card = |line: &[u8], letters: &[u8]| {
        line.get(72).is_some_and(|c| letters.contains(c)) && (!is_json || numbered(line))
    };
    is_card(head, b"S") || head.split(|b| *b == b'\n').any(|line| is_card(line, b"SG"))
}

/// The kind that the value of the first key `format` names.
fn json_kind(head: &[u8]) -> Option<FileKind> {
    let head = String::from_utf8_lossy(head);
    let after = head.split_once("\"format\"")?.1.trim_start().strip_prefix(':')?;
    let value = after.trim_start().strip_prefix('"')?.split('"').next()?;
    FORMATS.iter().find(|(name, _)| *name == value).map(|(_, kind)| *kind)
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Step => "a STEP file",
            Self::Iges => "an IGES file",
            Self::Mesh => "a mesh file",
            Self::Scene => "a scene",
            Self::Tool => "a tool file",
            Self::Study => "a study",
            Self::Run => "the record of a run",
            Self::Case => "a case of a study",
            Self::Audit => "the report of an audit",
            Self::Compressed => "a compressed file (gzip or zip), to be unpacked first",
            Self::Page => "an HTML page",
            Self::Empty => "an empty file",
            Self::Binary => "bytes that are no text",
        })
    }
}

/// A file of another kind than expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: found {found}; allowed: {expected}", path.display())]
pub struct WrongKind {
    /// The file.
    pub path: PathBuf,
    /// What it is.
    pub found: FileKind,
    /// What was expected.
    pub expected: FileKind,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_first_bytes() {
        let card = format!("{:72}S      1\n{:72}G      1\n", "start", "1H,,1H;");
        let of = |text: &str| FileKind::of(text.as_bytes());
        assert_eq!(of("ISO-10303-21;\nHEADER;"), Some(FileKind::Step));
        assert_eq!(of(&card), Some(FileKind::Iges));
        assert_eq!(of(&format!("\n{card}")), Some(FileKind::Iges));
        assert_eq!(
            of("\n { \"_comment\": 1, \"format\" : \"kanagata-scene\" }"),
            Some(FileKind::Scene)
        );
        assert_eq!(of("{\"format\":\"kanagata-tool\",\"version\":1}"), Some(FileKind::Tool));
        assert_eq!(of("{\"format\":\"kanagata-patches\"}"), Some(FileKind::Study));
        assert_eq!(of("<?xml version=\"1.0\"?>\n<VTKFile type=\"U\">"), Some(FileKind::Mesh));
        assert_eq!(of("solid a\n facet normal 0 0 1"), Some(FileKind::Mesh));
        assert_eq!(of("$MeshFormat\n4.1 0 8"), Some(FileKind::Mesh));
        assert_eq!(of("<!DOCTYPE html>"), Some(FileKind::Page));
        assert_eq!((of(""), of("{}"), of("solid ground")), (Some(FileKind::Empty), None, None));
        assert_eq!(of("{\"format\":\"other\"}"), None);
        // A letter in column 73 makes no IGES file of a JSON text; a card does.
        assert_eq!(of(&format!("{{\n{:72}S is a letter\n}}", "")), None);
        assert_eq!(of(&format!("{:72}S      1\n", "{")), Some(FileKind::Iges));
        assert_eq!(FileKind::of(&[0x1f, 0x8b, 8]), Some(FileKind::Compressed));
        assert_eq!(FileKind::of(&[1, 2, 3]), Some(FileKind::Binary));
    }

    #[test]
    fn only_other_kinds_are_errors() {
        let of = |text: &str| {
            let found = FileKind::other_than(FileKind::Scene, text.as_bytes(), "a.stp".into());
            found.map(|wrong| wrong.to_string())
        };
        assert_eq!(of("ISO-10303-21;").unwrap(), "a.stp: found a STEP file; allowed: a scene");
        assert_eq!((of("{\"format\":\"kanagata-scene\"}"), of("{ \"a\": ")), (None, None));
    }
}
