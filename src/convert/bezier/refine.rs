//! Bezier patches within a tolerance.

use super::{BezierOptions, BezierReport, bezier_from_cad};
use crate::audit::{CadReference, free_borders};
use crate::cad::Model;
use crate::convert::ConvertError;
use crate::mesh::{MeshError, SurfaceMesh};
use crate::tool::ToolModel;

/// Steps along a side at which free borders are compared, at least.
const SAMPLES: usize = 16;
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
        "Bezier patches of degree 6 are up to {error_mm:.2e} mm off, on patch {worst} of face {face}{}{}; allowed: {tolerance_mm} mm, none that folds; {}, or allow more (`tolerance_mm`), or folds",
        border_said(*.border_mm, *.border_at),
        folds_said(*.folded, *.folded_face),
        advice(*.divisions, *.in_vain)
    )]
    NotReached {
        /// Largest distance from the CAD [mm].
        error_mm: f64,
        /// Patch where it is.
        worst: u32,
        /// Face of that patch.
        face: u32,
        /// Largest distance of free borders from those of the CAD [mm], where they were compared.
        border_mm: f64,
        /// Where it is [mm].
        border_at: Option<[f64; 3]>,
        /// Patches that fold.
        folded: usize,
        /// Face of the first of these, if there are any.
        folded_face: Option<u32>,
        /// Distance allowed [mm].
        tolerance_mm: f64,
        /// Divisions of a quarter turn; `None` on a mesh that was given.
        divisions: Option<usize>,
        /// Finer meshes came no nearer, which is why no finer one was tried.
        in_vain: bool,
    },
    /// No mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No tool model.
    #[error(transparent)]
    Convert(#[from] ConvertError),
}

fn border_said(mm: f64, at: Option<[f64; 3]>) -> String {
    let said = |[x, y, z]: [f64; 3]| {
        format!(
            ", their free borders up to {mm:.2e} mm from the CAD's at ({x:.3}, {y:.3}, {z:.3}) mm"
        )
    };
    at.map_or_else(String::new, said)
}

fn folds_said(folded: usize, face: Option<u32>) -> String {
    let Some(face) = face else { return ", and none folds".into() };
    format!(", and {folded} fold, the first on face {face}")
}

fn advice(divisions: Option<usize>, in_vain: bool) -> String {
    match divisions {
        None => "mesh finer there".into(),
        Some(n) if in_vain => format!(
            "{n} divisions of a quarter turn came no nearer than half as many, so finer ones are not tried: make Nagata patches \
             and turn these into Bezier patches, or repair these faces in the CAD where they are faulty"
        ),
        Some(n) => format!(
            "{n} divisions of a quarter turn are the most that is tried: make Nagata patches and turn these into Bezier patches, or \
             repair these faces in the CAD where they are faulty"
        ),
    }
}

/// Bezier patches over `mesh_of(n)` for n = 1, 2, 3, 4, 6, 8 ... up to `finest` divisions of a quarter turn, until they keep
/// `options.tolerance_mm`, free borders as well, and none folds (or `allow_folds`). Meshes that cannot be made are passed over: finer borders
/// may bound a face that coarse chords do not. From 12 on, where three finer meshes neither halve the error nor leave fewer folded
/// patches, finer ones are not tried: work grows with the square of the divisions. `finest = 1`: one mesh that was given.
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
    let reference = CadReference::new(model);
    // The CAD's own edges are known no better than its faces are joined.
    let border_tolerance = options.tolerance_mm.max(2.0 * model.join_tolerance);
    let mut divisions = 1;
    let mut tried: Vec<Tried> = Vec::new();
    loop {
        let finer = finer(divisions);
        let last = finer > finest;
        match mesh_of(divisions) {
            Err(error) if last => return Err(error.into()),
            Err(_) => {}
            Ok(mesh) => {
                let (tool, mut report) = bezier_from_cad(model, &mesh, options)?;
                let folded = if allow_folds { 0 } else { report.folded.len() };
                let mut error_mm = report.error_mm;
                if error_mm <= options.tolerance_mm && folded == 0 {
                    report.borders = free_borders(&tool, &reference, SAMPLES);
                    error_mm = error_mm.max(report.borders.deviation_mm());
                    if error_mm <= border_tolerance {
                        return Ok(Within { tool, report, divisions });
                    }
                }
                tried.push(Tried { error_mm, folded });
                let in_vain = are_in_vain(&tried, options.tolerance_mm);
                if last || in_vain {
                    let divisions = (finest > 1).then_some(divisions);
                    return Err(not_reached(&tool, &report, options, divisions, in_vain));
                }
            }
        }
        divisions = finer;
    }
}

/// What a mesh came to.
#[derive(Clone, Copy)]
struct Tried {
    error_mm: f64,
    /// Patches that fold and must not.
    folded: usize,
}

/// Nothing that is not as asked is better by much than it was three meshes before: a quarter turn had half to a third of
/// the divisions then, and patches of degree 6 are a hundred times as near where finer ones help.
fn are_in_vain(tried: &[Tried], tolerance_mm: f64) -> bool {
    /// Meshes that are tried in any case, up to 12 divisions: a few patches may fold until then.
    const LEAST: usize = 7;
    let [.., before, _, _, now] = tried else { return false };
    if tried.len() < LEAST {
        return false;
    }
    let nearer = now.error_mm > tolerance_mm && now.error_mm <= 0.5 * before.error_mm;
    let fewer = now.folded > 0 && now.folded < before.folded;
    !(nearer || fewer)
}

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

/// The next of 1, 2, 3, 4, 6, 8, 12, 16 ...
fn finer(divisions: usize) -> usize {
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
    fn what_comes_no_nearer_is_given_up() {
        let tried = |all: &[(f64, usize)]| -> Vec<Tried> {
            let coarse = [(9.0, 40); 3].iter();
            coarse.chain(all).map(|&(error_mm, folded)| Tried { error_mm, folded }).collect()
        };
        let vain = |all: &[(f64, usize)]| are_in_vain(&tried(all), 1e-4);
        assert!(!vain(&[(5.0, 8), (5.0, 8), (5.0, 8)]));
        assert!(vain(&[(5.0, 8), (4.9, 16), (5.0, 24), (4.8, 32)]));
        assert!(!vain(&[(5.0, 0), (2.0, 0), (0.3, 0), (0.1, 0)]));
        // Near enough, and as many fold as before: no finer mesh unfolds them.
        assert!(vain(&[(9e-5, 1), (1e-5, 1), (1e-6, 1), (1e-7, 1)]));
        assert!(!vain(&[(9e-5, 3), (1e-5, 2), (1e-6, 1), (1e-7, 1)]));
    }
}
