//! Edges used by one face only, and the gaps between them.

use rayon::prelude::*;

use super::{FreeEdge, GAP_MOST, GAP_PROJECTIONS, GAP_PROJECTIONS_MIN, SAMPLES, samples};
use crate::cad::Model;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::nurbs::CurveProjector;
use crate::geometry::{Aabb, Vec3};

/// Free edges prepared for the search of the gaps between them.
struct Gaps {
    /// Points of each edge at which its distance from others is measured.
    points: Vec<Vec<Vec3>>,
    curves: Vec<CurveProjector>,
    /// Boxes of the edges' control points.
    tree: BoxTree,
    /// Gaps above this are none [mm].
    most: f64,
    /// Closest points on curves that the gap of one edge may take.
    budget: usize,
}

impl Model {
    /// Lists the edges used by one face only, longest first.
    pub(super) fn free_edges(&self) -> Vec<FreeEdge> {
        let free: Vec<usize> =
            (0..self.edges.len()).filter(|&k| self.edges[k].uses.len() == 1).collect();
        let gaps = Gaps::between(self, &free);
        let one = |k: usize| {
            let (gap_mm, gap_measured) = gaps.largest(k);
            FreeEdge {
                edge: free[k],
                face: self.edges[free[k]].uses[0][0],
                length_mm: self.edges[free[k]].curve.length(),
                gap_mm,
                gap_measured,
            }
        };
        let mut out: Vec<FreeEdge> = (0..free.len()).into_par_iter().map(one).collect();
        out.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm));
        out
    }
}

impl Gaps {
    /// Prepares the search between the edges `free` of a model.
    fn between(model: &Model, free: &[usize]) -> Self {
        let points: Vec<Vec<Vec3>> = free.iter().map(|&k| samples(&model.edges[k])).collect();
        let boxes: Vec<Aabb> = points.iter().map(Aabb::of_points).collect();
        let curves: Vec<CurveProjector> =
            free.iter().map(|&k| CurveProjector::new(&model.edges[k].curve)).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        let most = GAP_MOST * bounds.diagonal();
        let hull = |k: &usize| Aabb::of_points(model.edges[*k].curve.points());
        let tree = BoxTree::build(&free.iter().map(hull).collect::<Vec<_>>());
        let budget = GAP_PROJECTIONS_MIN.max(GAP_PROJECTIONS / free.len().max(1));
        Self { points, curves, tree, most, budget }
    }

    /// Largest distance [mm] of the edge `own` from the others, `None` where they are too far; false where the search took
    /// more than its budget.
    fn largest(&self, own: usize) -> (Option<f64>, bool) {
        let Self { most, budget, .. } = *self;
        let (mut worst, mut left) = (0.0_f64, budget);
        for p in &self.points[own][1..SAMPLES - 1] {
            // Beyond the largest gap of interest nothing is looked for.
            let start = (most * most).next_up();
            let found = self.tree.nearest(p, start, |k, best| {
                if k as usize == own || left == 0 || best == 0.0 {
                    return best;
                }
                left -= 1;
                best.min(self.curves[k as usize].closest(p).1)
            });
            if left == 0 {
                return (None, false);
            }
            if found >= start {
                return (None, true);
            }
            worst = worst.max(found);
        }
        let worst = worst.sqrt();
        ((worst <= most).then_some(worst), true)
    }
}
