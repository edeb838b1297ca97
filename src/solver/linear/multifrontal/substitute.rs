//! Forward and backward substitution with LU for one or two right-hand sides in a common pass over the factors, since
//! memory traffic dominates the cost. Subtrees run in parallel: every front stores its part of the solution
//! separately, and parents add the parts of their children in a fixed order.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::factors::{Factors, Kind};
use super::fronts::{Front, Symbolic};

/// Columns of the factors processed together.
const BLOCK_COLUMNS: usize = 4;

/// Right-hand sides of one pass.
pub(super) const RHS_PER_PASS: usize = 2;

impl Symbolic {
    /// Solves in place for right-hand sides in the numbering of the pattern.
    pub fn solve(&self, factors: &Factors, rhs: &mut [&mut [f64]]) {
        if factors.kind == Kind::Symmetric {
            rhs.iter_mut().for_each(|one| self.solve_symmetric(factors, one));
            return;
        }
        for pair in rhs.chunks_mut(RHS_PER_PASS) {
            match pair {
                [one] => self.substitute(factors, [&mut **one], None),
                [one, two] => self.substitute(factors, [&mut **one, &mut **two], None),
                _ => {}
            }
        }
    }

    /// Solves for right-hand sides of which the first were eliminated during the factorisation.
    pub fn finish(&self, factors: &mut Factors, rhs: &mut [&mut [f64]]) {
        let eliminated = std::mem::take(&mut factors.eliminated);
        let done = eliminated.len() / self.locals.max(1);
        let (first, rest) = rhs.split_at_mut(done.min(rhs.len()));
        match first {
            [one] => self.substitute(factors, [&mut **one], Some(eliminated)),
            [one, two] => self.substitute(factors, [&mut **one, &mut **two], Some(eliminated)),
            _ => {}
        }
        self.solve(factors, rest);
    }

    /// `eliminated`: right-hand sides of every front after elimination, if done before.
    fn substitute<const R: usize>(
        &self,
        factors: &Factors,
        rhs: [&mut [f64]; R],
        eliminated: Option<Vec<f64>>,
    ) {
        let pass = Pass::<R> { plan: self, factors, rhs: rhs.each_ref().map(|one| &**one) };
        let is_eliminated = eliminated.is_some();
        let mut locals = eliminated.unwrap_or_else(|| vec![0.0; R * self.locals]);
        let mut rest = &mut locals[..];
        for &root in &self.roots {
            let own;
            (own, rest) = rest.split_at_mut(pass.len(root as usize));
            if !is_eliminated {
                pass.forward(root as usize, own);
            }
            pass.backward(root as usize, own, &[]);
        }
        for (r, rhs) in rhs.into_iter().enumerate() {
            for front in &self.fronts {
                let old = &self.old_of_new[front.first..front.first + front.pivots];
                let start = R * front.local + r * (front.pivots + front.below);
                old.iter().zip(&locals[start..]).for_each(|(&old, x)| rhs[old as usize] = *x);
            }
        }
    }

    /// `L⁻¹ P` of the right-hand side of a front and the contributions of its children. `locals` covers at least the
    /// local numbers of its subtree, from offset `base`.
    pub(super) fn forward_front<const R: usize>(
        &self,
        i: usize,
        rhs: [&[f64]; R],
        (panel, pivot): (&[f64], &[u32]),
        locals: &mut [f64],
        base: usize,
    ) {
        let front = &self.fronts[i];
        let (np, height) = (front.pivots, front.pivots + front.below);
        let (before, own) = locals.split_at_mut(R * front.local - base);
        let own = &mut own[..R * height];
        let old = &self.old_of_new[front.first..front.first + np];
        for (own, rhs) in own.chunks_exact_mut(height).zip(rhs) {
            own.iter_mut().zip(old).for_each(|(own, &old)| *own = rhs[old as usize]);
            own[np..].fill(0.0);
        }
        for &child in &front.children {
            let child = &self.fronts[child as usize];
            let from = &before[R * child.local - base..];
            let parts = from.chunks_exact(child.pivots + child.below);
            for (own, part) in own.chunks_exact_mut(height).zip(parts) {
                for run in &child.runs {
                    let part = &part[child.pivots + run.child as usize..];
                    super::factors::add(&mut own[run.parent as usize..], part, run.len);
                }
            }
        }
        // Skips right-hand sides that vanish in the whole subtree, such as those of a few changed rows.
        if own.iter().all(|x| *x == 0.0) {
            return;
        }
        if pivot.iter().enumerate().any(|(k, &p)| k != p as usize) {
            for own in own.chunks_exact_mut(height) {
                let straight = own[..np].to_vec();
                own.iter_mut().zip(pivot).for_each(|(own, &p)| *own = straight[p as usize]);
            }
        }
        Arch::new().dispatch(Lower::<R> { panel, pivots: np, own });
    }
}

