//! Point projection onto a trimmed model: bounding volume hierarchies over rectangles of faces and pieces of edges,
//! with bounded Newton iteration in each.

mod best;
mod leaf;
mod piece;
mod span;
#[cfg(test)]
mod tests;

use super::model::{EdgeUse, Face, Foot, FootLocation, Model};
use super::trim_region::TrimRegion;
use best::Best;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::{Aabb, Vec2, Vec3};
use leaf::{Leaf, leaves_of};
use piece::MemoryBudget;
use span::{Span, spans_of};

/// Search structure for closest points on a model; built once, queried from any number of threads.
pub struct ClosestPoint<'m> {
    model: &'m Model,
    regions: Vec<TrimRegion>,
    leaves: Vec<Leaf>,
    /// Remaining memory for subdivided leaves.
    memory: MemoryBudget,
    spans: Vec<Span>,
    /// Hierarchy over leaves (first) and spans.
    tree: BoxTree,
    /// Index of the first leaf of each face, and the hierarchy over its leaves.
    face_leaves: Vec<(u32, BoxTree)>,
    /// Edge pieces of each face, and their hierarchy.
    face_spans: Vec<(Vec<u32>, BoxTree)>,
    /// Diagonal of the model's bounding box [mm].
    size: f64,
}

/// Maximum number of leaves and sub-rectangles examined per query; the hardest of 150 files needs 1783. A query that
/// exceeds it has no answer. Doubled: twice the longest query.
const VISITS_MAX: u32 = 5_000;

/// Squared distance that ends a search.
const SEARCH_DONE: f64 = -1.0;

/// The query exceeded its work limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkLimitReached;

/// Distance relative to the model's size below which two points coincide.
const COINCIDENCE_TOLERANCE_REL: f64 = 1e-9;

/// The closest point on the edges of a face.
#[derive(Debug, Clone, Copy)]
pub struct EdgeFoot {
    /// The edge.
    pub edge: usize,
    /// Parameter on its curve, over its domain: 0 to 1.
    pub fraction: f64,
    /// The point [mm].
    pub point: Vec3,
}

/// State of a search.
struct Search<'p> {
    p: &'p Vec3,
    inside: Best,
    /// Span, parameter, squared distance [mm^2].
    edge: Option<(u32, f64, f64)>,
    /// Leaves and sub-rectangles that may still be examined.
    left: u32,
}

