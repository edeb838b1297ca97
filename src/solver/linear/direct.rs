//! Direct solvers: the multifrontal LU of this crate and the sparse LU of faer.

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut};

use super::multifrontal::{Factors, PatternRef, Singular, SparseRow, Symbolic};
use super::pattern::Pattern;
use super::{Groups, LinearError, LinearSolver};
use kanagata_cancel::Cancel;

/// Multifrontal LU (see [`super::multifrontal`]).
#[derive(Debug, Default)]
pub struct MultifrontalLu {
    plan: Symbolic,
    factors: Factors,
    cancel: Cancel,
}

impl MultifrontalLu {
    /// Error of a factorisation: cancelled or singular.
    fn failed(&self, singular: &Singular) -> LinearError {
        if self.cancel.is_requested() {
            return LinearError::Cancelled;
        }
        LinearError::Singular { unknown: singular.unknown }
    }
}

impl LinearSolver for MultifrontalLu {
    fn analyze(&mut self, pattern: &Pattern, groups: &Groups) -> Result<(), LinearError> {
        let columns: Vec<u32> = pattern.col_idx.iter().map(|&c| c as u32).collect();
        let view = PatternRef { row_start: &pattern.row_ptr, columns: &columns };
        self.plan = Symbolic::new(view, &groups.of_unknown, &groups.centers)
            .map_err(|e| LinearError::Pattern(e.to_string()))?;
        self.plan.cancel = self.cancel.clone();
        Ok(())
    }

    fn set_cancel(&mut self, cancel: &Cancel) {
        self.cancel = cancel.clone();
        self.plan.cancel = cancel.clone();
    }

    fn factor(&mut self, values: &[f64], rhs: &[&[f64]]) -> Result<(), LinearError> {
        self.plan.factor(values, &mut self.factors, rhs).map_err(|e| self.failed(&e))
    }

    fn factor_symmetric(&mut self, values: &[f64]) -> Result<(), LinearError> {
        self.plan.factor_symmetric(values, &mut self.factors).map_err(|e| self.failed(&e))
    }

    fn finish(&mut self, rhs: &mut [&mut [f64]]) {
        self.plan.finish(&mut self.factors, rhs);
    }

    fn solve(&self, rhs: &mut [&mut [f64]]) {
        self.plan.solve(&self.factors, rhs);
    }

    fn products_with_inverse(&self, rows: &[SparseRow<'_>], columns: &[usize]) -> Option<Vec<f64>> {
        const UPDATE_WORK_RATIO: f64 = 0.6;
        if self.factors.is_symmetric() {
            return None;
        }
        let product = self.plan.plan_inverse_product(rows, columns);
        let worth = self.plan.relative_cost(&product) <= UPDATE_WORK_RATIO;
        worth.then(|| self.plan.products(&self.factors, &product))
    }

    fn name(&self) -> &'static str {
        "multifrontal LU"
    }
}

/// Sparse LU of faer with partial pivoting: slower, but pivots over whole columns.
///
/// Rows of the pattern are passed as columns, so the factors are those of the transpose.
#[derive(Debug, Default)]
pub struct SparseLu {
    pattern: Option<(Pattern, SymbolicLu<usize>)>,
    factors: Option<Lu<usize, f64>>,
}

impl LinearSolver for SparseLu {
    fn analyze(&mut self, pattern: &Pattern, _groups: &Groups) -> Result<(), LinearError> {
        let symbolic = SymbolicLu::try_new(columns_of(pattern))
            .map_err(|e| LinearError::Pattern(format!("{e:?}")))?;
        self.pattern = Some((pattern.clone(), symbolic));
        self.factors = None;
        Ok(())
    }

    fn factor(&mut self, values: &[f64], _rhs: &[&[f64]]) -> Result<(), LinearError> {
        let Some((pattern, symbolic)) = &self.pattern else {
            return Err(LinearError::Pattern("factor before analyze".into()));
        };
        let matrix = SparseColMatRef::new(columns_of(pattern), values);
        let factors = Lu::try_new_with_symbolic(symbolic.clone(), matrix)
            .map_err(|_| LinearError::Singular { unknown: 0 })?;
        self.factors = Some(factors);
        Ok(())
    }

    fn solve(&self, rhs: &mut [&mut [f64]]) {
        let Some(factors) = &self.factors else { return };
        for one in rhs {
            let n = one.len();
            let view = MatMut::from_column_major_slice_mut(one, n, 1);
            factors.solve_transpose_in_place_with_conj(Conj::No, view);
        }
    }

    fn name(&self) -> &'static str {
        "faer sparse LU"
    }
}

fn columns_of(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.dim();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.row_ptr, None, &pattern.col_idx)
}
