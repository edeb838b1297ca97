//! Matrix rows times vectors in one pass over the matrix, since memory traffic dominates the cost.
//!
//! In the pattern of a mesh (three rows and columns for each node) the rows of a node are multiplied together. The
//! vector entries are gathered once for all three, and the products run over contiguous numbers.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::pattern::Pattern;

/// Nodes of one parallel task.
const NODES_PER_TASK: usize = 512;

/// Some nodes and the output of their rows, by vector.
type Task<'a, const R: usize> = (&'a [usize], [&'a mut [[f64; 3]]; R]);

/// Pattern with three rows and columns for each node, as of a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeRows {
    /// Neighbours of every node, concatenated.
    neighbours: Vec<u32>,
}

impl NodeRows {
    /// `None` if the pattern has no such structure.
    #[must_use]
    pub fn of(pattern: &Pattern) -> Option<Self> {
        if !pattern.dim().is_multiple_of(3) {
            return None;
        }
        let columns = |row: usize| &pattern.col_idx[pattern.row_ptr[row]..pattern.row_ptr[row + 1]];
        let mut neighbours = Vec::with_capacity(pattern.nnz() / 9);
        for row in (0..pattern.dim()).step_by(3) {
            let (nodes, rest) = columns(row).as_chunks::<3>();
            let of_node = |&[a, b, c]: &[usize; 3]| a % 3 == 0 && b == a + 1 && c == a + 2;
            let alike = columns(row) == columns(row + 1) && columns(row) == columns(row + 2);
            if !rest.is_empty() || !alike || !nodes.iter().all(of_node) {
                return None;
            }
            neighbours.extend(nodes.iter().map(|[column, ..]| (column / 3) as u32));
        }
        Some(Self { neighbours })
    }

    /// The three rows of each node times the vectors: by vector, then in the order of `nodes`. `pattern` must be the
    /// one given to [`NodeRows::of`]; `rows` are the three rows of a node, concatenated.
    #[must_use]
    pub fn products<'a>(
        &self,
        pattern: &Pattern,
        rows: impl Fn(usize) -> &'a [f64] + Sync,
        nodes: &[usize],
        x: &[Vec<f64>],
    ) -> Vec<Vec<[f64; 3]>> {
        let mut out = Vec::with_capacity(x.len());
        for pair in x.chunks(2) {
            match pair {
                [one] => out.extend(self.products_of(pattern, &rows, nodes, [one])),
                [one, two] => out.extend(self.products_of(pattern, &rows, nodes, [one, two])),
                _ => {}
            }
        }
        out
    }

    /// Neighbours of a node including itself; its rows hold nine values for each.
    #[inline(always)]
    fn neighbours_of(&self, pattern: &Pattern, node: usize) -> &[u32] {
        &self.neighbours[pattern.row_ptr[3 * node] / 9..pattern.row_ptr[3 * node + 3] / 9]
    }

    fn products_of<'a, const R: usize>(
        &self,
        pattern: &Pattern,
        rows: &(impl Fn(usize) -> &'a [f64] + Sync),
        nodes: &[usize],
        x: [&[f64]; R],
    ) -> [Vec<[f64; 3]>; R] {
        let mut out = x.map(|_| vec![[0.0; 3]; nodes.len()]);
        let mut tasks: Vec<Task<'_, R>> = Vec::new();
        let mut parts = out.each_mut().map(|out| out.chunks_mut(NODES_PER_TASK));
        for nodes in nodes.chunks(NODES_PER_TASK) {
            tasks.push((nodes, parts.each_mut().map(|part| part.next().unwrap_or_default())));
        }
        tasks.into_par_iter().for_each(|(nodes, out)| {
            let of_node =
                |&node: &usize| NodeBlock::new(self.neighbours_of(pattern, node), rows(node));
            let rows = nodes.iter().map(of_node).collect();
            Arch::new().dispatch(Products { rows, x, out });
        });
        out
    }
}

impl Pattern {
    /// `b - A x` for the matrix with these values and every pair `[x, b]`; `nodes` is the node structure of a mesh
    /// pattern.
    #[must_use]
    pub fn residuals(
        &self,
        values: &[f64],
        pairs: &[[&[f64]; 2]],
        nodes: Option<&NodeRows>,
    ) -> Vec<Vec<f64>> {
        let mut out = Vec::with_capacity(pairs.len());
        for pair in pairs.chunks(2) {
            match pair {
                [one] => out.extend(self.residuals_of(values, [one], nodes)),
                [one, two] => out.extend(self.residuals_of(values, [one, two], nodes)),
                _ => {}
            }
        }
        out
    }

