//! What a tool model is compared with: the trimmed CAD, or any surface that knows its closest points.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::cad::Model;
use crate::cad::closest::ClosestPoint;
use crate::cad::model::{Edge, Face, Foot, FootLocation};
use crate::cad::raw::LostFace;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::nurbs::Curve3;
use crate::geometry::{Aabb, Vec3};
use crate::tool::{Patch, ToolModel};

/// Faces around a point of a border that are asked whether they contain it, at most. Where more boxes overlap there, a
/// border may count as free that is not: the audit then reports more than there is, and its work is bounded.
const CONTINUES_MAX: usize = 64;

/// The closest point of a reference surface, as Eq. 24 uses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceFoot {
    /// Closest point `P_CAD` [mm].
    pub point: Vec3,
    /// Outward unit normal `n_CAD` there; zero where the surface has none (apex).
    pub normal: Vec3,
    /// When `face` is not the patch's own CAD face: the normal of the own face where it comes nearest. Beside a
    /// crease a point of one side may have its foot on the other; its normal is then right if it is either's. Zero where
    /// the own face has none: the other's says nothing of the patch then.
    pub own_normal: Option<Vec3>,
    /// Face the foot is on.
    pub face: u32,
    /// The foot is on a free border of the surface.
    pub on_border: bool,
}

/// A surface that knows its closest points. Queried from many threads.
pub trait ReferenceSurface: Sync {
    /// The closest point of the whole trimmed surface to `p`; `face` is the CAD face of the patch that `p` is
    /// on. Where several faces are equally near (an edge, a vertex) the patch's own face gives the normal, so
    /// that the sign of the error does not jump with the order of the faces. `None` when there is no surface, or finding the
    /// point takes more work than a query may.
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot>;

    /// Faces of its file that the surface lacks.
    fn lost_faces(&self) -> Vec<LostFace> {
        Vec::new()
    }

    /// The border of `face` nearest to `p`; `None` when the face has none that is known.
    fn border(&self, _p: &Vec3, _face: u32) -> Option<Border> {
        None
    }

    /// Edges that exactly one of `faces` uses, once: the border of these faces. `None` for a surface that does not know
    /// its borders.
    fn border_edges(&self, _faces: &BTreeSet<u32>) -> Option<Vec<BorderEdge<'_>>> {
        None
    }

    /// Whether one of `faces` other than `own` contains `p`, to within the tolerance of joining: a border that lies on
    /// another face, as of faces that meet without a common edge, is not free.
    fn continues(&self, _p: &Vec3, _own: u32, _faces: &BTreeSet<u32>) -> bool {
        false
    }
}

/// An edge of the reference near a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Border {
    /// Distance to it [mm].
    pub distance: f64,
    /// Its number.
    pub edge: usize,
    /// Faces on which the surface goes on beyond it: none at its own border, the face itself at a seam.
    pub beyond: Vec<u32>,
}

/// An edge at the border of some faces.
#[derive(Debug, Clone, Copy)]
pub struct BorderEdge<'a> {
    /// Its number.
    pub edge: usize,
    /// The face that uses it.
    pub face: u32,
    /// Its curve.
    pub curve: &'a Curve3,
}

/// A trimmed CAD model as the reference.
pub struct CadReference<'m> {
    model: &'m Model,
    index: ClosestPoint<'m>,
    faces: usize,
    /// Distances that differ by less are equal [mm]: faces that meet at an edge meet to within this.
    tie: f64,
    /// Whether each edge, and each vertex, is on a free border.
    free: [Vec<bool>; 2],
    /// Boxes of the faces.
    boxes: BoxTree,
}

impl<'m> CadReference<'m> {
    /// Builds the index over all faces.
    #[must_use]
    pub fn new(model: &'m Model) -> Self {
        let hulls: Vec<Aabb> =
            model.faces.iter().map(|f| Aabb::of_points(f.surface.points())).collect();
        Self {
            model,
            index: ClosestPoint::new(model),
            faces: model.faces.len(),
            tie: 1e-9 + model.join_tolerance.max(0.0),
            free: free_borders(model),
            boxes: BoxTree::build(&hulls),
        }
    }
}

/// Edges that one face uses once, and the vertices at their ends.
fn free_borders(model: &Model) -> [Vec<bool>; 2] {
    let edges: Vec<bool> = model.edges.iter().map(|e| e.uses.len() == 1).collect();
    let mut vertices = vec![false; model.vertices.len()];
    for (edge, _) in model.edges.iter().zip(&edges).filter(|(_, free)| **free) {
        edge.vertices.iter().for_each(|&v| vertices[v] = true);
    }
    [edges, vertices]
}

