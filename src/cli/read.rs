//! Reads the CAD file of a command, with warnings to standard error.

use std::path::Path;

use super::exit::Failure;
use super::say::err;
use crate::cad::raw::LostFace;
use crate::cad::{Diagnostic, Model, Severity};

/// What to do with faces of the file that are lost: they cannot be read or enclose no area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LostFaces {
    /// The file is refused, the faces are named.
    Refuse,
    /// The model lacks them; a warning names them.
    LeaveOut,
}

/// Reads a CAD file that must have faces for a tool model: cut at creases. Warnings and cuts go to standard error.
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
        let said =
            format!("{}: {count} of {all} faces are lost: {}", path.display(), named(&model.lost));
        if lost == LostFaces::Refuse {
            return Err(Failure::input(format!(
                "{said}; allowed: none; repair them in the CAD and export again, or continue without them with --skip-bad-faces"
            )));
        }
        err!("warning: {said}; the result lacks them");
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

/// Lost faces with the reason, the first few of them.
fn named(lost: &[LostFace]) -> String {
    const MOST: usize = 10;
    let one = |f: &LostFace| format!("{} ({})", f.source, f.reason);
    let more =
        if lost.len() > MOST { format!(", and {} more", lost.len() - MOST) } else { String::new() };
    lost.iter().take(MOST).map(one).collect::<Vec<_>>().join(", ") + &more
}

/// Where faces lie on each other by the hundred no tool is meant, and every step after this one would compare all with all.
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

/// A tool of a guessed size is worse than none.
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
    const MOST: usize = 10;
    let warnings: Vec<_> = diagnostics.iter().filter(|d| d.severity == Severity::Warning).collect();
    for d in warnings.iter().take(MOST) {
        err!("warning: {} {}: {}", d.code, d.place, d.text);
    }
    if warnings.len() > MOST {
        err!("warning: and {} more; `kanagata inspect` lists them", warnings.len() - MOST);
    }
}
