//! Converts boundary entities to raw edges: pairing of curves, parameter conventions, directions.

use super::surface::BasisSurface;
use super::uv::{UvMap, point_on};
use crate::raw::{RawEdge, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Vec2, Vec3};

/// An edge whose parameter curve is not yet in the parameters of the raw surface.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeDraft {
    /// The raw edge; its `pcurve` is in the file's parameters.
    pub edge: RawEdge,
    /// The direction of `edge.curve` is defined by the topology; that of the parameter curve is not.
    pub curve_directs: bool,
}

/// Result of converting the parameter curves of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FittedMap {
    /// Index of the parameter map with the best fit.
    pub map: usize,
    /// Number of discarded parameter curves.
    pub dropped: usize,
}

/// Fractions of both parameter ranges at which curves are compared.
const MATCH_FRACTIONS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Pairs the space and parameter curves of a boundary. Where their numbers differ, one of the two lists is used.
pub(super) fn paired(
    curves: Vec<Curve3>,
    pcurves: Vec<Curve2>,
    prefer_pcurve: bool,
) -> Vec<EdgeDraft> {
    let draft = |curve, pcurve| EdgeDraft {
        edge: RawEdge { curve, pcurve, prefer_pcurve, ..RawEdge::default() },
        curve_directs: false,
    };
    if curves.len() == pcurves.len() {
        return curves.into_iter().zip(pcurves).map(|(c, p)| draft(Some(c), Some(p))).collect();
    }
    if curves.is_empty() || (prefer_pcurve && !pcurves.is_empty()) {
        return pcurves.into_iter().map(|p| draft(None, Some(p))).collect();
    }
    curves.into_iter().map(|c| draft(Some(c), None)).collect()
}

/// Converts the parameter curves of all loops of a face to the parameters of the raw surface. Among the parameter
/// conventions of known writers, the one that fits the space curves is used, the first by default. Parameter curves far
/// from their space curve are discarded unless the file prefers them.
pub(super) fn fit_parameter_map(basis: &BasisSurface, loops: &mut [Vec<EdgeDraft>]) -> FittedMap {
    let chosen = best_map(basis, loops);
    let mut fitted = FittedMap { map: chosen, dropped: 0 };
    for draft in loops.iter_mut().flatten() {
        let Some(flat) = draft.edge.pcurve.take() else { continue };
        let Some(map) = basis.maps.get(chosen) else { continue };
        if basis.approximate && draft.edge.curve.is_some() {
            continue;
        }
        let Some(pcurve) = map.curve(&flat) else { continue };
        if !draft.edge.prefer_pcurve
            && is_far_from(&basis.surface, &pcurve, draft.edge.curve.as_ref())
        {
            fitted.dropped += 1;
            continue;
        }
        align_directions(&basis.surface, draft, pcurve);
    }
    for edges in loops {
        chain(edges);
    }
    fitted
}

/// True when the ends of a parameter curve are far from those of the space curve, in either direction.
fn is_far_from(surface: &RawSurface, pcurve: &Curve2, curve: Option<&Curve3>) -> bool {
    let Some(curve) = curve else { return false };
    let [a, b] = pcurve.domain().map(|t| point_on(surface, pcurve.point(t)));
    let [c, d] = curve.domain().map(|t| curve.point(t));
    let (Some(a), Some(b)) = (a, b) else { return false };
    let forth = (a - c).norm() + (b - d).norm();
    let back = (a - d).norm() + (b - c).norm();
    forth.min(back) > 0.1 * extent(curve)
}

/// Makes the directions of both curves of an edge agree.
fn align_directions(surface: &RawSurface, draft: &mut EdgeDraft, pcurve: Curve2) {
    let against = draft.edge.curve.as_ref().is_some_and(|curve| {
        curve_distances(surface, &UvMap::identity(), &pcurve, curve)
            .is_some_and(|(forth, back)| back < 0.5 * forth && back < 0.1 * extent(curve))
    });
    if !against {
        draft.edge.pcurve = Some(pcurve);
    } else if draft.curve_directs || !draft.edge.prefer_pcurve {
        draft.edge.pcurve = Some(pcurve.reversed());
    } else {
        draft.edge.curve = draft.edge.curve.as_ref().map(Curve3::reversed);
        draft.edge.pcurve = Some(pcurve);
    }
}

