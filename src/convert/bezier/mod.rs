//! Bezier patches of degree 1 to 6 (Eq. 1 to 3) directly from the CAD. Each element of a coarse mesh interpolates its
//! face at a tensor grid of Chebyshev points, with the lowest degrees within a tolerance.
//!
//! Each side is made once and both neighbours use the same control points, so that they agree to the last bit. Sides on
//! CAD edges follow these edges. Sides inside a face are straight lines in its parameter plane.

mod basis;
mod degrees;
mod map;
mod parameters;
mod refine;
mod side;

use rayon::prelude::*;

use self::basis::{Basis, NODES};
use self::degrees::{BuiltPatch, build, build_within_tolerance, equalise};
use self::map::{PatchMap, PatchShape, is_within};
pub use self::refine::{BezierError, FINEST, Within, within_tolerance};
use self::side::Sides;
use super::conversion::faces_away;
use super::searches::{SearchLimits, SearchedFace, Searches};
use super::{ConvertError, normals};
use kanagata_audit::report::Borders;
use kanagata_cad::Model;
use kanagata_geometry::Vec3;
use kanagata_mesh::{Element, SurfaceMesh};
use kanagata_progress::Progress;
use kanagata_tool::patch::MAX_DEGREE;
use kanagata_tool::{Patch, ToolKind, ToolModel};

/// Options of a conversion to Bezier patches.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierOptions {
    /// Name of the tool.
    pub name: String,
    /// Maximum distance from the CAD up to which lower degrees are used [mm], > 0.
    pub tolerance_mm: f64,
    /// Direction towards the sheet. The model is reversed if its vector area points the other way.
    pub sheet_side: Option<Vec3>,
    /// Reverses the model (after `sheet_side`).
    pub flip: bool,
    /// Where the progress is reported.
    pub progress: Progress,
}

/// Report of a conversion to Bezier patches.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BezierReport {
    /// Maximum distance of patches from the CAD surfaces and of sides from their CAD edges [mm], at check points
    /// between the interpolated ones.
    pub error_mm: f64,
    /// Patch with this distance.
    pub worst: u32,
    /// Comparison of the free borders with those of the CAD, if [`within_tolerance`] made it.
    pub borders: Borders,
    /// Maximum degree.
    pub degree: usize,
    /// Folded patches: the normal points against that of the face at some point. A border arc that bulges past the
    /// opposite side is a cause.
    pub folded: Vec<u32>,
    /// True when the model was reversed to face the sheet.
    pub turned: bool,
}

/// Bezier patches over the elements of `mesh`. A triangle becomes a patch with one side of zero length.
///
/// # Errors
/// [`ConvertError::Face`] for an element on a face that the model does not have; [`ConvertError::Normal`] and
/// [`ConvertError::Searches`] as for Nagata patches.
pub fn bezier_from_cad(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &BezierOptions,
) -> Result<(ToolModel, BezierReport), ConvertError> {
    let count = model.faces.len();
    if let Some(element) = mesh.elements.iter().position(|e| e.face as usize >= count) {
        return Err(ConvertError::Face { element, face: mesh.elements[element].face, count });
    }
    let vertex_searches =
        Searches::new(model, mesh, SearchLimits::NAGATA).watched(&options.progress);
    let feet = normals::vertex_normals(model, mesh, 0.0, &vertex_searches)?.feet;
    let searches = Searches::new(model, mesh, SearchLimits::BEZIER);
    let sides = Sides::of(model, mesh, &feet, &searches);
    searches.check()?;
    let basis = Basis::new();
    let stage = options.progress.stage("patches", "patches", mesh.elements.len() as u64);
    let shape_of = |e: &Element| {
        stage.add(1);
        lowest_degrees(searches.face(e.face), e, (&sides, &basis), options.tolerance_mm)
    };
    let mut shapes: Vec<PatchShape> = mesh.elements.par_iter().map(shape_of).collect();
    searches.check()?;
    equalise(&mut shapes);
    let build = |shape: &PatchShape, face: u32| {
        build(searches.face(face), shape, (&sides, &basis), options.tolerance_mm)
    };
    let built = build_within_tolerance(&mut shapes, mesh, options.tolerance_mm, build);
    searches.check()?;
    let mut report = report_of(&built);
    report.degree = shapes.iter().flat_map(|s| s.degrees).max().unwrap_or(0);
    report.turned = faces_away(mesh, options.sheet_side);
    let turn = report.turned ^ options.flip;
    let patches =
        built.into_iter().map(|b| if turn { reversed(b.patch) } else { b.patch }).collect();
    let faces = mesh.elements.iter().map(|e| e.face).collect();
    let tool = ToolModel::of_patches(&options.name, ToolKind::Bezier, patches, faces);
    Ok((tool, report))
}

/// Reports the maximum error [mm] and the folded patches.
fn report_of(built: &[BuiltPatch]) -> BezierReport {
    let mut report = BezierReport::default();
    for (id, b) in built.iter().enumerate() {
        if b.is_folded {
            report.folded.push(id as u32);
        }
        if b.error_mm > report.error_mm {
            (report.error_mm, report.worst) = (b.error_mm, id as u32);
        }
    }
    report
}

/// Map of an element and the lowest degrees within the tolerance [mm]. Each direction is tested with the maximum degree
/// in the other one, against half of the tolerance.
fn lowest_degrees(
    face: SearchedFace<'_>,
    element: &Element,
    (sides, basis): (&Sides, &Basis),
    tolerance: f64,
) -> PatchShape {
    let map = PatchMap::new(face, element, sides);
    let mut shape = PatchShape { map, degrees: [MAX_DEGREE; 2] };
    for direction in 0..2 {
        // At its maximum degree the other direction adds the least error.
        let suffices = |degree: &usize| {
            let limit = tolerance / 2.0;
            if shape.map.edge_deviation(direction, *degree, sides, basis) > limit {
                return false;
            }
            let mut degrees = [MAX_DEGREE; 2];
            degrees[direction] = *degree;
            let points = shape.map.net(face, degrees, sides, basis);
            let patch = Patch::Bezier { degrees, points };
            is_within(face, &patch, &shape.map, [tolerance, limit])
        };
        shape.degrees[direction] = (1..MAX_DEGREE).find(suffices).unwrap_or(MAX_DEGREE);
    }
    shape
}

/// The patch with reversed normal: eta and zeta are exchanged.
fn reversed(patch: Patch) -> Patch {
    let Patch::Bezier { degrees: [n, m], points } = patch else { return patch };
    let swapped = (0..=m).flat_map(|j| (0..=n).map(move |i| i * (m + 1) + j));
    Patch::Bezier { degrees: [m, n], points: swapped.map(|k| points[k]).collect() }
}

const _: () = assert!(NODES == MAX_DEGREE + 1);

#[cfg(test)]
mod tests;