    /// `b - A x` of `R` pairs in one pass over the matrix.
    fn residuals_of<const R: usize>(
        &self,
        values: &[f64],
        pairs: [&[&[f64]; 2]; R],
        nodes: Option<&NodeRows>,
    ) -> [Vec<f64>; R] {
        let mut out = pairs.map(|[_, b]| b.to_vec());
        let mut chunks: Vec<[&mut [f64]; R]> = Vec::new();
        let mut parts = out.each_mut().map(|out| out.chunks_mut(3 * NODES_PER_TASK));
        for _ in 0..self.dim().div_ceil(3 * NODES_PER_TASK) {
            chunks.push(parts.each_mut().map(|part| part.next().unwrap_or_default()));
        }
        let x = pairs.map(|[x, _]| *x);
        chunks.into_par_iter().enumerate().for_each(|(chunk, out)| {
            let first = chunk * 3 * NODES_PER_TASK;
            Arch::new().dispatch(Subtract { pattern: self, nodes, values, x, first, out });
        });
        out
    }
}

/// Subtracts rows times vectors from the output, starting with row `first`.
struct Subtract<'a, const R: usize> {
    pattern: &'a Pattern,
    nodes: Option<&'a NodeRows>,
    values: &'a [f64],
    x: [&'a [f64]; R],
    first: usize,
    out: [&'a mut [f64]; R],
}

impl<const R: usize> WithSimd for Subtract<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { pattern, nodes, values, x, first, mut out } = self;
        let count = out.first().map_or(0, |out| out.len());
        let mut gathered = x.map(|_| Vec::new());
        if let Some(nodes) = nodes {
            for row in (0..count).step_by(3) {
                let node = (first + row) / 3;
                let rows = &values[pattern.row_ptr[first + row]..pattern.row_ptr[first + row + 3]];
                let rows = NodeBlock::new(nodes.neighbours_of(pattern, node), rows);
                rows.gather(x, &mut gathered);
                let sums = rows.times(simd, gathered.each_ref().map(|gathered| &gathered[..]));
                for (out, sums) in out.iter_mut().zip(sums) {
                    out[row..row + 3].iter_mut().zip(sums).for_each(|(out, sum)| *out -= sum);
                }
            }
            return;
        }
        for row in 0..count {
            let range = pattern.row_ptr[first + row]..pattern.row_ptr[first + row + 1];
            for (out, x) in out.iter_mut().zip(x) {
                let terms = values[range.clone()].iter().zip(&pattern.col_idx[range.clone()]);
                out[row] -= terms.map(|(value, &column)| value * x[column]).sum::<f64>();
            }
        }
    }
}

/// Rows of nodes times vectors.
struct Products<'a, const R: usize> {
    rows: Vec<NodeBlock<'a>>,
    x: [&'a [f64]; R],
    out: [&'a mut [[f64; 3]]; R],
}

impl<const R: usize> WithSimd for Products<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, x, mut out } = self;
        let mut gathered = x.map(|_| Vec::new());
        for (k, rows) in rows.iter().enumerate() {
            rows.gather(x, &mut gathered);
            let sums = rows.times(simd, gathered.each_ref().map(|gathered| &gathered[..]));
            out.iter_mut().zip(sums).for_each(|(out, sums)| out[k] = sums);
        }
    }
}

/// The rows of one node.
struct NodeBlock<'a> {
    neighbours: &'a [u32],
    rows: [&'a [f64]; 3],
}

impl<'a> NodeBlock<'a> {
    #[inline(always)]
    fn new(neighbours: &'a [u32], rows: &'a [f64]) -> Self {
        let (first, rest) = rows.split_at(3 * neighbours.len());
        let (second, third) = rest.split_at(3 * neighbours.len());
        Self { neighbours, rows: [first, second, third] }
    }

    /// Gathers the vector entries at the neighbours.
    #[inline(always)]
    fn gather<const R: usize>(&self, x: [&[f64]; R], gathered: &mut [Vec<f64>; R]) {
        for (gathered, x) in gathered.iter_mut().zip(x) {
            gathered.resize(3 * self.neighbours.len(), 0.0);
            let (gathered, _) = gathered.as_chunks_mut::<3>();
            let (x, _) = x.as_chunks::<3>();
            for (gathered, &neighbour) in gathered.iter_mut().zip(self.neighbours) {
                *gathered = x[neighbour as usize];
            }
        }
    }

