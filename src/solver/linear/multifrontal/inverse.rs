//! Products `D A⁻¹ E` of sparse rows, the inverse and unit columns, as needed for a low-rank update.
//!
//! With `P A = L U` in the new numbering the product is `(D U⁻¹) (L⁻¹ P E)`: two sweeps from the leaves to the roots.
//! Each sweep visits only the fronts between its entries and the roots, and in each front only the right-hand sides
//! with entries in its subtree. The results of both sweeps at the pivots of common fronts are then multiplied.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::factors::{Factors, add};
use super::fronts::{Front, Symbolic};

/// A sparse row: column indices and values.
pub type SparseRow<'a> = (&'a [usize], &'a [f64]);

/// Plan of the products `D A⁻¹ E`: entries and the fronts between them and the roots.
#[derive(Debug, Clone)]
pub struct InverseProduct {
    rows: Side,
    columns: Side,
}

/// Right-hand sides of one sweep.
#[derive(Debug, Clone)]
struct Side {
    /// Unknown (new numbering), right-hand side and value, sorted by unknown, then by right-hand side.
    entries: Vec<(u32, u32, f64)>,
    /// For every front the right-hand sides with entries in its subtree, ascending.
    active: Vec<Vec<u32>>,
    /// Number of right-hand sides.
    count: usize,
}

impl Side {
    fn new(fronts: &[Front], mut entries: Vec<(u32, u32, f64)>, count: usize) -> Self {
        entries.sort_unstable_by_key(|&(unknown, side, _)| (unknown, side));
        let mut side = Self { entries, active: Vec::with_capacity(fronts.len()), count };
        for front in fronts {
            let below = front.children.iter().flat_map(|&child| &side.active[child as usize]);
            let own = side.entries_of(front).iter().map(|(_, side, _)| side);
            let mut active: Vec<u32> = below.chain(own).copied().collect();
            active.sort_unstable();
            active.dedup();
            side.active.push(active);
        }
        side
    }

    /// Entries at the pivots of a front.
    fn entries_of(&self, front: &Front) -> &[(u32, u32, f64)] {
        let before = |end: usize| self.entries.partition_point(|e| (e.0 as usize) < end);
        &self.entries[before(front.first)..before(front.first + front.pivots)]
    }

    /// Operations of the sweep.
    fn operations(&self, fronts: &[Front]) -> f64 {
        let of = |(front, active): (&Front, &Vec<u32>)| {
            active.len() as f64 * (front.pivots * (front.pivots + 2 * front.below)) as f64
        };
        fronts.iter().zip(&self.active).map(of).sum()
    }
}

impl Symbolic {
    /// Plans the products of `rows` and unit `columns` (in the numbering of the pattern).
    #[must_use]
    pub fn plan_inverse_product(
        &self,
        rows: &[SparseRow<'_>],
        columns: &[usize],
    ) -> InverseProduct {
        let mut new_of_old = vec![0; self.n];
        for (new, &old) in self.old_of_new.iter().enumerate() {
            new_of_old[old as usize] = new as u32;
        }
        let entries = rows.iter().enumerate().flat_map(|(i, (columns, values))| {
            columns.iter().zip(*values).map(move |(&column, &value)| (column, i as u32, value))
        });
        let entries = entries.map(|(column, i, value)| (new_of_old[column], i, value)).collect();
        let rows = Side::new(&self.fronts, entries, rows.len());
        let units =
            columns.iter().enumerate().map(|(j, &column)| (new_of_old[column], j as u32, 1.0));
        let columns = Side::new(&self.fronts, units.collect(), columns.len());
        InverseProduct { rows, columns }
    }

    /// Operations of the products over those of a factorisation.
    #[must_use]
    pub fn relative_cost(&self, product: &InverseProduct) -> f64 {
        let InverseProduct { rows, columns } = product;
        let shared = self.fronts.iter().zip(rows.active.iter().zip(&columns.active));
        let products =
            shared.map(|(front, (rows, columns))| 2 * front.pivots * rows.len() * columns.len());
        let products: usize = products.sum();
        let sweeps = rows.operations(&self.fronts) + columns.operations(&self.fronts);
        let whole: f64 = self.roots.iter().map(|&r| self.fronts[r as usize].flops).sum();
        (sweeps + products as f64) / whole.max(1.0)
    }

    /// The products, column-major, with the factors of [`Symbolic::factor`].
    #[must_use]
    pub fn products(&self, factors: &Factors, product: &InverseProduct) -> Vec<f64> {
        let InverseProduct { rows, columns } = product;
        let sweep = |side, of_rows| Sweep { plan: self, factors, side, of_rows }.all();
        let (by_rows, by_columns) = rayon::join(|| sweep(rows, true), || sweep(columns, false));
        let mut out = vec![0.0; rows.count * columns.count];
        let mut by_columns = by_columns.iter().peekable();
        for (front, left) in &by_rows {
            while by_columns.next_if(|(other, _)| other < front).is_some() {}
            let Some((_, right)) = by_columns.next_if(|(other, _)| other == front) else {
                continue;
            };
            let k = *front as usize;
            let pivots = self.fronts[k].pivots;
            let [wide, long] = [&columns.active[k], &rows.active[k]];
            let mut product = vec![0.0; long.len() * wide.len()];
            let left = MatRef::from_column_major_slice(left, pivots, long.len());
            let right = MatRef::from_column_major_slice(right, pivots, wide.len());
            let into = MatMut::from_column_major_slice_mut(&mut product, long.len(), wide.len());
            matmul(into, Accum::Replace, left.transpose(), right, 1.0, Par::Seq);
            for (&j, product) in wide.iter().zip(product.chunks_exact(long.len())) {
                let out = &mut out[j as usize * rows.count..(j as usize + 1) * rows.count];
                long.iter().zip(product).for_each(|(&i, product)| out[i as usize] += product);
            }
        }
        out
    }
}

/// One sweep: `L⁻¹ P` of unit columns, or `U⁻ᵀ` of rows.
struct Sweep<'a> {
    plan: &'a Symbolic,
    factors: &'a Factors,
    side: &'a Side,
    of_rows: bool,
}

