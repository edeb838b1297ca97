//! Matrix of the linear system: the tangent with contact conditions in the rows of their nodes.
//!
//! The values of the tangent are taken over from the evaluation. Only the rows replaced by conditions are stored
//! separately: they give the change of the contact forces by a correction, and are restored when a condition changes.

use std::ops::Range;

use rayon::prelude::*;

use crate::contact::condition::Condition;
use crate::linear::pattern::Pattern;
use crate::linear::{ChangedRows, NodeRows};
use kanagata_geometry::Vec3;

/// Values of the matrix and the data needed to restore the tangent.
#[derive(Debug)]
pub(crate) struct Matrix {
    pub(crate) values: Vec<f64>,
    /// `values` are those of the tangent, except for the stored rows.
    taken: bool,
    kept: KeptRows,
    /// Conditions contained in the factors of the linear solver.
    factored: Vec<Condition>,
    /// Ranges of `values` that differ from the factored matrix, with the factored values.
    replaced: Vec<(Range<usize>, Vec<f64>)>,
}

/// Rows of the tangent by node.
#[derive(Debug)]
struct KeptRows {
    rows: Vec<f64>,
    /// Start of the rows of each node, or [`NOWHERE`].
    starts: Vec<usize>,
    nodes: Vec<usize>,
}

const NOWHERE: usize = usize::MAX;

impl KeptRows {
    fn clear(&mut self) {
        self.nodes.iter().for_each(|&node| self.starts[node] = NOWHERE);
        self.nodes.clear();
        self.rows.clear();
    }

    /// Allocates rows of a node.
    fn push(&mut self, node: usize, len: usize) {
        self.starts[node] = self.rows.len();
        self.nodes.push(node);
        self.rows.resize(self.rows.len() + len, 0.0);
    }

    fn of(&self, node: usize, len: usize) -> Option<&[f64]> {
        let start = self.starts[node];
        (start != NOWHERE).then(|| &self.rows[start..start + len])
    }
}

impl Matrix {
    /// Zero matrix with this pattern.
    pub(crate) fn new(pattern: &Pattern) -> Self {
        let nodes = pattern.dim() / 3;
        Self {
            values: vec![0.0; pattern.nnz()],
            taken: false,
            kept: KeptRows { rows: Vec::new(), starts: vec![NOWHERE; nodes], nodes: Vec::new() },
            factored: Vec::new(),
            replaced: Vec::new(),
        }
    }

    /// Registers that the evaluation holds a new tangent.
    pub(crate) fn renew(&mut self) {
        self.taken = false;
    }

    /// Sets up the matrix from tangent and conditions, which are sorted by node. The tangent is moved, which leaves
    /// undefined values in `tangent`; it is copied if columns will be changed too.
    pub(crate) fn set(
        &mut self,
        pattern: &Pattern,
        tangent: &mut Vec<f64>,
        conditions: &[Condition],
        copy: bool,
    ) {
        if self.taken {
            self.give_back(pattern, tangent);
        }
        self.kept.clear();
        if copy {
            let part = tangent.len().div_ceil(rayon::current_num_threads()).max(1);
            let parts = self.values.par_chunks_mut(part);
            let from = tangent.par_chunks(part);
            parts.zip(from).for_each(|(to, from)| to.copy_from_slice(from));
        } else {
            std::mem::swap(&mut self.values, tangent);
        }
        self.taken = !copy;
        for c in conditions {
            self.kept.push(c.node, rows_of(pattern, c.node).len());
        }
        let mut tasks = Vec::with_capacity(conditions.len());
        let (mut rest, mut from) = (&mut self.values[..], 0);
        let mut kept = &mut self.kept.rows[..];
        for c in conditions {
            let range = rows_of(pattern, c.node);
            let (rows, keep);
            (rows, rest) = rest[range.start - from..].split_at_mut(range.len());
            (keep, kept) = kept.split_at_mut(range.len());
            from = range.end;
            tasks.push((c, rows, keep));
        }
        tasks.into_par_iter().for_each(|(c, rows, keep)| {
            keep.copy_from_slice(rows);
            put(c, pattern, rows);
        });
    }

