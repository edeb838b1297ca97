//! Elimination tree of the block graph and its supernodes: blocks eliminated together in one front.

use super::order::BlockGraph;
use super::pattern::Members;

/// Blocks eliminated together, identified by their position in the elimination order.
#[derive(Debug, Clone, Default)]
pub(super) struct Supernode {
    /// Positions eliminated here, ascending.
    pub blocks: Vec<u32>,
    /// Later positions coupled to them, ascending.
    pub below: Vec<u32>,
    /// Child supernodes, ascending.
    pub children: Vec<u32>,
}

/// Supernodes in postorder: children first, every subtree consecutive.
#[derive(Debug, Clone, Default)]
pub(super) struct Supernodes {
    pub list: Vec<Supernode>,
    pub roots: Vec<u32>,
}

/// Maximum fraction of explicit zeros of a merged front, by its number of pivot unknowns (relaxed amalgamation).
/// Small fronts are merged freely, since dense kernels are inefficient on them.
const ZERO_FRACTION_MAX: [(usize, f64); 3] = [(40, 0.6), (100, 0.25), (400, 0.08)];

const NO_PARENT: u32 = u32::MAX;

#[derive(Default)]
struct Builder {
    blocks: Vec<Vec<u32>>,
    below: Vec<Vec<u32>>,
    parent: Vec<u32>,
    /// Unknowns in `blocks` and in `below`.
    size: Vec<[usize; 2]>,
    zeros: Vec<f64>,
}

impl Builder {
    /// Adds a position with `rows` rows below and the given child supernodes; returns its supernode.
    fn add_position(&mut self, position: u32, children: &[u32], rows: usize) -> u32 {
        // A child with exactly this structure and this block as its next position is extended (fundamental
        // supernode).
        let same = children.iter().copied().find(|&c| self.below[c as usize].len() == rows + 1);
        let node = if let Some(c) = same {
            self.blocks[c as usize].push(position);
            c
        } else {
            self.blocks.push(vec![position]);
            self.below.push(Vec::new());
            self.parent.push(NO_PARENT);
            (self.blocks.len() - 1) as u32
        };
        for &c in children.iter().filter(|&&c| c != node) {
            self.parent[c as usize] = node;
        }
        node
    }
}

pub(super) fn supernodes(graph: &BlockGraph, order: &[u32], members: &Members) -> Supernodes {
    let weight: Vec<usize> = order.iter().map(|&b| members.of(b as usize).len()).collect();
    let mut builder = fundamental(graph, order, &weight);
    let remains = amalgamate(&mut builder);
    postorder(builder, &remains)
}

/// Structures of the columns of L by position, joined into fundamental supernodes.
fn fundamental(graph: &BlockGraph, order: &[u32], weight: &[usize]) -> Builder {
    let n = order.len();
    let mut position = vec![0u32; graph.len()];
    for (k, &b) in order.iter().enumerate() {
        position[b as usize] = k as u32;
    }
    let mut b = Builder::default();
    // Supernodes by their first row below: their parent eliminates that position.
    let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut mark = vec![NO_PARENT; n];
    for j in 0..n {
        let mut rows: Vec<u32> = Vec::new();
        mark[j] = j as u32;
        let mut mark_row = |i: u32| {
            if i > j as u32 && mark[i as usize] != j as u32 {
                mark[i as usize] = j as u32;
                rows.push(i);
            }
        };
        graph.of(order[j] as usize).iter().for_each(|&o| mark_row(position[o as usize]));
        let children = std::mem::take(&mut waiting[j]);
        for &c in &children {
            b.below[c as usize].iter().for_each(|&i| mark_row(i));
        }
        rows.sort_unstable();
        let node = b.add_position(j as u32, &children, rows.len());
        if let Some(&next) = rows.first() {
            waiting[next as usize].push(node);
        }
        b.below[node as usize] = rows;
    }
    let count = |list: &[u32]| list.iter().map(|&k| weight[k as usize]).sum::<usize>();
    b.size = b.blocks.iter().zip(&b.below).map(|(p, r)| [count(p), count(r)]).collect();
    b.zeros = vec![0.0; b.blocks.len()];
    b
}

