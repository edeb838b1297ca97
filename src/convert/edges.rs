//! Edges that follow the CAD: the component of the coefficient c (Eq. 7) that the normals leave undetermined in Eq. 8.
//!
//! Along the border between a flat and a fillet all normals are equal, and Eq. 8 gives a chord across the arc of the
//! border. With the sagitta s of that arc, the patches of the fillet deviate from it by `s^2 / (2 r)`, which is most of
//! their error. The same holds in part for every edge with geodesic curvature. The remedy is a curve whose middle lies
//! on the CAD.

use std::collections::BTreeMap;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::normals::Feet;
use super::searches::Searches;
use kanagata_cad::Model;
use kanagata_geometry::nurbs::Surface;
use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_mesh::SurfaceMesh;
use kanagata_tool::build::{StraightEdge, edge_ends};
use kanagata_tool::edge::{EdgeFault, EdgeRule, edge_curve, nearest_coefficient};
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{GivenCurve, ToolModel};

/// Edges that follow the CAD.
#[derive(Default)]
pub(super) struct CadEdges {
    /// Prescribed coefficients.
    pub given: Vec<GivenCurve>,
    /// Edges among them that are not perpendicular to their normals, because the guard rejects Eq. 8.
    pub bent: Vec<StraightEdge>,
}

/// Maximum distance between the middles of curve and chord, over the chord. A semicircle has 0.5; a larger value is a
/// point on another branch.
const SAGITTA_RATIO_MAX: f64 = 0.6;
/// Difference of two coefficients, over the length of the edge, below which they are equal.
const COEFFICIENT_TOLERANCE_REL: f64 = 1e-9;

/// Elements that share an edge, and their CAD faces.
#[derive(Default)]
struct EdgeElements {
    patches: Vec<u32>,
    faces: Vec<u32>,
}

/// Computes the coefficients of all edges of `mesh` that follow the CAD and differ from Eq. 8. `feet` are the
/// parameters of the vertices; `corners` index `normals`.
pub(super) fn edges_through_cad(
    model: &Model,
    mesh: &SurfaceMesh,
    feet: &Feet,
    (corners, normals): (&[PatchCorners], &[Vec3]),
    searches: &Searches<'_>,
) -> CadEdges {
    let mut elements: BTreeMap<[u32; 2], EdgeElements> = BTreeMap::new();
    for (id, e) in mesh.elements.iter().enumerate() {
        for [a, b] in e.sides() {
            let edge = elements.entry([a.min(b), a.max(b)]).or_default();
            edge.patches.push(id as u32);
            edge.faces.push(e.face);
        }
    }
    let ends = edge_ends(corners);
    let finder = EdgeFinder::new(model, mesh, feet, searches);
    let list: Vec<([u32; 2], EdgeElements)> = elements.into_iter().collect();
    let stage = searches.progress.stage("edges", "edges", list.len() as u64);
    let found: Vec<Option<(GivenCurve, Option<StraightEdge>)>> = list
        .par_iter()
        .map(|(vertices, elements)| {
            stage.add(1);
            let pairs = ends.get(vertices)?.iter().map(|p| p.map(|n| normals[n as usize]));
            curve_through_cad(&finder, *vertices, elements, &pairs.collect::<Vec<[Vec3; 2]>>())
        })
        .collect();
    let (given, bent): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
    CadEdges { given, bent: bent.into_iter().flatten().collect() }
}

/// Curve of one edge through the CAD, with its fault where the guard rejects it. `None` when Eq. 8 gives the same curve
/// or a smaller deviation. `pairs` are the normals at both ends, one pair for each side of a crease.
fn curve_through_cad(
    finder: &EdgeFinder<'_>,
    vertices: [u32; 2],
    elements: &EdgeElements,
    pairs: &[[Vec3; 2]],
) -> Option<(GivenCurve, Option<StraightEdge>)> {
    let [a, b] = vertices.map(|v| finder.mesh.vertices[v as usize]);
    let (d, middle) = (b - a, (a + b) * 0.5);
    let wanted = (middle - finder.midpoint(vertices, &elements.faces)?) * 4.0;
    let curve = nearest_coefficient(&d, pairs, &wanted);
    let plain = edge_curve(&d, pairs, EdgeRule::Guarded);
    if (curve.c - plain.c).norm() <= COEFFICIENT_TOLERANCE_REL * d.norm() {
        return None;
    }
    let deviation = |c: &Vec3| finder.deviation(vertices, &elements.faces, c);
    // On a strongly curved profile the fallback of `nearest_coefficient` can deviate far from the CAD.
    if curve.fault.is_some() && deviation(&plain.c) <= deviation(&curve.c) {
        return None;
    }
    let straight = |fault| StraightEdge { patches: elements.patches.clone(), vertices, fault };
    Some((GivenCurve { vertices, c: curve.c.into() }, curve.fault.map(straight)))
}