    /// Returns the values of the tangent to `tangent`.
    fn give_back(&mut self, pattern: &Pattern, tangent: &mut Vec<f64>) {
        for &node in &self.kept.nodes {
            let range = rows_of(pattern, node);
            if let Some(rows) = self.kept.of(node, range.len()) {
                self.values[range].copy_from_slice(rows);
            }
        }
        std::mem::swap(&mut self.values, tangent);
        self.taken = false;
    }

    /// Registers that the factors are those of the matrix with these conditions.
    pub(crate) fn set_factored(&mut self, conditions: &[Condition]) {
        self.factored.clear();
        self.factored.extend_from_slice(conditions);
        self.replaced.clear();
    }

    /// Applies the conditions that differ from those in the factors; returns the resulting change of the factored
    /// rows.
    pub(crate) fn change(&mut self, pattern: &Pattern, conditions: &[Condition]) -> ChangedRows {
        let mut changed = ChangedRows::default();
        for (rows, values) in self.replaced.drain(..) {
            self.values[rows].copy_from_slice(&values);
        }
        for (node, [before, now]) in different(&self.factored, conditions) {
            let rows = rows_of(pattern, node);
            if self.kept.starts[node] == NOWHERE {
                self.kept.push(node, rows.len());
                let start = self.kept.starts[node];
                self.kept.rows[start..].copy_from_slice(&self.values[rows.clone()]);
            }
            let with = |condition: Option<&Condition>| {
                let mut values = self.tangent_rows(pattern, node).to_vec();
                condition.iter().for_each(|c| put(c, pattern, &mut values));
                values
            };
            let (before, now) = (with(before), with(now));
            self.values[rows.clone()].copy_from_slice(&now);
            let added: Vec<f64> = now.iter().zip(&before).map(|(now, old)| now - old).collect();
            for (k, added) in added.chunks_exact(rows.len() / 3).enumerate() {
                changed.rows.push(3 * node + k);
                changed.added.push(added.to_vec());
            }
            self.replaced.push((rows, before));
        }
        changed
    }

    /// The three rows of the tangent at a node.
    fn tangent_rows(&self, pattern: &Pattern, node: usize) -> &[f64] {
        let rows = rows_of(pattern, node);
        self.kept.of(node, rows.len()).unwrap_or_else(|| &self.values[rows])
    }

    /// Rows of the tangent at the nodes times the vectors, by vector: changes of the contact forces due to
    /// displacements.
    pub(crate) fn changes_of_force(
        &self,
        pattern: &Pattern,
        node_rows: &NodeRows,
        nodes: &[usize],
        x: &[Vec<f64>],
    ) -> Vec<Vec<[f64; 3]>> {
        node_rows.products(pattern, |node| self.tangent_rows(pattern, node), nodes, x)
    }
}

/// Range of the three rows of a node in the values.
fn rows_of(pattern: &Pattern, node: usize) -> Range<usize> {
    pattern.row_ptr[3 * node]..pattern.row_ptr[3 * node + 3]
}

/// Applies a condition to the three rows of its node.
fn put(c: &Condition, pattern: &Pattern, rows: &mut [f64]) {
    let start = pattern.row_ptr[3 * c.node];
    let width = rows.len() / 3;
    let (row0, rest) = rows.split_at_mut(width);
    let (row1, row2) = rest.split_at_mut(width);
    for ((x, y), z) in row0.iter_mut().zip(&mut *row1).zip(&mut *row2) {
        let v = c.a * Vec3::new(*x, *y, *z);
        (*x, *y, *z) = (v.x, v.y, v.z);
    }
    let Some(at) = pattern.position(3 * c.node, 3 * c.node).map(|q| q - start) else {
        return;
    };
    let b = c.b + c.b_tool;
    for k in 0..3 {
        row0[at + k] += b[(0, k)];
        row1[at + k] += b[(1, k)];
        row2[at + k] += b[(2, k)];
    }
}

