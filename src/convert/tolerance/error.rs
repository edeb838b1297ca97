//! Errors of a refinement to a tolerance.

use super::goal::Refined;
use crate::ConvertError;
use kanagata_audit::AuditError;
use kanagata_mesh::MeshError;

/// Reason why there is no model within the tolerance.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ToleranceError {
    /// A tolerance is not a positive number.
    #[error("{what} is {found}; allowed: a number above zero")]
    Goal {
        /// Field of the goal.
        what: &'static str,
        /// Its value.
        found: f64,
    },
    /// The tolerance was not reached.
    #[error(
        "{source_entity} (face {face}) still has {found:.3e} {unit}{near} with {patches} patches; asked: {allowed:.3e}{}; allow more, or repair the face in the CAD", work_limit_text(*.spent)
    )]
    NotReached {
        /// Face with the largest ratio of error to tolerance.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Error of this face.
        found: f64,
        /// Position of the error as ` near (x, y, z) mm`; empty if unknown.
        near: String,
        /// Allowed error.
        allowed: f64,
        /// Unit and kind of the error.
        unit: &'static str,
        /// Number of patches of the model with this error.
        patches: usize,
        /// Number of patches evaluated, if the search ended at its work limit.
        spent: Option<u64>,
    },
    /// The tolerance was not reached; `model` has the smallest error of the models found, and no folds.
    #[error("{why}")]
    Above {
        /// The model, with its complete audit.
        model: Box<Refined>,
        /// [`ToleranceError::NotReached`] or [`ToleranceError::NoPatches`].
        why: Box<ToleranceError>,
    },
    /// No valid patches were found for a face.
    #[error(
        "{source_entity} (face {face}): its patches fold or cannot be made, even with its border divided ten times as finely; repair the face in the CAD, or convert a mesh of fixed divisions and allow folds to see where"
    )]
    NoPatches {
        /// The face.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// The face alone has valid patches; those of the complete model fold.
        alone: bool,
    },
    /// Gap between the borders of independently divided faces.
    #[error(
        "borders of faces divided independently are {found:.3e} mm apart at ({:.3}, {:.3}, {:.3}) mm; allowed: {allowed:.3e}; use conforming borders", at[0], at[1], at[2]
    )]
    Apart {
        /// Largest gap [mm].
        found: f64,
        /// Allowed gap [mm].
        allowed: f64,
        /// Position of the gap [mm].
        at: [f64; 3],
    },
    /// The requested number of patches is too small.
    #[error("the coarsest model has {least} patches; allowed: at least this number")]
    TooFew {
        /// Number of patches of the coarsest model.
        least: usize,
    },
    /// Meshing failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Conversion failed.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// The audit failed.
    #[error(transparent)]
    Audit(#[from] AuditError),
}

/// Text on the work limit, if it ended the search.
fn work_limit_text(spent: Option<u64>) -> String {
    spent.map_or_else(String::new, |n| {
        format!("; the search ended at its work limit, after {n} patches were evaluated")
    })
}
