//! Bezier patches within a tolerance.

use super::{BezierOptions, BezierReport, bezier_from_cad};
use crate::ConvertError;
use kanagata_audit::{CadReference, free_borders};
use kanagata_cad::Model;
use kanagata_mesh::{MeshError, SurfaceMesh};
use kanagata_tool::ToolModel;

/// Minimum number of steps along a side at which free borders are compared.
const BORDER_STEPS_MIN: usize = 16;
/// Maximum divisions per quarter turn for [`within_tolerance`].
pub const FINEST: usize = 64;

/// Bezier patches within a tolerance, and the divisions per quarter turn used.
#[derive(Debug, Clone)]
pub struct Within {
    /// The model.
    pub tool: ToolModel,
    /// Report of its conversion.
    pub report: BezierReport,
    /// Divisions per quarter turn: 1, 2, 3, 4, 6, 8 ...
    pub divisions: usize,
}

/// Reason why there are no Bezier patches within the tolerance.
#[derive(Debug, thiserror::Error)]
pub enum BezierError {
    /// The tolerance was not reached, or patches are folded.
    #[error(
        "Bezier patches of degree 6 deviate by up to {error_mm:.2e} mm, on patch {worst} of face {face}{}{}; allowed: {tolerance_mm} mm and no folds; {}, or allow a larger `tolerance_mm` or folds",
        border_text(*.border_mm, *.border_at),
        folds_text(*.folded, *.folded_face),
        remedy(*.divisions, *.in_vain)
    )]
    NotReached {
        /// Maximum distance from the CAD [mm].
        error_mm: f64,
        /// Patch with this distance.
        worst: u32,
        /// Face of that patch.
        face: u32,
        /// Maximum distance of free borders from those of the CAD [mm]; zero if not compared.
        border_mm: f64,
        /// Position of this distance [mm].
        border_at: Option<[f64; 3]>,
        /// Number of folded patches.
        folded: usize,
        /// Face of the first folded patch, if any.
        folded_face: Option<u32>,
        /// Allowed distance [mm].
        tolerance_mm: f64,
        /// Divisions per quarter turn; `None` for a prescribed mesh.
        divisions: Option<usize>,
        /// True when refinement had stopped reducing the error or the folds.
        in_vain: bool,
    },
    /// Meshing failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Conversion failed.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

/// Text on free borders, where they were compared.
fn border_text(mm: f64, at: Option<[f64; 3]>) -> String {
    let text = |[x, y, z]: [f64; 3]| {
        format!(
            ", and their free borders by up to {mm:.2e} mm from those of the CAD at ({x:.3}, {y:.3}, {z:.3}) mm"
        )
    };
    at.map_or_else(String::new, text)
}

/// Text on folded patches.
fn folds_text(folded: usize, face: Option<u32>) -> String {
    let Some(face) = face else { return "; no patch is folded".into() };
    format!("; folded patches: {folded}, the first on face {face}")
}

/// Remedy for a tolerance that was not reached.
fn remedy(divisions: Option<usize>, in_vain: bool) -> String {
    match divisions {
        None => "refine the mesh there".into(),
        Some(n) if in_vain => format!(
            "{n} divisions per quarter turn reduce neither the error nor the folds, so finer meshes are not tried: make Nagata \
             patches and convert these to Bezier patches, or repair these faces in the CAD where they are faulty"
        ),
        Some(n) => format!(
            "{n} divisions per quarter turn are the maximum: make Nagata patches and convert these to Bezier patches, or repair \
             these faces in the CAD where they are faulty"
        ),
    }
}

