//! Whether a model that was read can become a tool: unit, overlap, faces.

use super::diagnostic::Diagnostic;
use super::model::Model;
use super::raw::LostFace;

/// Why a model cannot become a tool as it is.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unusable {
    /// The size of the tool would be a guess.
    #[error(
        "{place}: {found}; allowed: one unit that flag and name agree on; correct the unit in the file (IGES: fields 14 and 15 of the global section)"
    )]
    Unit {
        /// Where in the file.
        place: String,
        /// What was found.
        found: String,
    },
    /// Hundreds of faces overlap: not a tool, and later steps would compare all with all.
    #[error(
        "{found}; allowed: faces that meet in edges; remove the duplicates in the CAD and export it again"
    )]
    Overlap {
        /// What was found.
        found: String,
    },
    /// No faces.
    #[error(
        "no faces (entities: {entities}); allowed: at least one surface; export the die as surfaces or as a solid"
    )]
    NoFaces {
        /// Kinds of entities and their numbers.
        entities: String,
    },
    /// Faces that cannot be read or have no area.
    #[error(
        "{count} of {all} faces are lost: {list}; allowed: none; repair them in the CAD and export again, or leave them out"
    )]
    LostFaces {
        /// Number of lost faces.
        count: usize,
        /// Number of faces in the file.
        all: usize,
        /// The first of them, with reasons.
        list: String,
    },
}

/// Whether a model can become a tool, with `skip_lost` also without its lost faces.
///
/// # Errors
/// [`Unusable`], the first of unit, overlap, lost faces and no faces.
pub fn check(model: &Model, diagnostics: &[Diagnostic], skip_lost: bool) -> Result<(), Unusable> {
    let found = |codes: &[&str]| diagnostics.iter().find(|d| codes.contains(&d.code));
    if let Some(d) = found(&["unit-unknown", "unit-conflict", "unit-missing"]) {
        let place = if d.place.is_empty() { "global section".into() } else { d.place.clone() };
        return Err(Unusable::Unit { place, found: d.text.clone() });
    }
    if let Some(d) = found(&["faces-overlap"]) {
        return Err(Unusable::Overlap { found: d.text.clone() });
    }
    if !skip_lost && !model.lost.is_empty() {
        let (count, all) = (model.lost.len(), model.lost.len() + model.faces.len());
        return Err(Unusable::LostFaces { count, all, list: list_of(&model.lost) });
    }
    if model.faces.is_empty() {
        let kinds: Vec<String> = model.entities.iter().map(|(k, n)| format!("{n} x {k}")).collect();
        let entities = if kinds.is_empty() { "none".into() } else { kinds.join(", ") };
        return Err(Unusable::NoFaces { entities });
    }
    Ok(())
}

/// The first lost faces with their reasons.
#[must_use]
pub fn list_of(lost: &[LostFace]) -> String {
    const LISTED_MAX: usize = 10;
    let one = |f: &LostFace| format!("{} ({})", f.source, f.reason);
    let more = if lost.len() > LISTED_MAX {
        format!(", and {} more", lost.len() - LISTED_MAX)
    } else {
        String::new()
    };
    lost.iter().take(LISTED_MAX).map(one).collect::<Vec<_>>().join(", ") + &more
}
