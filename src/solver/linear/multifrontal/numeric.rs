//! Numeric factorisation: fronts are assembled, factored by dense kernels and passed up the tree.
//!
//! The arithmetic of a front does not depend on the number of threads: subtrees run in parallel, wide products are
//! divided into strips of fixed width, and each dense kernel runs on one thread.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor as lu;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::factors::{Factors, Kind, STRIP_COLUMNS, STRIP_FLOPS_MIN, Singular, add};
use super::fronts::{Front, Symbolic};
use super::part::Part;
use super::substitute::RHS_PER_PASS;
use super::symmetric;

impl Symbolic {
    /// Factors the matrix with these values (in the order of the pattern) into `factors`, reusing its memory. Up to
    /// two right-hand sides are eliminated in the same pass, for [`Symbolic::finish`].
    ///
    /// # Errors
    /// [`Singular`] if a pivot block is singular.
    pub fn factor(
        &self,
        values: &[f64],
        factors: &mut Factors,
        rhs: &[&[f64]],
    ) -> Result<(), Singular> {
        self.factor_as(Kind::General, values, factors, rhs)
    }

    /// Factors a symmetric positive definite matrix into `factors`; only its lower triangle in the numbering of the
    /// plan is read.
    ///
    /// # Errors
    /// [`Singular`] if the matrix is not positive definite.
    pub fn factor_symmetric(&self, values: &[f64], factors: &mut Factors) -> Result<(), Singular> {
        self.factor_as(Kind::Symmetric, values, factors, &[])
    }

    fn factor_as(
        &self,
        kind: Kind,
        values: &[f64],
        factors: &mut Factors,
        rhs: &[&[f64]],
    ) -> Result<(), Singular> {
        let rhs = &rhs[..rhs.len().min(RHS_PER_PASS)];
        factors.kind = kind;
        factors.storage.resize(self.storage);
        factors.workspace.resize(self.workspace);
        factors.pivot.resize(self.n, 0);
        factors.inverse.resize(self.n, 0);
        factors.eliminated.resize(rhs.len() * self.locals, 0.0);
        let mut part = Part::whole(kind, factors, rhs);
        for &root in &self.roots {
            let (mut own, rest) = self.split(part, root as usize);
            self.subtree(root as usize, values, &mut own)?;
            // Roots are processed in sequence and share the workspace.
            part = Part { workspace: own.workspace, workspace_from: own.workspace_from, ..rest };
        }
        Ok(())
    }

    fn subtree(&self, root: usize, values: &[f64], part: &mut Part<'_>) -> Result<(), Singular> {
        let front = &self.fronts[root];
        if !front.forks {
            for i in front.subtree..=root {
                self.front(i, values, part)?;
            }
            return Ok(());
        }
        if front.parallel {
            self.factor_children_in_parallel(front, values, part)?;
        } else {
            for &c in &front.children {
                self.subtree(c as usize, values, part)?;
            }
        }
        self.front(root, values, part)
    }

    fn factor_children_in_parallel(
        &self,
        front: &Front,
        values: &[f64],
        part: &mut Part<'_>,
    ) -> Result<(), Singular> {
        let mut tasks: Vec<_> = self
            .parts_of_children(front, part)
            .into_iter()
            .map(|(c, own)| (c, own, Ok(())))
            .collect();
        tasks.par_iter_mut().for_each(|(c, own, outcome)| *outcome = self.subtree(*c, values, own));
        tasks.into_iter().try_for_each(|(_, _, outcome)| outcome)
    }