/// One solve. For each right-hand side the local numbers of a front are its pivots and the unknowns below.
struct Pass<'a, const R: usize> {
    plan: &'a Symbolic,
    factors: &'a Factors,
    rhs: [&'a [f64]; R],
}

impl<const R: usize> Pass<'_, R> {
    fn front(&self, i: usize) -> &Front {
        &self.plan.fronts[i]
    }

    /// Offset of the local numbers of a subtree.
    fn base(&self, root: usize) -> usize {
        R * self.front(self.front(root).subtree).local
    }

    /// Number of local numbers of a subtree.
    fn len(&self, root: usize) -> usize {
        let front = self.front(root);
        R * (front.local + front.pivots + front.below) - self.base(root)
    }

    /// Splits the local numbers of the children off those of a subtree.
    fn children<'l>(&self, root: usize, locals: &'l mut [f64]) -> Vec<(usize, &'l mut [f64])> {
        let mut rest = locals;
        let mut out = Vec::new();
        for &child in &self.front(root).children {
            let own;
            (own, rest) = rest.split_at_mut(self.len(child as usize));
            out.push((child as usize, own));
        }
        out
    }

    fn forward(&self, root: usize, locals: &mut [f64]) {
        let front = self.front(root);
        let base = self.base(root);
        if front.forks {
            let children = self.children(root, locals);
            if front.parallel {
                children.into_par_iter().for_each(|(child, own)| self.forward(child, own));
            } else {
                children.into_iter().for_each(|(child, own)| self.forward(child, own));
            }
            self.forward_front(root, locals, base);
        } else {
            (front.subtree..=root).for_each(|i| self.forward_front(i, locals, base));
        }
    }

    fn forward_front(&self, i: usize, locals: &mut [f64], base: usize) {
        let front = self.front(i);
        let panel = &self.factors.storage()[front.storage..front.storage + front.panel_len()];
        let pivot = &self.factors.pivot[front.first..front.first + front.pivots];
        self.plan.forward_front(i, self.rhs, (panel, pivot), locals, base);
    }

    /// `parent`: the local numbers of the parent of the root.
    fn backward(&self, root: usize, locals: &mut [f64], parent: &[f64]) {
        let front = self.front(root);
        let base = self.base(root);
        let (before, own) = locals.split_at_mut(R * front.local - base);
        self.backward_front(root, own, parent);
        let own = &*own;
        if front.forks {
            let children = self.children(root, before);
            if front.parallel {
                children.into_par_iter().for_each(|(child, of)| self.backward(child, of, own));
            } else {
                children.into_iter().for_each(|(child, of)| self.backward(child, of, own));
            }
            return;
        }
        for i in (front.subtree..root).rev() {
            let front = self.front(i);
            if front.parent as usize == root {
                self.backward_front(i, &mut before[R * front.local - base..], own);
            } else {
                let parent = R * self.front(front.parent as usize).local - base;
                let (low, parent) = before.split_at_mut(parent);
                self.backward_front(i, &mut low[R * front.local - base..], parent);
            }
        }
    }

    /// `U⁻¹` of the result of [`Pass::forward_front`]; the solution at the unknowns below is copied from the parent.
    fn backward_front(&self, i: usize, own: &mut [f64], parent: &[f64]) {
        let front = self.front(i);
        let (np, height) = (front.pivots, front.pivots + front.below);
        let own = &mut own[..R * height];
        if front.below > 0 {
            let above = self.front(front.parent as usize);
            let parts = parent.chunks_exact(above.pivots + above.below);
            for (own, part) in own.chunks_exact_mut(height).zip(parts) {
                for run in &front.runs {
                    let (to, from) = (np + run.child as usize, run.parent as usize);
                    let len = run.len as usize;
                    own[to..to + len].copy_from_slice(&part[from..from + len]);
                }
            }
        }
        let storage = &self.factors.storage()[front.storage..front.storage + front.storage_len()];
        let (panel, beside) = storage.split_at(front.panel_len());
        Arch::new().dispatch(Upper::<R> { panel, beside, pivots: np, own });
    }
}

/// Solves with the unit lower triangle at the top of `panel` and updates the rows below.
struct Lower<'a, const R: usize> {
    panel: &'a [f64],
    pivots: usize,
    own: &'a mut [f64],
}

