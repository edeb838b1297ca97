//! The closest point of a trimmed model: a tree of boxes over small rectangles of the faces and one over pieces of
//! the edges, bounded Newton inside each.

use super::model::{Face, Foot, FootLocation, Model};
use super::trim_region::TrimRegion;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::nurbs::Curve3;
use crate::geometry::{Aabb, Vec2, Vec3};

/// A rectangle of a face's parameter plane.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    face: u32,
    low: Vec2,
    high: Vec2,
}

/// A Bezier piece of an edge.
struct EdgePiece {
    edge: u32,
    curve: Curve3,
}

/// Index for closest points on a model; built once, queried from any number of threads.
pub struct ClosestPoint<'m> {
    model: &'m Model,
    regions: Vec<TrimRegion>,
    leaves: Vec<Leaf>,
    /// Leaves of each face, and their tree.
    face_trees: Vec<BoxTree>,
    first_leaf: Vec<u32>,
    tree: BoxTree,
    edges: Vec<EdgePiece>,
    edge_tree: BoxTree,
    /// Pieces of the edges of each face, and their tree.
    face_edges: Vec<(Vec<u32>, BoxTree)>,
}

/// Rectangles along one direction of a Bezier piece that is not straight.
const CUTS: usize = 4;

impl<'m> ClosestPoint<'m> {
    /// Builds the trees over all faces and edges.
    #[must_use]
    pub fn new(model: &'m Model) -> Self {
        use rayon::prelude::*;
        let parts: Vec<(TrimRegion, Vec<(Leaf, Aabb)>)> = model
            .faces
            .par_iter()
            .enumerate()
            .map(|(f, face)| {
                let region = TrimRegion::new(face);
                let leaves = leaves_of(f as u32, face, &region);
                (region, leaves)
            })
            .collect();
        let (mut regions, mut leaves, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        let (mut face_trees, mut first_leaf) = (Vec::new(), Vec::new());
        for (region, own) in parts {
            first_leaf.push(leaves.len() as u32);
            let own_boxes: Vec<Aabb> = own.iter().map(|l| l.1).collect();
            face_trees.push(BoxTree::build(&own_boxes));
            leaves.extend(own.into_iter().map(|l| l.0));
            boxes.extend(own_boxes);
            regions.push(region);
        }
        let mut edges = Vec::new();
        let mut pieces_of_edge: Vec<Vec<u32>> = vec![Vec::new(); model.edges.len()];
        for (edge, e) in model.edges.iter().enumerate() {
            for curve in e.curve.bezier_pieces() {
                pieces_of_edge[edge].push(edges.len() as u32);
                edges.push(EdgePiece { edge: edge as u32, curve });
            }
        }
        let edge_boxes: Vec<Aabb> =
            edges.iter().map(|e| Aabb::of_points(e.curve.points())).collect();
        let face_edges = model.faces.iter().map(|face| {
            let uses = face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
            let mut pieces: Vec<u32> =
                uses.flat_map(|e| pieces_of_edge[e].iter().copied()).collect();
            pieces.sort_unstable();
            pieces.dedup();
            let boxes: Vec<Aabb> = pieces.iter().map(|&k| edge_boxes[k as usize]).collect();
            (pieces, BoxTree::build(&boxes))
        });
        let face_edges = face_edges.collect();
        Self {
            model,
            regions,
            face_trees,
            first_leaf,
            tree: BoxTree::build(&boxes),
            leaves,
            edge_tree: BoxTree::build(&edge_boxes),
            edges,
            face_edges,
        }
    }

    /// The model that is searched.
    #[must_use]
    pub fn model(&self) -> &'m Model {
        self.model
    }

    /// Globally closest point of the trimmed model; `None` when it has no faces. At an edge the foot is given on
    /// that of its faces which looks most straight at `p`.
    #[must_use]
    pub fn closest(&self, p: &Vec3) -> Option<Foot> {
        let mut inside: Option<(u32, Vec2)> = None;
        let mut best =
            self.tree.nearest(p, f64::INFINITY, |k, best| self.try_leaf(k, p, best, &mut inside));
        let mut on_edge: Option<(u32, f64)> = None;
        // An edge must be nearer by more than rounding to take the foot from a face.
        let scale = 1e-24 * self.scale_squared(p);
        best = self
            .edge_tree
            .nearest(p, (best - scale).max(0.0), |k, best| self.try_edge(k, p, best, &mut on_edge));
        match (on_edge, inside) {
            (Some((piece, t)), _) => self.edge_foot(piece, t, p, None),
            (None, Some((face, uv))) => Some(self.face_foot(face, uv, p, best)),
            (None, None) => None,
        }
    }