/// Merges children into parents if that adds few zeros. Returns which supernodes remain.
fn amalgamate(b: &mut Builder) -> Vec<bool> {
    let mut remains = vec![true; b.blocks.len()];
    let mut sequence: Vec<u32> = (0..b.blocks.len() as u32).collect();
    sequence.sort_by_key(|&s| b.blocks[s as usize].last().copied());
    for &s in &sequence {
        let p = merged_into(b.parent[s as usize], &b.parent, &remains);
        if p == NO_PARENT {
            continue;
        }
        let (s, p) = (s as usize, p as usize);
        let ([n1, m1], [n2, m2]) = (b.size[s], b.size[p]);
        let zeros = n1 as f64 * (n2 + m2 - m1) as f64 + b.zeros[s] + b.zeros[p];
        let pivots = n1 + n2;
        let total = (pivots * (pivots + 1)) as f64 / 2.0 + (pivots * m2) as f64;
        let allowed = ZERO_FRACTION_MAX
            .iter()
            .any(|&(pivots_max, fraction)| pivots <= pivots_max && zeros < fraction * total);
        if zeros == 0.0 || allowed {
            let mut blocks = std::mem::take(&mut b.blocks[s]);
            blocks.append(&mut b.blocks[p]);
            blocks.sort_unstable();
            b.blocks[p] = blocks;
            b.below[s] = Vec::new();
            b.size[p] = [pivots, m2];
            b.zeros[p] = zeros;
            remains[s] = false;
        }
    }
    for s in 0..b.parent.len() {
        b.parent[s] = merged_into(b.parent[s], &b.parent, &remains);
    }
    remains
}

/// The supernode into which `s` has been merged.
fn merged_into(mut s: u32, parent: &[u32], remains: &[bool]) -> u32 {
    while s != NO_PARENT && !remains[s as usize] {
        s = parent[s as usize];
    }
    s
}

fn postorder(b: Builder, remains: &[bool]) -> Supernodes {
    let n = b.blocks.len();
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut roots = Vec::new();
    let mut sequence: Vec<u32> = (0..n as u32).filter(|&s| remains[s as usize]).collect();
    sequence.sort_by_key(|&s| b.blocks[s as usize].last().copied());
    for &s in &sequence {
        match b.parent[s as usize] {
            NO_PARENT => roots.push(s),
            p => children[p as usize].push(s),
        }
    }
    // Larger contributions first: they then have the lowest addresses in the shared workspace.
    for list in &mut children {
        list.sort_by_key(|&c| std::cmp::Reverse(b.size[c as usize][1]));
    }
    let sorted = children_first(&roots, &children);
    let mut number = vec![NO_PARENT; n];
    for (k, &s) in sorted.iter().enumerate() {
        number[s as usize] = k as u32;
    }
    let (mut blocks, mut below) = (b.blocks, b.below);
    let list = sorted
        .iter()
        .map(|&s| Supernode {
            blocks: std::mem::take(&mut blocks[s as usize]),
            below: std::mem::take(&mut below[s as usize]),
            children: children[s as usize].iter().map(|&c| number[c as usize]).collect(),
        })
        .collect();
    Supernodes { list, roots: roots.iter().map(|&r| number[r as usize]).collect() }
}

/// Postorder of the trees with these roots.
fn children_first(roots: &[u32], children: &[Vec<u32>]) -> Vec<u32> {
    let mut sorted = Vec::new();
    for &root in roots {
        let mut stack = vec![(root, 0usize)];
        while let Some((s, next)) = stack.pop() {
            if let Some(&c) = children[s as usize].get(next) {
                stack.push((s, next + 1));
                stack.push((c, 0));
            } else {
                sorted.push(s);
            }
        }
    }
    sorted
}
