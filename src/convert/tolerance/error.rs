//! Why there is no model within the tolerance.

use crate::audit::AuditError;
use crate::convert::ConvertError;
use crate::mesh::MeshError;

/// Why there is no model within the tolerance.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ToleranceError {
    /// A tolerance that is no positive number, or none at all.
    #[error("{what} is {found}; allowed: a number above zero")]
    Goal {
        /// Its field of the goal.
        what: &'static str,
        /// What was given.
        found: f64,
    },
    /// The tolerance was not reached.
    #[error(
        "{source_entity} (face {face}) still has {found:.3e} {unit}{near} with {patches} patches; asked: {allowed:.3e}{}; allow more, or repair the face in the CAD", spent_said(*.spent)
    )]
    NotReached {
        /// Face with the largest error.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
        /// Error found.
        found: f64,
        /// Where it is, as ` near (x, y, z) mm`; empty where that is not known.
        near: String,
        /// Error allowed.
        allowed: f64,
        /// Unit and kind of the error.
        unit: &'static str,
        /// Patches of the best model found.
        patches: usize,
        /// Patches judged, where the search ended because they were as many as it may judge.
        spent: Option<u64>,
    },
    /// A face of which no patches come out sound.
    #[error(
        "{source_entity} (face {face}): its patches fold or cannot be made, even with its border divided ten times as finely; repair the face in the CAD, or convert a mesh of fixed divisions and allow folds to see where"
    )]
    NoPatches {
        /// The face.
        face: usize,
        /// Its entity in the CAD file.
        source_entity: String,
    },
    /// Faces divided independently whose borders do not meet.
    #[error(
        "borders of faces divided independently are {found:.3e} mm apart at ({:.3}, {:.3}, {:.3}) mm; allowed: {allowed:.3e}; use conforming borders", at[0], at[1], at[2]
    )]
    Apart {
        /// Gap found [mm].
        found: f64,
        /// Gap allowed [mm].
        allowed: f64,
        /// Where it is [mm].
        at: [f64; 3],
    },
    /// So few patches are not possible.
    #[error("the coarsest model has {least} patches; allowed: at least so many")]
    TooFew {
        /// Patches of the coarsest model.
        least: usize,
    },
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// No audit.
    #[error(transparent)]
    Audit(#[from] AuditError),
}

fn spent_said(spent: Option<u64>) -> String {
    spent.map_or_else(String::new, |n| {
        format!("; the search ended at its work limit, after {n} patches were judged")
    })
}
