//! Edges used by a single face, and the gaps between them.

use rayon::prelude::*;

use super::{
    FreeEdge, GAP_MAX_REL, GAP_PROJECTIONS_MIN, GAP_PROJECTIONS_TOTAL, GAP_SAMPLES, samples,
};
use crate::Model;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::nurbs::CurveProjector;
use kanagata_geometry::{Aabb, Vec3};

/// Search structure for the gaps between free edges.
struct Gaps {
    /// Sample points of each edge for the gap measurement.
    points: Vec<Vec<Vec3>>,
    curves: Vec<CurveProjector>,
    /// Hierarchy over the bounding boxes of the edges.
    tree: BoxTree,
    /// Largest gap measured [mm].
    limit: f64,
    /// Maximum number of point projections per edge.
    budget: usize,
}

impl Model {
    /// Edges used by a single face, longest first.
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
    /// Builds the search structure over the free edges of a model.
    fn between(model: &Model, free: &[usize]) -> Self {
        let points: Vec<Vec<Vec3>> = free.iter().map(|&k| samples(&model.edges[k])).collect();
        let boxes: Vec<Aabb> = points.iter().map(Aabb::of_points).collect();
        let curves: Vec<CurveProjector> =
            free.iter().map(|&k| CurveProjector::new(&model.edges[k].curve)).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        let limit = GAP_MAX_REL * bounds.diagonal();
        let hull = |k: &usize| Aabb::of_points(model.edges[*k].curve.points());
        let tree = BoxTree::build(&free.iter().map(hull).collect::<Vec<_>>());
        let budget = GAP_PROJECTIONS_MIN.max(GAP_PROJECTIONS_TOTAL / free.len().max(1));
        Self { points, curves, tree, limit, budget }
    }

    /// Largest distance [mm] of the edge `own` from the other free edges, `None` beyond the limit. The flag is false
    /// when the projection budget was exhausted.
    fn largest(&self, own: usize) -> (Option<f64>, bool) {
        let Self { limit, budget, .. } = *self;
        let (mut worst, mut left) = (0.0_f64, budget);
        for p in &self.points[own][1..GAP_SAMPLES - 1] {
            // Distances beyond the largest gap are not searched.
            let start = (limit * limit).next_up();
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
        ((worst <= limit).then_some(worst), true)
    }
}
