//! Nested dissection of a block graph by the coordinates of the blocks.

use kanagata_geometry::Vec3;

/// Undirected graph in compressed rows: the neighbours of block b without b itself.
#[derive(Debug, Clone, Default)]
pub struct BlockGraph {
    /// Start of the neighbours of each block; length blocks + 1.
    pub start: Vec<usize>,
    /// Neighbours, ascending within a block.
    pub neighbours: Vec<u32>,
}

impl BlockGraph {
    /// Number of blocks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Neighbours of block `b`.
    #[must_use]
    pub fn of(&self, b: usize) -> &[u32] {
        &self.neighbours[self.start[b]..self.start[b + 1]]
    }
}

/// Maximum number of blocks of a leaf of the dissection; smaller leaves cost more fronts than they save fill.
const LEAF_BLOCKS_MAX: usize = 6;

/// Elimination order (block ids) by nested dissection. Each part is halved across its longer side at the median
/// coordinate. The separator is the smaller of the two layers of blocks that are adjacent across the cut. The result
/// is a pure function of the arguments.
#[must_use]
pub fn nested_dissection(graph: &BlockGraph, centers: &[Vec3]) -> Vec<u32> {
    let mut order = Vec::with_capacity(graph.len());
    // Built in reverse: separators are appended before their halves, then all is reversed.
    let mut side = vec![0u32; graph.len()];
    let mut stamp = 0;
    let mut parts = vec![(0..graph.len() as u32).collect::<Vec<u32>>()];
    while let Some(mut part) = parts.pop() {
        if part.len() <= LEAF_BLOCKS_MAX {
            let axis = longest_axes(&part, centers)[0];
            sort_along(&mut part, centers, axis);
            order.extend(part.iter().rev());
            continue;
        }
        let [first, second, _] = longest_axes(&part, centers);
        let cut = [first, second]
            .into_iter()
            .map(|axis| split(&mut part, graph, centers, axis, &mut side, &mut stamp))
            // A cut across the second axis must be clearly thinner to compensate for its longer halves.
            .reduce(|a, b| if 4 * b.separator.len() < 3 * a.separator.len() { b } else { a });
        let Some(cut) = cut else { continue };
        if cut.low.is_empty() && cut.high.is_empty() {
            order.extend(cut.separator.iter().rev());
            continue;
        }
        order.extend(cut.separator.iter().rev());
        parts.push(cut.low);
        parts.push(cut.high);
    }
    order.reverse();
    order
}

struct Cut {
    low: Vec<u32>,
    high: Vec<u32>,
    separator: Vec<u32>,
}

fn split(
    part: &mut [u32],
    graph: &BlockGraph,
    centers: &[Vec3],
    axis: usize,
    side: &mut [u32],
    stamp: &mut u32,
) -> Cut {
    sort_along(part, centers, axis);
    let half = gap_near_middle(part, centers, axis);
    let (low_mark, high_mark) = (*stamp + 1, *stamp + 2);
    *stamp += 2;
    for (k, &b) in part.iter().enumerate() {
        side[b as usize] = if k < half { low_mark } else { high_mark };
    }
    let touches =
        |b: u32, mark: u32| graph.of(b as usize).iter().any(|&n| side[n as usize] == mark);
    let layer = |blocks: &[u32], mark| -> Vec<u32> {
        blocks.iter().copied().filter(|&b| touches(b, mark)).collect()
    };
    let low_layer = layer(&part[..half], high_mark);
    let high_layer = layer(&part[half..], low_mark);
    let separator = if high_layer.len() < low_layer.len() { high_layer } else { low_layer };
    let mut in_separator = rustc_hash::FxHashSet::default();
    in_separator.extend(separator.iter().copied());
    let rest = |blocks: &[u32]| -> Vec<u32> {
        blocks.iter().copied().filter(|b| !in_separator.contains(b)).collect()
    };
    let (low, high) = (rest(&part[..half]), rest(&part[half..]));
    let mut separator = separator;
    let [longest, second, _] = longest_axes(part, centers);
    // Along the separator, so that neighbouring blocks have neighbouring numbers.
    sort_along(&mut separator, centers, if axis == longest { second } else { longest });
    Cut { low, high, separator }
}