impl<'m> ClosestPoint<'m> {
    /// Builds the hierarchies over all faces and edges.
    #[must_use]
    pub fn new(model: &'m Model) -> Self {
        use rayon::prelude::*;
        let prepare = |(f, face): (usize, &Face)| {
            let region = TrimRegion::new(face);
            let leaves = leaves_of(f as u32, face, &region);
            (region, leaves)
        };
        let parts: Vec<(TrimRegion, Vec<Leaf>)> =
            model.faces.par_iter().enumerate().map(prepare).collect();
        let (mut regions, mut leaves, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        let mut face_leaves = Vec::new();
        for (region, own) in parts {
            let own_boxes: Vec<Aabb> = own.iter().map(Leaf::bounds).collect();
            face_leaves.push((leaves.len() as u32, BoxTree::build(&own_boxes)));
            leaves.extend(own);
            boxes.extend(own_boxes);
            regions.push(region);
        }
        // Edges of faces that are not in the model have no uses.
        let edges = model.edges.iter().enumerate().filter(|(_, e)| !e.uses.is_empty());
        let spans: Vec<Span> = edges.flat_map(|(k, e)| spans_of(k as u32, &e.curve)).collect();
        let span_boxes: Vec<Aabb> = spans.iter().map(Span::bounds).collect();
        boxes.extend_from_slice(&span_boxes);
        Self {
            model,
            regions,
            memory: MemoryBudget::of_pieces(leaves.iter().map(Leaf::bytes).sum()),
            leaves,
            tree: BoxTree::build(&boxes),
            face_leaves,
            face_spans: spans_by_face(model, &spans, &span_boxes),
            spans,
            size: boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b)).diagonal(),
        }
    }

    /// The model searched.
    #[must_use]
    pub fn model(&self) -> &'m Model {
        self.model
    }

    /// True when `uv` is inside the trimmed region of a face or on its border.
    pub fn region_contains(&self, face: usize, uv: Vec2) -> bool {
        self.regions[face].contains(uv)
    }

    /// Globally closest point of the trimmed model. `None` when the model has no faces, `p` is not finite, or the query
    /// exceeds its work limit, as on self-folding surfaces.
    ///
    /// Among faces at equal distance the lowest index is returned. For a foot point on an edge or vertex (within 1e-9
    /// of the model's size) the face is the adjacent one whose normal is most nearly parallel to `p - foot`.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> Option<Foot> {
        if !p.iter().all(|x| x.is_finite()) {
            return None;
        }
        self.nearest(Search::new(p)).ok().flatten()
    }

    /// As [`Self::closest`], restricted to distances below `distance` [mm]. `known`: face and parameters of a known foot
    /// point, a local minimum of the distance inside the face. The parts of the face around it are not searched again.
    ///
    /// # Errors
    /// [`WorkLimitReached`] when the query exceeds its work limit.
    pub fn closest_within(
        &self,
        p: &Vec3,
        distance: f64,
        known: Option<(u32, Vec2)>,
    ) -> Result<Option<Foot>, WorkLimitReached> {
        if !p.iter().all(|x| x.is_finite()) || distance.is_nan() || distance <= 0.0 {
            return Ok(None);
        }
        let mut search = Search::new(p);
        search.inside.distance = distance * distance;
        search.inside.known = known;
        Ok(self.nearest(search)?.filter(|foot| foot.distance < distance))
    }

    fn nearest(&self, mut search: Search) -> Result<Option<Foot>, WorkLimitReached> {
        let leaves = self.leaves.len() as u32;
        self.tree.nearest(search.p, self.reach(&search), |k, _| {
            if k < leaves {
                self.try_leaf(k, &mut search);
            } else {
                self.try_span(k - leaves, &mut search);
            }
            self.reach(&search)
        });
        self.answer(&search, None)
    }

    /// The foot point, or an error when the search ended at its work limit.
    fn answer(
        &self,
        search: &Search,
        only: Option<usize>,
    ) -> Result<Option<Foot>, WorkLimitReached> {
        if search.left == 0 { Err(WorkLimitReached) } else { Ok(self.foot(search, only)) }
    }

    /// Closest points of a list of points, in the same order.
    #[must_use]
    pub fn closest_many(&self, points: &[Vec3]) -> Vec<Option<Foot>> {
        use rayon::prelude::*;
        points.par_iter().map(|p| self.closest(p)).collect()
    }

    /// Closest point on one trimmed face; `None` for an invalid index and as for [`Self::closest`].
    #[must_use]
    pub fn closest_on_face(&self, face: usize, p: &Vec3) -> Option<Foot> {
        let (first, tree) = self.face_leaves.get(face)?;
        if !p.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut search = Search::new(p);
        // The edges bound the search of the face, whose foot points may all be outside its loops.
        let (ids, span_tree) = &self.face_spans[face];
        span_tree.nearest(p, f64::INFINITY, |k, _| {
            self.try_span(ids[k as usize], &mut search);
            self.reach(&search)
        });
        search.left = VISITS_MAX;
        search.inside.distance = self.reach(&search);
        tree.nearest(p, search.inside.distance, |k, _| {
            self.try_leaf(first + k, &mut search);
            if search.left == 0 { SEARCH_DONE } else { search.inside.distance }
        });
        if search.inside.foot.is_none() {
            search.inside.distance = f64::INFINITY;
        }
        self.answer(&search, Some(face)).ok().flatten()
    }

    /// Point of the edges of a face closest to `p`; `None` for a face without edges.
    pub fn closest_edge_of_face(&self, face: usize, p: &Vec3) -> Option<EdgeFoot> {
        let (ids, tree) = self.face_spans.get(face)?;
        let mut search = Search::new(p);
        tree.nearest(p, f64::INFINITY, |k, _| {
            self.try_span(ids[k as usize], &mut search);
            search.edge.map_or(f64::INFINITY, |e| e.2)
        });
        let (span, t, _) = search.edge?;
        let span = &self.spans[span as usize];
        let edge = span.edge as usize;
        let [a, b] = self.model.edges[edge].curve.domain();
        Some(EdgeFoot { edge, fraction: (t - a) / (b - a), point: span.curve.point(t) })
    }

    /// Squared search radius: a leaf or span within it may contain the answer, or the edge that carries a foot point
    /// found on a face.
    fn reach(&self, search: &Search) -> f64 {
        if search.left == 0 {
            return SEARCH_DONE;
        }
        let edge = search.edge.map_or(f64::INFINITY, |e| e.2);
        (search.inside.distance.min(edge).sqrt() + COINCIDENCE_TOLERANCE_REL * self.size).powi(2)
    }

    fn try_leaf(&self, k: u32, search: &mut Search) {
        let leaf = &self.leaves[k as usize];
        let region = &self.regions[leaf.face() as usize];
        leaf.search(search.p, region, &mut search.inside, (&mut search.left, &self.memory));
    }

    fn try_span(&self, k: u32, search: &mut Search) {
        search.left = search.left.saturating_sub(1);
        let (t, distance) = self.spans[k as usize].closest(search.p);
        let nearer = |f: (u32, f64, f64)| distance < f.2 || (distance == f.2 && k < f.0);
        if search.edge.is_none_or(nearer) {
            search.edge = Some((k, t, distance));
        }
    }

    /// The closer of the foot points inside a face and on an edge; the edge is preferred when both coincide.
    fn foot(&self, search: &Search, only: Option<usize>) -> Option<Foot> {
        let (p, best) = (search.p, &search.inside);
        let inside = best.foot.map(|(face, uv)| self.face_foot(face as usize, uv, p));
        let near = (best.distance.sqrt() + COINCIDENCE_TOLERANCE_REL * self.size).powi(2);
        let on_edge = search.edge.filter(|e| e.2 < near);
        let Some((span, t, distance)) = on_edge else { return inside };
        let at = self.spans[span as usize].curve.point(t);
        let same = |f: &Foot| (f.point - at).norm() <= COINCIDENCE_TOLERANCE_REL * self.size;
        if distance >= best.distance && !inside.as_ref().is_some_and(same) {
            return inside;
        }
        let foot = self.edge_foot(span, t, p, only);
        match (foot, inside) {
            // Both coincide within the gap of the edge: the closer point, located at the edge.
            (Some(e), Some(f)) if f.distance < e.distance && e.face == f.face => {
                Some(Foot { location: e.location, ..f })
            }
            (Some(e), Some(f)) if f.distance < e.distance => {
                Some(Foot { point: f.point, distance: f.distance, ..e })
            }
            (foot, inside) => foot.or(inside),
        }
    }

    fn face_foot(&self, face: usize, uv: Vec2, p: &Vec3) -> Foot {
        let f = &self.model.faces[face];
        let point = f.surface.point(uv);
        Foot {
            face,
            uv,
            point,
            normal: f.normal(uv).unwrap_or_else(Vec3::zeros),
            distance: (point - p).norm(),
            location: FootLocation::Inside,
        }
    }

    /// Foot point on an edge, on the adjacent face whose normal is most nearly parallel to `p - foot`, or on the face
    /// requested.
    fn edge_foot(&self, span: u32, t: f64, p: &Vec3, only: Option<usize>) -> Option<Foot> {
        let span = &self.spans[span as usize];
        let edge = &self.model.edges[span.edge as usize];
        let point = span.curve.point(t);
        let r = p - point;
        let [a, b] = edge.curve.domain();
        let fraction = (t - a) / (b - a);
        let location = self.location(span.edge as usize, fraction, &point);
        let near = self.model.join_tolerance.max(COINCIDENCE_TOLERANCE_REL * self.size);
        let mut best: Option<(f64, Foot)> = None;
        for &[face, ring, place] in &edge.uses {
            if only.is_some_and(|f| f != face) {
                continue;
            }
            let f = &self.model.faces[face];
            let Some(used) = f.loops.get(ring).and_then(|l| l.uses.get(place)) else { continue };
            let uv = uv_on_use(f, used, fraction, &point, near);
            let normal = f.normal(uv).unwrap_or_else(Vec3::zeros);
            let straight = normal.dot(&r).abs();
            let margin = 1e-9 * r.norm();
            let better = |b: &(f64, Foot)| {
                straight > b.0 + margin || (straight >= b.0 - margin && face < b.1.face)
            };
            if best.as_ref().is_none_or(better) {
                best = Some((
                    straight,
                    Foot { face, uv, point, normal, distance: r.norm(), location },
                ));
            }
        }
        best.map(|b| b.1)
    }

    fn location(&self, edge: usize, fraction: f64, point: &Vec3) -> FootLocation {
        let ends = self.model.edges[edge].vertices;
        if fraction <= 1e-12 {
            return FootLocation::Vertex(ends[0]);
        }
        if fraction >= 1.0 - 1e-12 {
            return FootLocation::Vertex(ends[1]);
        }
        let near = |v: &&usize| {
            let vertex = self.model.vertices.get(**v);
            vertex.is_some_and(|x| (x - point).norm() <= COINCIDENCE_TOLERANCE_REL * self.size)
        };
        ends.iter().find(near).map_or(FootLocation::Edge(edge), |&v| FootLocation::Vertex(v))
    }
}

