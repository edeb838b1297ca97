//! Nodes inside a face moved where an element beside them is turned over or nearly so: an arc of the border that
//! bulges into the element, a concave ring around a centre.

use super::patchwork::{Node, Patchwork};
use crate::cad::model::Face;
use crate::geometry::Vec2;

/// Elements whose worst corner (sine of its angle, signed) is below this are worked on.
const POOR: f64 = 0.15;
/// Sweeps over the nodes.
const SWEEPS: usize = 12;
/// Halvings of the step in a sweep.
const HALVINGS: usize = 5;

impl Patchwork {
    /// Moves free nodes so that the worst corner of the elements around them gets better, until no element is poor or
    /// nothing helps.
    pub fn untangle(&mut self, face: &Face) {
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); self.nodes.len()];
        for (k, e) in self.elements.iter().enumerate() {
            e.nodes().iter().for_each(|&n| around[n as usize].push(k));
        }
        for _ in 0..SWEEPS {
            let poor: Vec<usize> = (0..self.nodes.len())
                .filter(|&n| self.nodes[n].id.is_none() && self.worst_of(face, &around[n]) < POOR)
                .collect();
            let moved = poor.iter().filter(|&&n| self.improve(face, n, &around[n])).count();
            if moved == 0 {
                return;
            }
        }
    }

    fn worst_of(&self, face: &Face, elements: &[usize]) -> f64 {
        elements.iter().map(|&k| self.corner(face, k)).fold(1.0, f64::min)
    }

    /// Worst corner of one element.
    fn corner(&self, face: &Face, element: usize) -> f64 {
        let ring = self.elements[element].nodes();
        let count = ring.len();
        let node = |k: usize| &self.nodes[ring[k % count] as usize];
        let sine = |k: usize| {
            let Some(normal) = face.surface.normal(node(k).uv) else { return 1.0 };
            let (before, after) = (&node(k + count - 1).point, &node(k + 1).point);
            super::corner_sine(before, &node(k).point, after, &normal)
        };
        (0..count).map(sine).fold(1.0, f64::min)
    }

    /// Pattern search around node `n`; true when it found a better place.
    fn improve(&mut self, face: &Face, n: usize, elements: &[usize]) -> bool {
        let start = self.nodes[n];
        let reach = elements
            .iter()
            .flat_map(|&k| self.elements[k].nodes())
            .map(|&m| (self.nodes[m as usize].uv - start.uv).abs())
            .fold(Vec2::zeros(), |a, b| a.sup(&b));
        let (mut best, mut value) = (start, self.worst_of(face, elements));
        let mut step = reach * 0.25;
        for _ in 0..HALVINGS {
            let centre = best.uv;
            for k in 0..9_i32 {
                let shift = Vec2::new(f64::from(k % 3 - 1), f64::from(k / 3 - 1));
                self.nodes[n] = Node::inside(face, centre + step.component_mul(&shift));
                let found = self.worst_of(face, elements);
                if found > value {
                    (best, value) = (self.nodes[n], found);
                }
            }
            if best.uv == centre {
                step *= 0.5;
            }
        }
        self.nodes[n] = best;
        best.uv != start.uv
    }
}