/// Nodes whose conditions differ in two lists sorted by node, with both conditions.
fn different<'a>(
    before: &'a [Condition],
    now: &'a [Condition],
) -> Vec<(usize, [Option<&'a Condition>; 2])> {
    let mut out = Vec::new();
    let (mut before, mut now) = (before.iter().peekable(), now.iter().peekable());
    while let Some(node) =
        before.peek().map(|c| c.node).into_iter().chain(now.peek().map(|c| c.node)).min()
    {
        let pair = [before.next_if(|c| c.node == node), now.next_if(|c| c.node == node)];
        let same = match pair {
            [Some(a), Some(b)] => (a.a, a.b, a.b_tool) == (b.a, b.b, b.b_tool),
            _ => false,
        };
        if !same {
            out.push((node, pair));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::condition::untouched;
    use kanagata_geometry::Mat3;

    /// Three nodes, the last not adjacent to the first.
    fn pattern() -> Pattern {
        let mut pattern = Pattern { row_ptr: vec![0], col_idx: Vec::new() };
        for columns in [0..6, 0..9, 3..9] {
            for _ in 0..3 {
                pattern.col_idx.extend(columns.clone());
                pattern.row_ptr.push(pattern.col_idx.len());
            }
        }
        pattern
    }

    fn condition(node: usize, by: f64) -> Condition {
        let plain = untouched(node, &Vec3::zeros(), &Mat3::identity());
        Condition { a: Mat3::from_diagonal_element(by), b: Mat3::identity(), ..plain }
    }

    fn tangent(pattern: &Pattern) -> Vec<f64> {
        (0..pattern.nnz()).map(|k| 1.0 + k as f64).collect()
    }

    /// The matrix by its definition.
    fn plain(pattern: &Pattern, conditions: &[Condition]) -> Vec<f64> {
        let mut values = tangent(pattern);
        for c in conditions {
            put(c, pattern, &mut values[rows_of(pattern, c.node)]);
        }
        values
    }

    #[test]
    fn conditions_come_and_go_and_the_tangent_is_never_lost() {
        let pattern = pattern();
        let node_rows = NodeRows::of(&pattern).unwrap();
        let mut matrix = Matrix::new(&pattern);
        let mut values = tangent(&pattern);
        let x = vec![(0..9).map(|k| (k as f64).sin()).collect::<Vec<f64>>()];
        let forces = |m: &Matrix| m.changes_of_force(&pattern, &node_rows, &[0, 1, 2], &x);
        let first = [condition(0, 2.0), condition(2, 3.0)];
        matrix.set(&pattern, &mut values, &first, false);
        assert_eq!(matrix.values, plain(&pattern, &first));
        let expected = forces(&matrix);
        matrix.set_factored(&first);
        // Removed, new and changed conditions; then back.
        for now in [vec![condition(1, 5.0), condition(2, 7.0)], first.to_vec()] {
            let changed = matrix.change(&pattern, &now);
            assert_eq!(matrix.values, plain(&pattern, &now));
            let rows: Vec<usize> = if now.len() == first.len() && now[0].node == 0 {
                vec![]
            } else {
                (0..9).collect()
            };
            assert_eq!(changed.rows, rows);
            assert_eq!(forces(&matrix), expected);
        }
        // Again at the same evaluation, then with a copy that may be modified.
        matrix.set(&pattern, &mut values, &[condition(1, 4.0)], false);
        assert_eq!(matrix.values, plain(&pattern, &[condition(1, 4.0)]));
        matrix.set(&pattern, &mut values, &[], true);
        matrix.values.fill(0.0);
        matrix.set(&pattern, &mut values, &first, true);
        assert_eq!((&matrix.values, &values), (&plain(&pattern, &first), &tangent(&pattern)));
        assert_eq!(forces(&matrix), expected);
    }
}
