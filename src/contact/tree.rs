//! A tree of boxes, eight to a node, in single precision rounded outwards; nearest-first descent with pruning.

use crate::geometry::{Aabb, Vec3};

const WIDE: usize = 8;
/// Set in a child that is a piece.
const PIECE: u32 = 1 << 31;
/// Each binary cut leaves at least a quarter of the pieces on either side: 2^31 pieces need 75 cuts, three to a node.
const STACK: usize = 26 * (WIDE - 1) + 1;

/// Boxes of eight children side by side.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Node {
    low: [[f32; WIDE]; 3],
    high: [[f32; WIDE]; 3],
    child: [u32; WIDE],
}

impl Node {
    const EMPTY: Self = Self {
        low: [[f32::INFINITY; WIDE]; 3],
        high: [[f32::NEG_INFINITY; WIDE]; 3],
        child: [PIECE; WIDE],
    };

    fn set(&mut self, lane: usize, bounds: &Aabb, child: u32) {
        for k in 0..3 {
            self.low[k][lane] = down(bounds.min[k]);
            self.high[k][lane] = -down(-bounds.max[k]);
        }
        self.child[lane] = child;
    }

    /// Squared distances to the children; infinite for missing ones.
    #[inline]
    fn distances(&self, p: [f32; 3]) -> [f32; WIDE] {
        let mut sum = [0.0; WIDE];
        for ((low, high), p) in self.low.iter().zip(&self.high).zip(p) {
            for ((low, high), sum) in low.iter().zip(high).zip(&mut sum) {
                let (below, above) = (low - p, p - high);
                let d = if below > above { below } else { above };
                let d = if d > 0.0 { d } else { 0.0 };
                *sum += d * d;
            }
        }
        sum
    }
}

/// The largest single below `x`.
fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

/// The tree.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// A point as the tree sees it.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    p: [f32; 3],
    /// How far that is from the point.
    off: f64,
}

impl Probe {
    #[inline]
    pub(super) fn new(p: &Vec3) -> Self {
        let q = [p.x as f32, p.y as f32, p.z as f32];
        let back = Vec3::new(f64::from(q[0]), f64::from(q[1]), f64::from(q[2]));
        Self { p: q, off: (p - back).norm() }
    }

    /// Boxes beyond this squared distance are farther from the point than `radius`.
    #[inline]
    pub(super) fn threshold(&self, radius: f64) -> f32 {
        const SINGLE: f64 = 1.0 + 2e-6;
        let r = (radius + self.off) * SINGLE;
        (r * r).min(f64::from(f32::MAX)) as f32
    }
}

impl Tree {
    /// Builds the tree over boxes of pieces; `order` becomes the order in which it visits them when nothing else
    /// decides, and children name positions in `order`.
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

    /// Calls `visit` with every piece whose box is not beyond the threshold `visit` returned last, nearest boxes
    /// first.
    #[inline]
    pub(super) fn nearest(
        &self,
        probe: &Probe,
        mut threshold: f32,
        mut visit: impl FnMut(usize) -> f32,
    ) {
        let mut stack = [(0.0_f32, 0_u32); STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (distance, id) = stack[depth];
            if distance > threshold {
                continue;
            }
            if id & PIECE != 0 {
                threshold = visit((id & !PIECE) as usize);
                continue;
            }
            let node = &self.nodes[id as usize];
            let distances = node.distances(probe.p);
            let first = depth;
            for (lane, &d) in distances.iter().enumerate() {
                if d <= threshold {
                    // Farthest first, so that the nearest comes off the stack first.
                    let mut at = depth;
                    while at > first && stack[at - 1].0 < d {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = (d, node.child[lane]);
                    depth += 1;
                }
            }
        }
    }
}

/// Sorts `items` so that those of the first part come first and returns how many they are: the cut with the least
/// sum of surface times number among the middle ones along the longest side.
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

/// Half the surface of a box.
fn surface(b: &Aabb) -> f64 {
    let d = b.max - b.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}

#[cfg(test)]
mod tests {
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
            tree.nearest(&probe, threshold, |k| {
                seen.push(order[k]);
                threshold
            });
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
            let mut count = 0;
            tree.nearest(&probe, probe.threshold(1e30), |_| {
                count += 1;
                f32::MAX
            });
            count
        };
        assert_eq!(visits(&[]), 0);
        assert_eq!(visits(&[Aabb { min: Vec3::zeros(), max: Vec3::zeros() }; 100]), 100);
    }
}