    /// The rows times the gathered entries.
    #[inline(always)]
    fn times<S: Simd, const R: usize>(&self, simd: S, gathered: [&[f64]; R]) -> [[f64; 3]; R] {
        let rows = self.rows.map(|row| S::as_simd_f64s(row));
        let gathered = gathered.map(|gathered| S::as_simd_f64s(gathered));
        let mut sums = [[simd.splat_f64s(0.0); 3]; R];
        let count = rows[0].0.len();
        let wide = rows.map(|(wide, _)| &wide[..count]);
        let wide_gathered = gathered.map(|(gathered, _)| &gathered[..count]);
        for i in 0..count {
            let values = wide.map(|row| row[i]);
            for (sums, gathered) in sums.iter_mut().zip(wide_gathered) {
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum = simd.mul_add_e_f64s(value, gathered[i], *sum);
                }
            }
        }
        let mut out = [[0.0; 3]; R];
        for ((out, sums), (_, gathered)) in out.iter_mut().zip(sums).zip(gathered) {
            for ((out, sum), (_, row)) in out.iter_mut().zip(sums).zip(rows) {
                let rest: f64 = row.iter().zip(gathered).map(|(value, x)| value * x).sum();
                *out = simd.reduce_sum_f64s(sum) + rest;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(k: usize) -> f64 {
        (0.7 * k as f64 + 0.3).sin()
    }

    fn pattern(rows: &[Vec<usize>]) -> Pattern {
        let mut pattern = Pattern { row_ptr: vec![0], col_idx: Vec::new() };
        for row in rows {
            pattern.col_idx.extend(row);
            pattern.row_ptr.push(pattern.col_idx.len());
        }
        pattern
    }

    /// Four nodes with their neighbours.
    fn mesh() -> Pattern {
        let neighbours = [vec![0, 1, 3], vec![0, 1], vec![2], vec![0, 1, 2, 3]];
        let columns = |nodes: &Vec<usize>| nodes.iter().flat_map(|n| 3 * n..3 * n + 3).collect();
        let rows: Vec<Vec<usize>> =
            neighbours.iter().flat_map(|nodes| [(); 3].map(|()| columns(nodes))).collect();
        pattern(&rows)
    }

    fn sum(pattern: &Pattern, values: &[f64], row: usize, x: &[f64]) -> f64 {
        let range = pattern.row_ptr[row]..pattern.row_ptr[row + 1];
        range.map(|q| values[q] * x[pattern.col_idx[q]]).sum()
    }

    #[test]
    fn residuals_are_those_of_plain_sums() {
        let others = pattern(&[vec![0, 3, 10], vec![1, 2, 4, 7], vec![5], vec![0, 9]]);
        // As wide as the rows of a node, but with columns of no node.
        let beside = pattern(&[(); 3].map(|()| vec![0, 1, 4]));
        for (pattern, is_mesh) in [(mesh(), true), (others, false), (beside, false)] {
            let nodes = NodeRows::of(&pattern);
            assert_eq!(nodes.is_some(), is_mesh);
            let values: Vec<f64> = (0..pattern.nnz()).map(number).collect();
            let vectors: Vec<Vec<f64>> =
                (1..7).map(|r| (0..12).map(|k| number(k * r + 5)).collect()).collect();
            let pairs = [0, 1, 2].map(|r| [&vectors[r][..], &vectors[r + 3][..pattern.dim()]]);
            let found = pattern.residuals(&values, &pairs, nodes.as_ref());
            for (found, [x, b]) in found.iter().zip(pairs) {
                for row in 0..pattern.dim() {
                    let left = b[row] - sum(&pattern, &values, row, x);
                    assert!((found[row] - left).abs() < 1e-14, "row {row}");
                }
            }
        }
    }

    #[test]
    fn products_of_nodes_are_those_of_their_rows() {
        let pattern = mesh();
        let values: Vec<f64> = (0..pattern.nnz()).map(number).collect();
        let x: Vec<Vec<f64>> =
            (1..4).map(|r| (0..12).map(|k| number(k * r + 5)).collect()).collect();
        let nodes = [3, 0, 2];
        let rows = |node: usize| &values[pattern.row_ptr[3 * node]..pattern.row_ptr[3 * node + 3]];
        let found = NodeRows::of(&pattern).unwrap().products(&pattern, rows, &nodes, &x);
        assert_eq!(found.len(), x.len());
        for (found, x) in found.iter().zip(&x) {
            for (found, node) in found.iter().zip(nodes) {
                for (k, found) in found.iter().enumerate() {
                    assert!((found - sum(&pattern, &values, 3 * node + k, x)).abs() < 1e-14);
                }
            }
        }
    }
}