    fn front(&self, i: usize, values: &[f64], part: &mut Part<'_>) -> Result<(), Singular> {
        let front = &self.fronts[i];
        if self.cancel.is_requested() {
            return Err(Singular { unknown: self.old_of_new[front.first] as usize });
        }
        let from = front.storage - part.storage_from;
        let storage = &mut part.storage[from..from + front.storage_len()];
        let base = front.contribution - part.workspace_from;
        let (low, above) = part.workspace.split_at_mut(base + front.contribution_len());
        let contribution = &mut low[base..base + front.below * front.below];
        let (panel, u12) = storage.split_at_mut(front.panel_len());
        self.scatter_values(front, values, part.kind, panel, u12);
        let above_from = front.contribution + front.contribution_len();
        let children = || {
            front.children.iter().map(|&c| {
                let child = &self.fronts[c as usize];
                let start = child.contribution - above_from;
                (child, &above[start..start + child.below * child.below])
            })
        };
        let singular = |k| Singular { unknown: self.old_of_new[front.first + k] as usize };
        if part.kind == Kind::Symmetric {
            children().for_each(|(child, s)| symmetric::add_to_panel(front, child, s, panel));
            symmetric::eliminate(front, panel, contribution).map_err(singular)?;
            children().for_each(|(c, s)| symmetric::add_to_contribution(front, c, s, contribution));
            return Ok(());
        }
        let at = front.first - part.unknown_from;
        let pivot = &mut part.pivot[at..at + front.pivots];
        let inverse = &mut part.inverse[at..at + front.pivots];
        children().for_each(|(child, s)| add_to_panel(front, child, s, panel, u12));
        eliminate(front, panel, u12, contribution, (pivot, inverse)).map_err(singular)?;
        let (panel, pivot) = (&*panel, &*pivot);
        let locals = (&mut *part.eliminated, part.eliminated_from);
        self.eliminate_at(i, part.rhs, (panel, pivot), locals);
        children().for_each(|(child, s)| add_to_contribution(front, child, s, contribution));
        Ok(())
    }

    /// Eliminates up to [`RHS_PER_PASS`] right-hand sides at a front; `base` is the offset of `locals` in the
    /// complete array.
    fn eliminate_at(
        &self,
        i: usize,
        rhs: &[&[f64]],
        factors: (&[f64], &[u32]),
        (locals, base): (&mut [f64], usize),
    ) {
        match *rhs {
            [one] => self.forward_front(i, [one], factors, locals, base),
            [one, two] => self.forward_front(i, [one, two], factors, locals, base),
            _ => {}
        }
    }

    /// Scatters the matrix values of a front to its panel and U12 block.
    fn scatter_values(
        &self,
        front: &Front,
        values: &[f64],
        kind: Kind,
        panel: &mut [f64],
        u12: &mut [f64],
    ) {
        panel.fill(0.0);
        if kind == Kind::General {
            u12.fill(0.0);
        }
        for k in front.entries.clone() {
            let (place, value) =
                (self.entry_place[k] as usize, values[self.entry_value[k] as usize]);
            if place < panel.len() {
                panel[place] += value;
            } else if kind == Kind::General {
                u12[place - panel.len()] += value;
            }
        }
    }
}

/// Adds the contribution of a child to the pivots of its parent (extend-add).
fn add_to_panel(front: &Front, child: &Front, source: &[f64], panel: &mut [f64], u12: &mut [f64]) {
    let (np, height) = (front.pivots, front.pivots + front.below);
    for (column, from) in columns(child, source) {
        let (to, rows) = if column < np {
            (&mut panel[column * height..(column + 1) * height], height)
        } else {
            (&mut u12[(column - np) * np..(column - np + 1) * np], np)
        };
        // A run does not cross the boundary between pivots and the rows below.
        for run in child.runs.iter().filter(|run| (run.parent as usize) < rows) {
            add(&mut to[run.parent as usize..], &from[run.child as usize..], run.len);
        }
    }
}

/// Adds the contribution of a child to the contribution of its parent (extend-add).
fn add_to_contribution(front: &Front, child: &Front, source: &[f64], contribution: &mut [f64]) {
    let (np, m) = (front.pivots, front.below);
    for (column, from) in columns(child, source).filter(|&(column, _)| column >= np) {
        let to = &mut contribution[(column - np) * m..(column - np + 1) * m];
        for run in child.runs.iter().filter(|run| run.parent as usize >= np) {
            add(&mut to[run.parent as usize - np..], &from[run.child as usize..], run.len);
        }
    }
}