fn best_map(basis: &BasisSurface, loops: &[Vec<EdgeDraft>]) -> usize {
    if basis.maps.len() < 2 {
        return 0;
    }
    let total = |map: &UvMap| -> f64 {
        let pairs = loops.iter().flatten().filter_map(|d| {
            curve_distances(&basis.surface, map, d.edge.pcurve.as_ref()?, d.edge.curve.as_ref()?)
        });
        pairs.map(|(forth, back)| forth.min(back)).sum()
    };
    let costs: Vec<f64> = basis.maps.iter().map(total).collect();
    let best = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
    if costs[best] < 0.5 * costs[0] { best } else { 0 }
}

/// Sum of the distances between both curves of an edge, in equal and in opposite direction.
fn curve_distances(
    surface: &RawSurface,
    map: &UvMap,
    pcurve: &Curve2,
    curve: &Curve3,
) -> Option<(f64, f64)> {
    let [a, b] = pcurve.domain();
    let [c, d] = curve.domain();
    let (mut forth, mut back) = (0.0, 0.0);
    for s in MATCH_FRACTIONS {
        let on: Vec2 = map.point(pcurve.point(a + s * (b - a)));
        let on = point_on(surface, on)?;
        forth += (on - curve.point(c + s * (d - c))).norm();
        back += (on - curve.point(d - s * (d - c))).norm();
    }
    Some((forth, back))
}

fn extent(curve: &Curve3) -> f64 {
    let first = curve.points().first().copied().unwrap_or_default();
    curve.points().iter().map(|p| (p - first).norm()).sum()
}

/// Reverses edges where only that connects the loop: some writers list the members of a boundary in order but with
/// arbitrary direction.
fn chain(edges: &mut [EdgeDraft]) {
    let ends: Option<Vec<[Vec3; 2]>> = edges
        .iter()
        .map(|d| d.edge.curve.as_ref().map(|c| c.domain().map(|t| c.point(t))))
        .collect();
    let Some(ends) = ends.filter(|e| e.len() > 1) else { return };
    if edges.iter().any(|d| d.curve_directs) {
        return;
    }
    let total = |turned: &[bool]| sum_of_gaps(&ends, turned);
    let as_is = vec![false; ends.len()];
    let size: f64 = ends.iter().map(|[a, b]| (a - b).norm()).sum();
    let gaps = total(&as_is);
    if gaps <= 1e-3 * size {
        return;
    }
    let follow = |first: bool| {
        let mut turned = vec![first];
        for i in 1..ends.len() {
            let last = ends[i - 1][usize::from(!turned[i - 1])];
            turned.push((ends[i][1] - last).norm() < (ends[i][0] - last).norm());
        }
        turned
    };
    let (one, two) = (follow(false), follow(true));
    let best = if total(&one) <= total(&two) { one } else { two };
    if total(&best) > 1e-2 * gaps {
        return;
    }
    for (draft, _) in edges.iter_mut().zip(&best).filter(|(_, turned)| **turned) {
        draft.edge.curve = draft.edge.curve.as_ref().map(Curve3::reversed);
        draft.edge.pcurve = draft.edge.pcurve.as_ref().map(Curve2::reversed);
    }
}

/// Sum of the gaps [mm] between consecutive edges of a loop, some of them reversed.
fn sum_of_gaps(ends: &[[Vec3; 2]], turned: &[bool]) -> f64 {
    let n = ends.len();
    (0..n)
        .map(|i| {
            let (next, here) = ((i + 1) % n, usize::from(!turned[i]));
            (ends[i][here] - ends[next][usize::from(turned[next])]).norm()
        })
        .sum()
}
