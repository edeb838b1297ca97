//! Deviation of the free borders of a tool from those of its CAD, in both directions.
//!
//! It is the Hausdorff distance of the two borders T and C: `d(T, C) = max over p in T of dist(p, C)`,
//! `d(C, T) = max over q in C of dist(q, T)`. T contains the patch sides without neighbour. C contains the edges used
//! by exactly one of the faces with patches, where no other of these faces contains them. The maxima are taken over
//! points along sides and edges and refined around the largest; the distances are exact.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::reference::{BorderEdge, ReferenceSurface};
use super::report::Borders;
use super::side::Side;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::golden::minimize;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_tool::ToolModel;
use kanagata_tool::side::SideCurve;

/// Minimum number of intervals per side or edge.
const INTERVALS_MIN: usize = 16;
/// Maximum number of intervals per edge. An edge longer than 256 sides of the tool is sampled at larger steps, which
/// [`Borders::step_mm`] reports.
const INTERVALS_MAX: usize = 4096;
/// Maximum number of curves examined per point, nearest bounding boxes first. More boxes contain a point only where
/// hundreds of edges overlap; the distance is then an upper bound. This limits the work in proportion to the number of
/// points.
const VISITS_MAX: usize = 256;
/// Golden-section steps around the largest distance of a side: accuracy 1e-5 of the interval.
const REFINEMENTS: usize = 24;
/// Ratio of the distance of a side or edge to the largest of its face above which its maximum is refined. With 16
/// intervals a cubic variation exceeds its samples by at most 3 %.
const REFINEMENT_RATIO: f64 = 0.9;
/// Distance between sides relative to the size of the tool below which they coincide.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-6;

/// Deviations of the free borders.
#[derive(Debug, Clone, Default)]
pub(super) struct Compared {
    pub whole: Borders,
    /// Largest deviation at each CAD face [mm].
    pub by_face: BTreeMap<u32, f64>,
}

/// Largest distance of a side of the tool or an edge of the CAD, and its location.
struct LargestDistance<'a> {
    face: u32,
    of_tool: bool,
    mm: f64,
    at: Vec3,
    step_mm: f64,
    /// Refines the maximum around that point.
    refined: Box<dyn Fn() -> (Vec3, f64) + Sync + Send + 'a>,
}

/// Compares the sides `free` of a tool, each used by one patch, with the borders of the CAD at `n` or more intervals
/// per side, refined around the maxima. `None` for a reference without known borders.
pub(super) fn compare(
    tool: &ToolModel,
    reference: &impl ReferenceSurface,
    free: &[Side],
    n: usize,
) -> Option<Compared> {
    let faces: BTreeSet<u32> = tool.faces.iter().copied().collect();
    let edges = reference.border_edges(&faces)?;
    let sides = Sides::new(tool, free);
    let n = n.max(INTERVALS_MIN);
    let edge_boxes: Vec<Aabb> = edges.iter().map(|e| Aabb::of_points(e.curve.points())).collect();
    let edge_tree = BoxTree::build(&edge_boxes);
    // The deviation of a border without a counterpart is limited by its extent.
    let tool_size = extent(sides.open.iter().map(|&k| sides.curves[k].bounds()));
    let cad_size = extent(edge_boxes.iter().copied());
    let from_edges = |p: &Vec3| {
        let visit = bounded(|k, best| best.min(edges[k as usize].curve.closest(p).1));
        let found = edge_tree.nearest(p, f64::INFINITY, visit).sqrt();
        Some(if found.is_finite() { found } else { tool_size })
    };
    let from_sides = |face: u32, p: &Vec3| {
        let found = || Some(sides.distance(p)).filter(|d| d.is_finite()).unwrap_or(cad_size);
        (!reference.continues(p, face, &faces)).then(found)
    };
    let mut far: Vec<LargestDistance<'_>> = sides
        .open
        .par_iter()
        .filter_map(|&k| {
            let curve = &sides.curves[k];
            farthest(sides.faces[k], true, n, move |s| curve.point(s), from_edges)
        })
        .collect();
    let step_mm = sides.mean_chord() / n as f64;
    let of_edges: Vec<LargestDistance<'_>> = edges
        .par_iter()
        .filter_map(|e| farthest_on_edge(*e, step_mm, n, move |p| from_sides(e.face, p)))
        .collect();
    far.extend(of_edges);
    Some(compared(far))
}

/// Diagonal of the union of bounding boxes [mm].
fn extent(boxes: impl Iterator<Item = Aabb>) -> f64 {
    boxes.fold(Aabb::EMPTY, |sum, b| sum.union(&b)).diagonal()
}

/// Largest distance of an edge at intervals of about `step_mm` [mm], at min_intervals `min_intervals` of them.
fn farthest_on_edge<'a>(
    e: BorderEdge<'a>,
    step_mm: f64,
    min_intervals: usize,
    distance: impl Fn(&Vec3) -> Option<f64> + Sync + Send + 'a,
) -> Option<LargestDistance<'a>> {
    let [a, b] = e.curve.domain();
    let count = intervals(e.curve.length(), step_mm, min_intervals);
    let point = move |s: f64| e.curve.point(a + (b - a) * s);
    farthest(e.face, false, count, point, distance)
}

/// Restricts the visits to the first [`VISITS_MAX`] curves, those with the nearest boxes: the distance is never too
/// small.
fn bounded(visit: impl Fn(u32, f64) -> f64) -> impl FnMut(u32, f64) -> f64 {
    let mut visits = 0;
    move |k, best| {
        visits += 1;
        if visits <= VISITS_MAX { visit(k, best) } else { best }
    }
}