/// Results of a front at its pivots for its active right-hand sides.
type Head = (u32, Vec<f64>);

/// Results of a subtree: at the pivots of each front, and the contribution to the parent of its root.
#[derive(Default)]
struct SubtreeResult {
    heads: Vec<Head>,
    tail: Vec<f64>,
}

impl Sweep<'_> {
    fn all(&self) -> Vec<Head> {
        let roots = self.plan.roots.iter();
        roots.flat_map(|&root| self.subtree(root as usize).heads).collect()
    }

    fn subtree(&self, root: usize) -> SubtreeResult {
        if self.side.active[root].is_empty() {
            return SubtreeResult::default();
        }
        let front = &self.plan.fronts[root];
        if front.forks {
            return self.forked(root);
        }
        let mut heads = Vec::new();
        let mut tails = vec![Vec::new(); root + 1 - front.subtree];
        for k in (front.subtree..=root).filter(|&k| !self.side.active[k].is_empty()) {
            let children = self.plan.fronts[k].children.iter();
            let children =
                children.map(|&c| (c, std::mem::take(&mut tails[c as usize - front.subtree])));
            let [head, tail] = self.eliminate(k, &children.collect::<Vec<_>>());
            heads.push((k as u32, head));
            tails[k - front.subtree] = tail;
        }
        SubtreeResult { heads, tail: tails.pop().unwrap_or_default() }
    }

    /// Processes a subtree whose parts run in parallel.
    fn forked(&self, root: usize) -> SubtreeResult {
        let children = &self.plan.fronts[root].children;
        let below = |&child: &u32| (child, self.subtree(child as usize));
        let below: Vec<(u32, SubtreeResult)> = if self.plan.fronts[root].parallel {
            children.par_iter().map(below).collect()
        } else {
            children.iter().map(below).collect()
        };
        let (mut heads, mut tails) = (Vec::new(), Vec::with_capacity(below.len()));
        for (child, left) in below {
            heads.extend(left.heads);
            tails.push((child, left.tail));
        }
        let [head, tail] = self.eliminate(root, &tails);
        heads.push((root as u32, head));
        SubtreeResult { heads, tail }
    }

    /// Processes a front: results at its pivots and contribution to its parent.
    fn eliminate(&self, k: usize, children: &[(u32, Vec<f64>)]) -> [Vec<f64>; 2] {
        let front = &self.plan.fronts[k];
        let (np, count) = (front.pivots, self.side.active[k].len());
        let [mut head, mut tail] = self.assemble(k, children);
        let storage = &self.factors.storage()[front.storage..front.storage + front.storage_len()];
        let (panel, u12) = storage.split_at(front.panel_len());
        let (top, low) =
            MatRef::from_column_major_slice(panel, np + front.below, np).split_at_row(np);
        if !self.of_rows {
            let pivot = &self.factors.pivot[front.first..front.first + np];
            let mut straight = vec![0.0; np];
            for one in head.chunks_exact_mut(np) {
                straight.copy_from_slice(one);
                one.iter_mut().zip(pivot).for_each(|(one, &p)| *one = straight[p as usize]);
            }
        }
        let mut at_pivots = MatMut::from_column_major_slice_mut(&mut head, np, count);
        let for_parent = MatMut::from_column_major_slice_mut(&mut tail, front.below, count);
        if self.of_rows {
            triangular::solve_lower_triangular_in_place(
                top.transpose(),
                at_pivots.as_mut(),
                Par::Seq,
            );
            let u12 = MatRef::from_column_major_slice(u12, np, front.below);
            matmul(for_parent, Accum::Add, u12.transpose(), at_pivots.as_ref(), -1.0, Par::Seq);
        } else {
            triangular::solve_unit_lower_triangular_in_place(top, at_pivots.as_mut(), Par::Seq);
            matmul(for_parent, Accum::Add, low, at_pivots.as_ref(), -1.0, Par::Seq);
        }
        [head, tail]
    }

    /// Assembles the right-hand sides of a front and the contributions of its children, at its pivots and below.
    fn assemble(&self, k: usize, children: &[(u32, Vec<f64>)]) -> [Vec<f64>; 2] {
        let (front, active) = (&self.plan.fronts[k], &self.side.active[k]);
        let (np, below) = (front.pivots, front.below);
        let mut head = vec![0.0; np * active.len()];
        let mut tail = vec![0.0; below * active.len()];
        for &(unknown, side, value) in self.side.entries_of(front) {
            let at = active.partition_point(|&other| other < side);
            head[at * np + unknown as usize - front.first] += value;
        }
        for (child, left) in children.iter().filter(|(_, left)| !left.is_empty()) {
            let runs = &self.plan.fronts[*child as usize].runs;
            let parts = left.chunks_exact(self.plan.fronts[*child as usize].below);
            for (part, side) in parts.zip(&self.side.active[*child as usize]) {
                let at = active.partition_point(|other| other < side);
                for run in runs {
                    // A run does not cross the boundary between pivots and the rows below.
                    let (from, to) = (&part[run.child as usize..], run.parent as usize);
                    match to.checked_sub(np) {
                        None => add(&mut head[at * np + to..], from, run.len),
                        Some(to) => add(&mut tail[at * below + to..], from, run.len),
                    }
                }
            }
        }
        [head, tail]
    }
}
