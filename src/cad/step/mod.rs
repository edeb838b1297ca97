//! STEP part 21 (AP203, AP214, AP242).
//!
//! Layers, from the text upwards: [`lexer`] (tokens) -> [`table`] (instances) -> [`entity`] (attributes by position) ->
//! [`resolver`] (points, placements, budget), [`units`], [`curve`] and [`form`], [`surface`] -> [`edge`], [`face`],
//! [`bounded`] (topology) -> [`items`] (solids, shells, sets) -> [`graph`], [`assembly`] and [`place`] (every placed
//! instance). [`styles`] and [`names`] say what else the file tells about items and products.

#![forbid(unsafe_code)]

mod assembly;
mod bounded;
mod curve;
mod edge;
mod entity;
mod face;
mod form;
mod graph;
#[cfg(test)]
mod habits;
mod items;
mod lexer;
mod loose;
mod names;
mod place;
mod relations;
mod resolver;
mod styles;
mod surface;
mod table;
#[cfg(test)]
mod tests;
mod units;

use rustc_hash::FxHashMap;

pub use self::loose::read_curves;

use self::resolver::Resolver;
use self::table::{Table, parse};
use super::raw::{LostFace, RawModel};
use super::{CadError, Diagnostic, Severity};

/// Parses the bytes of a STEP file; `name` is used in messages. Lengths of the result are in mm, angles in rad.
///
/// # Errors
/// [`CadError::Invalid`] with `#id` or line when the text cannot be repaired, for self-multiplying references, or when
/// no face of the file can be read.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<RawModel, CadError> {
    let table = parse(bytes, name)?;
    let resolver = Resolver::new(&table, bytes.len());
    let (writer, bytes) = (writer(&table), bytes.len());
    let mut model = RawModel { writer, unit_mm: 1.0, bytes, ..RawModel::default() };
    let mut counts: FxHashMap<_, usize> = FxHashMap::default();
    for e in resolver.entities() {
        *counts.entry(e.counted_as()).or_default() += 1;
    }
    model.entities = counts.into_iter().map(|(k, n)| (k.into_owned(), n)).collect();
    note_text_faults(&resolver);
    assembly::faces(&resolver, &mut model).map_err(|fault| fault.into_error(name))?;
    model.diagnostics = resolver.diagnostics.take();
    let is_loss = |d: &&Diagnostic| matches!(d.code, "entity-invalid" | "face-skipped");
    let lost = |d: &Diagnostic| LostFace { source: d.place.clone(), reason: d.text.clone() };
    model.lost = model.diagnostics.iter().filter(is_loss).map(lost).collect();
    let failed = model.diagnostics.iter().find(|d| d.code == "entity-invalid");
    if let (true, Some(first)) = (model.faces.is_empty(), failed) {
        return Err(CadError::Invalid {
            file: name.into(),
            place: first.place.clone(),
            found: format!("no face can be read; the first fault: {}", first.text),
            allowed: "at least one readable face".into(),
            remedy: "export the model again as AP214 or AP242 B-rep".into(),
        });
    }
    Ok(model)
}

fn note_text_faults(resolver: &Resolver) {
    if resolver.table.unfinished {
        let text = "the text ends before END-ISO-10303-21: incomplete file used".to_string();
        resolver.note(Severity::Warning, "file-unfinished", String::new(), text);
    }
    if let Some(first) = resolver.table.repeated.first() {
        let n = resolver.table.repeated.len();
        let text = format!("{n} ids are used twice: the first instance is used");
        resolver.note(Severity::Warning, "id-repeated", format!("#{first}"), text);
    }
}

/// Preprocessor and originating system of `FILE_NAME`.
fn writer(table: &Table) -> String {
    let Some(part) = table.header().iter().find(|p| p.keyword == "FILE_NAME") else {
        return String::new();
    };
    let values = table.values(part.values);
    let (preprocessor, system) = (units::header_text(values, 4), units::header_text(values, 5));
    [system, preprocessor]
        .into_iter()
        .filter(|s| !s.trim().is_empty())
        .collect::<Vec<_>>()
        .join("; ")
}
