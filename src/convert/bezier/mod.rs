//! Bezier patches of arbitrary order (Eq. 1-3) straight from the CAD: each element of a coarse mesh interpolates its
//! face at a tensor grid of Chebyshev points, with the lowest degrees that keep a tolerance.
//!
//! Sides are made first, each once, and both neighbours take the same control points: the model is watertight to the
//! bit. Sides on edges of the CAD follow these; sides inside a face are straight in its parameters.

mod basis;
mod degrees;
mod map;
mod parameters;
mod refine;
mod side;

use rayon::prelude::*;

use self::basis::{Basis, NODES};
use self::degrees::{Built, agree, build, raised};
use self::map::{Map, Shape, is_within};
pub use self::refine::{BezierError, FINEST, Within, within_tolerance};
use self::side::Sides;
use super::ground::looks_away;
use super::searches::{SearchLimits, SearchedFace, Searches};
use super::{ConvertError, normals};
use crate::audit::report::Borders;
use crate::cad::Model;
use crate::geometry::Vec3;
use crate::mesh::{Element, SurfaceMesh};
use crate::tool::patch::MAX_DEGREE;
use crate::tool::{Patch, ToolKind, ToolModel};

/// Choices of a conversion to Bezier patches.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierOptions {
    /// Name of the tool.
    pub name: String,
    /// Largest distance from the CAD that lower degrees may bring [mm], > 0.
    pub tolerance_mm: f64,
    /// Direction to the sheet: the model is turned round if its faces look the other way on the whole.
    pub sheet_side: Option<Vec3>,
    /// Turns the model round (after `sheet_side`).
    pub flip: bool,
}

/// What a conversion to Bezier patches found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BezierReport {
    /// Largest distance from the CAD's surfaces, and of sides from the edges that they follow, at check points between the
    /// interpolated ones [mm].
    pub error_mm: f64,
    /// Patch where it is.
    pub worst: u32,
    /// Free borders against those of the CAD, where [`within_tolerance`] compared them.
    pub borders: Borders,
    /// Largest degree.
    pub degree: usize,
    /// Patches that fold: somewhere they look against their face. An arc that bulges past the opposite side does it.
    pub folded: Vec<u32>,
    /// The model was turned round to look at the sheet.
    pub turned: bool,
}

/// Bezier patches over the elements of `mesh` (triangles get a side of no length).
///
/// # Errors
/// [`ConvertError::Face`] for an element on a face that the model does not have; [`ConvertError::Normal`] as for
/// Nagata patches.
pub fn bezier_from_cad(
    model: &Model,
    mesh: &SurfaceMesh,
    options: &BezierOptions,
) -> Result<(ToolModel, BezierReport), ConvertError> {
    let count = model.faces.len();
    if let Some(element) = mesh.elements.iter().position(|e| e.face as usize >= count) {
        return Err(ConvertError::Face { element, face: mesh.elements[element].face, count });
    }
    let of_vertices = Searches::new(model, mesh, SearchLimits::NAGATA);
    let feet = normals::table(model, mesh, 0.0, &of_vertices)?.feet;
    let searches = Searches::new(model, mesh, SearchLimits::BEZIER);
    let sides = Sides::of(model, mesh, &feet, &searches);
    searches.check()?;
    let basis = Basis::new();
    let mut shapes: Vec<Shape> = mesh
        .elements
        .par_iter()
        .map(|e| shape(searches.face(e.face), e, (&sides, &basis), options.tolerance_mm))
        .collect();
    searches.check()?;
    agree(&mut shapes);
    let build = |shape: &Shape, face: u32| {
        build(searches.face(face), shape, (&sides, &basis), options.tolerance_mm)
    };
    let built = raised(&mut shapes, mesh, options.tolerance_mm, build);
    searches.check()?;
    let mut report = report_of(&built);
    report.degree = shapes.iter().flat_map(|s| s.degrees).max().unwrap_or(0);
    report.turned = looks_away(mesh, options.sheet_side);
    let turn = report.turned ^ options.flip;
    let patches =
        built.into_iter().map(|b| if turn { mirrored(b.patch) } else { b.patch }).collect();
    let faces = mesh.elements.iter().map(|e| e.face).collect();
    let tool = ToolModel::of_patches(&options.name, ToolKind::Bezier, patches, faces);
    Ok((tool, report))
}

/// Reports the largest error [mm] and the folded patches.
fn report_of(built: &[Built]) -> BezierReport {
    let mut report = BezierReport::default();
    for (id, b) in built.iter().enumerate() {
        if b.folds {
            report.folded.push(id as u32);
        }
        if b.error_mm > report.error_mm {
            (report.error_mm, report.worst) = (b.error_mm, id as u32);
        }
    }
    report
}

/// The map of an element and the lowest degrees that keep the tolerance.
fn shape(
    face: SearchedFace<'_>,
    element: &Element,
    (sides, basis): (&Sides, &Basis),
    tolerance: f64,
) -> Shape {
    let mut shape = Shape { map: Map::new(face, element, sides), degrees: [MAX_DEGREE; 2] };
    for direction in 0..2 {
        // The other direction at its finest does not limit this one.
        let keeps = |degree: &usize| {
            let limit = tolerance / 2.0;
            if shape.map.miss(direction, *degree, sides, basis) > limit {
                return false;
            }
            let mut degrees = [MAX_DEGREE; 2];
            degrees[direction] = *degree;
            let points = shape.map.net(face, degrees, sides, basis);
            let patch = Patch::Bezier { degrees, points };
            is_within(face, &patch, &shape.map, [tolerance, limit])
        };
        shape.degrees[direction] = (1..MAX_DEGREE).find(keeps).unwrap_or(MAX_DEGREE);
    }
    shape
}

/// The patch seen from the other side: eta and zeta swapped.
fn mirrored(patch: Patch) -> Patch {
    let Patch::Bezier { degrees: [n, m], points } = patch else { return patch };
    let swapped = (0..=m).flat_map(|j| (0..=n).map(move |i| i * (m + 1) + j));
    Patch::Bezier { degrees: [m, n], points: swapped.map(|k| points[k]).collect() }
}

const _: () = assert!(NODES == MAX_DEGREE + 1);

#[cfg(test)]
mod tests;
