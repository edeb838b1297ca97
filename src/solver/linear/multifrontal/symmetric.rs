//! LL^T factorisation of a front at half the cost of LU. Only lower triangles are read and written.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as llt;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::prelude::IntoConst;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::factors::{Factors, STRIP_COLUMNS, STRIP_FLOPS_MIN, add};
use super::fronts::{Front, Run, Symbolic};

/// Adds the lower triangle of the contribution of a child to the pivots of its parent (extend-add). Both number
/// unknowns in the same order, so lower triangles map to lower triangles.
pub(super) fn add_to_panel(front: &Front, child: &Front, source: &[f64], panel: &mut [f64]) {
    let height = front.pivots + front.below;
    for_each_column(child, source, |column, from, runs| {
        if column < front.pivots {
            let to = &mut panel[column * height..(column + 1) * height];
            runs.for_each(|run| {
                add(&mut to[run.parent as usize..], &from[run.child as usize..], run.len);
            });
        }
    });
}

/// Adds the lower triangle of the contribution of a child to the contribution of its parent.
pub(super) fn add_to_contribution(
    front: &Front,
    child: &Front,
    source: &[f64],
    contribution: &mut [f64],
) {
    let (np, m) = (front.pivots, front.below);
    for_each_column(child, source, |column, from, runs| {
        if column >= np {
            let to = &mut contribution[(column - np) * m..(column - np + 1) * m];
            runs.for_each(|run| {
                add(&mut to[run.parent as usize - np..], &from[run.child as usize..], run.len);
            });
        }
    });
}

/// Calls `work` for every column of the lower triangle of a child with its index in the parent and its runs of rows.
fn for_each_column(
    child: &Front,
    source: &[f64],
    mut work: impl FnMut(usize, &[f64], &mut dyn Iterator<Item = Run>),
) {
    for (k, run) in child.runs.iter().enumerate() {
        for i in 0..run.len {
            let from = &source[(run.child + i) as usize * child.below..][..child.below];
            let rest = Run { child: run.child + i, parent: run.parent + i, len: run.len - i };
            let mut rows = std::iter::once(rest).chain(child.runs[k + 1..].iter().copied());
            work((run.parent + i) as usize, from, &mut rows);
        }
    }
}

/// A11 = L11 L11^T, L21 = A21 L11^-T, contribution = -L21 L21^T. On failure returns the index of a non-positive
/// pivot.
pub(super) fn eliminate(
    front: &Front,
    panel: &mut [f64],
    contribution: &mut [f64],
) -> Result<(), usize> {
    let (np, m) = (front.pivots, front.below);
    let panel = MatMut::from_column_major_slice_mut(panel, np + m, np);
    let (mut top, bottom) = panel.split_at_row_mut(np);
    let scratch = llt::cholesky_in_place_scratch::<f64>(np, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    llt::cholesky_in_place(top.as_mut(), Default::default(), Par::Seq, stack, Default::default())
        .map_err(|llt::LltError::NonPositivePivot { index }| index)?;
    if let Some(k) = (0..np).find(|&k| !top[(k, k)].is_finite()) {
        return Err(k);
    }
    if m == 0 {
        return Ok(());
    }
    let in_parallel = (np * m) as f64 * (np + m) as f64 > STRIP_FLOPS_MIN;
    let bottom = lower(top.as_ref(), bottom, in_parallel);
    update(bottom, contribution, in_parallel);
    Ok(())
}

/// L21 = A21 L11^-T in strips of rows.
fn lower<'a>(top: MatRef<'_, f64>, bottom: MatMut<'a, f64>, in_parallel: bool) -> MatRef<'a, f64> {
    let mut bottom = bottom;
    let solve = |strip: MatMut<'_, f64>| {
        triangular::solve_lower_triangular_in_place(top, strip.transpose_mut(), Par::Seq);
    };
    if in_parallel {
        let mut strips = Vec::with_capacity(bottom.nrows().div_ceil(STRIP_COLUMNS));
        let mut rest = bottom.as_mut();
        while rest.nrows() > STRIP_COLUMNS {
            let (strip, below) = rest.split_at_row_mut(STRIP_COLUMNS);
            strips.push(strip);
            rest = below;
        }
        strips.push(rest);
        strips.into_par_iter().for_each(solve);
    } else {
        solve(bottom.as_mut());
    }
    bottom.into_const()
}

