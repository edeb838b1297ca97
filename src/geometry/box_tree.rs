//! Bounding volume hierarchy of axis-aligned boxes with overlap and branch-and-bound nearest-neighbour queries.

use super::{Aabb, Vec3};

/// Maximum number of items in a leaf. Doubled: half the nodes and twice the box tests per leaf.
const LEAF_SIZE_MAX: usize = 4;

#[derive(Debug, Clone)]
struct Node {
    bounds: Aabb,
    /// First child (the second child follows it), or first item of a leaf in `order`.
    first: u32,
    /// Number of items in a leaf; 0 for an inner node.
    items: u32,
}

/// A binary bounding volume hierarchy in a flat array.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
    /// Boxes of the items, in `order`.
    boxes: Vec<Aabb>,
}

impl BoxTree {
    /// Builds the tree by median splits along the longest axis of each node. Item ids are indices into `boxes`; empty
    /// boxes are excluded.
    #[must_use]
    pub fn build(boxes: &[Aabb]) -> Self {
        let order: Vec<u32> =
            (0..boxes.len() as u32).filter(|&k| !boxes[k as usize].is_empty()).collect();
        let mut tree = Self { nodes: Vec::new(), order, boxes: Vec::new() };
        if tree.order.is_empty() {
            return tree;
        }
        tree.nodes.push(Node { bounds: Aabb::EMPTY, first: 0, items: 0 });
        let mut stack = vec![(0usize, 0usize, tree.order.len())];
        while let Some((node, from, to)) = stack.pop() {
            let items = &mut tree.order[from..to];
            let bounds = items.iter().fold(Aabb::EMPTY, |b, &k| b.union(&boxes[k as usize]));
            tree.nodes[node].bounds = bounds;
            if items.len() <= LEAF_SIZE_MAX {
                tree.nodes[node].first = from as u32;
                tree.nodes[node].items = items.len() as u32;
                continue;
            }
            let axis = (bounds.max - bounds.min).imax();
            let key = |k: u32| boxes[k as usize].min[axis] + boxes[k as usize].max[axis];
            items.sort_unstable_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
            let middle = from + (to - from) / 2;
            let child = tree.nodes.len();
            tree.nodes[node].first = child as u32;
            let empty = Node { bounds: Aabb::EMPTY, first: 0, items: 0 };
            tree.nodes.extend([empty.clone(), empty]);
            stack.push((child + 1, middle, to));
            stack.push((child, from, middle));
        }
        tree.boxes = tree.order.iter().map(|&k| boxes[k as usize]).collect();
        tree
    }

    /// Visits every item of each leaf whose bounding box overlaps `region`. The visited set contains all overlapping
    /// items and may contain others.
    pub fn overlapping(&self, region: &Aabb, mut visit: impl FnMut(u32)) {
        let mut stack = if self.nodes.is_empty() { vec![] } else { vec![0u32] };
        while let Some(id) = stack.pop() {
            let node = &self.nodes[id as usize];
            let b = &node.bounds;
            if (0..3).any(|k| b.min[k] > region.max[k] || b.max[k] < region.min[k]) {
                continue;
            }
            if node.items == 0 {
                stack.extend([node.first + 1, node.first]);
                continue;
            }
            let items = node.first as usize..(node.first + node.items) as usize;
            self.order[items].iter().for_each(|&item| visit(item));
        }
    }

    /// Branch-and-bound nearest-neighbour search from the squared distance `start`; returns the smallest squared
    /// distance. `visit` receives an item and the smallest squared distance found and returns the updated one. Items
    /// with a box at exactly the smallest distance are also visited, so that ties are complete. Closer nodes are
    /// visited first.
    pub fn nearest(&self, p: &Vec3, start: f64, mut visit: impl FnMut(u32, f64) -> f64) -> f64 {
        let mut best = start;
        if self.nodes.is_empty() {
            return best;
        }
        let mut stack = vec![(self.nodes[0].bounds.distance_squared(p), 0u32)];
        while let Some((distance, id)) = stack.pop() {
            if distance > best {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.items > 0 {
                for k in node.first as usize..(node.first + node.items) as usize {
                    if self.boxes[k].distance_squared(p) <= best {
                        best = visit(self.order[k], best);
                    }
                }
                continue;
            }
            let children = [node.first, node.first + 1]
                .map(|c| (self.nodes[c as usize].bounds.distance_squared(p), c));
            let [near, far] =
                if children[0].0 <= children[1].0 { children } else { [children[1], children[0]] };
            stack.push(far);
            stack.push(near);
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_many_points_is_found() {
        let points: Vec<Vec3> = (0..1000u32)
            .map(|k| {
                let f = |m: u32| f64::from(k.wrapping_mul(m) % 997) / 997.0;
                Vec3::new(f(7919), f(104_729), f(1_299_709))
            })
            .collect();
        let boxes: Vec<Aabb> = points.iter().map(|p| Aabb::of_points([p])).collect();
        let tree = BoxTree::build(&boxes);
        for q in [Vec3::zeros(), Vec3::new(0.5, 0.4, 0.3), Vec3::new(3.0, -1.0, 0.5)] {
            let brute = points.iter().map(|p| (p - q).norm_squared()).fold(f64::INFINITY, f64::min);
            let mut visited = 0;
            let found = tree.nearest(&q, f64::INFINITY, |k, best| {
                visited += 1;
                best.min((points[k as usize] - q).norm_squared())
            });
            assert_eq!(found, brute);
            assert!(visited < 200, "{visited}");
        }
        let region = Aabb::of_points(&[Vec3::repeat(0.4), Vec3::repeat(0.6)]);
        let inside = |k: u32| region.distance_squared(&points[k as usize]) == 0.0;
        let mut met = Vec::new();
        tree.overlapping(&region, |k| met.push(k));
        assert!(met.len() < 200, "{}", met.len());
        met.retain(|&k| inside(k));
        met.sort_unstable();
        assert_eq!(met, (0..1000).filter(|&k| inside(k)).collect::<Vec<u32>>());
        assert_eq!(BoxTree::build(&[]).nearest(&Vec3::zeros(), 5.0, |_, _| 0.0), 5.0);
    }
}
