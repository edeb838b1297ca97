//! Reference surfaces of an audit: the trimmed CAD, or any surface with a closest-point query.

use std::collections::BTreeSet;

use rayon::prelude::*;

use kanagata_cad::Model;
use kanagata_cad::closest::ClosestPoint;
use kanagata_cad::health::OpenJoints;
use kanagata_cad::model::{Edge, Face, Foot, FootLocation};
use kanagata_cad::raw::LostFace;
use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::{Curve3, SurfaceDerivs};
use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_tool::{Patch, ToolModel};

/// Maximum number of faces near a border point tested for containing it. Where more bounding boxes overlap, a border
/// may be classified as free that is not. The deviation reported is then too large; the work is bounded.
const CONTAINMENT_TESTS_MAX: usize = 64;

/// The closest point of a reference surface, as used in Eq. 24.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceFoot {
    /// Closest point `P_CAD` [mm].
    pub point: Vec3,
    /// Outward unit normal `n_CAD` there; zero where it is undefined (apex).
    pub normal: Vec3,
    /// Normal of the patch's own CAD face at its closest point, when `face` is another face. Near a crease the foot
    /// point of one side may lie on the other; the patch normal is then correct if it matches either. Zero where the
    /// own face has no normal: the other face then says nothing about the patch.
    pub own_normal: Option<Vec3>,
    /// Face of the foot point.
    pub face: u32,
    /// True when the foot point is on a free border of the surface.
    pub on_border: bool,
}

/// A surface with closest-point queries, called from many threads.
pub trait ReferenceSurface: Sync {
    /// The point of the whole trimmed surface closest to `p`; `face` is the CAD face of the patch that contains `p`.
    /// Among faces at equal distance (on an edge or vertex) the patch's own face supplies the normal, so that the sign
    /// of the error does not depend on the order of the faces. `None` without a surface, or when the query exceeds its
    /// work limit.
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot>;

    /// As [`Self::closest`]. `start` are parameters of `face` near those of the closest point, which some surfaces need.
    /// Also returns the parameters found, the start for a point nearby.
    fn closest_from(
        &self,
        p: &Vec3,
        face: u32,
        _start: Option<Vec2>,
    ) -> Option<(ReferenceFoot, Option<Vec2>)> {
        Some((self.closest(p, face)?, None))
    }

    /// Faces of the file missing from the surface.
    fn lost_faces(&self) -> Vec<LostFace> {
        Vec::new()
    }

    /// Free edges of `faces` that run beside those of others of them, which are not joined there; `None` without any.
    fn open_joints(&self, _faces: &BTreeSet<u32>) -> Option<OpenJoints> {
        None
    }

    /// The border of `face` closest to `p`; `None` when no border is known.
    fn border(&self, _p: &Vec3, _face: u32) -> Option<Border> {
        None
    }

    /// Edges used exactly once and by one of `faces` only: the border of these faces. `None` for a surface without
    /// known borders.
    fn border_edges(&self, _faces: &BTreeSet<u32>) -> Option<Vec<BorderEdge<'_>>> {
        None
    }

    /// True when one of `faces` other than `own` contains `p` within the joining tolerance. A border on another face,
    /// as between faces without a common edge, is not free.
    fn continues(&self, _p: &Vec3, _own: u32, _faces: &BTreeSet<u32>) -> bool {
        false
    }
}

/// A foot point inside the trimmed region of a face.
pub(super) struct FootInside {
    pub foot: ReferenceFoot,
    /// Parameters on the face.
    pub uv: Vec2,
    /// Distance [mm].
    pub distance: f64,
}

/// Cosine of the angle between the distance vector and the tangents below which a foot point is a minimum of the
/// distance. A point at which the iteration stopped early, or that the border of the domain holds, is above it.
const STATIONARY_COSINE: f64 = 1e-6;

/// An edge of the reference near a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Border {
    /// Distance to it [mm].
    pub distance: f64,
    /// Index of the edge.
    pub edge: usize,
    /// Faces on which the surface continues beyond it: none at its own border, the same face at a seam.
    pub beyond: Vec<u32>,
}

/// An edge on the border of some faces.
#[derive(Debug, Clone, Copy)]
pub struct BorderEdge<'a> {
    /// Index of the edge.
    pub edge: usize,
    /// The face that uses it.
    pub face: u32,
    /// Its curve.
    pub curve: &'a Curve3,
}

