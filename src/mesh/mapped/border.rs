//! Nodes on the edges of the model, shared by adjacent faces.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use rustc_hash::FxHashMap;

use super::edge_tangents::EdgeTangents;
use super::patchwork::Node;
use super::sample::{Lengths, Lifted, MeasuredCurve};
use super::sides::{Shape, is_joint};
use crate::MeshFeet;
use kanagata_cad::Model;
use kanagata_cad::model::{EdgeUse, Face};
use kanagata_geometry::{Vec2, Vec3};

/// A divided edge.
struct Divided {
    /// Interior points.
    inner: Vec<Vec3>,
    /// Parameters of the ends and the interior points.
    parameters: Vec<f64>,
    /// Tangents at the ends and at the interior points of a curved edge.
    tangents: Vec<Vec3>,
}

/// Divisions of edges.
pub struct Cuts<'a> {
    /// Divisions of each edge.
    pub counts: &'a [usize],
    /// Curved edges, whose tangents are needed.
    pub curved: &'a [bool],
    /// Edges of strongly uneven curvature are divided by turning angle, all others by equal lengths.
    pub by_turn: bool,
    /// The edges with their lengths measured, on first use.
    pub measured: &'a [OnceLock<Lengths>],
}

impl Divided {
    fn new(model: &Model, edge: usize, cuts: &Cuts<'_>) -> Self {
        let curve = &model.edges[edge].curve;
        let measure = || {
            let measured = MeasuredCurve::new(curve);
            (if cuts.by_turn { measured.by_turn() } else { measured }).into_lengths()
        };
        let along = cuts.measured[edge].get_or_init(measure);
        let curve = MeasuredCurve::with_lengths(curve, along);
        let count = cuts.counts[edge];
        let tangents = if cuts.curved[edge] { curve.tangents(count) } else { Vec::new() };
        let (parameters, points): (Vec<f64>, Vec<Vec3>) = curve.divide(count).into_iter().unzip();
        Self { inner: points[1..points.len() - 1].to_vec(), parameters, tangents }
    }
}

/// Vertices of the mesh on the edges of the model.
pub struct Border {
    /// Positions [mm]: ends of the edges first, in the order of the model's vertices, then the interior points of the
    /// edges in order.
    pub points: Vec<Vec3>,
    /// Vertex ids along each edge, including both ends.
    along: FxHashMap<usize, Vec<u32>>,
    /// Parameters of these vertices on the curve of the edge.
    parameters: FxHashMap<usize, Vec<f64>>,
    /// Tangents at these vertices for curved edges; empty for others.
    tangents: FxHashMap<usize, Vec<Vec3>>,
}

impl Border {
    /// Divides every edge.
    pub fn new(model: &Model, cuts: &Cuts<'_>) -> Self {
        use rayon::prelude::*;
        let edges = (0..model.edges.len()).into_par_iter();
        Self::of(model, edges.map(|e| (e, Divided::new(model, e, cuts))).collect())
    }

    /// Divides the edges of one face.
    pub fn of_face(model: &Model, cuts: &Cuts<'_>, face: &Face) -> Self {
        let uses = face.loops.iter().flat_map(|l| &l.uses);
        let edges: BTreeSet<usize> = uses.filter_map(|u| u.edge).collect();
        Self::of(model, edges.into_iter().map(|e| (e, Divided::new(model, e, cuts))).collect())
    }

    fn of(model: &Model, divided: Vec<(usize, Divided)>) -> Self {
        let ends = |&(e, _): &(usize, Divided)| model.edges[e].vertices;
        let vertices: BTreeSet<usize> = divided.iter().flat_map(ends).collect();
        let mut points: Vec<Vec3> = vertices.iter().map(|&v| model.vertices[v]).collect();
        let ids: FxHashMap<usize, u32> = vertices.into_iter().zip(0..).collect();
        let (mut along, mut parameters) = (FxHashMap::default(), FxHashMap::default());
        let mut tangents = FxHashMap::default();
        for (e, of_edge) in divided {
            let [start, end] = model.edges[e].vertices.map(|v| ids[&v]);
            let first = points.len() as u32;
            points.extend(of_edge.inner);
            let inner = first..points.len() as u32;
            along.insert(e, std::iter::once(start).chain(inner).chain([end]).collect());
            parameters.insert(e, of_edge.parameters);
            tangents.insert(e, of_edge.tangents);
        }
        Self { points, along, parameters, tangents }
    }

    /// Parameters of the vertices on their edges.
    pub fn feet(&self) -> MeshFeet {
        let mut feet = MeshFeet::default();
        for (&e, ids) in &self.along {
            let of_edge = ids.iter().zip(&self.parameters[&e]);
            of_edge.for_each(|(&v, &t)| feet.add_on_edge(v, e as u32, t));
        }
        feet
    }

    /// Tangents of the element sides on the boundary of a face.
    pub fn edge_tangents(&self, face: &Face) -> EdgeTangents {
        let mut edge_tangents = EdgeTangents::default();
        for side in face.loops.iter().flat_map(|l| &l.uses) {
            let Some(e) = side.edge.filter(|e| !self.tangents[e].is_empty()) else { continue };
            let (mut ids, mut tangents) = (self.along[&e].clone(), self.tangents[&e].clone());
            if side.reversed {
                ids.reverse();
                tangents.reverse();
                tangents.iter_mut().for_each(|t| *t = -*t);
            }
            edge_tangents.add(&ids, &tangents);
        }
        edge_tangents
    }

