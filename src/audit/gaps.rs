//! Gaps across CAD edges between patches without common corners.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::reference::ReferenceSurface;
use super::side::Side;
use kanagata_geometry::Vec3;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::golden::minimize;
use kanagata_tool::ToolModel;
use kanagata_tool::side::SideCurve;

/// Distance of a side from a CAD edge relative to its length below which it lies on the edge.
const ON_EDGE_TOLERANCE_REL: f64 = 0.25;
/// Minimum number of sample points per side.
const INTERVALS_MIN: usize = 16;
/// Number of local maxima that are refined.
const REFINED_MAXIMA: usize = 3;

/// A patch side without neighbour although the CAD continues beyond it.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenSide {
    /// The patch.
    pub patch: usize,
    /// Index of its side, in order.
    pub side: usize,
    /// CAD edge on which it lies.
    pub edge: usize,
    /// Largest distance of its points from the patch sides beyond that edge [mm].
    pub gap_mm: f64,
    /// Location of the largest distance.
    pub at: Vec3,
}

/// A side whose gap is not yet known.
struct Found<'a> {
    side: Side,
    curve: SideCurve<'a>,
    edge: usize,
    beyond: Vec<u32>,
}

/// Those of the `free` sides of a tool beyond which the CAD continues, each with its largest gap at `n` intervals,
/// refined around the largest. A tool of a single face has no neighbours.
pub(super) fn across(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    free: &[Side],
    n: usize,
) -> Vec<OpenSide> {
    // A face without patches was excluded and has no gap.
    let there: BTreeSet<u32> = tool.faces.iter().copied().collect();
    if there.len() < 2 {
        return Vec::new();
    }
    let of_side = |&side: &Side| {
        let mut found = found(tool, reference, side)?;
        found.beyond.retain(|f| there.contains(f));
        (!found.beyond.is_empty()).then_some(found)
    };
    let open: Vec<Found<'_>> = free.par_iter().filter_map(of_side).collect();
    let mut of_face: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (k, o) in open.iter().enumerate() {
        of_face.entry(tool.faces[o.side.patch]).or_default().push(k);
    }
    let indexed = |(face, sides): (u32, Vec<usize>)| {
        let boxes: Vec<_> = sides.iter().map(|&k| open[k].curve.bounds()).collect();
        (face, (BoxTree::build(&boxes), sides))
    };
    let of_face: BTreeMap<u32, (BoxTree, Vec<usize>)> = of_face.into_iter().map(indexed).collect();
    let gap = |o: &Found<'_>| {
        let apart = |t: f64| {
            let p = o.curve.point(t);
            let sides = o.beyond.iter().filter_map(|f| of_face.get(f));
            sides.fold(f64::INFINITY, |best, near| nearest(&open, o.side, &p, near, best))
        };
        let (at, gap_mm) = largest(apart, n.max(INTERVALS_MIN));
        let Side { patch, side, .. } = o.side;
        OpenSide { patch, side, edge: o.edge, gap_mm, at: o.curve.point(at) }
    };
    open.par_iter().map(gap).collect()
}

/// The side with its CAD edge and the faces beyond.
fn found<'a>(
    tool: &'a ToolModel,
    reference: &impl ReferenceSurface,
    side: Side,
) -> Option<Found<'a>> {
    let curve = SideCurve::new(&tool.patches[side.patch], side.side);
    let border = reference.border(&curve.point(0.5), tool.faces[side.patch])?;
    let on = border.distance <= ON_EDGE_TOLERANCE_REL * curve.chord();
    on.then_some(Found { side, curve, edge: border.edge, beyond: border.beyond })
}

/// Distance from `p` to the nearest side of a face, excluding its own, or `best` when none is closer.
fn nearest(
    open: &[Found<'_>],
    own: Side,
    p: &Vec3,
    (tree, sides): &(BoxTree, Vec<usize>),
    best: f64,
) -> f64 {
    let visit = |k: u32, best: f64| {
        let other = &open[sides[k as usize]];
        let same = other.side.patch == own.patch && other.side.side == own.side;
        if same { best } else { best.min(other.curve.distance(p).powi(2)) }
    };
    tree.nearest(p, best * best, visit).sqrt()
}

/// Largest finite value of `f` over [0, 1] and its argument: at `n` intervals, refined around the largest. Zero when
/// there is none.
fn largest(f: impl Fn(f64) -> f64, n: usize) -> (f64, f64) {
    let at = |k: usize| k as f64 / n as f64;
    let value = |t: f64| Some(f(t)).filter(|v| v.is_finite()).unwrap_or(0.0);
    let values: Vec<f64> = (0..=n).map(|k| value(at(k))).collect();
    let tops = |&k: &usize| {
        let [before, after] = [k.saturating_sub(1), (k + 1).min(n)];
        values[k] >= values[before] && values[k] >= values[after]
    };
    let mut tops: Vec<usize> = (0..=n).filter(tops).collect();
    tops.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
    let mut best = tops.first().map_or((0.0, 0.0), |&k| (at(k), values[k]));
    for &k in tops.iter().take(REFINED_MAXIMA) {
        let around = [at(k.saturating_sub(1)), at((k + 1).min(n))];
        let (t, negative) = minimize(|t| -value(t), around, 24);
        if -negative > best.1 {
            best = (t, -negative);
        }
    }
    best
}