    /// Closest points of many points, in order.
    #[must_use]
    pub fn closest_many(&self, points: &[Vec3]) -> Vec<Option<Foot>> {
        use rayon::prelude::*;
        points.par_iter().map(|p| self.closest(p)).collect()
    }

    /// Closest point on one trimmed face; `None` for a face that is not there.
    #[must_use]
    pub fn closest_on_face(&self, face: usize, p: &Vec3) -> Option<Foot> {
        let tree = self.face_trees.get(face)?;
        let first = self.first_leaf[face];
        let mut inside: Option<(u32, Vec2)> = None;
        let best = tree
            .nearest(p, f64::INFINITY, |k, best| self.try_leaf(first + k, p, best, &mut inside));
        let (pieces, edge_tree) = &self.face_edges[face];
        let mut on_edge: Option<(u32, f64)> = None;
        let scale = 1e-24 * self.scale_squared(p);
        edge_tree.nearest(p, (best - scale).max(0.0), |k, best| {
            self.try_edge(pieces[k as usize], p, best, &mut on_edge)
        });
        match (on_edge, inside) {
            (Some((piece, t)), _) => self.edge_foot(piece, t, p, Some(face)),
            (None, Some((_, uv))) => Some(self.face_foot(face as u32, uv, p, best)),
            (None, None) => None,
        }
    }

    fn scale_squared(&self, p: &Vec3) -> f64 {
        p.norm_squared().max(self.model.join_tolerance.powi(2) * 1e12)
    }

    fn try_leaf(&self, k: u32, p: &Vec3, best: f64, inside: &mut Option<(u32, Vec2)>) -> f64 {
        let leaf = &self.leaves[k as usize];
        let face = &self.model.faces[leaf.face as usize];
        let (uv, distance) = face.surface.closest_within(p, leaf.low, leaf.high);
        if distance < best && self.regions[leaf.face as usize].contains(uv) {
            *inside = Some((leaf.face, uv));
            return distance;
        }
        best
    }

    fn try_edge(&self, k: u32, p: &Vec3, best: f64, found: &mut Option<(u32, f64)>) -> f64 {
        let (t, distance) = self.edges[k as usize].curve.closest(p);
        if distance < best {
            *found = Some((k, t));
            return distance;
        }
        best
    }

    fn face_foot(&self, face: u32, uv: Vec2, p: &Vec3, distance_squared: f64) -> Foot {
        let f = &self.model.faces[face as usize];
        let point = f.surface.point(uv);
        let _ = p;
        Foot {
            face: face as usize,
            uv,
            point,
            normal: f.normal(uv).unwrap_or_else(Vec3::zeros),
            distance: distance_squared.sqrt(),
            location: FootLocation::Inside,
        }
    }

    /// The foot on an edge, on the face that looks most straight at `p` (or on the face asked for).
    fn edge_foot(&self, piece: u32, t: f64, p: &Vec3, only: Option<usize>) -> Option<Foot> {
        let piece = &self.edges[piece as usize];
        let edge = &self.model.edges[piece.edge as usize];
        let point = piece.curve.point(t);
        let r = p - point;
        let mut best: Option<(f64, Foot)> = None;
        for &[face, ..] in edge.uses.iter().filter(|u| only.is_none_or(|f| f == u[0])) {
            let f = &self.model.faces[face];
            let (uv, _) = f.surface.closest(&point);
            let normal = f.normal(uv).unwrap_or_else(Vec3::zeros);
            let straight = normal.dot(&r).abs();
            if best.as_ref().is_none_or(|b| straight > b.0) {
                let location = self.at_vertex(piece.edge as usize, &point);
                let foot = Foot { face, uv, point, normal, distance: r.norm(), location };
                best = Some((straight, foot));
            }
        }
        best.map(|b| b.1)
    }

    fn at_vertex(&self, edge: usize, point: &Vec3) -> FootLocation {
        let near =
            |v: &&usize| (self.model.vertices[**v] - point).norm() <= self.model.join_tolerance;
        match self.model.edges[edge].vertices.iter().find(near) {
            Some(&v) => FootLocation::Vertex(v),
            None => FootLocation::Edge(edge),
        }
    }
}

