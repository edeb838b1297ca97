//! Search tree with eight bounding boxes per node in single precision, rounded outwards; nearest-first traversal with
//! pruning.

use super::node::{Node, PIECE, WIDE};
use super::wide::Wide;
use kanagata_geometry::{Aabb, Vec3};

/// The tree.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// A query point in single precision.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    p: [f32; 3],
    /// Its distance from the exact point [mm].
    off: f64,
}

impl Probe {
    #[inline(always)]
    pub(super) fn new(p: &Vec3) -> Self {
        let q = [p.x as f32, p.y as f32, p.z as f32];
        let back = Vec3::new(f64::from(q[0]), f64::from(q[1]), f64::from(q[2]));
        Self { p: q, off: (p - back).norm() }
    }

    /// Squared distance threshold: boxes beyond it are farther from the point than `radius`.
    #[inline(always)]
    pub(super) fn threshold(&self, radius: f64) -> f32 {
        const SINGLE_ROUNDING: f64 = 1.0 + 2e-6;
        let r = (radius + self.off) * SINGLE_ROUNDING;
        (r * r).min(f64::from(f32::MAX)) as f32
    }
}

impl Tree {
    /// Builds the tree over the boxes of pieces. `order` becomes the default order of traversal; children are indices
    /// into `order`.
    pub(super) fn build(boxes: &[Aabb], order: &mut [u32]) -> Self {
        let mut nodes = vec![Node::EMPTY];
        let mut todo = vec![(0_usize, 0, order.len())];
        while let Some((node, from, to)) = todo.pop() {
            let mut runs = vec![(from, to)];
            for _ in 0..3 {
                runs = runs
                    .into_iter()
                    .flat_map(|(a, b)| match b - a {
                        0 | 1 => vec![(a, b)],
                        _ => {
                            let middle = a + split(boxes, &mut order[a..b]);
                            vec![(a, middle), (middle, b)]
                        }
                    })
                    .collect();
            }
            for (lane, (a, b)) in runs.into_iter().filter(|(a, b)| a < b).enumerate() {
                let all = &order[a..b];
                let bounds = all.iter().fold(Aabb::EMPTY, |sum, &k| sum.union(&boxes[k as usize]));
                let child = if b - a == 1 {
                    PIECE | a as u32
                } else {
                    nodes.push(Node::EMPTY);
                    todo.push((nodes.len() - 1, a, b));
                    nodes.len() as u32 - 1
                };
                nodes[node].set(lane, &bounds, child);
            }
        }
        Self { nodes }
    }

    /// A piece near the point: descends to the child with the nearest box.
    #[inline(always)]
    pub(super) fn descend_to_nearest(&self, wide: impl Wide, probe: &Probe) -> usize {
        let mut id = 0;
        while id & PIECE == 0 {
            let node = &self.nodes[id as usize];
            id = node.child[wide.min_lane(wide.distances(node, probe.p))];
        }
        (id & !PIECE) as usize
    }
}

/// Traversal of the pieces with near boxes, nearest child first.
pub(super) struct Walk {
    /// Next entry: squared distance in the upper half, child in the lower one.
    next: Option<u64>,
    stack: [u64; STACK_SIZE],
    depth: usize,
    /// Entries beyond the capacity of the stack.
    more: Vec<u64>,
}

const STACK_SIZE: usize = 32;