/// Lists the edges of `elements` as straight edges, each with all patches that share it.
pub(super) fn straight_edges(corners: &[PatchCorners], elements: &[u32]) -> Vec<StraightEdge> {
    fn sides(corners: &[PatchCorners], k: u32) -> impl Iterator<Item = [u32; 2]> {
        let vertices = &corners[k as usize].vertices;
        let count = vertices.len();
        (0..count).map(move |i| {
            let (a, b) = (vertices[i], vertices[(i + 1) % count]);
            [a.min(b), a.max(b)]
        })
    }
    let edge = |vertices| {
        (vertices, StraightEdge { patches: Vec::new(), vertices, fault: EdgeFault::Folds })
    };
    let mut out: BTreeMap<[u32; 2], StraightEdge> =
        elements.iter().flat_map(|&k| sides(corners, k)).map(edge).collect();
    if !out.is_empty() {
        for k in 0..corners.len() as u32 {
            for side in sides(corners, k) {
                if let Some(edge) = out.get_mut(&side) {
                    edge.patches.push(k);
                }
            }
        }
    }
    out.into_values().collect()
}

/// Prescribed curves of a model after its vertices move to `vertices` [mm]. The old coefficient is scaled by the ratio
/// of the chord lengths and made compatible with the normals. Straight edges stay straight.
pub(super) fn curves_after_motion(tool: &ToolModel, vertices: &[Vec3]) -> Vec<GivenCurve> {
    let ends = edge_ends(&tool.corners);
    let updated = |curve: &GivenCurve| {
        if curve.c == [0.0; 3] {
            return *curve;
        }
        let [a, b] = curve.vertices;
        let d = vertices[b as usize] - vertices[a as usize];
        let before = (tool.vertices[b as usize] - tool.vertices[a as usize]).norm();
        let scale = if before > 0.0 { d.norm() / before } else { 1.0 };
        let pairs = ends.get(&[a.min(b), a.max(b)]).map_or(&[][..], |p| &p[..]);
        let turn = |p: &[u32; 2]| if a < b { *p } else { [p[1], p[0]] };
        let normals: Vec<[Vec3; 2]> =
            pairs.iter().map(|p| turn(p).map(|n| tool.normals[n as usize])).collect();
        let c = nearest_coefficient(&d, &normals, &(scale * Vec3::from(curve.c))).c;
        GivenCurve { vertices: curve.vertices, c: c.into() }
    };
    tool.curves.iter().map(updated).collect()
}

/// Relates the edges of a mesh to the edges and faces of the CAD.
pub(super) struct EdgeFinder<'a> {
    model: &'a Model,
    mesh: &'a SurfaceMesh,
    feet: &'a Feet,
    /// CAD edges of each face of the mesh.
    edges: FxHashMap<u32, Vec<usize>>,
    /// Bounding boxes of these edges, widened by `tolerance_mm`.
    boxes: FxHashMap<usize, Aabb>,
    /// Maximum distance of a vertex from a curve on which it lies [mm].
    tolerance_mm: f64,
    searches: &'a Searches<'a>,
}

impl<'a> EdgeFinder<'a> {
    pub(super) fn new(
        model: &'a Model,
        mesh: &'a SurfaceMesh,
        feet: &'a Feet,
        searches: &'a Searches<'a>,
    ) -> Self {
        // Only faces of the mesh are examined: the work on a mesh of one face does not depend on the size of the model.
        let mut edges: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        for element in &mesh.elements {
            edges.entry(element.face).or_insert_with_key(|&f| {
                let uses = model.faces[f as usize].loops.iter().flat_map(|l| &l.uses);
                uses.filter_map(|u| u.edge).collect()
            });
        }
        let size = Aabb::of_points(&mesh.vertices).diagonal();
        let tolerance_mm = 1e-7 * size + 2.0 * model.join_tolerance;
        let hull = |e: usize| Aabb::of_points(model.edges[e].curve.points()).widened(tolerance_mm);
        let boxes = edges.values().flatten().map(|&e| (e, hull(e))).collect();
        Self { model, mesh, feet, edges, boxes, tolerance_mm, searches }
    }

    /// Point of the CAD in the middle of an edge: in the face when both elements lie on one face, otherwise on the
    /// common CAD edge. `None` when it is farther from the middle of the chord than `SAGITTA_RATIO_MAX` allows.
    fn midpoint(&self, vertices: [u32; 2], faces: &[u32]) -> Option<Vec3> {
        let found = match *faces {
            [f, g] if f == g => {
                self.midpoint_in_face(vertices, f).or_else(|| self.midpoint_on_edge(vertices, &[f]))
            }
            _ => self.midpoint_on_edge(vertices, faces),
        }?;
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let sound = (found - (a + b) * 0.5).norm() <= SAGITTA_RATIO_MAX * (b - a).norm();
        sound.then_some(found)
    }

