//! Blocks of the inverse.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::numeric::Factors;
use super::symbolic::{Front, Symbolic};

/// Most columns of the inverse worked on together: every pass reads the factors anew.
const TOGETHER: usize = 48;

/// Part of the inverse: some rows of some columns. Only the fronts between theirs and the roots take part.
#[derive(Debug, Clone)]
pub struct InverseBlock {
    columns: Vec<u32>,
    rows: Vec<u32>,
    /// Fronts on the way to the roots, rising, and where the unknowns of each (its pivots and those below) begin among
    /// those of all.
    fronts: Vec<(u32, usize)>,
    /// Unknowns of all these fronts.
    unknowns: usize,
}

impl InverseBlock {
    /// Place of a front among those on the way.
    fn place(&self, front: u32) -> Option<usize> {
        self.fronts.binary_search_by_key(&front, |&(k, _)| k).ok()
    }
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
            on_the_way[self.front_of(unknown)] = true;
        }
        for (k, front) in self.fronts.iter().enumerate() {
            on_the_way[k] |= front.children.iter().any(|&c| on_the_way[c as usize]);
        }
        let mut unknowns = 0;
        let fronts = (0..self.fronts.len() as u32).filter(|&k| on_the_way[k as usize]);
        let fronts = fronts
            .map(|k| {
                let from = unknowns;
                unknowns += height(&self.fronts[k as usize]);
                (k, from)
            })
            .collect();
        InverseBlock { columns, rows, fronts, unknowns }
    }

    /// The front that eliminates an unknown (new numbering).
    fn front_of(&self, unknown: u32) -> usize {
        self.fronts.partition_point(|f| f.first <= unknown as usize) - 1
    }

    /// Operations for the block, over those of a factorisation.
    #[must_use]
    pub fn share_of_factorisation(&self, block: &InverseBlock) -> f64 {
        let panels: usize =
            block.fronts.iter().map(|&(k, _)| self.fronts[k as usize].storage_len()).sum();
        let whole: f64 = self.roots.iter().map(|&r| self.fronts[r as usize].flops).sum();
        2.0 * panels as f64 * block.columns.len() as f64 / whole.max(1.0)
    }

    /// The block, column by column, with the factors of [`Symbolic::factor`].
    #[must_use]
    pub fn solve_block(&self, factors: &Factors, block: &InverseBlock) -> Vec<f64> {
        let rows = block.rows.len().max(1);
        let mut out = vec![0.0; rows * block.columns.len()];
        // Parts of equal width, an even number of them; not by the number of threads, of which results are independent.
        let parts = 2 * block.columns.len().div_ceil(2 * TOGETHER);
        let width = block.columns.len().div_ceil(parts.max(1)).max(1);
        let parts = out.par_chunks_mut(width * rows).zip(block.columns.par_chunks(width));
        parts.for_each(|(out, columns)| {
            let mut locals = vec![0.0; block.unknowns * columns.len()];
            for at in 0..block.fronts.len() {
                self.forward_block(factors, block, columns, at, &mut locals);
            }
            for at in (0..block.fronts.len()).rev() {
                self.backward_block(factors, block, columns.len(), at, &mut locals);
            }
            for (i, &row) in block.rows.iter().enumerate() {
                let front = self.front_of(row);
                let Some(place) = block.place(front as u32) else { continue };
                let front = &self.fronts[front];
                let from = block.fronts[place].1 * columns.len() + row as usize - front.first;
                for (j, out) in out.chunks_exact_mut(rows).enumerate() {
                    out[i] = locals[from + j * height(front)];
                }
            }
        });
        out
    }

    /// `L^-1 P` of the unit columns in the front at place `at` of the block, with its children's contributions.
    fn forward_block(
        &self,
        factors: &Factors,
        block: &InverseBlock,
        columns: &[u32],
        at: usize,
        locals: &mut [f64],
    ) {
        let (k, from) = block.fronts[at];
        let front = &self.fronts[k as usize];
        let (np, height, count) = (front.pivots, height(front), columns.len());
        let (before, own) = locals.split_at_mut(from * count);
        let own = &mut own[..height * count];
        self.gather_block(block, columns, front, before, own);
        if own.iter().all(|x| *x == 0.0) {
            return;
        }
        let pivot = &factors.pivot[front.first..front.first + np];
        let mut straight = vec![0.0; np];
        for own in own.chunks_exact_mut(height) {
            straight.copy_from_slice(&own[..np]);
            own.iter_mut().zip(pivot).for_each(|(own, &p)| *own = straight[p as usize]);
        }
        let panel = &factors.storage()[front.storage..front.storage + front.panel_len()];
        let (top, low) = MatRef::from_column_major_slice(panel, height, np).split_at_row(np);
        let own = MatMut::from_column_major_slice_mut(own, height, count);
        let (mut head, tail) = own.split_at_row_mut(np);
        triangular::solve_unit_lower_triangular_in_place(top, head.as_mut(), Par::Seq);
        if front.below > 0 {
            matmul(tail, Accum::Add, low, head.as_ref(), -1.0, Par::Seq);
        }
    }

    /// The unit columns in a front, and what its children contribute.
    fn gather_block(
        &self,
        block: &InverseBlock,
        columns: &[u32],
        front: &Front,
        before: &[f64],
        own: &mut [f64],
    ) {
        for (own, &column) in own.chunks_exact_mut(height(front)).zip(columns) {
            if let Some(k) =
                (column as usize).checked_sub(front.first).filter(|&k| k < front.pivots)
            {
                own[k] = 1.0;
            }
        }
        for &child in &front.children {
            let Some(place) = block.place(child) else { continue };
            let child = &self.fronts[child as usize];
            let parts = before[block.fronts[place].1 * columns.len()..].chunks_exact(height(child));
            for (own, part) in own.chunks_exact_mut(height(front)).zip(parts) {
                for run in &child.runs {
                    let part = &part[child.pivots + run.child as usize..];
                    super::numeric::add(&mut own[run.parent as usize..], part, run.len);
                }
            }
        }
    }

    /// `U^-1` of what is left by [`Symbolic::forward_block`], with the solution above taken from the parent.
    fn backward_block(
        &self,
        factors: &Factors,
        block: &InverseBlock,
        count: usize,
        at: usize,
        locals: &mut [f64],
    ) {
        let (k, from) = block.fronts[at];
        let front = &self.fronts[k as usize];
        let (np, height) = (front.pivots, height(front));
        let (own, after) = locals[from * count..].split_at_mut(height * count);
        if let Some(place) = block.place(front.parent).filter(|_| front.below > 0) {
            let above = self::height(&self.fronts[front.parent as usize]);
            let parent = &after[(block.fronts[place].1 - from - height) * count..];
            for (own, part) in own.chunks_exact_mut(height).zip(parent.chunks_exact(above)) {
                for run in &front.runs {
                    let (to, from) = (np + run.child as usize, run.parent as usize);
                    let len = run.len as usize;
                    own[to..to + len].copy_from_slice(&part[from..from + len]);
                }
            }
        }
        let storage = &factors.storage()[front.storage..front.storage + front.storage_len()];
        let (panel, u12) = storage.split_at(front.panel_len());
        let top = MatRef::from_column_major_slice(panel, height, np).subrows(0, np);
        let own = MatMut::from_column_major_slice_mut(own, height, count);
        let (mut head, tail) = own.split_at_row_mut(np);
        if front.below > 0 {
            let u12 = MatRef::from_column_major_slice(u12, np, front.below);
            matmul(head.as_mut(), Accum::Add, u12, tail.as_ref(), -1.0, Par::Seq);
        }
        triangular::solve_upper_triangular_in_place(top, head.as_mut(), Par::Seq);
    }
}

/// Unknowns of a front: its pivots and those below.
fn height(front: &Front) -> usize {
    front.pivots + front.below
}