impl Walk {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { next: Some(0), stack: [0; STACK_SIZE], depth: 0, more: Vec::new() }
    }

    /// The next piece whose box is not beyond the threshold.
    #[inline(always)]
    pub(super) fn next(
        &mut self,
        wide: impl Wide,
        tree: &Tree,
        probe: &Probe,
        threshold: f32,
    ) -> Option<usize> {
        loop {
            let entry = match self.next.take() {
                Some(entry) => entry,
                None => self.pop(threshold)?,
            };
            let id = entry as u32;
            if id & PIECE != 0 {
                return Some((id & !PIECE) as usize);
            }
            if self.depth + WIDE > STACK_SIZE {
                self.store();
            }
            let node = &tree.nodes[id as usize];
            let distances = wide.distances(node, probe.p);
            let mut near = wide.not_above(distances, threshold);
            let distances = wide.eight(distances);
            let mut take = || {
                let lane = near.trailing_zeros() as usize % WIDE;
                let found = near != 0;
                near &= near.wrapping_sub(1);
                let entry =
                    u64::from(distances[lane].to_bits()) << 32 | u64::from(node.child[lane]);
                found.then_some(entry)
            };
            self.next = take();
            while let (Some(best), Some(other)) = (self.next, take()) {
                self.next = Some(best.min(other));
                self.push(best.max(other));
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: u64) {
        self.stack[self.depth % STACK_SIZE] = entry;
        self.depth += 1;
    }

    /// The last stored entry that is not beyond the threshold.
    #[inline(always)]
    fn pop(&mut self, threshold: f32) -> Option<u64> {
        loop {
            let entry = match self.depth.checked_sub(1) {
                Some(depth) => {
                    self.depth = depth;
                    self.stack[depth % STACK_SIZE]
                }
                None => self.more.pop()?,
            };
            if f32::from_bits((entry >> 32) as u32) <= threshold {
                return Some(entry);
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn store(&mut self) {
        self.more.extend_from_slice(&self.stack[..self.depth]);
        self.depth = 0;
    }
}

/// Partitions `items` and returns the number of items in the first part: among the middle splits along the longest side
/// the one with the smallest sum of surface area times number (surface area heuristic).
fn split(boxes: &[Aabb], items: &mut [u32]) -> usize {
    let centre = |k: u32| boxes[k as usize].center();
    let spread = items.iter().fold(Aabb::EMPTY, |mut b, &k| {
        b.grow(&centre(k));
        b
    });
    let axis = (spread.max - spread.min).imax();
    items.sort_unstable_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
    let n = items.len();
    let grown = |all: &mut dyn Iterator<Item = &u32>| {
        let mut sum = Aabb::EMPTY;
        all.map(|&k| {
            sum = sum.union(&boxes[k as usize]);
            surface(&sum)
        })
        .collect::<Vec<f64>>()
    };
    let (left, right) = (grown(&mut items.iter()), grown(&mut items.iter().rev()));
    let cost = |k: usize| left[k - 1] * k as f64 + right[n - k - 1] * (n - k) as f64;
    let (first, last) = (n.div_ceil(4), n - n.div_ceil(4));
    (first.max(1)..=last.max(1).min(n - 1))
        .min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
        .unwrap_or(n / 2)
}

/// Half the surface area of a box.
fn surface(b: &Aabb) -> f64 {
    let d = b.max - b.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}

#[cfg(test)]
mod tests {
    use super::super::wide::Plain;
    use super::*;

    #[test]
    fn every_box_within_the_radius_is_visited_nearest_first() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((seed >> 33) as f64) / (1u64 << 31) as f64
        };
        let boxes: Vec<Aabb> = (0..1000)
            .map(|_| {
                let a = Vec3::new(random(), random(), random()) * 100.0;
                let b = Vec3::new(random(), random(), random()) * 5.0;
                Aabb { min: a, max: a + b }
            })
            .collect();
        let mut order: Vec<u32> = (0..1000).collect();
        let tree = Tree::build(&boxes, &mut order);
        for radius in [0.0, 3.0, 40.0] {
            let p = Vec3::new(random(), random(), random()) * 120.0;
            let probe = Probe::new(&p);
            let mut seen = vec![];
            let threshold = probe.threshold(radius);
            let mut walk = Walk::new();
            while let Some(k) = walk.next(Plain, &tree, &probe, threshold) {
                seen.push(order[k]);
            }
            let inside = |k: &u32| boxes[*k as usize].distance_squared(&p) <= radius * radius;
            let expected = (0..1000).filter(inside).count();
            assert_eq!(seen.iter().filter(|k| inside(k)).count(), expected);
            assert!(seen.len() <= expected + 3);
        }
    }

    #[test]
    fn no_box_and_equal_boxes_are_trees() {
        let visits = |boxes: &[Aabb]| {
            let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
            let tree = Tree::build(boxes, &mut order);
            let probe = Probe::new(&Vec3::zeros());
            let mut walk = Walk::new();
            std::iter::from_fn(|| walk.next(Plain, &tree, &probe, f32::MAX)).count()
        };
        assert_eq!(visits(&[]), 0);
        assert_eq!(visits(&[Aabb { min: Vec3::zeros(), max: Vec3::zeros() }; 100]), 100);
    }
}
