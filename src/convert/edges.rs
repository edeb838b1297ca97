//! Edges that follow the CAD: the part of c (Eq. 7) that the normals of Eq. 8 leave open.
//!
//! Along the border of a flat and a fillet all normals are equal, and Eq. 8 draws a chord across the border's arc:
//! the fillet's patches then miss the fillet by `s^2 / (2 r)` for a sagitta s, most of their error. The same holds, in
//! part, for every edge that turns within its surface. The curve wanted here goes through the CAD at its middle.

use std::collections::BTreeMap;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::normals::Feet;
use super::searches::Searches;
use crate::cad::Model;
use crate::geometry::nurbs::Surface;
use crate::geometry::{Aabb, Vec2, Vec3};
use crate::mesh::SurfaceMesh;
use crate::tool::build::{StraightEdge, edge_ends};
use crate::tool::edge::{EdgeFault, EdgeRule, edge_curve, nearest_coefficient};
use crate::tool::model::PatchCorners;
use crate::tool::{GivenCurve, ToolModel};

/// Given edges, and those that leave their normals.
#[derive(Default)]
pub(super) struct Followed {
    pub given: Vec<GivenCurve>,
    pub bent: Vec<StraightEdge>,
}

/// Largest distance of a curve's middle from its chord's, over the chord: half a circle has 0.5.
const SAGITTA: f64 = 0.6;
/// Coefficients that differ by less, over the length of the edge, are equal.
const EQUAL: f64 = 1e-9;

/// Elements of an edge: their ids, and the CAD faces they are on.
#[derive(Default)]
struct Around {
    patches: Vec<u32>,
    faces: Vec<u32>,
}

/// Coefficients of all edges of `mesh` that differ from those of Eq. 8.
pub(super) fn follow(
    model: &Model,
    mesh: &SurfaceMesh,
    feet: &Feet,
    (corners, normals): (&[PatchCorners], &[Vec3]),
    searches: &Searches<'_>,
) -> Followed {
    let mut around: BTreeMap<[u32; 2], Around> = BTreeMap::new();
    for (id, e) in mesh.elements.iter().enumerate() {
        for [a, b] in e.sides() {
            let edge = around.entry([a.min(b), a.max(b)]).or_default();
            edge.patches.push(id as u32);
            edge.faces.push(e.face);
        }
    }
    let ends = edge_ends(corners);
    let finder = Finder::new(model, mesh, feet, searches);
    let list: Vec<([u32; 2], Around)> = around.into_iter().collect();
    let found: Vec<Option<(GivenCurve, Option<StraightEdge>)>> = list
        .par_iter()
        .map(|(vertices, around)| {
            let pairs = ends.get(vertices)?.iter().map(|p| p.map(|n| normals[n as usize]));
            given(&finder, *vertices, around, &pairs.collect::<Vec<[Vec3; 2]>>())
        })
        .collect();
    let (given, bent): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
    Followed { given, bent: bent.into_iter().flatten().collect() }
}

/// The curve of one edge through the CAD, where it is not that of Eq. 8.
fn given(
    finder: &Finder<'_>,
    vertices: [u32; 2],
    around: &Around,
    pairs: &[[Vec3; 2]],
) -> Option<(GivenCurve, Option<StraightEdge>)> {
    let [a, b] = vertices.map(|v| finder.mesh.vertices[v as usize]);
    let (d, middle) = (b - a, (a + b) * 0.5);
    let wanted = (middle - finder.middle(vertices, &around.faces)?) * 4.0;
    let curve = nearest_coefficient(&d, pairs, &wanted);
    let plain = edge_curve(&d, pairs, EdgeRule::Guarded);
    if (curve.c - plain.c).norm() <= EQUAL * d.norm() {
        return None;
    }
    let off = |c: &Vec3| finder.off(vertices, &around.faces, c);
    // Around a nose the way out that `nearest_coefficient` takes can stand far out of the CAD.
    if curve.fault.is_some() && off(&plain.c) <= off(&curve.c) {
        return None;
    }
    let straight = |fault| StraightEdge { patches: around.patches.clone(), vertices, fault };
    Some((GivenCurve { vertices, c: curve.c.into() }, curve.fault.map(straight)))
}

/// The edges of `elements`, made straight, with the patches beside them.
pub(super) fn straightened(corners: &[PatchCorners], elements: &[u32]) -> Vec<StraightEdge> {
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

/// Given edges of a model whose vertices move to `vertices`: as near to what they were, longer or shorter with their chords,
/// as the normals let them be; chords stay chords.
pub(super) fn moved(tool: &ToolModel, vertices: &[Vec3]) -> Vec<GivenCurve> {
    let ends = edge_ends(&tool.corners);
    let again = |curve: &GivenCurve| {
        if curve.c == [0.0; 3] {
            return *curve;
        }
        let [a, b] = curve.vertices;
        let d = vertices[b as usize] - vertices[a as usize];
        let before = (tool.vertices[b as usize] - tool.vertices[a as usize]).norm();
        let longer = if before > 0.0 { d.norm() / before } else { 1.0 };
        let pairs = ends.get(&[a.min(b), a.max(b)]).map_or(&[][..], |p| &p[..]);
        let turn = |p: &[u32; 2]| if a < b { *p } else { [p[1], p[0]] };
        let normals: Vec<[Vec3; 2]> =
            pairs.iter().map(|p| turn(p).map(|n| tool.normals[n as usize])).collect();
        let c = nearest_coefficient(&d, &normals, &(longer * Vec3::from(curve.c))).c;
        GivenCurve { vertices: curve.vertices, c: c.into() }
    };
    tool.curves.iter().map(again).collect()
}

/// Finds the point of the CAD that the middle of an edge belongs to.
pub(super) struct Finder<'a> {
    model: &'a Model,
    mesh: &'a SurfaceMesh,
    feet: &'a Feet,
    /// Edges of the model on each face of the mesh.
    edges: FxHashMap<u32, Vec<usize>>,
    /// Boxes around these edges.
    boxes: FxHashMap<usize, Aabb>,
    /// A vertex this near to a curve is on it [mm].
    near: f64,
    searches: &'a Searches<'a>,
}

