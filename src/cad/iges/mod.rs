//! IGES 5.3, fixed ASCII form.
//!
//! Layers, from the file upwards: [`cards`] (columns and sections) -> [`global`] -> [`directory`] -> [`token`] and
//! [`params`] -> one file per group of entities ([`curves`], [`surface`], ..., [`trimming`], [`brep`]) -> [`structure`]
//! (displayed entities and their placement). [`attributes`] has their names, levels and colours.

#![forbid(unsafe_code)]

mod analytic;
mod attributes;
mod brep;
mod cards;
mod conic;
mod curves;
mod directory;
mod edges;
mod file;
mod found;
mod global;
pub(crate) mod join;
mod loose;
mod marks;
mod names;
mod offset;
mod ownership;
mod params;
mod reader;
mod splines;
mod status;
mod structure;
mod surface;
mod swept;
#[cfg(test)]
mod tests;
mod token;
mod trimming;
pub(crate) mod uv;

use std::collections::BTreeMap;

use self::file::{Fault, File};
use self::reader::Reader;
use super::raw::RawModel;
use super::{CadError, Diagnostic, Severity};
use kanagata_geometry::nurbs::Curve3;

/// Parses the bytes of an IGES file; `name` is used in messages. Lengths of the result are in mm, angles in rad.
///
/// Unusable entities are skipped and reported in the diagnostics.
///
/// # Errors
/// [`CadError::Invalid`] with line and card when the text cannot be repaired: no directory, no usable entity,
/// self-multiplying pointers.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<RawModel, CadError> {
    let file = File::open(bytes);
    if file.len() == 0 {
        return Err(no_directory(&file, name));
    }
    let reader = Reader::new(&file);
    let unit_mm = file.global.unit_mm;
    let found = reader.walk(unit_mm / file.global.scale).map_err(|f| invalid(name, f))?;
    // A file of curves alone is valid; a file that lost all its surfaces is not.
    if found.faces.is_empty()
        && let Some(fault) = found.first_fault
    {
        return Err(invalid(name, cut_off(&file).unwrap_or(fault)));
    }
    let mut diagnostics = whole_file(&file);
    diagnostics.extend(file.diagnostics());
    diagnostics.extend(names::unread_types(&file));
    let mut counts = BTreeMap::new();
    for entry in &file.directory.entries {
        *counts.entry((entry.kind, entry.form)).or_insert(0) += 1;
    }
    let named = |((kind, form), count)| (format!("{kind}:{form}"), count);
    let entities = counts.into_iter().map(named).collect();
    Ok(RawModel {
        unit: file.global.unit.clone(),
        unit_mm,
        writer: file.global.writer.clone(),
        resolution_mm: file.global.resolution * unit_mm / file.global.scale,
        entities,
        faces: found.faces,
        bodies: found.bodies,
        lost: found.lost,
        loose_curves: found.loose_curves,
        diagnostics,
        bytes: bytes.len(),
    })
}

/// Reads the displayed curves of an IGES file that no other entity uses [mm]; composites give their segments.
///
/// # Errors
/// [`CadError::Invalid`] as for [`read_bytes`], and for a curve that cannot be read.
pub fn read_curves(bytes: &[u8], name: &str) -> Result<Vec<Curve3>, CadError> {
    let file = File::open(bytes);
    if file.len() == 0 {
        return Err(no_directory(&file, name));
    }
    let scale = file.global.unit_mm / file.global.scale;
    Reader::new(&file).loose_curves(scale).map_err(|fault| invalid(name, fault))
}

fn invalid(name: &str, fault: Fault) -> CadError {
    CadError::Invalid {
        file: name.to_owned(),
        place: fault.place,
        found: fault.found,
        allowed: fault.allowed,
        remedy: "export the model again, as IGES 5.3 or STEP".to_owned(),
    }
}

/// The fault of a file that ends before its terminate section.
fn cut_off(file: &File<'_>) -> Option<Fault> {
    let cards = file.cards();
    let of_parameters = cards.parameter_cards.last().map(|c| ("parameter section (P)", c.line));
    let of_directory = cards.directory.last().map(|c| ("directory section (D)", c.line));
    let (section, line) = of_parameters.or(of_directory).filter(|_| !cards.terminated)?;
    let missing = if of_parameters.is_some() { "" } else { "no parameter section (P) and " };
    Some(Fault {
        code: "section-missing",
        place: format!("line {line}"),
        found: format!(
            "the file ends in its {section}, with no face that can be read: {missing}no terminate section (T) follow, it is cut off"
        ),
        allowed: "the sections S, G, D, P and T, whole".to_owned(),
    })
}

fn no_directory(file: &File<'_>, name: &str) -> CadError {
    let found = if file.cards().other_form {
        "the compressed or binary form of IGES"
    } else {
        "no directory section (cards with D in column 73)"
    };
    CadError::Invalid {
        file: name.to_owned(),
        place: "line 1".to_owned(),
        found: found.to_owned(),
        allowed: "the fixed ASCII form of IGES".to_owned(),
        remedy: "export the model as IGES 5.3 in ASCII, or as STEP".to_owned(),
    }
}

/// Diagnostics of the entire file.
fn whole_file(file: &File<'_>) -> Vec<Diagnostic> {
    let (cards, directory) = (file.cards(), &file.directory);
    let mut out: Vec<Diagnostic> = Vec::new();
    let mut say = |severity, code, text: String| {
        out.push(Diagnostic { severity, code, place: String::new(), text });
    };
    for (code, text) in &file.global.remarks {
        say(Severity::Warning, code, text.clone());
    }
    if cards.unlettered > 0 {
        let text = format!(
            "{} lines without a section letter (the first is line {}) were read as part of their section",
            cards.unlettered, cards.first_unlettered
        );
        say(Severity::Note, "card-unlettered", text);
    }
    if !cards.terminated {
        say(Severity::Note, "section-missing", "no terminate section (T)".to_owned());
    }
    if directory.renumbered {
        say(
            Severity::Note,
            "directory-renumbered",
            "directory sequence numbers are not 1, 3, 5, ...".to_owned(),
        );
    }
    if directory.relocated > 0 {
        let text = format!(
            "{} parameter pointers were wrong; the records were located by their sequence",
            directory.relocated
        );
        say(Severity::Note, "parameters-relocated", text);
    }
    if directory.unpaired > 0 {
        let text = format!("{} directory cards are unpaired and were ignored", directory.unpaired);
        say(Severity::Warning, "directory-unpaired", text);
    }
    out
}