/// Columns of the contribution of a child with their indices in its parent.
fn columns<'a>(
    child: &'a Front,
    source: &'a [f64],
) -> impl Iterator<Item = (usize, &'a [f64])> + 'a {
    let places = child.runs.iter().flat_map(|run| run.parent..run.parent + run.len);
    places.map(|place| place as usize).zip(source.chunks_exact(child.below))
}

/// P A11 = L11 U11, U12 = L11^-1 P A12, L21 = A21 U11^-1, contribution = -L21 U12. On failure returns the index of a
/// zero or non-finite pivot.
fn eliminate(
    front: &Front,
    panel: &mut [f64],
    u12: &mut [f64],
    contribution: &mut [f64],
    (pivot, inverse): (&mut [u32], &mut [u32]),
) -> Result<(), usize> {
    let (np, m) = (front.pivots, front.below);
    let panel = MatMut::from_column_major_slice_mut(panel, np + m, np);
    let (mut top, mut bottom) = panel.split_at_row_mut(np);
    let scratch = lu::lu_in_place_scratch::<u32, f64>(np, np, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    lu::lu_in_place(top.as_mut(), pivot, inverse, Par::Seq, stack, Default::default());
    if let Some(k) = (0..np).find(|&k| !(top[(k, k)].is_finite() && top[(k, k)] != 0.0)) {
        return Err(k);
    }
    if m == 0 {
        return Ok(());
    }
    let top = top.as_ref();
    let strips = 2.0 * (np * m) as f64 * (np + m) as f64 > STRIP_FLOPS_MIN;
    let width = if strips { STRIP_COLUMNS } else { m };
    upper_strips(top, u12, pivot, width);
    lower_strips(top, bottom.as_mut(), width);
    update_strips(bottom.as_ref(), u12, contribution, width);
    Ok(())
}

/// U12 = L11^-1 P A12 in strips of columns.
fn upper_strips(top: MatRef<'_, f64>, u12: &mut [f64], pivot: &[u32], width: usize) {
    let np = top.nrows();
    let moved = pivot.iter().enumerate().any(|(k, &p)| k != p as usize);
    u12.par_chunks_mut(width * np).for_each(|strip| {
        if moved {
            let mut column = vec![0.0; np];
            for to in strip.chunks_exact_mut(np) {
                column.copy_from_slice(to);
                to.iter_mut().zip(pivot).for_each(|(t, &p)| *t = column[p as usize]);
            }
        }
        let columns = strip.len() / np;
        let strip = MatMut::from_column_major_slice_mut(strip, np, columns);
        triangular::solve_unit_lower_triangular_in_place(top, strip, Par::Seq);
    });
}

/// L21 = A21 U11^-1, that is U11^T L21^T = A21^T, in strips of rows.
fn lower_strips(top: MatRef<'_, f64>, bottom: MatMut<'_, f64>, width: usize) {
    let mut strips = Vec::with_capacity(bottom.nrows().div_ceil(width));
    let mut rest = bottom;
    while rest.nrows() > width {
        let (strip, below) = rest.split_at_row_mut(width);
        strips.push(strip);
        rest = below;
    }
    strips.push(rest);
    strips.into_par_iter().for_each(|strip| {
        let transposed = strip.transpose_mut();
        triangular::solve_lower_triangular_in_place(top.transpose(), transposed, Par::Seq);
    });
}

/// contribution = -L21 U12 in strips of columns.
fn update_strips(l21: MatRef<'_, f64>, u12: &[f64], contribution: &mut [f64], width: usize) {
    let (m, np) = (l21.nrows(), l21.ncols());
    let strips = contribution.par_chunks_mut(width * m).zip(u12.par_chunks(width * np));
    strips.for_each(|(to, from)| {
        let columns = to.len() / m;
        let to = MatMut::from_column_major_slice_mut(to, m, columns);
        let from = MatRef::from_column_major_slice(from, np, columns);
        matmul(to, Accum::Replace, l21, from, -1.0, Par::Seq);
    });
}
