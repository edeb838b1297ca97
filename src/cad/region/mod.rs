//! Faces inside and outside a closed curve in plan, the plane z = 0. Faces that the curve crosses are split along it.
//!
//! - [`plan`]: the curve, with its signed distance
//! - [`trace`]: the curves on a surface that lie above the curve; [`track`]: sides along them
//! - [`cut`]: the loops of a face cut at the curve and closed along it; [`crossings`]: where its sides cross the curve
//! - [`cells`]: points of a face whose side is certain, by which every cut is checked
//! - `chain`: curves of a file as one closed curve
//!
//! The cut is a curve in the parameter plane of the face, within a fraction of the joining tolerance. Both halves have
//! it, so that they and the neighbours remain joined.

mod cells;
mod chain;
mod crossings;
mod cut;
mod error;
mod plan;
#[cfg(test)]
mod tests;
mod trace;
mod track;

use std::collections::BTreeSet;

use rayon::prelude::*;

pub use self::error::RegionError;
pub use self::plan::PlanCurve;

use self::cut::{Cut, FaceCut};
use super::loops::Side;
use super::model::{Edge, EdgeUse, Face, Model, TrimLoop};
use super::topology::{Piece, join};
use kanagata_geometry::Aabb;
use kanagata_geometry::nurbs::Curve3;

/// A model whose faces lie inside or outside the curve.
#[derive(Debug, Clone)]
pub struct Split {
    /// The faces. A face that was split has the place of its first part on the side asked for; other parts are at the
    /// end.
    pub model: Model,
    /// Whether each face is inside.
    pub inside: Vec<bool>,
}

/// Splits the faces of `model` along `curve`. Of a split face the first part inside (`inside_first`) or outside keeps
/// its place.
///
/// # Errors
/// [`RegionError::Face`] for a face that cannot be split: the curve touches it or runs along it.
pub fn split(model: &Model, curve: &PlanCurve, inside_first: bool) -> Result<Split, RegionError> {
    let tolerance = model.join_tolerance.max(1e-9);
    let cut = |face: &Face| Cut { face, curve, tolerance }.cut(&sides_of(model, face));
    let cuts: Vec<Result<FaceCut, String>> = model.faces.par_iter().map(cut).collect();
    let mut out = Split { model: model.clone(), inside: Vec::with_capacity(cuts.len()) };
    let mut sides: Vec<Option<Vec<Vec<Side>>>> = vec![None; cuts.len()];
    let (mut more, mut more_inside) = (Vec::new(), Vec::new());
    for (f, found) in cuts.into_iter().enumerate() {
        let reason = |reason| {
            let source = model.faces[f].source.clone();
            RegionError::Face { face: f, source_entity: source, reason }
        };
        let (mut first, other) = match found.map_err(reason)? {
            FaceCut::Whole(inside) => {
                out.inside.push(inside);
                continue;
            }
            FaceCut::Parts { inside, outside } if inside_first => (inside, outside),
            FaceCut::Parts { inside, outside } => (outside, inside),
        };
        out.inside.push(inside_first);
        sides[f] = Some(first.remove(0));
        let parts = first.into_iter().map(|l| (l, inside_first));
        for (loops, inside) in parts.chain(other.into_iter().map(|l| (l, !inside_first))) {
            more.push((f, loops));
            more_inside.push(inside);
        }
    }
    if sides.iter().all(Option::is_none) {
        return Ok(out);
    }
    out.inside.extend(more_inside);
    for (f, loops) in more {
        out.model.faces.push(model.faces[f].clone());
        sides.push(Some(loops));
    }
    rejoin(&mut out.model, model, sides, tolerance);
    Ok(out)
}

/// Sides of the loops of a face, with the curves of their edges.
fn sides_of(model: &Model, face: &Face) -> Vec<Vec<Side>> {
    let side = |used: &EdgeUse| {
        let edge = used.edge.map(|e| &model.edges[e].curve);
        let curve = edge.map(|c| if used.reversed { c.reversed() } else { c.clone() });
        Side { path: used.pcurve.clone(), curve, edge_id: used.edge }
    };
    face.loops.iter().map(|l| l.uses.iter().map(side).collect()).collect()
}

/// Gives the split faces their loops and joins all sides anew. Sides of an edge that is not cut remain on one edge.
fn rejoin(out: &mut Model, model: &Model, sides: Vec<Option<Vec<Vec<Side>>>>, tolerance: f64) {
    let mut pieces = Vec::new();
    for (f, cut) in sides.into_iter().enumerate() {
        let loops = cut.unwrap_or_else(|| sides_of(model, &out.faces[f]));
        let mut trims = Vec::with_capacity(loops.len());
        for (l, sides) in loops.into_iter().enumerate() {
            let mut uses = Vec::with_capacity(sides.len());
            for Side { path, curve, edge_id } in sides {
                if !super::build::is_point(&out.faces[f].surface, &path, tolerance) {
                    let at = [f, l, uses.len()];
                    pieces.push(Piece { at, pcurve: path.clone(), curve, edge_id });
                }
                uses.push(EdgeUse { pcurve: path, edge: None, reversed: false });
            }
            trims.push(TrimLoop { uses });
        }
        out.faces[f].loops = trims;
    }
    out.cut.clear();
    out.edges.clear();
    join(out, pieces, tolerance);
    out.left_out = left_out_edges(out, model, tolerance);
}

/// The free edges of `out` along those of `model` that a face which is not taken uses too.
fn left_out_edges(out: &Model, model: &Model, tolerance: f64) -> BTreeSet<usize> {
    let curve = |&e: &usize| {
        let curve = &model.edges[e].curve;
        (Aabb::of_points(curve.points()).widened(tolerance), curve)
    };
    let left_out: Vec<(Aabb, &Curve3)> = model.left_out.iter().map(curve).collect();
    let lies_along = |edge: &Edge| {
        let [a, b] = edge.curve.domain();
        let p = edge.curve.point(0.5 * (a + b));
        let near = |(hull, curve): &(Aabb, &Curve3)| {
            hull.distance_squared(&p) == 0.0
                && (curve.point(curve.closest(&p).0) - p).norm() <= tolerance
        };
        edge.uses.len() == 1 && left_out.iter().any(near)
    };
    (0..out.edges.len()).filter(|&k| lies_along(&out.edges[k])).collect()
}
