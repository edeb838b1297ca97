//! Edges and vertices of an offset model: the same topology, with curves from the offset faces.

use rayon::prelude::*;

use super::sharp::parameters_at;
use crate::Model;
use crate::topology::space_curve;
use kanagata_geometry::Vec3;
use kanagata_geometry::nurbs::Curve3;

/// Points of an edge at which the gap between its faces is measured.
const POINTS: usize = 17;

/// Largest distance between the faces of an edge.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OffsetGap {
    /// Distance [mm].
    pub distance: f64,
    /// Its place [mm].
    pub at: Vec3,
}

/// Gives edges and vertices the places of the offset faces, and returns the largest gap between faces of one edge. The
/// curve of an edge is the side of its first face; vertices are the ends of their first edge.
pub(super) fn renew(model: &mut Model, tolerance: f64) -> OffsetGap {
    let renewed: Vec<Option<(Curve3, OffsetGap)>> =
        (0..model.edges.len()).into_par_iter().map(|e| renewed_edge(model, e, tolerance)).collect();
    let mut known = vec![false; model.vertices.len()];
    let mut largest = OffsetGap::default();
    for (edge, found) in model.edges.iter_mut().zip(renewed) {
        let Some((curve, gap)) = found else { continue };
        let [a, b] = curve.domain();
        for (v, t) in edge.vertices.into_iter().zip([a, b]) {
            let end = curve.point(t);
            if std::mem::replace(&mut known[v], true) {
                let distance = (model.vertices[v] - end).norm();
                largest = larger(largest, OffsetGap { distance, at: end });
            } else {
                model.vertices[v] = end;
            }
        }
        edge.curve = curve;
        largest = larger(largest, gap);
    }
    largest
}

fn larger(a: OffsetGap, b: OffsetGap) -> OffsetGap {
    if b.distance > a.distance { b } else { a }
}

/// The curve of an edge and the largest distance of its other sides from it; `None` for an edge without faces.
fn renewed_edge(model: &Model, edge: usize, tolerance: f64) -> Option<(Curve3, OffsetGap)> {
    let uses = &model.edges[edge].uses;
    let (first, others) = uses.split_first()?;
    let side = |[f, l, k]: [usize; 3]| (&model.faces[f], &model.faces[f].loops[l].uses[k]);
    let (face, used) = side(*first);
    let curve = space_curve(&face.surface, &used.pcurve, tolerance);
    let curve = if used.reversed { curve.reversed() } else { curve };
    let [a, b] = curve.domain();
    let mut largest = OffsetGap::default();
    for k in 0..POINTS {
        let at = curve.point(a + (b - a) * k as f64 / (POINTS - 1) as f64);
        for other in others {
            let (face, used) = side(*other);
            let there = face.surface.point(parameters_at(face, used, &at));
            largest = larger(largest, OffsetGap { distance: (there - at).norm(), at });
        }
    }
    Some((curve, largest))
}
