//! Gaps across edges of the CAD where the patches of its faces do not share their corners.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::jumps::{Side, on_side};
use super::reference::ReferenceSurface;
use crate::geometry::{Aabb, Vec3};
use crate::tool::ToolModel;

/// Points of a side that the nearest one is looked for from.
const STEPS: usize = 16;
/// A side this near to an edge of the CAD, over its length, is on it.
const ON: f64 = 0.25;

/// A side that one patch uses, and the faces the surface goes on with beyond it.
struct Open {
    side: Side,
    beyond: Vec<u32>,
}

/// How many of the `free` sides of a tool have more of the CAD beyond them, and the largest distance from `n + 1` points
/// of each to the free sides of the patches there [mm]. A tool of a single face has no neighbours.
pub(super) fn across(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    free: &[Side],
    n: usize,
) -> (usize, f64) {
    // A face without patches was left out: nothing to be apart from.
    let there: BTreeSet<u32> = tool.faces.iter().copied().collect();
    if there.len() < 2 {
        return (0, 0.0);
    }
    let of_side = |&side: &Side| {
        let mut beyond = beyond(tool, reference, side);
        beyond.retain(|f| there.contains(f));
        Open { side, beyond }
    };
    let open: Vec<Open> = free.par_iter().map(of_side).filter(|o| !o.beyond.is_empty()).collect();
    let mut of_face: BTreeMap<u32, Vec<(Side, Aabb)>> = BTreeMap::new();
    for o in &open {
        let points = (0..=STEPS).map(|k| point(tool, o.side, k as f64 / STEPS as f64));
        let points: Vec<Vec3> = points.collect();
        // A side bulges between its points by less than their distances.
        let around = Aabb::of_points(&points);
        let around = around.widened(around.diagonal() / STEPS as f64);
        of_face.entry(tool.faces[o.side.patch]).or_default().push((o.side, around));
    }
    let gap = |o: &Open| {
        let points = (0..=n).map(|k| point(tool, o.side, k as f64 / n as f64));
        let sides = || o.beyond.iter().filter_map(|f| of_face.get(f)).flatten();
        let apart = points.map(|p| nearest(tool, o.side, &p, sides()));
        apart.filter(|d| d.is_finite()).fold(0.0, f64::max)
    };
    let gaps: Vec<f64> = open.par_iter().map(gap).collect();
    (open.len(), gaps.into_iter().fold(0.0, f64::max))
}

fn point(tool: &ToolModel, side: Side, t: f64) -> Vec3 {
    on_side(&tool.patches[side.patch], side, t).0
}

/// Faces beyond the edge of the CAD that a side lies on.
fn beyond(tool: &ToolModel, reference: &impl ReferenceSurface, side: Side) -> Vec<u32> {
    let [a, b] = [0.0, 1.0].map(|t| point(tool, side, t));
    let found = reference.border(&point(tool, side, 0.5), tool.faces[side.patch]);
    found.filter(|f| f.distance <= ON * (b - a).norm()).map_or_else(Vec::new, |f| f.beyond)
}

/// Distance from `p` to the nearest of `sides`, its own aside.
fn nearest<'a>(
    tool: &ToolModel,
    own: Side,
    p: &Vec3,
    sides: impl Iterator<Item = &'a (Side, Aabb)>,
) -> f64 {
    let mut best = f64::INFINITY;
    for (side, around) in sides {
        let same = side.patch == own.patch && side.side == own.side;
        if same || around.distance_squared(p) >= best * best {
            continue;
        }
        let off = |t: f64| (point(tool, *side, t) - p).norm();
        let at = |k: usize| k as f64 / STEPS as f64;
        let steps = (0..=STEPS).map(|k| (off(at(k)), k));
        let Some((_, k)) = steps.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        best = best.min(least(off, at(k.saturating_sub(1)), at((k + 1).min(STEPS))));
    }
    best
}

/// Least value between `a` and `b` by golden sections.
fn least(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let mut best = f(a).min(f(b));
    for _ in 0..40 {
        let (c, d) = (b - SHARE * (b - a), a + SHARE * (b - a));
        let (fc, fd) = (f(c), f(d));
        best = best.min(fc).min(fd);
        if fc < fd { b = d } else { a = c }
    }
    best
}
