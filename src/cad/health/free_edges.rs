//! Edges used by a single face, and the gaps between them.

use rayon::prelude::*;

use super::{
    FreeEdge, GAP_MAX_REL, GAP_PROJECTIONS_MIN, GAP_PROJECTIONS_TOTAL, GAP_SAMPLES,
    OPEN_JOINT_MAX_REL, OpenJoints, samples,
};
use crate::Model;
use crate::attributes::BodyKind;
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
    /// Edges in the model.
    edges: Vec<usize>,
}

impl Model {
    /// Edges used by a single face that is one of those taken, longest first.
    pub(super) fn free_edges(&self, is_taken: impl Fn(usize) -> bool) -> Vec<FreeEdge> {
        let is_free = |k: &usize| match &self.edges[*k].uses[..] {
            [only] => is_taken(only[0]),
            _ => false,
        };
        let free: Vec<usize> = (0..self.edges.len()).filter(is_free).collect();
        let gaps = Gaps::between(self, &free);
        let face_of = |edge: usize| self.edges[edge].uses[0][0];
        let one = |k: usize| {
            let (gap, gap_measured) = gaps.largest(k, |other| other == k);
            let length_mm = self.edges[free[k]].curve.length();
            let is_beside = |gap: &(f64, Vec3)| gap.0 <= OPEN_JOINT_MAX_REL * length_mm;
            let is_cut = |k: usize| self.left_out.contains(&free[k]);
            let apart = |other: usize| {
                is_cut(other) || self.are_no_joint([k, other].map(|k| face_of(free[k])))
            };
            let near = gap.filter(is_beside).filter(|_| !is_cut(k));
            let near = near.and_then(|_| gaps.largest(k, apart).0).filter(is_beside);
            let near = near.filter(|_| gaps.leaves_face(self, k, apart));
            FreeEdge {
                edge: free[k],
                face: face_of(free[k]),
                length_mm,
                gap_mm: gap.map(|gap| gap.0),
                gap_measured,
                open_joint_mm: near.map(|near| near.0),
                open_joint_at: near.map(|near| near.1),
            }
        };
        let mut out: Vec<FreeEdge> = (0..free.len()).into_par_iter().map(one).collect();
        out.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm));
        out
    }

    /// True for one face, and for faces of different bodies, as of a die and its binder.
    fn are_no_joint(&self, [f, g]: [usize; 2]) -> bool {
        let [own, other] = [f, g].map(|f| self.faces[f].attributes.body);
        let is_body =
            |body: usize| self.bodies.get(body).is_some_and(|body| body.kind != BodyKind::Faces);
        f == g || (own != other && is_body(own) && is_body(other))
    }

    /// Free edges of the faces taken that run beside those of other such faces; `None` without any.
    #[must_use]
    pub fn open_joints(&self, is_taken: impl Fn(usize) -> bool) -> Option<OpenJoints> {
        let free = self.free_edges(is_taken);
        let open: Vec<(f64, &FreeEdge)> =
            free.iter().filter_map(|edge| Some((edge.open_joint_mm?, edge))).collect();
        let (widest_mm, widest) = *open.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(OpenJoints {
            edges: open.len(),
            widest_mm,
            face: widest.face,
            at: widest.open_joint_at?,
            join_tolerance_mm: self.join_tolerance,
        })
    }

    /// A sentence on the open joints between all faces; `None` without any.
    #[must_use]
    pub fn open_joints_text(&self) -> Option<String> {
        let found = self.open_joints(|_| true)?;
        Some(format!(
            "{} free edges run beside edges of other faces, up to {:.3e} mm away ({} at ({:.3}, {:.3}, {:.3}) mm): the faces \
             are not joined there (joining tolerance {:.1e} mm), and a tool is open",
            found.edges,
            found.widest_mm,
            self.faces[found.face].source,
            found.at.x,
            found.at.y,
            found.at.z,
            self.join_tolerance
        ))
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
        Self { points, curves, tree, limit, budget, edges: free.to_vec() }
    }

    /// True when the nearest edge without those to `skip` lies beyond the face of the edge `own`, within 60 degrees of the direction
    /// in which the face ends: not on the other side of a sheet, nor of the face itself. In the middle of the edge; also where
    /// both are one to rounding.
    fn leaves_face(&self, model: &Model, own: usize, skip: impl Fn(usize) -> bool) -> bool {
        let [f, l, k] = model.edges[self.edges[own]].uses[0];
        let (face, pcurve) = (&model.faces[f], &model.faces[f].loops[l].uses[k].pcurve);
        let [a, b] = pcurve.domain();
        let trim = pcurve.derivs(0.5 * (a + b));
        let d = face.surface.derivs(trim.c);
        let (p, along) = (d.s, d.su * trim.d1.x + d.sv * trim.d1.y);
        let mut nearest = None;
        self.tree.nearest(&p, f64::INFINITY, |k, best| {
            if skip(k as usize) {
                return best;
            }
            let (t, distance) = self.curves[k as usize].closest(&p);
            if distance < best {
                nearest = Some((k as usize, t));
            }
            best.min(distance)
        });
        nearest.is_some_and(|(k, t)| {
            let away = model.edges[self.edges[k]].curve.point(t) - p;
            // Loops have their face to the left.
            let outward = along.cross(&d.su.cross(&d.sv));
            away.norm() <= model.join_tolerance
                || away.dot(&outward) > 0.5 * away.norm() * outward.norm()
        })
    }

    /// Largest distance [mm] of the edge `own` from the other free edges without those to `skip`, and its point; `None` beyond
    /// the limit. The flag is false when the projection budget was exhausted.
    fn largest(&self, own: usize, skip: impl Fn(usize) -> bool) -> (Option<(f64, Vec3)>, bool) {
        let Self { limit, budget, .. } = *self;
        let (mut worst, mut left) = ((0.0_f64, self.points[own][GAP_SAMPLES / 2]), budget);
        for p in &self.points[own][1..GAP_SAMPLES - 1] {
            // Distances beyond the largest gap are not searched.
            let start = (limit * limit).next_up();
            let found = self.tree.nearest(p, start, |k, best| {
                if skip(k as usize) || left == 0 || best == 0.0 {
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
            if found > worst.0 {
                worst = (found, *p);
            }
        }
        let worst = (worst.0.sqrt(), worst.1);
        ((worst.0 <= limit).then_some(worst), true)
    }
}