/// Small rectangles over the loops' box, cut at knots and, where the surface bends, inside spans.
fn leaves_of(id: u32, face: &Face, region: &TrimRegion) -> Vec<(Leaf, Aabb)> {
    let surface = &face.surface;
    let cuts = |k: usize, low: f64, high: f64| -> Vec<f64> {
        let mut out = vec![low];
        out.extend(surface.knots()[k].iter().copied().filter(|&t| t > low && t < high));
        out.push(high);
        out.dedup();
        if surface.degrees()[k] == 1 {
            return out;
        }
        let fine = |w: &[f64]| -> Vec<f64> {
            (0..CUTS).map(|c| w[0] + (w[1] - w[0]) * c as f64 / CUTS as f64).collect()
        };
        let mut finer: Vec<f64> = out.windows(2).flat_map(fine).collect();
        finer.push(high);
        finer
    };
    let us = cuts(0, region.low.x, region.high.x);
    let vs = cuts(1, region.low.y, region.high.y);
    let mut leaves = Vec::new();
    for u in us.windows(2) {
        let Ok(strip) = surface.trimmed([u[0], u[1]], surface.domain()[1]) else { continue };
        for v in vs.windows(2) {
            let Ok(piece) = strip.trimmed([u[0], u[1]], [v[0], v[1]]) else { continue };
            let leaf = Leaf { face: id, low: Vec2::new(u[0], v[0]), high: Vec2::new(u[1], v[1]) };
            leaves.push((leaf, Aabb::of_points(piece.points())));
        }
    }
    leaves
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn model(name: &str) -> Model {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming").join(name);
        crate::cad::read(&path).unwrap().0
    }

    /// Points of all faces on a grid of the parameter plane, inside the trim.
    fn samples(model: &Model, n: usize) -> Vec<(usize, Vec2, Vec3)> {
        let mut out = Vec::new();
        for (f, face) in model.faces.iter().enumerate() {
            let region = TrimRegion::new(face);
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let share = Vec2::new(i as f64 / n as f64, j as f64 / n as f64);
                let uv = region.low + (region.high - region.low).component_mul(&share);
                if region.contains(uv) {
                    out.push((f, uv, face.surface.point(uv)));
                }
            }
        }
        out
    }

    #[test]
    fn no_sample_is_nearer_than_the_answer() {
        for name in [
            "cross_die_144.igs",
            "cross_punch_AP214.stp",
            "square_punch_186.igs",
            "torus_AP214.stp",
        ] {
            let model = model(name);
            let index = ClosestPoint::new(&model);
            let dense = samples(&model, 60);
            let bounds = model.bbox();
            let mut seed = 5u64;
            let mut random = || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (seed >> 33) as f64 / (1u64 << 31) as f64
            };
            for _ in 0..200 {
                let share = Vec3::new(random(), random(), random()).map(|x| 1.4 * x - 0.2);
                let p = bounds.min + (bounds.max - bounds.min).component_mul(&share);
                let foot = index.closest(&p).unwrap();
                assert!(((foot.point - p).norm() - foot.distance).abs() < 1e-9);
                let best = dense.iter().map(|s| (s.2 - p).norm()).fold(f64::INFINITY, f64::min);
                assert!(foot.distance <= best + 1e-9, "{name} {p:?}: {} {best}", foot.distance);
                // And the answer lies on the model: nothing is invented.
                assert!(best <= foot.distance + 6.0, "{name} {p:?}: {} {best}", foot.distance);
            }
        }
    }

    #[test]
    fn points_off_a_face_along_its_normal_come_back() {
        let model = model("cross_die_144.igs");
        let index = ClosestPoint::new(&model);
        for (f, uv, x) in samples(&model, 9) {
            let n = model.faces[f].normal(uv).unwrap();
            for d in [0.02, -0.02] {
                let foot = index.closest(&(x + n * d)).unwrap();
                assert!((foot.distance - 0.02).abs() < 1e-9, "{f} {uv:?}: {}", foot.distance);
                assert!((foot.point - x).norm() < 1e-7);
            }
            let own = index.closest_on_face(f, &x).unwrap();
            assert!(own.distance < 1e-9 && own.face == f);
        }
    }
}
