//! Flat faces with one loop: division into quadrilaterals between boundary nodes.

use super::{Mesher, ring};
use crate::mapped::border::Border;
use crate::mapped::edge_tangents::EdgeTangents;
use crate::mapped::options::MeshStyle;
use crate::mapped::patchwork::{Node, Patchwork};
use crate::mapped::{bridges, polygon};

impl Mesher<'_> {
    /// True for a flat face to be cut into quadrilaterals only.
    pub(super) fn is_even_flat(&self, f: usize) -> bool {
        self.even_flats && self.flats[f] && self.model.faces[f].loops.len() == 1
    }

    /// Edges of face `f` between flat faces only, longest first: their divisions do not affect the geometry.
    pub(super) fn free_edges(&self, f: usize) -> Vec<usize> {
        let mut edges = self.edges_of(f);
        edges.retain(|&e| self.model.edges[e].uses.iter().all(|u| self.flats[u[0]]));
        edges.sort_by(|&a, &b| self.lengths[b].total_cmp(&self.lengths[a]).then(a.cmp(&b)));
        edges
    }

    /// Raises the minima of the longest free edges of the flat face `f` by as little as possible until it can be cut
    /// into quadrilaterals; false when impossible.
    pub(super) fn divide_flat(&mut self, f: usize, counts: &[usize]) -> bool {
        const EDGES_VARIED: usize = 3;
        const TRIES_MAX: usize = 4000;
        let edges: Vec<usize> = self.free_edges(f).into_iter().take(EDGES_VARIED).collect();
        if edges.is_empty() {
            return false;
        }
        let mut tries = 0;
        for more in 1.. {
            let mut best: Option<(f64, Vec<usize>)> = None;
            for first in 0..=more {
                for second in 0..=more - first {
                    let extra = [first, second, more - first - second];
                    // Skip extra divisions of missing edges.
                    if extra[edges.len()..].iter().any(|&n| n > 0) {
                        continue;
                    }
                    tries += 1;
                    let mut raised = counts.to_vec();
                    edges.iter().zip(extra).for_each(|(&e, n)| raised[e] += n);
                    if let Some(penalty) = self.shape_penalty(f, &raised)
                        && best.as_ref().is_none_or(|b| penalty < b.0)
                    {
                        best = Some((penalty, raised));
                    }
                }
            }
            if let Some((_, raised)) = best {
                edges.iter().for_each(|&e| self.minima[e] = self.minima[e].max(raised[e]));
                return true;
            }
            if tries > TRIES_MAX {
                return false;
            }
        }
        false
    }

    /// Shape penalty of the quadrilaterals of the flat face `f` with these divisions; `None` where it cannot be cut
    /// into quadrilaterals.
    fn shape_penalty(&self, f: usize, counts: &[usize]) -> Option<f64> {
        let face = &self.model.faces[f];
        let border = Border::of_face(self.model, &self.cuts(counts), face);
        let loops = border.loops(face, &self.shapes[f], 2);
        let edge_tangents = border.edge_tangents(face);
        polygon::quads(face, &ring(&loops[0]), &edge_tangents, false).map(|found| found.1)
    }

    /// A flat face without interior nodes: one with a single loop and, where few elements are required, also one with
    /// holes.
    pub(super) fn polygon(
        &self,
        f: usize,
        loops: &[Vec<Vec<Node>>],
        edge_tangents: &EdgeTangents,
    ) -> Option<Patchwork> {
        let wanted = self.options.style == MeshStyle::Structured
            && !self.options.unstructured
            && !self.halved
            && self.flats[f]
            && self.options.max_size.is_none();
        let triangles = !self.even_flats;
        let face = &self.model.faces[f];
        let ring = match loops {
            _ if !wanted => return None,
            [sides] => ring(sides),
            _ if self.options.fewest => {
                let rings: Vec<Vec<Node>> = loops.iter().map(|sides| ring(sides)).collect();
                bridges::one_ring(face, &rings)?
            }
            _ => return None,
        };
        Some(polygon::quads(face, &ring, edge_tangents, triangles)?.0)
    }
}
