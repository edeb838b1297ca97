//! The mesh of one face during generation: nodes with parameters, elements over local ids.

use std::collections::BTreeMap;

use crate::Element;
use kanagata_cad::model::Face;
use kanagata_geometry::{Vec2, Vec3};

/// A node of a face's mesh.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// Parameters on the face.
    pub uv: Vec2,
    /// Position [mm].
    pub point: Vec3,
    /// Vertex of the global mesh for nodes on edges; `None` inside the face.
    pub id: Option<u32>,
}

/// Nodes and elements of one face; elements are counter-clockwise in the parameter plane.
#[derive(Debug, Clone, Default)]
pub struct Patchwork {
    /// Nodes, boundary nodes first.
    pub nodes: Vec<Node>,
    /// Elements over indices into `nodes`.
    pub elements: Vec<Element>,
}

impl Node {
    /// A node in the interior of `face` at `uv`.
    pub fn inside(face: &Face, uv: Vec2) -> Self {
        Self { uv, point: face.surface.point(uv), id: None }
    }

    /// True when both are the same vertex of the mesh.
    pub fn same(&self, other: &Self) -> bool {
        self.id.is_some() && self.id == other.id
    }
}

impl Patchwork {
    /// Adds an element over local ids; corners with a common vertex (poles) are merged.
    pub fn push(&mut self, ring: &[u32]) {
        let mut kept: Vec<u32> = Vec::with_capacity(4);
        for &n in ring {
            let same = |m: u32| m == n || self.nodes[m as usize].same(&self.nodes[n as usize]);
            if !kept.last().is_some_and(|&m| same(m)) {
                kept.push(n);
            }
        }
        if let (Some(&first), Some(&last)) = (kept.first(), kept.last())
            && kept.len() > 1
            && self.nodes[first as usize].same(&self.nodes[last as usize])
        {
            kept.pop();
        }
        self.elements.extend(Element::from_ring(&kept, 0));
    }

    /// Smallest corner Jacobian over all elements: the signed sine, 1 for right angles on a flat face, negative where a
    /// corner is inverted relative to the surface normal.
    pub fn worst_corner(&self, face: &Face) -> f64 {
        let normals: Vec<Option<Vec3>> =
            self.nodes.iter().map(|n| face.surface.normal(n.uv)).collect();
        let mut worst = 1.0f64;
        for e in &self.elements {
            worst = worst.min(self.element_quality(e.nodes(), &normals));
        }
        worst
    }

    fn element_quality(&self, ring: &[u32], normals: &[Option<Vec3>]) -> f64 {
        let count = ring.len();
        let at = |k: usize| self.nodes[ring[k % count] as usize].point;
        let mut worst = 1.0f64;
        for k in 0..count {
            let Some(normal) = normals[ring[k] as usize] else { continue };
            let (out, back) = (at(k + 1) - at(k), at(k + count - 1) - at(k));
            let scale = out.norm() * back.norm();
            worst =
                worst.min(if scale > 0.0 { out.cross(&back).dot(&normal) / scale } else { -1.0 });
        }
        worst
    }

    /// Mean of the parameters of some nodes. At a pole the free parameter is excluded.
    fn mean_uv(&self, face: &Face, nodes: &[u32]) -> Vec2 {
        let (mut sum, mut weight) = (Vec2::zeros(), Vec2::zeros());
        let mut plain = Vec2::zeros();
        for node in nodes.iter().map(|&n| &self.nodes[n as usize]) {
            let d = face.surface.derivs(node.uv);
            let speed = [d.su.norm(), d.sv.norm()];
            for k in 0..2 {
                let counts = speed[k] > 1e-9 * speed[1 - k];
                sum[k] += if counts { node.uv[k] } else { 0.0 };
                weight[k] += if counts { 1.0 } else { 0.0 };
            }
            plain += node.uv / nodes.len() as f64;
        }
        let mean = |k: usize| if weight[k] > 0.0 { sum[k] / weight[k] } else { plain[k] };
        Vec2::new(mean(0), mean(1))
    }

    /// Splits quadrilaterals in four and triangles in three quadrilaterals. `middle` contains the node halfway along a
    /// boundary segment, by the vertex ids of its ends (smaller first).
    pub fn refined(&self, face: &Face, middle: &BTreeMap<[u32; 2], Node>) -> Self {
        let mut out = Self { nodes: self.nodes.clone(), elements: Vec::new() };
        let mut halves = BTreeMap::new();
        // Nodes of a pole are one vertex: sides are identified by vertex where there is one.
        let name = |n: u32| self.nodes[n as usize].id.map_or((1, n), |id| (0, id));
        for e in &self.elements {
            let ring = e.nodes();
            let count = ring.len();
            let mut mids = Vec::with_capacity(4);
            for [a, b] in e.sides() {
                let (x, y) = (name(a).min(name(b)), name(a).max(name(b)));
                let id = *halves.entry((x, y)).or_insert_with(|| {
                    let uv = self.mean_uv(face, &[a, b]);
                    let known = if x.0 == 0 && y.0 == 0 { middle.get(&[x.1, y.1]) } else { None };
                    out.nodes.push(known.copied().unwrap_or_else(|| Node::inside(face, uv)));
                    out.nodes.len() as u32 - 1
                });
                mids.push(id);
            }
            let uv = self.mean_uv(face, ring);
            out.nodes.push(Node::inside(face, uv));
            let centre = out.nodes.len() as u32 - 1;
            for k in 0..count {
                out.push(&[ring[k], mids[k], centre, mids[(k + count - 1) % count]]);
            }
        }
        out
    }
}
