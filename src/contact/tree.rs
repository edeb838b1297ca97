//! A binary tree of boxes over the pieces of a tool; nearest-first descent with pruning.

use super::piece::Piece;
use crate::geometry::{Aabb, Vec3};

/// One node: its box, and either two children or a run of pieces.
#[derive(Debug, Clone)]
struct Node {
    bounds: Aabb,
    /// Second child (the first follows its parent), or first piece of a leaf.
    next: u32,
    /// Pieces of a leaf; 0 for an inner node.
    count: u32,
}

/// The tree; pieces are reordered so that a leaf's pieces lie together.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

const LEAF: usize = 2;

impl Tree {
    /// Builds the tree by median splits along the longest side and sorts `pieces` to match.
    pub(super) fn build(pieces: &mut [Piece]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(pieces.len()) };
        if !pieces.is_empty() {
            tree.split(pieces, 0);
        }
        tree
    }

    // Depth is log2 of the number of pieces: the median halves every run.
    fn split(&mut self, pieces: &mut [Piece], first: usize) {
        let bounds = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(&p.bounds));
        let me = self.nodes.len();
        if pieces.len() <= LEAF {
            self.nodes.push(Node { bounds, next: first as u32, count: pieces.len() as u32 });
            return;
        }
        self.nodes.push(Node { bounds, next: 0, count: 0 });
        let axis = (bounds.max - bounds.min).imax();
        let half = pieces.len() / 2;
        pieces.sort_by(|a, b| a.bounds.center()[axis].total_cmp(&b.bounds.center()[axis]));
        let (low, high) = pieces.split_at_mut(half);
        self.split(low, first);
        self.nodes[me].next = self.nodes.len() as u32;
        self.split(high, first + half);
    }

    /// Calls `visit` with every piece whose box may hold a point nearer than the squared radius `visit`
    /// returned last, nearest boxes first.
    pub(super) fn nearest(&self, p: &Vec3, mut radius: f64, mut visit: impl FnMut(usize) -> f64) {
        let Some(root) = self.nodes.first() else { return };
        let mut stack = [(0_u32, 0.0_f64); 96];
        stack[0] = (0, root.bounds.distance_squared(p));
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (id, distance) = stack[depth];
            if distance > radius {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.count > 0 {
                for k in node.next..node.next + node.count {
                    radius = visit(k as usize);
                }
                continue;
            }
            let (a, b) = (id + 1, node.next);
            let da = self.nodes[a as usize].bounds.distance_squared(p);
            let db = self.nodes[b as usize].bounds.distance_squared(p);
            let order = if da <= db { [(b, db), (a, da)] } else { [(a, da), (b, db)] };
            for entry in order {
                if entry.1 <= radius {
                    stack[depth] = entry;
                    depth += 1;
                }
            }
        }
    }
}