impl CadReference<'_> {
    /// Faces of the model.
    pub(crate) fn face_count(&self) -> usize {
        self.faces
    }

    fn is_on_border(&self, foot: &Foot) -> bool {
        let [edges, vertices] = &self.free;
        match foot.location {
            FootLocation::Inside => false,
            FootLocation::Edge(e) => edges[e],
            FootLocation::Vertex(v) => vertices[v],
        }
    }

    /// The face nearest to the middle of every patch, for models that were not made from this CAD.
    #[must_use]
    pub fn faces_of(&self, tool: &ToolModel) -> Vec<u32> {
        let middle = |patch: &Patch| match patch {
            Patch::Triangle(_) => patch.derivs(2.0 / 3.0, 1.0 / 3.0).s,
            _ => patch.derivs(0.5, 0.5).s,
        };
        let nearest = |patch| self.index.closest(&middle(patch)).map_or(0, |foot| foot.face as u32);
        tool.patches.par_iter().map(nearest).collect()
    }

    /// Normal at a foot. Where the surface is degenerate but for rounding the limit that it has there from all sides (pole of
    /// a sphere); zero where it has none: at the apex of a cone every direction of its normals is as near, and the one that
    /// rounding picks may be opposite to a patch's.
    fn normal(&self, foot: &Foot) -> Vec3 {
        const DEGENERATE: f64 = 1e-9;
        let Some(face) = self.model.faces.get(foot.face) else { return foot.normal };
        let d = face.surface.derivs(foot.uv);
        let domain = face.surface.domain();
        let [u, v] = domain;
        let reach = [d.su.norm() * (u[1] - u[0]), d.sv.norm() * (v[1] - v[0])];
        let longest = reach[0].max(reach[1]);
        match [0, 1].map(|k| reach[k] <= DEGENERATE * longest) {
            [false, false] => foot.normal,
            [true, true] => Vec3::zeros(),
            [first, _] => {
                let k = usize::from(!first);
                limit_along(face, foot, k, domain[k]).unwrap_or_else(Vec3::zeros)
            }
        }
    }
}

/// The normal that a face has all along its parameter `k`, which goes over `range` without the surface's moving (a
/// collapsed side); `None` where it differs along the way.
fn limit_along(face: &Face, foot: &Foot, k: usize, range: [f64; 2]) -> Option<Vec3> {
    const STEPS: usize = 8;
    const SAME: f64 = 1e-6;
    let at = |step: usize| {
        let mut uv = foot.uv;
        uv[k] = range[0] + (range[1] - range[0]) * step as f64 / STEPS as f64;
        face.normal(uv)
    };
    let first = at(0)?;
    (1..=STEPS).all(|step| at(step).is_some_and(|n| (n - first).norm() <= SAME)).then_some(first)
}

impl ReferenceSurface for CadReference<'_> {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let at = |foot: &Foot, own_normal: Option<Vec3>| ReferenceFoot {
            point: foot.point,
            normal: self.normal(foot),
            own_normal,
            face: foot.face as u32,
            on_border: self.is_on_border(foot),
        };
        let own = (face as usize) < self.faces;
        let Some(own) = own.then(|| self.index.closest_on_face(face as usize, p)).flatten() else {
            return Some(at(&self.index.closest(p)?, None));
        };
        // The face's own foot, unless something else is nearer.
        let nearer = self.index.closest_within(p, own.distance - self.tie).ok()?;
        Some(match nearer.filter(|foot| foot.face != own.face) {
            Some(foot) => at(&foot, Some(self.normal(&own))),
            None => at(&own, None),
        })
    }

    fn lost_faces(&self) -> Vec<LostFace> {
        self.model.lost.clone()
    }

    fn border(&self, p: &Vec3, face: u32) -> Option<Border> {
        let uses = self.model.faces.get(face as usize)?.loops.iter().flat_map(|l| &l.uses);
        let edges = uses.filter_map(|u| Some((u.edge?, self.model.edges.get(u.edge?)?)));
        let off = |e: &Edge| (e.curve.point(e.curve.closest(p).0) - p).norm();
        let nearest = edges.map(|(k, e)| (off(e), k, e)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (distance, edge, found) = nearest;
        let mut beyond: Vec<u32> = found.uses.iter().map(|u| u[0] as u32).collect();
        if let Some(own) = beyond.iter().position(|&f| f == face) {
            beyond.remove(own);
        }
        Some(Border { distance, edge, beyond })
    }

    fn border_edges(&self, faces: &BTreeSet<u32>) -> Option<Vec<BorderEdge<'_>>> {
        let of = |(edge, e): (usize, &'_ Edge)| {
            let mut own = e.uses.iter().map(|u| u[0] as u32).filter(|f| faces.contains(f));
            let face = own.next()?;
            own.next().is_none().then_some((edge, face))
        };
        let found = self.model.edges.iter().enumerate().filter_map(of);
        let curve = |edge: usize| &self.model.edges[edge].curve;
        Some(found.map(|(edge, face)| BorderEdge { edge, face, curve: curve(edge) }).collect())
    }

    fn continues(&self, p: &Vec3, own: u32, faces: &BTreeSet<u32>) -> bool {
        let (mut found, mut compared) = (false, 0);
        self.boxes.overlapping(&Aabb::of_points([p]).widened(self.tie), |f| {
            let foot = || self.index.closest_on_face(f as usize, p);
            if !found && f != own && compared < CONTINUES_MAX && faces.contains(&f) {
                compared += 1;
                found = foot().is_some_and(|foot| foot.distance <= self.tie);
            }
        });
        found
    }
}
