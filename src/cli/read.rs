//! Reads the CAD file of a command; warnings go to standard error.

use std::path::Path;

use super::exit::Failure;
use super::stages::progress;
use super::terminal::err;
use crate::cad::{Diagnostic, Model, Severity, usable};

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
    let _stage = progress().stage("read", "", 0);
    let (model, diagnostics) = crate::cad::read_with(path, crate::cad::Creases::Cut)?;
    warn(&diagnostics);
    for d in diagnostics.iter().filter(|d| d.code == "face-creased") {
        err!("note: {} {}: {}", d.code, d.place, d.text);
    }
    let skips = lost == LostFaces::Skip;
    usable::check(&model, &diagnostics, skips).map_err(|e| Failure::of_file(path, e))?;
    if !model.lost.is_empty() {
        let (count, all) = (model.lost.len(), model.lost.len() + model.faces.len());
        err!(
            "warning: {}: {count} of {all} faces are lost: {}; the result lacks them",
            path.display(),
            usable::list_of(&model.lost)
        );
    }
    if let Some(text) = model.open_joints_text() {
        err!("warning: {}: {text}; repair the CAD there", path.display());
    }
    Ok(model)
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
