//! Names of entity types that are counted but contain no supported geometry.

use std::collections::BTreeMap;

use super::curves::CURVES;
use super::file::File;
use super::surface::SURFACES;
use crate::{Diagnostic, Severity};

/// Entity types that are read.
const READ: [u32; 22] = [
    314, 406, 116, 123, 124, 141, 142, 143, 144, 184, 186, 308, 402, 408, 430, 502, 504, 508, 510,
    514, 0, 106,
];

/// One diagnostic for each type that is not read, with name and number.
pub(super) fn unread_types(file: &File<'_>) -> Vec<Diagnostic> {
    let mut counts: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for (index, entry) in file.directory.entries.iter().enumerate() {
        let read = READ.contains(&entry.kind)
            || CURVES.contains(&entry.kind)
            || SURFACES.contains(&entry.kind);
        if !read {
            counts.entry(entry.kind).or_insert((0, index)).0 += 1;
        }
    }
    let diagnostics = counts.into_iter().map(|(kind, (count, first))| {
        let (name, shape) = name(kind);
        let severity = if shape { Severity::Warning } else { Severity::Note };
        let text = format!(
            "{count} of entity {kind} ({name}) ignored: not a supported surface or curve type"
        );
        Diagnostic { severity, code: "entity-skipped", place: file.place(first, None), text }
    });
    diagnostics.collect()
}

/// Name of an entity type, and whether it carries shape that is lost.
fn name(kind: u32) -> (&'static str, bool) {
    match kind {
        125 => ("flash", false),
        132 => ("connect point", false),
        134 | 136 | 138 | 146 | 148 => ("finite elements", false),
        150 | 152 | 154 | 156 | 158 | 160 | 162 | 164 | 168 => ("solid primitive", true),
        180 => ("Boolean tree", true),
        182 => ("selected component", true),
        202..=230 => ("annotation", false),
        302 => ("associativity definition", false),
        304 => ("line font", false),
        306 => ("macro", false),
        310 | 312 | 314 | 316 | 320 | 322 => {
            ("definition of fonts, colours, units or attributes", false)
        }
        404 | 410 => ("drawing or view", false),
        406 => ("property", false),
        412 | 414 => ("array of subfigures", true),
        416 => ("reference to another file", true),
        418 | 420 => ("network", false),
        422 => ("attribute table", false),
        600..=699 | 10000.. => ("macro or private entity", true),
        _ => ("unknown", true),
    }
}