/// A trimmed CAD model as reference surface.
pub struct CadReference<'m> {
    pub(super) model: &'m Model,
    pub(super) index: ClosestPoint<'m>,
    faces: usize,
    /// Difference of distances below which they are equal [mm]: the gap at which adjacent faces are joined.
    pub(super) tie: f64,
    /// Whether each edge, and each vertex, is on a free border.
    pub(super) free: [Vec<bool>; 2],
    /// Bounding boxes of the faces.
    boxes: BoxTree,
    /// Error of foot points found near others that is always allowed [mm].
    pub(super) accuracy: f64,
}

/// Allowed error of a foot point found near another one, over the size of the model. Doubled: distances of 1e-5 of that
/// size and less have twice the error.
const NEAR_ACCURACY_REL: f64 = 1e-8;

impl<'m> CadReference<'m> {
    /// Builds the search structure over all faces.
    #[must_use]
    pub fn new(model: &'m Model) -> Self {
        let hulls: Vec<Aabb> =
            model.faces.iter().map(|f| Aabb::of_points(f.surface.points())).collect();
        let size = hulls.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b)).diagonal();
        Self {
            model,
            accuracy: NEAR_ACCURACY_REL * size,
            index: ClosestPoint::new(model),
            faces: model.faces.len(),
            tie: 1e-9 + model.join_tolerance.max(0.0),
            free: free_borders(model),
            boxes: BoxTree::build(&hulls),
        }
    }
}

/// Edges used exactly once, and the vertices at their ends.
fn free_borders(model: &Model) -> [Vec<bool>; 2] {
    let edges: Vec<bool> = model.edges.iter().map(|e| e.uses.len() == 1).collect();
    let mut vertices = vec![false; model.vertices.len()];
    for (edge, _) in model.edges.iter().zip(&edges).filter(|(_, free)| **free) {
        edge.vertices.iter().for_each(|&v| vertices[v] = true);
    }
    [edges, vertices]
}

impl CadReference<'_> {
    /// Number of faces of the model.
    pub fn face_count(&self) -> usize {
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

    /// The face closest to the centre of every patch, for tool models made from another source.
    #[must_use]
    pub fn faces_of(&self, tool: &ToolModel) -> Vec<u32> {
        let middle = |patch: &Patch| match patch {
            Patch::Triangle(_) => patch.derivs(2.0 / 3.0, 1.0 / 3.0).s,
            _ => patch.derivs(0.5, 0.5).s,
        };
        let nearest = |patch| self.index.closest(&middle(patch)).map_or(0, |foot| foot.face as u32);
        tool.patches.par_iter().map(nearest).collect()
    }

    /// Foot point inside the trimmed region of `face`, the local minimum of the distance reached from the parameters
    /// `start`. `None` when it is on the border of the region or outside.
    pub(super) fn foot_inside(&self, p: &Vec3, face: u32, start: Vec2) -> Option<FootInside> {
        let own = self.model.faces.get(face as usize)?;
        let (uv, d) = own.surface.closest_locally(p, start);
        let offset = p - d.s;
        let distance = offset.norm();
        let slope = |tangent: &Vec3| {
            offset.dot(tangent).abs() <= STATIONARY_COSINE * tangent.norm() * distance
        };
        let stationary = distance <= self.tie || (slope(&d.su) && slope(&d.sv));
        // At a degenerate point every tangent is stationary.
        let found = stationary && is_regular([d.su, d.sv], own.reach(&d));
        if !found || !self.index.region_contains(face as usize, uv) {
            return None;
        }
        let cross = || unit(d.su.cross(&d.sv)).map(|n| if own.flipped { -n } else { n });
        let normal = cross().unwrap_or_else(Vec3::zeros);
        let (point, own_normal, on_border) = (d.s, None, false);
        Some(FootInside {
            foot: ReferenceFoot { point, normal, own_normal, face, on_border },
            uv,
            distance,
        })
    }

    /// The foot point of a search, on a face other than `own` with the normal there.
    fn reference_foot(&self, foot: &Foot, own_normal: Option<Vec3>) -> ReferenceFoot {
        ReferenceFoot {
            point: foot.point,
            normal: self.normal(foot),
            own_normal,
            face: foot.face as u32,
            on_border: self.is_on_border(foot),
        }
    }

    /// Normal at a foot point.
    fn normal(&self, foot: &Foot) -> Vec3 {
        let Some(face) = self.model.faces.get(foot.face) else { return foot.normal };
        degenerate_normal(face, foot.uv, &face.surface.derivs(foot.uv)).unwrap_or(foot.normal)
    }
}

