//! Blocks of the inverse.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::numeric::Factors;
use super::symbolic::{Front, Symbolic};

/// Columns of the inverse worked on together.
const TOGETHER: usize = 16;

/// Part of the inverse: some rows of some columns. Only the fronts between theirs and the roots take part.
#[derive(Debug, Clone)]
pub struct InverseBlock {
    columns: Vec<u32>,
    rows: Vec<u32>,
    /// Fronts on the way to the roots, rising.
    fronts: Vec<u32>,
}

impl Symbolic {
    /// Plans the rows `rows` of the columns `columns` of the inverse (numbered as in the pattern).
    #[must_use]
    pub fn inverse_block(&self, columns: &[usize], rows: &[usize]) -> InverseBlock {
        let mut new_of_old = vec![0; self.n];
        for (new, &old) in self.old_of_new.iter().enumerate() {
            new_of_old[old as usize] = new as u32;
        }
        let renumber = |list: &[usize]| list.iter().map(|&k| new_of_old[k]).collect::<Vec<u32>>();
        let (columns, rows) = (renumber(columns), renumber(rows));
        let mut on_the_way = vec![false; self.fronts.len()];
        for &unknown in columns.iter().chain(&rows) {
            on_the_way[self.fronts.partition_point(|f| f.first <= unknown as usize) - 1] = true;
        }
        for (k, front) in self.fronts.iter().enumerate() {
            on_the_way[k] |= front.children.iter().any(|&c| on_the_way[c as usize]);
        }
        let fronts = (0..self.fronts.len() as u32).filter(|&k| on_the_way[k as usize]).collect();
        InverseBlock { columns, rows, fronts }
    }

    /// Operations for the block, over those of a factorisation.
    #[must_use]
    pub fn share_of_factorisation(&self, block: &InverseBlock) -> f64 {
        let panels: usize =
            block.fronts.iter().map(|&k| self.fronts[k as usize].storage_len()).sum();
        let whole: f64 = self.roots.iter().map(|&r| self.fronts[r as usize].flops).sum();
        2.0 * panels as f64 * block.columns.len() as f64 / whole.max(1.0)
    }

    /// The block, column by column, with the factors of [`Symbolic::factor`].
    #[must_use]
    pub fn solve_block(&self, factors: &Factors, block: &InverseBlock) -> Vec<f64> {
        let rows = block.rows.len();
        let mut out = vec![0.0; rows * block.columns.len()];
        let parts = out.par_chunks_mut(TOGETHER * rows.max(1));
        parts.zip(block.columns.par_chunks(TOGETHER)).for_each(|(out, columns)| {
            let n = self.n;
            let mut y = vec![0.0; n * columns.len()];
            for (y, &c) in y.chunks_exact_mut(n).zip(columns) {
                y[c as usize] = 1.0;
            }
            let widest = block.fronts.iter().map(|&k| &self.fronts[k as usize]);
            let widest = widest.map(|f| f.pivots + f.below).max().unwrap_or(0);
            let mut work = vec![0.0; widest * columns.len()];
            for &k in &block.fronts {
                self.forward_block(factors, &self.fronts[k as usize], &mut y, &mut work);
            }
            for &k in block.fronts.iter().rev() {
                self.backward_block(factors, &self.fronts[k as usize], &mut y, &mut work);
            }
            for (out, y) in out.chunks_exact_mut(rows).zip(y.chunks_exact(n)) {
                out.iter_mut().zip(&block.rows).for_each(|(out, &r)| *out = y[r as usize]);
            }
        });
        out
    }

    fn forward_block(&self, factors: &Factors, front: &Front, y: &mut [f64], work: &mut [f64]) {
        let (np, below) = (front.pivots, front.below);
        let columns = y.len() / self.n;
        let panel = &factors.storage()[front.storage..front.storage + front.panel_len()];
        let panel = MatRef::from_column_major_slice(panel, np + below, np);
        let (head, tail) = work[..(np + below) * columns].split_at_mut(np * columns);
        let pivot = &factors.pivot[front.first..front.first + np];
        for (head, y) in head.chunks_exact_mut(np).zip(y.chunks_exact(self.n)) {
            head.iter_mut().zip(pivot).for_each(|(t, &p)| *t = y[front.first + p as usize]);
        }
        let mut head = MatMut::from_column_major_slice_mut(head, np, columns);
        let top = panel.subrows(0, np);
        triangular::solve_unit_lower_triangular_in_place(top, head.as_mut(), Par::Seq);
        if below > 0 {
            let to = MatMut::from_column_major_slice_mut(tail, below, columns);
            matmul(to, Accum::Replace, panel.subrows(np, below), head.as_ref(), -1.0, Par::Seq);
        }
        for (k, y) in y.chunks_exact_mut(self.n).enumerate() {
            (0..np).for_each(|i| y[front.first + i] = head[(i, k)]);
            let tail = &tail[k * below..(k + 1) * below];
            front.rows.iter().zip(tail).for_each(|(&row, value)| y[row as usize] += value);
        }
    }

    fn backward_block(&self, factors: &Factors, front: &Front, y: &mut [f64], work: &mut [f64]) {
        let (np, below) = (front.pivots, front.below);
        let columns = y.len() / self.n;
        let storage = &factors.storage()[front.storage..front.storage + front.storage_len()];
        let (panel, u12) = storage.split_at(front.panel_len());
        let top = MatRef::from_column_major_slice(panel, np + below, np).subrows(0, np);
        let (head, tail) = work[..(np + below) * columns].split_at_mut(np * columns);
        for (k, y) in y.chunks_exact(self.n).enumerate() {
            head[k * np..(k + 1) * np].copy_from_slice(&y[front.first..front.first + np]);
            let tail = &mut tail[k * below..(k + 1) * below];
            tail.iter_mut().zip(&front.rows).for_each(|(t, &row)| *t = y[row as usize]);
        }
        let mut head = MatMut::from_column_major_slice_mut(head, np, columns);
        if below > 0 {
            let u12 = MatRef::from_column_major_slice(u12, np, below);
            let tail = MatRef::from_column_major_slice(tail, below, columns);
            matmul(head.as_mut(), Accum::Add, u12, tail, -1.0, Par::Seq);
        }
        triangular::solve_upper_triangular_in_place(top, head.as_mut(), Par::Seq);
        for (k, y) in y.chunks_exact_mut(self.n).enumerate() {
            (0..np).for_each(|i| y[front.first + i] = head[(i, k)]);
        }
    }
}