/// contribution = -L21 L21^T on and below its diagonal, in strips of columns.
fn update(l21: MatRef<'_, f64>, contribution: &mut [f64], in_parallel: bool) {
    let m = l21.nrows();
    let strip = |(k, to): (usize, &mut [f64])| {
        let (first, columns) = (k * STRIP_COLUMNS, to.len() / m);
        let to = MatMut::from_column_major_slice_mut(to, m, columns).subrows_mut(first, m - first);
        let (left, right) = (l21.subrows(first, m - first), l21.subrows(first, columns));
        matmul(to, Accum::Replace, left, right.transpose(), -1.0, Par::Seq);
    };
    if in_parallel {
        contribution.par_chunks_mut(STRIP_COLUMNS * m).enumerate().for_each(strip);
    } else {
        contribution.chunks_mut(STRIP_COLUMNS * m).enumerate().for_each(strip);
    }
}

impl Symbolic {
    /// Solves in place with LL^T for a right-hand side in the numbering of the pattern.
    pub(super) fn solve_symmetric(&self, factors: &Factors, rhs: &mut [f64]) {
        let mut y: Vec<f64> = self.old_of_new.iter().map(|&old| rhs[old as usize]).collect();
        let tallest = self.fronts.iter().map(|f| f.pivots + f.below).max().unwrap_or(0);
        self.substitute_symmetric(factors, &mut y, &mut vec![0.0; tallest]);
        for (&old, value) in self.old_of_new.iter().zip(&y) {
            rhs[old as usize] = *value;
        }
    }

    fn substitute_symmetric(&self, factors: &Factors, y: &mut [f64], work: &mut [f64]) {
        for front in &self.fronts {
            let (np, height) = (front.pivots, front.pivots + front.below);
            let panel = &factors.storage()[front.storage..front.storage + front.panel_len()];
            let w = &mut work[..height];
            w[..np].copy_from_slice(&y[front.first..front.first + np]);
            w[np..].fill(0.0);
            for (j, column) in panel.chunks_exact(height).enumerate() {
                let (head, tail) = w.split_at_mut(j + 1);
                head[j] /= column[j];
                subtract(tail, &column[j + 1..], head[j]);
            }
            y[front.first..front.first + np].copy_from_slice(&w[..np]);
            for (&row, value) in front.rows.iter().zip(&w[np..]) {
                y[row as usize] += value;
            }
        }
        for front in self.fronts.iter().rev() {
            let (np, height) = (front.pivots, front.pivots + front.below);
            let panel = &factors.storage()[front.storage..front.storage + front.panel_len()];
            let w = &mut work[..height];
            w[..np].copy_from_slice(&y[front.first..front.first + np]);
            for (w, &row) in w[np..].iter_mut().zip(&front.rows) {
                *w = y[row as usize];
            }
            for (j, column) in panel.chunks_exact(height).enumerate().rev() {
                w[j] = (w[j] - dot(&column[j + 1..], &w[j + 1..])) / column[j];
            }
            y[front.first..front.first + np].copy_from_slice(&w[..np]);
        }
    }
}

#[inline]
fn subtract(to: &mut [f64], column: &[f64], by: f64) {
    for (t, c) in to.iter_mut().zip(column) {
        *t -= by * c;
    }
}

/// Scalar product with eight partial sums for SIMD.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    for (a, b) in a.zip(b) {
        for (sum, (x, y)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += x * y;
        }
    }
    sums.iter().sum::<f64>() + rest
}