    /// Point at the mean of the parameters of both vertices. Where that point is too far from the chord: a periodic
    /// image of it, or else the closest point of the surface.
    fn midpoint_in_face(&self, [a, b]: [u32; 2], face: u32) -> Option<Vec3> {
        let (p, q) = (self.feet.get(&(a, face))?, self.feet.get(&(b, face))?);
        let searched = self.searches.face(face);
        let surface = &searched.face.surface;
        let [a, b] = [a, b].map(|v| self.mesh.vertices[v as usize]);
        let distance = |point: &Vec3| (point - (a + b) * 0.5).norm();
        let sound = |point: &Vec3| distance(point) <= SAGITTA_RATIO_MAX * (b - a).norm();
        let point = surface.point((p + q) * 0.5);
        if sound(&point) {
            return Some(point);
        }
        // A vertex on a seam has two parameters, of which the other one may be required.
        let images = periodic_images(surface, &((p + q) * 0.5));
        let images = images.into_iter().map(|uv| surface.point(uv));
        let nearest = images.min_by(|x, y| distance(x).total_cmp(&distance(y))).filter(sound);
        Some(nearest.unwrap_or_else(|| surface.point(searched.closest(&((a + b) * 0.5)).0)))
    }

    /// Closest point to the middle of the chord on the CAD edge that contains both vertices.
    fn midpoint_on_edge(&self, vertices: [u32; 2], faces: &[u32]) -> Option<Vec3> {
        let edge = self.common_edge(vertices, faces)?;
        let curve = &self.model.edges[edge].curve;
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let middle = (a + b) * 0.5;
        let t = match vertices.map(|v| self.mesh.feet.on_edge(v, edge as u32)) {
            [Some(a), Some(b)] => curve.closest_near(&middle, 0.5 * (a + b), 0.0).0,
            _ => curve.closest(&middle).0,
        };
        Some(curve.point(t))
    }

    /// Maximum distance of the curve with coefficient `c` from its CAD edge, or from its face for an interior edge
    /// [mm]. The curve is sampled at 1/4, 1/2 and 3/4.
    fn deviation(&self, vertices: [u32; 2], faces: &[u32], c: &Vec3) -> f64 {
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let inside = matches!(*faces, [f, g] if f == g);
        let edge = if inside { None } else { self.common_edge(vertices, faces) };
        let point = |e: f64| a + (b - a - c) * e + c * (e * e);
        let feet = vertices.map(|v| self.feet.get(&(v, faces[0])));
        let nearest = |e: f64, p: Vec3| match edge.map(|e| &self.model.edges[e].curve) {
            Some(curve) => curve.point(curve.closest(&p).0),
            None => {
                let searched = self.searches.face(faces[0]);
                let foot = match feet {
                    [Some(a), Some(b)] => searched.closest_from(&p, a * (1.0 - e) + b * e),
                    _ => searched.closest(&p),
                };
                searched.face.surface.point(foot.0)
            }
        };
        [0.25, 0.5, 0.75]
            .map(|e| (nearest(e, point(e)) - point(e)).norm())
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// CAD edge of all `faces` that contains both vertices to within `tolerance_mm`; the nearest one of several. An edge
    /// on which the mesher placed both is that edge, if there is no other such edge.
    pub(super) fn common_edge(&self, vertices: [u32; 2], faces: &[u32]) -> Option<usize> {
        let (&first, others) = faces.split_first()?;
        let placed = |e: &&usize| {
            vertices.iter().all(|&v| self.mesh.feet.on_edge(v, **e as u32).is_some())
                && others.iter().all(|g| self.edges[g].contains(*e))
        };
        let mut known = self.edges[&first].iter().filter(placed);
        if let (Some(&edge), None) = (known.next(), known.next()) {
            return Some(edge);
        }
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let shared = |e: &&usize| others.iter().all(|g| self.edges[g].contains(*e));
        let reached = |e: &&usize| [a, b].iter().all(|p| self.boxes[*e].distance_squared(p) == 0.0);
        let curves = self.edges[&first].iter().filter(shared).filter(reached);
        let deviation = |e: usize| {
            let curve = &self.model.edges[e].curve;
            let distance = |p: &Vec3| (curve.point(curve.closest(p).0) - p).norm();
            distance(&a).max(distance(&b))
        };
        let best = curves.map(|&e| (deviation(e), e)).min_by(|x, y| x.0.total_cmp(&y.0))?;
        (best.0 <= self.tolerance_mm).then_some(best.1)
    }
}

/// Parameters shifted by half a period from `uv`, in every combination of the directions in which the surface is closed
/// there. The mean of two parameters on different sides of a seam is wrong by this shift.
fn periodic_images(surface: &Surface, uv: &Vec2) -> Vec<Vec2> {
    let domain = surface.domain();
    let mut images = vec![*uv];
    for (k, [low, high]) in domain.into_iter().enumerate() {
        let at = |x: f64, mut uv: Vec2| {
            uv[k] = x;
            uv
        };
        let half = |uv: Vec2| {
            let x = uv[k] + 0.5 * (high - low);
            at(if x > high { x - (high - low) } else { x }, uv)
        };
        let [a, b, c] = [at(low, *uv), at(high, *uv), half(*uv)].map(|uv| surface.point(uv));
        if (b - a).norm() <= 1e-6 * (c - a).norm() {
            images.extend(images.clone().into_iter().map(half));
        }
    }
    images.split_off(1)
}
