//! Bisection of triangle sides down to a given length, longest first.

use std::collections::BTreeMap;

use super::patchwork::{Node, Patchwork};
use crate::Element;
use kanagata_cad::model::Face;

/// Maximum number of passes; each bisects the longest side of every triangle.
const PASSES_MAX: usize = 24;

impl Patchwork {
    /// Bisects sides between two triangles that are longer than `size` [mm]; the boundary is unchanged.
    pub(super) fn bisect(&mut self, face: &Face, size: f64) {
        for _ in 0..PASSES_MAX {
            let long = self.long_sides(size);
            if long.is_empty() {
                return;
            }
            let mut touched = vec![false; self.elements.len()];
            for (_, [a, b], [left, right]) in long {
                if touched[left] || touched[right] {
                    continue;
                }
                let node = self.halfway(face, a, b);
                let middle = self.nodes.len() as u32;
                self.nodes.push(node);
                for k in [left, right] {
                    touched[k] = true;
                    let element = self.elements[k];
                    let with = |old: u32| {
                        let ring: Vec<u32> = element
                            .nodes()
                            .iter()
                            .map(|&n| if n == old { middle } else { n })
                            .collect();
                        Element::from_ring(&ring, element.face)
                    };
                    if let (Some(one), Some(other)) = (with(a), with(b)) {
                        self.elements[k] = one;
                        self.elements.push(other);
                    }
                }
            }
        }
    }

    /// Sides between two triangles that are longer than `size` [mm], longest first.
    fn long_sides(&self, size: f64) -> Vec<(f64, [u32; 2], [usize; 2])> {
        let mut beside: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (k, e) in self.elements.iter().enumerate().filter(|(_, e)| e.nodes().len() == 3) {
            for [a, b] in e.sides() {
                beside.entry([a.min(b), a.max(b)]).or_default().push(k);
            }
        }
        let point = |n: u32| self.nodes[n as usize].point;
        let long = beside.into_iter().filter_map(|([a, b], two)| {
            let length = (point(a) - point(b)).norm();
            let &[left, right] = &two[..] else { return None };
            (length > size).then_some((length, [a, b], [left, right]))
        });
        let mut long: Vec<_> = long.collect();
        long.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        long
    }

    /// Node on the face halfway between two nodes in space.
    fn halfway(&self, face: &Face, a: u32, b: u32) -> Node {
        let [a, b] = [a, b].map(|n| &self.nodes[n as usize]);
        let (uv, middle) = ((a.uv + b.uv) * 0.5, (a.point + b.point) * 0.5);
        let even = Node::inside(face, uv);
        // Near a pole the mean of the parameters may be far from the midpoint.
        if (even.point - middle).norm() <= 0.25 * (a.point - b.point).norm() {
            return even;
        }
        Node::inside(face, face.surface.closest_near(&middle, uv, 0.0).0)
    }
}
