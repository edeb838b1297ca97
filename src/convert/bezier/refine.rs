//! Bezier patches within a tolerance.

use super::{BezierOptions, BezierReport, bezier_from_cad};
use crate::cad::Model;
use crate::convert::ConvertError;
use crate::mesh::{MeshError, SurfaceMesh};
use crate::tool::ToolModel;

/// Most divisions of a quarter turn that [`within_tolerance`] is asked for.
pub const FINEST: usize = 64;

/// Bezier patches within a tolerance, and the divisions of a quarter turn they took.
#[derive(Debug, Clone)]
pub struct Within {
    /// The model.
    pub tool: ToolModel,
    /// What its conversion found.
    pub report: BezierReport,
    /// Divisions of a quarter turn: 1, 2, 3, 4, 6, 8 ...
    pub divisions: usize,
}

/// Why there are no Bezier patches within the tolerance.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum BezierError {
    /// The tolerance was not reached, or patches fold.
    #[error(
        "Bezier patches of degree 6 are {error_mm:.2e} mm off on patch {worst}, and {folded} fold; allowed: {tolerance_mm} mm, none; allow more with --tol and --allow-folds, or mesh finer"
    )]
    NotReached {
        /// Largest distance from the CAD [mm].
        error_mm: f64,
        /// Patch where it is.
        worst: u32,
        /// Patches that fold.
        folded: usize,
        /// Distance allowed [mm].
        tolerance_mm: f64,
    },
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

/// Bezier patches over `mesh_of(n)` for n = 1, 2, 3, 4, 6, 8 ... up to `finest` divisions of a quarter turn, until they keep
/// `options.tolerance_mm` and none folds (or `allow_folds`). Meshes that cannot be made are passed over: finer borders
/// may bound a face that coarse chords do not.
///
/// # Errors
/// [`BezierError`] of the finest mesh.
pub fn within_tolerance(
    model: &Model,
    options: &BezierOptions,
    allow_folds: bool,
    finest: usize,
    mesh_of: impl Fn(usize) -> Result<SurfaceMesh, MeshError>,
) -> Result<Within, BezierError> {
    let mut divisions = 1;
    loop {
        let finer = finer(divisions);
        let last = finer > finest;
        match mesh_of(divisions) {
            Err(error) if last => return Err(error.into()),
            Err(_) => {}
            Ok(mesh) => {
                let (tool, report) = bezier_from_cad(model, &mesh, options)?;
                let near = report.error_mm <= options.tolerance_mm;
                if near && (allow_folds || report.folded.is_empty()) {
                    return Ok(Within { tool, report, divisions });
                }
                if last {
                    return Err(BezierError::NotReached {
                        error_mm: report.error_mm,
                        worst: report.worst,
                        folded: report.folded.len(),
                        tolerance_mm: options.tolerance_mm,
                    });
                }
            }
        }
        divisions = finer;
    }
}

/// The next of 1, 2, 3, 4, 6, 8, 12, 16 ...
fn finer(divisions: usize) -> usize {
    match divisions {
        1 => 2,
        n if n.is_power_of_two() => n / 2 * 3,
        n => n / 3 * 4,
    }
}
