//! Reads the CAD file of a command; warnings go to standard error.

use std::path::Path;

use super::exit::Failure;
use super::terminal::err;
use crate::cad::raw::LostFace;
use crate::cad::{Diagnostic, Model, Severity};

/// Treatment of lost faces, which cannot be read or have no area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LostFaces {
    /// The file is refused with a list of the faces.
    Refuse,
    /// The model lacks them; a warning lists them.
    Skip,
}

/// Reads a CAD file with faces for a tool model, split at creases. Warnings and splits go to standard error.
pub(super) fn read_model(path: &Path, lost: LostFaces) -> Result<Model, Failure> {
    let (model, diagnostics) = crate::cad::read_with(path, crate::cad::Creases::Cut)?;
    warn(&diagnostics);
    for d in diagnostics.iter().filter(|d| d.code == "face-creased") {
        err!("note: {} {}: {}", d.code, d.place, d.text);
    }
    refuse_guessed_units(path, &diagnostics)?;
    refuse_unjoined(path, &diagnostics)?;
    if !model.lost.is_empty() {
        let (count, all) = (model.lost.len(), model.lost.len() + model.faces.len());
        let message = format!(
            "{}: {count} of {all} faces are lost: {}",
            path.display(),
            list_of(&model.lost)
        );
        if lost == LostFaces::Refuse {
            return Err(Failure::input(format!(
                "{message}; allowed: none; repair them in the CAD and export again, or continue without them with --skip-bad-faces"
            )));
        }
        err!("warning: {message}; the result lacks them");
    }
    if model.faces.is_empty() {
        let kinds: Vec<String> = model.entities.iter().map(|(k, n)| format!("{n} x {k}")).collect();
        return Err(Failure::input(format!(
            "{}: no faces (entities: {}); allowed: at least one surface; export the die as surfaces or as a solid",
            path.display(),
            if kinds.is_empty() { "none".into() } else { kinds.join(", ") }
        )));
    }
    Ok(model)
}

/// The first lost faces with their reasons.
fn list_of(lost: &[LostFace]) -> String {
    const LISTED_MAX: usize = 10;
    let one = |f: &LostFace| format!("{} ({})", f.source, f.reason);
    let more = if lost.len() > LISTED_MAX {
        format!(", and {} more", lost.len() - LISTED_MAX)
    } else {
        String::new()
    };
    lost.iter().take(LISTED_MAX).map(one).collect::<Vec<_>>().join(", ") + &more
}

/// Refuses files with hundreds of overlapping faces. They are not tools, and later steps would compare all with all.
fn refuse_unjoined(path: &Path, diagnostics: &[Diagnostic]) -> Result<(), Failure> {
    let Some(found) = diagnostics.iter().find(|d| d.code == "faces-overlap") else {
        return Ok(());
    };
    Err(Failure::input(format!(
        "{}: {}; allowed: faces that meet in edges; remove the duplicates in the CAD and export it again (`kanagata inspect --health` names them)",
        path.display(),
        found.text
    )))
}

/// Refuses files with an unknown unit: the size of the tool would be a guess.
fn refuse_guessed_units(path: &Path, diagnostics: &[Diagnostic]) -> Result<(), Failure> {
    let guessed = diagnostics
        .iter()
        .find(|d| matches!(d.code, "unit-unknown" | "unit-conflict" | "unit-missing"));
    match guessed {
        Some(d) => Err(Failure::input(format!(
            "{}, {}: {}; allowed: one unit that flag and name agree on; the size of the tool would be a guess: \
             correct the unit in the file (IGES: fields 14 and 15 of the global section) and convert again",
            path.display(),
            if d.place.is_empty() { "global section" } else { &d.place },
            d.text
        ))),
        None => Ok(()),
    }
}

fn warn(diagnostics: &[Diagnostic]) {
    const LISTED_MAX: usize = 10;
    let warnings: Vec<_> = diagnostics.iter().filter(|d| d.severity == Severity::Warning).collect();
    for d in warnings.iter().take(LISTED_MAX) {
        err!("warning: {} {}: {}", d.code, d.place, d.text);
    }
    if warnings.len() > LISTED_MAX {
        err!("warning: and {} more; `kanagata inspect` lists them", warnings.len() - LISTED_MAX);
    }
}
