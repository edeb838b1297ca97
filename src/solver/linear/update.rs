//! Low-rank update: solution after a few rows of the matrix have changed, with the old factors.
//!
//! With `A' = A + E D` (`E` the unit columns of the changed rows, `D` the added rows) and `Z = A⁻¹ E`,
//! `x = A⁻¹ (b - E m)` solves `A' x = b` if `(I + D Z) m = D A⁻¹ b` (Sherman, Morrison, Woodbury).

use super::dense::DenseLu;
use super::pattern::Pattern;
use super::{LinearSolver, SparseRow};

/// Rows of the matrix that changed since its factorisation, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChangedRows {
    /// Row indices.
    pub rows: Vec<usize>,
    /// Values added to each row, in the order of the pattern.
    pub added: Vec<Vec<f64>>,
}

/// An update of the factors.
pub(super) struct Update<'a> {
    pattern: &'a Pattern,
    changed: &'a ChangedRows,
    /// `D Z`, column-major.
    by_changes: Vec<f64>,
    /// Capacitance matrix `I + D Z`.
    capacitance: DenseLu,
}

impl<'a> Update<'a> {
    /// `None` if new factors are cheaper or the update is singular.
    pub(super) fn new(
        solver: &dyn LinearSolver,
        pattern: &'a Pattern,
        changed: &'a ChangedRows,
    ) -> Option<Self> {
        let m = changed.rows.len();
        let columns = changed.rows.iter().map(|&row| columns_of(pattern, row));
        let rows: Vec<SparseRow<'_>> =
            columns.zip(&changed.added).map(|(columns, added)| (columns, &added[..])).collect();
        let by_changes = solver.products_with_inverse(&rows, &changed.rows)?;
        let mut capacitance = by_changes.clone();
        capacitance.iter_mut().step_by(m + 1).for_each(|diagonal| *diagonal += 1.0);
        let capacitance = DenseLu::new(m, capacitance)?;
        Some(Self { pattern, changed, by_changes, capacitance })
    }