    /// Nodes of every use of a face's loops, in the direction of the loops, including both ends. A degenerate side
    /// (pole) has `poles` segments, or on a four-sided face as many as the opposite side. One that only closes a gap of
    /// rounding has no nodes.
    pub fn loops(&self, face: &Face, shape: &Shape, poles: usize) -> Vec<Vec<Vec<Node>>> {
        let mut out = Vec::with_capacity(face.loops.len());
        for trim in &face.loops {
            let count = trim.uses.len();
            let mut sides: Vec<Vec<Node>> =
                trim.uses.iter().map(|side| self.edge_nodes(face, side)).collect();
            for k in (0..count).filter(|&k| trim.uses[k].edge.is_none()) {
                if is_joint(face, &trim.uses[k]) {
                    continue;
                }
                let at = self.pole_vertex(&trim.uses, k);
                let opposite = opposite_of(shape, k)
                    .map(|uses| joined(&sides, uses).iter().map(|n| n.uv).collect());
                sides[k] = pole_nodes(face, &trim.uses[k], at, opposite, poles);
            }
            out.push(sides);
        }
        out
    }

    fn edge_nodes(&self, face: &Face, side: &EdgeUse) -> Vec<Node> {
        let Some(ids) = side.edge.and_then(|e| self.along.get(&e)) else { return Vec::new() };
        let mut ids = ids.clone();
        if side.reversed {
            ids.reverse();
        }
        let points: Vec<Vec3> = ids.iter().map(|&id| self.points[id as usize]).collect();
        let feet = Lifted::new(face, side).feet(&points);
        let nodes = ids.iter().zip(points).zip(feet);
        nodes.map(|((&id, point), uv)| Node { uv, point, id: Some(id) }).collect()
    }

    /// Mesh vertex of the pole at use `k`: the end of the nearest preceding edge.
    fn pole_vertex(&self, uses: &[EdgeUse], k: usize) -> Option<u32> {
        let count = uses.len();
        (1..count).find_map(|back| {
            let before = &uses[(k + count - back) % count];
            let ids = self.along.get(&before.edge?)?;
            if before.reversed { ids.first().copied() } else { ids.last().copied() }
        })
    }
}

/// The uses opposite to a pole that forms an entire side of a four-sided face.
fn opposite_of(shape: &Shape, k: usize) -> Option<&[usize]> {
    let Shape::Four(sides) = shape else { return None };
    let side = sides.iter().position(|s| s[..] == [k])?;
    Some(&sides[(side + 2) % 4])
}

fn pole_nodes(
    face: &Face,
    side: &EdgeUse,
    at: Option<u32>,
    opposite: Option<Vec<Vec2>>,
    poles: usize,
) -> Vec<Node> {
    let lifted = Lifted::new(face, side);
    let [t0, t1] = lifted.domain();
    // The opposite side has the opposite direction; its parameters, not its lengths, are matched.
    let shares: Vec<f64> = match opposite.filter(|o| o.len() > 1) {
        Some(uv) => {
            let steps: Vec<f64> = uv.windows(2).rev().map(|w| (w[1] - w[0]).norm()).collect();
            let whole: f64 = steps.iter().sum();
            let run = steps.iter().scan(0.0, |sum, s| {
                *sum += s;
                Some((*sum / whole).min(1.0))
            });
            std::iter::once(0.0).chain(run).collect()
        }
        None => (0..=poles).map(|k| k as f64 / poles as f64).collect(),
    };
    let last = shares.len() - 1;
    let nodes = shares.iter().enumerate().map(|(k, s)| {
        let s = if k == last { 1.0 } else { *s };
        let uv = lifted.uv(t0 + (t1 - t0) * s);
        Node { uv, point: face.surface.point(uv), id: at }
    });
    nodes.collect()
}

/// Nodes of consecutive uses, common nodes once.
pub fn joined(sides: &[Vec<Node>], uses: &[usize]) -> Vec<Node> {
    let mut out: Vec<Node> = Vec::new();
    for &u in uses {
        let skip = usize::from(!out.is_empty());
        out.extend(sides[u].iter().skip(skip));
    }
    out
}

/// Every second node of each side.
pub fn every_other(sides: &[Vec<Vec<Node>>]) -> Vec<Vec<Vec<Node>>> {
    let thin = |side: &Vec<Node>| side.iter().step_by(2).copied().collect();
    sides.iter().map(|l| l.iter().map(thin).collect()).collect()
}

/// Nodes omitted by [`every_other`], by the vertex ids of their neighbours (smaller first).
pub fn halfway(sides: &[Vec<Vec<Node>>]) -> BTreeMap<[u32; 2], Node> {
    let mut out = BTreeMap::new();
    for side in sides.iter().flatten() {
        for w in side.windows(3).step_by(2) {
            if let (Some(a), Some(b)) = (w[0].id, w[2].id) {
                out.insert([a.min(b), a.max(b)], w[1]);
            }
        }
    }
    out
}