/// Bezier patches over `mesh_of(n)` for n = 1, 2, 3, 4, 6, 8 ... up to `finest` divisions per quarter turn, the first
/// that:
///
/// - are within `options.tolerance_mm` of the CAD;
/// - have free borders within this tolerance, or within twice the joining tolerance if that is larger;
/// - contain no folded patch, unless `allow_folds` is set.
///
/// A mesh that fails is skipped: with finer divisions the border may enclose a region. The refinement stops when the
/// last three meshes neither halved the error nor reduced the number of folds, at the earliest after n = 12. The work
/// grows with the square of n. With `finest = 1` there is one prescribed mesh.
///
/// # Errors
/// [`BezierError`] of the last mesh.
pub fn within_tolerance(
    model: &Model,
    options: &BezierOptions,
    allow_folds: bool,
    finest: usize,
    mesh_of: impl Fn(usize) -> Result<SurfaceMesh, MeshError>,
) -> Result<Within, BezierError> {
    let reference = CadReference::new(model);
    // CAD edges are known only to within the joining tolerance of their faces.
    let border_tolerance = options.tolerance_mm.max(2.0 * model.join_tolerance);
    let mut divisions = 1;
    let mut tried: Vec<Attempt> = Vec::new();
    loop {
        let finer = next_divisions(divisions);
        let last = finer > finest;
        match mesh_of(divisions) {
            Err(error) if last => return Err(error.into()),
            Err(_) => {}
            Ok(mesh) => {
                let (tool, mut report) = bezier_from_cad(model, &mesh, options)?;
                let folded = if allow_folds { 0 } else { report.folded.len() };
                let mut error_mm = report.error_mm;
                if error_mm <= options.tolerance_mm && folded == 0 {
                    report.borders = free_borders(&tool, &reference, BORDER_STEPS_MIN);
                    error_mm = error_mm.max(report.borders.deviation_mm());
                    if error_mm <= border_tolerance {
                        return Ok(Within { tool, report, divisions });
                    }
                }
                tried.push(Attempt { error_mm, folded });
                let in_vain = is_stagnant(&tried, options.tolerance_mm);
                if last || in_vain {
                    let divisions = (finest > 1).then_some(divisions);
                    return Err(not_reached(&tool, &report, options, divisions, in_vain));
                }
            }
        }
        divisions = finer;
    }
}

/// Result of one mesh.
#[derive(Clone, Copy)]
struct Attempt {
    /// Maximum distance from the CAD [mm], with free borders if these were compared.
    error_mm: f64,
    /// Number of folded patches; zero when folds are allowed.
    folded: usize,
}

/// True when neither an error above the tolerance was halved nor the number of folds reduced since the mesh three steps
/// before. That mesh had a third to half of the divisions. Where refinement helps, patches of degree 6 gain a factor of
/// about 100.
fn is_stagnant(tried: &[Attempt], tolerance_mm: f64) -> bool {
    /// Number of meshes tried in any case, up to 12 divisions. Until then a few patches may fold.
    const ATTEMPTS_MIN: usize = 7;
    let [.., before, _, _, now] = tried else { return false };
    if tried.len() < ATTEMPTS_MIN {
        return false;
    }
    let better = now.error_mm > tolerance_mm && now.error_mm <= 0.5 * before.error_mm;
    let fewer = now.folded > 0 && now.folded < before.folded;
    !(better || fewer)
}

/// The error for the last mesh.
fn not_reached(
    tool: &ToolModel,
    report: &BezierReport,
    options: &BezierOptions,
    divisions: Option<usize>,
    in_vain: bool,
) -> BezierError {
    let face_of = |patch: u32| tool.faces.get(patch as usize).copied();
    BezierError::NotReached {
        error_mm: report.error_mm,
        worst: report.worst,
        face: face_of(report.worst).unwrap_or(0),
        border_mm: report.borders.deviation_mm(),
        border_at: report.borders.at,
        folded: report.folded.len(),
        folded_face: report.folded.first().and_then(|&k| face_of(k)),
        tolerance_mm: options.tolerance_mm,
        divisions,
        in_vain,
    }
}

/// The next number of divisions in 1, 2, 3, 4, 6, 8, 12, 16 ...
fn next_divisions(divisions: usize) -> usize {
    match divisions {
        1 => 2,
        n if n.is_power_of_two() => n / 2 * 3,
        n => n / 3 * 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refinement_without_progress_is_stagnant() {
        let tried = |all: &[(f64, usize)]| -> Vec<Attempt> {
            let coarse = [(9.0, 40); 3].iter();
            coarse.chain(all).map(|&(error_mm, folded)| Attempt { error_mm, folded }).collect()
        };
        let stagnant = |all: &[(f64, usize)]| is_stagnant(&tried(all), 1e-4);
        assert!(!stagnant(&[(5.0, 8), (5.0, 8), (5.0, 8)]));
        assert!(stagnant(&[(5.0, 8), (4.9, 16), (5.0, 24), (4.8, 32)]));
        assert!(!stagnant(&[(5.0, 0), (2.0, 0), (0.3, 0), (0.1, 0)]));
        // Within the tolerance with an unchanged number of folds: a finer mesh does not remove them.
        assert!(stagnant(&[(9e-5, 1), (1e-5, 1), (1e-6, 1), (1e-7, 1)]));
        assert!(!stagnant(&[(9e-5, 3), (1e-5, 2), (1e-6, 1), (1e-7, 1)]));
    }
}