/// True where neither tangent is negligible relative to the other, over the widths of their parameter ranges, and they
/// are not parallel.
pub(super) fn is_regular([su, sv]: [Vec3; 2], [along_u, along_v]: [f64; 2]) -> bool {
    const REGULAR_RATIO_MIN: f64 = 1e-6;
    let sine = su.cross(&sv).norm();
    along_u.min(along_v) > REGULAR_RATIO_MIN * along_u.max(along_v)
        && sine > REGULAR_RATIO_MIN * su.norm() * sv.norm()
}

/// Outward normal of a face at `uv` with the derivatives `d` where its surface is degenerate to within rounding; `None`
/// elsewhere. It is the limit from all sides (pole of a sphere), and zero where there is none: at the apex of a cone all
/// normals are equally close, and rounding may select one opposite to that of a patch.
fn degenerate_normal(face: &Face, uv: Vec2, d: &SurfaceDerivs) -> Option<Vec3> {
    const DEGENERATE_RATIO: f64 = 1e-9;
    let domain = face.surface.domain();
    let reach = face.reach(d);
    let longest = reach[0].max(reach[1]);
    match [0, 1].map(|k| reach[k] <= DEGENERATE_RATIO * longest) {
        [false, false] => None,
        [true, true] => Some(Vec3::zeros()),
        [first, _] => {
            let k = usize::from(!first);
            Some(limit_along(face, uv, k, domain[k]).unwrap_or_else(Vec3::zeros))
        }
    }
}

/// The normal of a face along its collapsed parameter `k` over `range`; `None` where it varies.
fn limit_along(face: &Face, uv: Vec2, k: usize, range: [f64; 2]) -> Option<Vec3> {
    const STEPS: usize = 8;
    const NORMAL_TOLERANCE: f64 = 1e-6;
    let at = |step: usize| {
        let mut uv = uv;
        uv[k] = range[0] + (range[1] - range[0]) * step as f64 / STEPS as f64;
        face.normal(uv)
    };
    let first = at(0)?;
    (1..=STEPS)
        .all(|step| at(step).is_some_and(|n| (n - first).norm() <= NORMAL_TOLERANCE))
        .then_some(first)
}

impl ReferenceSurface for CadReference<'_> {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        self.closest_from(p, face, None).map(|found| found.0)
    }

    fn closest_from(
        &self,
        p: &Vec3,
        face: u32,
        start: Option<Vec2>,
    ) -> Option<(ReferenceFoot, Option<Vec2>)> {
        if let Some(own) = start.and_then(|start| self.foot_inside(p, face, start)) {
            let known = Some((face, own.uv));
            let nearer = self.index.closest_within(p, own.distance - self.tie, known).ok()?;
            return Some(match nearer {
                Some(foot) if foot.face as u32 == face => {
                    (self.reference_foot(&foot, None), Some(foot.uv))
                }
                Some(foot) => (self.reference_foot(&foot, Some(own.foot.normal)), Some(own.uv)),
                None => (own.foot, Some(own.uv)),
            });
        }
        let own = (face as usize) < self.faces;
        let Some(own) = own.then(|| self.index.closest_on_face(face as usize, p)).flatten() else {
            return Some((self.reference_foot(&self.index.closest(p)?, None), None));
        };
        // Foot point on the own face, unless another face is closer.
        let inside = own.location == FootLocation::Inside;
        let known = inside.then_some((own.face as u32, own.uv));
        let nearer = self.index.closest_within(p, own.distance - self.tie, known).ok()?;
        let foot = match nearer.filter(|foot| foot.face != own.face) {
            Some(foot) => self.reference_foot(&foot, Some(self.normal(&own))),
            None => self.reference_foot(&own, None),
        };
        Some((foot, Some(own.uv)))
    }

    fn lost_faces(&self) -> Vec<LostFace> {
        self.model.lost.clone()
    }

    fn open_joints(&self, faces: &BTreeSet<u32>) -> Option<OpenJoints> {
        self.model.open_joints(|face| faces.contains(&(face as u32)))
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
            if !found && f != own && compared < CONTAINMENT_TESTS_MAX && faces.contains(&f) {
                compared += 1;
                found = foot().is_some_and(|foot| foot.distance <= self.tie);
            }
        });
        found
    }
}
