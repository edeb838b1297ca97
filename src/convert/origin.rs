//! The part of a CAD model from which a tool was made, by the provenance in its file.

use super::select::{Chosen, SelectError, choose};
use kanagata_cad::Model;
use kanagata_cad::offset::{OffsetError, offset_model_again};
use kanagata_tool::file::Provenance;

/// The provenance of a tool does not apply to a CAD model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum OriginError {
    /// The choice of faces.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// The offset.
    #[error(transparent)]
    Offset(#[from] OffsetError),
}

/// The faces of `model` from which a tool was made, moved by its offset; `None`: all faces as they are.
///
/// # Errors
/// [`OriginError`] when the choice or the offset does not apply to this model.
pub fn origin(provenance: &Provenance, model: &Model) -> Result<Option<Chosen>, OriginError> {
    let chosen = provenance.selection.as_ref().map(|s| choose(model, s)).transpose()?;
    Ok(moved(provenance, model, chosen)?)
}

/// The chosen faces of `model` (`None`: all), moved by the offset that the provenance records.
///
/// # Errors
/// [`OffsetError`] with the face numbers of `model`.
pub fn moved(
    provenance: &Provenance,
    model: &Model,
    chosen: Option<Chosen>,
) -> Result<Option<Chosen>, OffsetError> {
    let Some(distance) = provenance.offset_mm else { return Ok(chosen) };
    let kept = || (0..model.faces.len()).collect();
    let (own, kept) = chosen.map_or_else(|| (None, kept()), |c| (Some(c.model), c.kept));
    let moved = offset_model_again(own.as_ref().unwrap_or(model), distance)
        .map_err(|e| e.renumbered(|f| kept[f]))?;
    Ok(Some(Chosen { model: moved, kept }))
}