/// Number of intervals of an edge of length `length` [mm].
fn intervals(length: f64, step_mm: f64, min_intervals: usize) -> usize {
    let required = if step_mm > 0.0 { (length / step_mm).ceil() } else { 0.0 };
    (required as usize).clamp(min_intervals, INTERVALS_MAX)
}

/// Largest distance at `n` intervals of a curve over [0, 1]; `None` where no point counts.
fn farthest<'a>(
    face: u32,
    of_tool: bool,
    n: usize,
    point: impl Fn(f64) -> Vec3 + Sync + Send + 'a,
    distance: impl Fn(&Vec3) -> Option<f64> + Sync + Send + 'a,
) -> Option<LargestDistance<'a>> {
    let at = |k: usize| k as f64 / n as f64;
    let (mut largest, mut last, mut step_mm) = (None::<(f64, f64, Vec3)>, None, 0.0f64);
    for k in 0..=n {
        let p = point(at(k));
        let here = distance(&p);
        if let Some(mm) = here
            && largest.is_none_or(|(_, max_mm, _)| mm > max_mm)
        {
            largest = Some((at(k), mm, p));
        }
        let next = here.map(|_| p);
        step_mm =
            last.zip(next).map_or(step_mm, |(a, b): (Vec3, Vec3)| step_mm.max((b - a).norm()));
        last = next;
    }
    let (s, mm, place) = largest?;
    let around = [(s - at(1)).max(0.0), (s + at(1)).min(1.0)];
    let refined = move || {
        let value = |t: f64| distance(&point(t)).unwrap_or(0.0);
        let (t, negative) = minimize(|t| -value(t), around, REFINEMENTS);
        (point(t), -negative)
    };
    Some(LargestDistance { face, of_tool, mm, at: place, step_mm, refined: Box::new(refined) })
}

/// Combines the distances of all sides and edges; those within [`REFINEMENT_RATIO`] of the largest of their face are
/// refined.
fn compared(mut far: Vec<LargestDistance<'_>>) -> Compared {
    let mut largest: BTreeMap<(u32, bool), f64> = BTreeMap::new();
    for f in &far {
        let max_mm = largest.entry((f.face, f.of_tool)).or_default();
        *max_mm = max_mm.max(f.mm);
    }
    far.par_iter_mut()
        .filter(|f| f.mm > 0.0 && f.mm >= REFINEMENT_RATIO * largest[&(f.face, f.of_tool)])
        .for_each(|f| {
            let (at, mm) = (f.refined)();
            if mm > f.mm {
                (f.at, f.mm) = (at, mm);
            }
        });
    let mut out = Compared::default();
    let mut max_mm = 0.0;
    for f in &far {
        let whole = &mut out.whole;
        let (count, deviation) = if f.of_tool {
            (&mut whole.tool_sides, &mut whole.tool_to_cad_mm)
        } else {
            (&mut whole.cad_edges, &mut whole.cad_to_tool_mm)
        };
        *count += 1;
        *deviation = deviation.max(f.mm);
        whole.step_mm = whole.step_mm.max(f.step_mm);
        let own = out.by_face.entry(f.face).or_default();
        *own = own.max(f.mm);
        if f.mm > max_mm || whole.at.is_none() {
            max_mm = f.mm;
            (whole.at, whole.face) = (Some(f.at.into()), Some(f.face));
        }
    }
    out
}

/// Sides used by one patch.
struct Sides<'a> {
    curves: Vec<SideCurve<'a>>,
    faces: Vec<u32>,
    /// Indices of the sides at free borders: no other side coincides with them.
    open: Vec<usize>,
    tree: BoxTree,
}

impl<'a> Sides<'a> {
    fn new(tool: &'a ToolModel, free: &[Side]) -> Self {
        let curve = |s: &Side| SideCurve::new(&tool.patches[s.patch], s.side);
        let curves: Vec<SideCurve<'a>> = free.par_iter().map(curve).collect();
        let boxes: Vec<Aabb> = curves.iter().map(SideCurve::bounds).collect();
        let tree = BoxTree::build(&boxes);
        let size = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b)).diagonal();
        let meets = |k: usize, p: &Vec3| {
            let near = (COINCIDENCE_TOLERANCE_REL * size).powi(2);
            let visit = |other: u32, best: f64| {
                let other = other as usize;
                if other == k { best } else { best.min(curves[other].distance(p).powi(2)) }
            };
            tree.nearest(p, near, visit) < near
        };
        let is_open =
            |k: &usize| ![0.25, 0.5, 0.75].iter().all(|&t| meets(*k, &curves[*k].point(t)));
        let open = (0..curves.len()).into_par_iter().filter(is_open).collect::<Vec<usize>>();
        let faces = free.iter().map(|s| tool.faces[s.patch]).collect();
        let tree = BoxTree::build(&open.iter().map(|&k| boxes[k]).collect::<Vec<Aabb>>());
        Self { curves, faces, open, tree }
    }

    /// Distance from the free sides [mm]; infinite without any.
    fn distance(&self, p: &Vec3) -> f64 {
        let open = |k: u32| &self.curves[self.open[k as usize]];
        let visit = bounded(|k, best| best.min(open(k).distance(p).powi(2)));
        self.tree.nearest(p, f64::INFINITY, visit).sqrt()
    }

    /// Mean chord length of the free sides [mm]; 0 without any.
    fn mean_chord(&self) -> f64 {
        let sum: f64 = self.open.iter().map(|&k| self.curves[k].chord()).sum();
        sum / self.open.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests;
