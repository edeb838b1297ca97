//! LU factorisation with row pivoting of a small dense matrix.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor as lu;
use faer::linalg::triangular_solve as triangular;
use faer::{MatMut, MatRef, Par};

/// LU factors of a square matrix.
pub(super) struct DenseLu {
    n: usize,
    /// Unit lower and upper triangle, column-major.
    factors: Vec<f64>,
    /// Original row at each position after pivoting.
    pivot: Vec<u32>,
}

impl DenseLu {
    /// Factors the `n` by `n` matrix given column-major; `None` if it is singular.
    pub(super) fn new(n: usize, mut factors: Vec<f64>) -> Option<Self> {
        let (mut pivot, mut inverse) = (vec![0; n], vec![0; n]);
        let scratch = lu::lu_in_place_scratch::<u32, f64>(n, n, Par::Seq, Default::default());
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        let matrix = MatMut::from_column_major_slice_mut(&mut factors, n, n);
        // One thread, so that results do not depend on the number of threads.
        lu::lu_in_place(matrix, &mut pivot, &mut inverse, Par::Seq, stack, Default::default());
        let is_regular = |k: usize| factors[k * n + k].is_finite() && factors[k * n + k] != 0.0;
        (0..n).all(is_regular).then_some(Self { n, factors, pivot })
    }

    /// Solution for one right-hand side.
    pub(super) fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self.pivot.iter().map(|&p| rhs[p as usize]).collect();
        let factors = MatRef::from_column_major_slice(&self.factors, self.n, self.n);
        let mut column = MatMut::from_column_major_slice_mut(&mut x, self.n, 1);
        triangular::solve_unit_lower_triangular_in_place(factors, column.as_mut(), Par::Seq);
        triangular::solve_upper_triangular_in_place(factors, column, Par::Seq);
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_are_correct_and_singular_matrices_are_detected() {
        let n = 150;
        let entries: Vec<f64> = (0..n * n).map(|k| (k as f64 * 0.37).sin()).collect();
        let x: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
        let mut b = vec![0.0; n];
        for (column, x) in entries.chunks_exact(n).zip(&x) {
            b.iter_mut().zip(column).for_each(|(b, a)| *b += a * x);
        }
        // sin of a linear function has rank two; the diagonal makes the matrix regular.
        let mut regular = entries;
        (0..n).for_each(|k| regular[k * n + k] += 3.0);
        b.iter_mut().zip(&x).for_each(|(b, x)| *b += 3.0 * x);
        let found = DenseLu::new(n, regular).unwrap().solve(&b);
        assert!(found.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
        assert!(DenseLu::new(2, vec![1.0, 2.0, 0.0, 0.0]).is_none());
        assert!(DenseLu::new(0, Vec::new()).unwrap().solve(&[]).is_empty());
    }
}
