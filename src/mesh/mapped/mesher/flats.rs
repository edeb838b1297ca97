//! Flats with one loop: cut into quads between the nodes of their borders.

use super::{Mesher, ring};
use crate::mesh::mapped::bends::Bends;
use crate::mesh::mapped::border::Border;
use crate::mesh::mapped::options::MeshStyle;
use crate::mesh::mapped::patchwork::{Node, Patchwork};
use crate::mesh::mapped::{bridges, polygon};

impl Mesher<'_> {
    /// True for a flat that is to be cut into quads only.
    pub(super) fn is_even_flat(&self, f: usize) -> bool {
        self.even_flats && self.flats[f] && self.model.faces[f].loops.len() == 1
    }

    /// Edges of face `f` that bound only flats, longest first: what their divisions are does not matter to shapes.
    pub(super) fn free_edges(&self, f: usize) -> Vec<usize> {
        let mut edges = self.edges_of(f);
        edges.retain(|&e| self.model.edges[e].uses.iter().all(|u| self.flats[u[0]]));
        edges.sort_by(|&a, &b| self.lengths[b].total_cmp(&self.lengths[a]).then(a.cmp(&b)));
        edges
    }

    /// Raises the minima of the longest free edges of flat `f` by as little as lets it be cut into quads; false when
    /// nothing does.
    pub(super) fn divide_flat(&mut self, f: usize, counts: &[usize]) -> bool {
        const EDGES: usize = 3;
        const MOST_TRIES: usize = 4000;
        let edges: Vec<usize> = self.free_edges(f).into_iter().take(EDGES).collect();
        if edges.is_empty() {
            return false;
        }
        let mut tries = 0;
        for more in 1.. {
            let mut best: Option<(f64, Vec<usize>)> = None;
            for first in 0..=more {
                for second in 0..=more - first {
                    let extra = [first, second, more - first - second];
                    // Nothing for edges there are none of.
                    if extra[edges.len()..].iter().any(|&n| n > 0) {
                        continue;
                    }
                    tries += 1;
                    let mut raised = counts.to_vec();
                    edges.iter().zip(extra).for_each(|(&e, n)| raised[e] += n);
                    if let Some(badness) = self.badness_of_quads(f, &raised)
                        && best.as_ref().is_none_or(|b| badness < b.0)
                    {
                        best = Some((badness, raised));
                    }
                }
            }
            if let Some((_, raised)) = best {
                edges.iter().for_each(|&e| self.minima[e] = self.minima[e].max(raised[e]));
                return true;
            }
            if tries > MOST_TRIES {
                return false;
            }
        }
        false
    }

    /// How badly shaped the quads of flat `f` are with such divisions of its edges; `None` where it cannot be cut into quads.
    fn badness_of_quads(&self, f: usize, counts: &[usize]) -> Option<f64> {
        let face = &self.model.faces[f];
        let border = Border::of_face(self.model, &self.cuts(counts), face);
        let loops = border.loops(face, &self.shapes[f], 2);
        let bends = border.bends(face);
        polygon::quads(face, &ring(&loops[0]), &bends, false).map(|found| found.1)
    }

    /// A flat without nodes inside: one with one loop, and where few elements are asked also one with holes.
    pub(super) fn polygon(
        &self,
        f: usize,
        loops: &[Vec<Vec<Node>>],
        bends: &Bends,
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
        Some(polygon::quads(face, &ring, bends, triangles)?.0)
    }
}