    /// Solves in place. `known` are right-hand sides and solutions of the factored matrix, by index. If a right-hand
    /// side differs from the known one only in changed rows, the equations are solved for the difference. This halves
    /// the work, and further if the solver skips zeros.
    pub(super) fn solve(
        &self,
        solver: &dyn LinearSolver,
        rhs: &mut [&mut [f64]],
        known: &[(Vec<f64>, Vec<f64>)],
    ) {
        let base: Vec<Option<&(Vec<f64>, Vec<f64>)>> = rhs
            .iter()
            .enumerate()
            .map(|(k, x)| known.get(k).filter(|k| self.differs_in_changed_rows(x, &k.0)))
            .collect();
        let unknown = || rhs.iter().zip(&base).filter(|(_, base)| base.is_none());
        let mut first: Vec<Vec<f64>> = unknown().map(|(x, _)| x.to_vec()).collect();
        if !first.is_empty() {
            solver.solve(&mut first.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
        }
        let mut first = first.iter();
        for (x, base) in rhs.iter_mut().zip(&base) {
            let product = match base {
                Some((given, known)) => Some(self.subtract_known(x, given, known)),
                None => first.next().map(|y| self.changes_times(y)),
            };
            if let Some(product) = product {
                let m = self.capacitance.solve(&product);
                self.changed.rows.iter().zip(m).for_each(|(&row, m)| x[row] -= m);
            }
        }
        solver.solve(rhs);
        for (x, (_, known)) in rhs.iter_mut().zip(&base).filter_map(|(x, base)| Some((x, (*base)?)))
        {
            x.iter_mut().zip(known).for_each(|(x, known)| *x += known);
        }
    }

    /// Whether two right-hand sides differ only in changed rows.
    fn differs_in_changed_rows(&self, x: &[f64], given: &[f64]) -> bool {
        let differ = x.iter().zip(given).filter(|(x, g)| x != g).count();
        differ == self.changed.rows.iter().filter(|&&row| x[row] != given[row]).count()
    }

    /// Subtracts the right-hand side `given` with solution `known` from `x`, which differs only in changed rows.
    /// Returns `D A⁻¹` of the original `x`: `D known + D Z` times the difference.
    fn subtract_known(&self, x: &mut [f64], given: &[f64], known: &[f64]) -> Vec<f64> {
        x.iter_mut().zip(given).for_each(|(x, given)| *x -= given);
        let mut product = self.changes_times(known);
        let columns = self.by_changes.chunks_exact(product.len().max(1));
        for (column, &row) in columns.zip(&self.changed.rows) {
            product.iter_mut().zip(column).for_each(|(product, z)| *product += z * x[row]);
        }
        product
    }

    /// `D y`.
    fn changes_times(&self, y: &[f64]) -> Vec<f64> {
        let rows = self.changed.rows.iter().zip(&self.changed.added);
        rows.map(|(&row, added)| {
            let columns = columns_of(self.pattern, row).iter();
            columns.zip(added).map(|(&c, d)| d * y[c]).sum()
        })
        .collect()
    }
}

fn columns_of(pattern: &Pattern, row: usize) -> &[usize] {
    &pattern.col_idx[pattern.row_ptr[row]..pattern.row_ptr[row + 1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{CheckedSolver, Groups};
    use kanagata_geometry::Vec3;

    /// Five-point grid, unsymmetric, with the solver that holds its factors.
    fn grid(n: usize) -> (Pattern, Vec<f64>, Groups) {
        let mut pattern = Pattern { row_ptr: vec![0], col_idx: vec![] };
        let mut values = vec![];
        let at = |i: usize, j: usize| i * n + j;
        for i in 0..n {
            for j in 0..n {
                for (k, l) in
                    [(i.wrapping_sub(1), j), (i, j.wrapping_sub(1)), (i, j), (i, j + 1), (i + 1, j)]
                {
                    if k < n && l < n {
                        pattern.col_idx.push(at(k, l));
                        let same = (k, l) == (i, j);
                        values.push(if same {
                            4.5
                        } else {
                            -1.0 + 0.1 * ((k + 3 * l) as f64).sin()
                        });
                    }
                }
                pattern.row_ptr.push(pattern.col_idx.len());
            }
        }
        let groups = Groups {
            of_unknown: (0..(n * n) as u32).collect(),
            centers: (0..n * n).map(|k| Vec3::new((k / n) as f64, (k % n) as f64, 0.0)).collect(),
        };
        (pattern, values, groups)
    }

    /// All entries of these rows but the diagonal halved, the diagonal negative in every other row.
    fn change(pattern: &Pattern, values: &mut [f64], rows: Vec<usize>) -> ChangedRows {
        let mut changed = ChangedRows::default();
        for row in rows {
            let places = pattern.row_ptr[row]..pattern.row_ptr[row + 1];
            let old = values[places.clone()].to_vec();
            for q in places.clone() {
                let turned = pattern.col_idx[q] == row && row % 2 == 0;
                values[q] *= if turned { -1.0 } else { 0.5 };
            }
            let added = values[places].iter().zip(&old).map(|(new, old)| new - old).collect();
            changed.rows.push(row);
            changed.added.push(added);
        }
        changed
    }

    fn right_hand_side(n: usize) -> Vec<f64> {
        (0..n).map(|k| (0.3 * k as f64).cos()).collect()
    }

    #[test]
    fn a_few_changed_rows_need_no_new_factors() {
        let (pattern, mut values, groups) = grid(40);
        let n = pattern.dim();
        let mut solver = CheckedSolver::new(&pattern, groups).unwrap();
        let b = right_hand_side(n);
        solver.solve(&values, &mut [b.clone()]).unwrap();
        let mut x = [b.clone()];
        solver.solve_changed(&values, &ChangedRows::default(), &mut x).unwrap();
        assert!(
            pattern.residuals(&values, &[[&x[0], &b]], None)[0].iter().all(|r| r.abs() < 1e-10)
        );
        let rows = vec![3, 4, 777, 1000];
        let changed = change(&pattern, &mut values, rows.clone());
        // Right-hand sides that change in the changed rows only, and everywhere.
        let mut base = b.clone();
        rows.iter().for_each(|&row| base[row] += 1.0);
        let far: Vec<f64> = b.iter().map(|b| b + 0.5).collect();
        for given in [b, base, far] {
            let mut x = [given.clone()];
            solver.solve_changed(&values, &changed, &mut x).unwrap();
            let left = &pattern.residuals(&values, &[[&x[0], &given]], None)[0];
            assert!(left.iter().all(|r| r.abs() < 1e-10));
        }
        assert_eq!((solver.factorisations, solver.updates), (1, 4));
    }

    #[test]
    fn many_changed_rows_and_none_known_are_factored_anew() {
        let (pattern, mut values, groups) = grid(20);
        let n = pattern.dim();
        let mut solver = CheckedSolver::new(&pattern, groups).unwrap();
        let b = right_hand_side(n);
        let changed = change(&pattern, &mut values, vec![5]);
        solver.solve_changed(&values, &changed, &mut [b.clone()]).unwrap();
        assert_eq!((solver.factorisations, solver.updates), (1, 0), "no factors before");
        let changed = change(&pattern, &mut values, (0..n).collect());
        let mut x = [b.clone()];
        solver.solve_changed(&values, &changed, &mut x).unwrap();
        assert_eq!((solver.factorisations, solver.updates), (2, 0), "too many rows");
        let left = &pattern.residuals(&values, &[[&x[0], &b]], None)[0];
        assert!(left.iter().all(|r| r.abs() < 1e-10));
    }
}