impl<const R: usize> WithSimd for Lower<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let height = self.own.len() / R;
        let mut x = parts::<R>(self.own, height);
        let mut columns = self.panel.chunks_exact(height);
        for first in (0..self.pivots).step_by(BLOCK_COLUMNS) {
            let width = BLOCK_COLUMNS.min(self.pivots - first);
            let columns: [&[f64]; BLOCK_COLUMNS] =
                std::array::from_fn(|k| columns.next().filter(|_| k < width).unwrap_or_default());
            for (k, column) in columns[..width].iter().enumerate() {
                for x in &mut x {
                    let by = x[first + k];
                    for row in first + k + 1..first + width {
                        x[row] -= column[row] * by;
                    }
                }
            }
            let by = x.each_ref().map(|x| padded(&x[first..first + width]));
            let below = x.each_mut().map(|x| &mut x[first + width..]);
            let columns = columns.map(|column| column.get(first + width..).unwrap_or_default());
            subtract(simd, columns, width, by, below);
        }
    }
}

/// Subtracts `beside` times the solution below and solves with the upper triangle at the top of `panel`.
struct Upper<'a, const R: usize> {
    panel: &'a [f64],
    beside: &'a [f64],
    pivots: usize,
    own: &'a mut [f64],
}

impl<const R: usize> WithSimd for Upper<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let np = self.pivots;
        let height = self.own.len() / R;
        let x = parts::<R>(self.own, height);
        let mut split = x.map(|x| x.split_at_mut(np));
        for (first, columns) in
            (0..).step_by(BLOCK_COLUMNS).zip(self.beside.chunks(BLOCK_COLUMNS * np))
        {
            let width = columns.len() / np;
            let by = split.each_ref().map(|(_, below)| padded(&below[first..first + width]));
            let columns: [&[f64]; BLOCK_COLUMNS] =
                std::array::from_fn(|k| columns.get(k * np..(k + 1) * np).unwrap_or_default());
            subtract(simd, columns, width, by, split.each_mut().map(|(top, _)| &mut **top));
        }
        for first in (0..np).step_by(BLOCK_COLUMNS).rev() {
            let width = BLOCK_COLUMNS.min(np - first);
            let column = |k: usize| &self.panel[(first + k) * height..][..first + k + 1];
            for k in (0..width).rev() {
                let column = column(k);
                for (x, _) in &mut split {
                    x[first + k] /= column[first + k];
                    let by = x[first + k];
                    for row in first..first + k {
                        x[row] -= column[row] * by;
                    }
                }
            }
            let by = split.each_ref().map(|(x, _)| padded(&x[first..first + width]));
            let above = split.each_mut().map(|(x, _)| &mut x[..first]);
            let columns: [&[f64]; BLOCK_COLUMNS] = std::array::from_fn(|k| {
                if k < width { &column(k)[..first] } else { Default::default() }
            });
            subtract(simd, columns, width, by, above);
        }
    }
}

/// Parts of the right-hand sides.
#[inline(always)]
fn parts<const R: usize>(own: &mut [f64], height: usize) -> [&mut [f64]; R] {
    let mut parts = own.chunks_exact_mut(height);
    std::array::from_fn(|_| parts.next().unwrap_or_default())
}

/// Up to four numbers, padded with zeros.
#[inline(always)]
fn padded(x: &[f64]) -> [f64; BLOCK_COLUMNS] {
    std::array::from_fn(|k| x.get(k).copied().unwrap_or(0.0))
}

/// `to_r -= Σ_k columns_k by_rk` with the first `width` columns; all have the length of every `to_r`.
#[inline(always)]
fn subtract<S: Simd, const R: usize>(
    simd: S,
    columns: [&[f64]; BLOCK_COLUMNS],
    width: usize,
    by: [[f64; BLOCK_COLUMNS]; R],
    to: [&mut [f64]; R],
) {
    if width < BLOCK_COLUMNS {
        for (to, by) in to.into_iter().zip(by) {
            for (column, by) in columns[..width].iter().zip(by) {
                to.iter_mut().zip(*column).for_each(|(to, value)| *to -= value * by);
            }
        }
        return;
    }
    let columns = columns.map(|column| S::as_simd_f64s(column));
    let mut to = to.map(|to| S::as_mut_simd_f64s(to));
    let factors = by.map(|by| by.map(|by| simd.splat_f64s(-by)));
    let count = columns[0].0.len();
    let wide = columns.map(|(wide, _)| &wide[..count]);
    let mut wide_to = to.each_mut().map(|(to, _)| &mut to[..count]);
    for i in 0..count {
        let values = wide.map(|column| column[i]);
        for (to, factors) in wide_to.iter_mut().zip(&factors) {
            let one = simd.mul_add_e_f64s(values[0], factors[0], to[i]);
            let two = simd.mul_f64s(values[1], factors[1]);
            let one = simd.mul_add_e_f64s(values[2], factors[2], one);
            let two = simd.mul_add_e_f64s(values[3], factors[3], two);
            to[i] = simd.add_f64s(one, two);
        }
    }
    for ((_, to), by) in to.iter_mut().zip(by) {
        for ((_, column), by) in columns.iter().zip(by) {
            to.iter_mut().zip(*column).for_each(|(to, value)| *to -= value * by);
        }
    }
}