/// Cut position in a sorted part: the widest gap between neighbours in its middle fifth, nearest to the middle among
/// equals. Layers of a regular mesh therefore stay whole.
fn gap_near_middle(part: &[u32], centers: &[Vec3], axis: usize) -> usize {
    let n = part.len();
    let at = |k: usize| centers[part[k] as usize][axis];
    let (low, high) = ((2 * n / 5).max(1), (3 * n / 5).max(1));
    let gap = |k: usize| at(k) - at(k - 1);
    let widest = (low..=high).map(gap).fold(0.0, f64::max);
    (low..=high)
        .filter(|&k| gap(k) >= widest * (1.0 - 1e-9))
        .min_by_key(|&k| (2 * k).abs_diff(n))
        .unwrap_or(n / 2)
}

/// Axes in order of decreasing extent of the part.
fn longest_axes(part: &[u32], centers: &[Vec3]) -> [usize; 3] {
    let bounds = kanagata_geometry::Aabb::of_points(part.iter().map(|&b| &centers[b as usize]));
    let extent = bounds.max - bounds.min;
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extent[b].total_cmp(&extent[a]));
    axes
}

/// Sorts by one coordinate, ties by the others and the id, so that the order is deterministic.
fn sort_along(part: &mut [u32], centers: &[Vec3], axis: usize) {
    part.sort_unstable_by(|&a, &b| {
        let (ca, cb) = (&centers[a as usize], &centers[b as usize]);
        let by = |k: usize| ca[k].total_cmp(&cb[k]);
        by(axis).then_with(|| by((axis + 1) % 3)).then_with(|| by((axis + 2) % 3)).then(a.cmp(&b))
    });
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Graph of an nx x ny grid of blocks, each connected to its eight neighbours.
    pub fn grid(nx: usize, ny: usize) -> (BlockGraph, Vec<Vec3>) {
        let mut graph = BlockGraph { start: vec![0], neighbours: Vec::new() };
        let mut centers = Vec::new();
        for i in 0..nx {
            for j in 0..ny {
                centers.push(Vec3::new(i as f64, j as f64, 0.0));
                for ii in i.saturating_sub(1)..(i + 2).min(nx) {
                    for jj in j.saturating_sub(1)..(j + 2).min(ny) {
                        if (ii, jj) != (i, j) {
                            graph.neighbours.push((ii * ny + jj) as u32);
                        }
                    }
                }
                graph.start.push(graph.neighbours.len());
            }
        }
        (graph, centers)
    }

    /// Graph of undirected edges in any order, given once or twice.
    pub fn from_ties(blocks: usize, ties: impl Iterator<Item = [u32; 2]>) -> BlockGraph {
        let mut near = vec![std::collections::BTreeSet::new(); blocks];
        for [a, b] in ties.filter(|[a, b]| a != b) {
            near[a as usize].insert(b);
            near[b as usize].insert(a);
        }
        let mut graph = BlockGraph { start: vec![0], neighbours: Vec::new() };
        for others in near {
            graph.neighbours.extend(others);
            graph.start.push(graph.neighbours.len());
        }
        graph
    }

    /// An n x n x n grid of blocks, each connected to its six neighbours, with permuted coordinates.
    pub fn scattered(n: u32) -> (BlockGraph, Vec<Vec3>) {
        let at = |k: u32| [k / (n * n), k / n % n, k % n];
        let next = |k: u32, d: usize| (at(k)[d] + 1 < n).then_some([k, k + [n * n, n, 1][d]]);
        let count = n * n * n;
        let ties = (0..count).flat_map(|k| (0..3).filter_map(move |d| next(k, d)));
        let graph = from_ties(count as usize, ties);
        let mut dealt: Vec<u32> = (0..count).collect();
        dealt.sort_by_key(|k| (k ^ (k >> 3)).wrapping_mul(0x9E37_79B9).swap_bytes());
        let centers = dealt.into_iter().map(|k| Vec3::from(at(k).map(f64::from))).collect();
        (graph, centers)
    }

    #[test]
    fn every_block_occurs_once_and_the_last_ones_separate_the_grid() {
        let (graph, centers) = grid(21, 20);
        let order = nested_dissection(&graph, &centers);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(k, &b)| k == b as usize));
        // The last separator is one column of 20 blocks with equal x.
        let last: Vec<f64> = order[400..].iter().map(|&b| centers[b as usize].x).collect();
        assert!(last.iter().all(|&x| x == last[0]), "{last:?}");
    }

    #[test]
    fn coincident_centers_and_cliques_are_ordered_too() {
        let (graph, _) = grid(9, 1);
        let order = nested_dissection(&graph, &vec![Vec3::zeros(); 9]);
        assert_eq!(order.len(), 9);
    }
}