/// Parameters on a face of a point on its boundary edge. Start: the parameter curve where it matches the edge curve,
/// otherwise its nearest sample; then Newton iteration. The edge lies within `near` [mm] of the face.
fn uv_on_use(face: &Face, used: &EdgeUse, fraction: f64, point: &Vec3, near: f64) -> Vec2 {
    let [a, b] = used.pcurve.domain();
    let fraction = if used.reversed { 1.0 - fraction } else { fraction };
    let off = |uv: Vec2| (face.surface.point(uv) - point).norm_squared();
    let mut start = used.pcurve.point(a + (b - a) * fraction);
    let mut smallest = off(start);
    let samples = if smallest <= near * near { 0..0 } else { 0..9 };
    for k in samples {
        let uv = used.pcurve.point(a + (b - a) * f64::from(k) / 8.0);
        let distance = off(uv);
        if distance < smallest {
            (start, smallest) = (uv, distance);
        }
    }
    face.surface.closest_near(point, start, near * near).0
}

impl<'p> Search<'p> {
    fn new(p: &'p Vec3) -> Self {
        Self {
            p,
            inside: Best { distance: f64::INFINITY, foot: None, known: None },
            edge: None,
            left: VISITS_MAX,
        }
    }
}

fn spans_by_face(model: &Model, spans: &[Span], boxes: &[Aabb]) -> Vec<(Vec<u32>, BoxTree)> {
    let mut of_edge: Vec<Vec<u32>> = vec![Vec::new(); model.edges.len()];
    for (k, span) in spans.iter().enumerate() {
        of_edge[span.edge as usize].push(k as u32);
    }
    let one = |face: &Face| {
        let uses = face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
        let mut ids: Vec<u32> = uses.filter_map(|e| of_edge.get(e)).flatten().copied().collect();
        ids.sort_unstable();
        ids.dedup();
        let own: Vec<Aabb> = ids.iter().map(|&k| boxes[k as usize]).collect();
        (ids, BoxTree::build(&own))
    };
    model.faces.iter().map(one).collect()
}