impl<'a> Finder<'a> {
    pub(super) fn new(
        model: &'a Model,
        mesh: &'a SurfaceMesh,
        feet: &'a Feet,
        searches: &'a Searches<'a>,
    ) -> Self {
        // Of a mesh of one face the others are not looked at: a face's work does not depend on the size of the model.
        let mut edges: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        for element in &mesh.elements {
            edges.entry(element.face).or_insert_with_key(|&f| {
                let uses = model.faces[f as usize].loops.iter().flat_map(|l| &l.uses);
                uses.filter_map(|u| u.edge).collect()
            });
        }
        let size = Aabb::of_points(&mesh.vertices).diagonal();
        let near = 1e-7 * size + 2.0 * model.join_tolerance;
        let hull = |e: usize| Aabb::of_points(model.edges[e].curve.points()).widened(near);
        let boxes = edges.values().flatten().map(|&e| (e, hull(e))).collect();
        Self { model, mesh, feet, edges, boxes, near, searches }
    }

    fn middle(&self, vertices: [u32; 2], faces: &[u32]) -> Option<Vec3> {
        let found = match *faces {
            [f, g] if f == g => self.inside(vertices, f).or_else(|| self.along(vertices, &[f])),
            _ => self.along(vertices, faces),
        }?;
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let sound = (found - (a + b) * 0.5).norm() <= SAGITTA * (b - a).norm();
        sound.then_some(found)
    }

    /// Halfway in the parameters of the face; across the seam of a closed surface where that is the way.
    fn inside(&self, [a, b]: [u32; 2], face: u32) -> Option<Vec3> {
        let (p, q) = (self.feet.get(&(a, face))?, self.feet.get(&(b, face))?);
        let searched = self.searches.face(face);
        let surface = &searched.face.surface;
        let [a, b] = [a, b].map(|v| self.mesh.vertices[v as usize]);
        let off = |point: &Vec3| (point - (a + b) * 0.5).norm();
        let sound = |point: &Vec3| off(point) <= SAGITTA * (b - a).norm();
        let point = surface.point((p + q) * 0.5);
        if sound(&point) {
            return Some(point);
        }
        // A vertex on a seam has two parameters: the other one was meant.
        let across = other_ways(surface, &((p + q) * 0.5));
        let across = across.into_iter().map(|uv| surface.point(uv));
        let nearest = across.min_by(|x, y| off(x).total_cmp(&off(y))).filter(sound);
        Some(nearest.unwrap_or_else(|| surface.point(searched.closest(&((a + b) * 0.5)).0)))
    }

    /// On the edge of the model that both vertices are on, where it is nearest to the middle of the chord.
    fn along(&self, vertices: [u32; 2], faces: &[u32]) -> Option<Vec3> {
        let curve = &self.model.edges[self.edge(vertices, faces)?].curve;
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        Some(curve.point(curve.closest(&((a + b) * 0.5)).0))
    }

    /// Largest distance of three points of the curve with coefficient `c` from the edge of the model it runs along, or
    /// from the face it runs inside of [mm].
    fn off(&self, vertices: [u32; 2], faces: &[u32], c: &Vec3) -> f64 {
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let inside = matches!(*faces, [f, g] if f == g);
        let edge = if inside { None } else { self.edge(vertices, faces) };
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

    /// The edge of the model between these faces (or on the one face) that both vertices are on.
    pub(super) fn edge(&self, vertices: [u32; 2], faces: &[u32]) -> Option<usize> {
        let (&first, others) = faces.split_first()?;
        let [a, b] = vertices.map(|v| self.mesh.vertices[v as usize]);
        let shared = |e: &&usize| others.iter().all(|g| self.edges[g].contains(*e));
        let reached = |e: &&usize| [a, b].iter().all(|p| self.boxes[*e].distance_squared(p) == 0.0);
        let curves = self.edges[&first].iter().filter(shared).filter(reached);
        let off = |e: usize| {
            let curve = &self.model.edges[e].curve;
            let distance = |p: &Vec3| (curve.point(curve.closest(p).0) - p).norm();
            distance(&a).max(distance(&b))
        };
        let best = curves.map(|&e| (off(e), e)).min_by(|x, y| x.0.total_cmp(&y.0))?;
        (best.0 <= self.near).then_some(best.1)
    }
}

/// Parameters half a turn from `uv` in the directions in which a surface is closed there.
fn other_ways(surface: &Surface, uv: &Vec2) -> Vec<Vec2> {
    let domain = surface.domain();
    let mut ways = vec![*uv];
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
            ways.extend(ways.clone().into_iter().map(half));
        }
    }
    ways.split_off(1)
}
