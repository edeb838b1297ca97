//! Rows of a matrix times vectors, in one pass over the matrix, which is what the time goes into.
//!
//! Where the pattern is that of a mesh, three rows a node with the same columns, a node's rows are multiplied together: the
//! vectors are gathered once for all three, and the products run over consecutive numbers.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::solver::pattern::Pattern;

/// Rows of one task; a multiple of three.
const ROWS: usize = 1536;

impl Pattern {
    /// `b - A x` for the matrix with these values and every pair `[x, b]`; `together`: [`Pattern::rows_together`].
    #[must_use]
    pub fn residuals(
        &self,
        values: &[f64],
        pairs: &[[&[f64]; 2]],
        together: usize,
    ) -> Vec<Vec<f64>> {
        let mut out = Vec::with_capacity(pairs.len());
        for pair in pairs.chunks(2) {
            match pair {
                [one] => out.extend(self.residuals_of(values, [one], together)),
                [one, two] => out.extend(self.residuals_of(values, [one, two], together)),
                _ => {}
            }
        }
        out
    }

    /// The same of `R` pairs in one pass over the matrix.
    fn residuals_of<const R: usize>(
        &self,
        values: &[f64],
        pairs: [&[&[f64]; 2]; R],
        together: usize,
    ) -> [Vec<f64>; R] {
        let mut out = pairs.map(|[_, b]| b.to_vec());
        let mut chunks: Vec<[&mut [f64]; R]> = Vec::new();
        let mut parts = out.each_mut().map(|out| out.chunks_mut(ROWS));
        for _ in 0..self.dim().div_ceil(ROWS) {
            chunks.push(parts.each_mut().map(|part| part.next().unwrap_or_default()));
        }
        let x = pairs.map(|[x, _]| *x);
        chunks.into_par_iter().enumerate().for_each(|(chunk, out)| {
            let first = chunk * ROWS;
            Arch::new().dispatch(Subtract { pattern: self, values, x, first, together, out });
        });
        out
    }

    /// How many rows after one another have the same columns: three in the pattern of a mesh, otherwise one.
    #[must_use]
    pub fn rows_together(&self) -> usize {
        let columns = |row: usize| &self.col_idx[self.row_ptr[row]..self.row_ptr[row + 1]];
        let alike =
            |row: usize| columns(row) == columns(row + 1) && columns(row) == columns(row + 2);
        if self.dim().is_multiple_of(3) && (0..self.dim()).step_by(3).all(alike) { 3 } else { 1 }
    }
}

/// Subtracts rows times vectors from the rows' numbers, from row `first` on.
struct Subtract<'a, const R: usize> {
    pattern: &'a Pattern,
    values: &'a [f64],
    x: [&'a [f64]; R],
    first: usize,
    together: usize,
    out: [&'a mut [f64]; R],
}

impl<const R: usize> WithSimd for Subtract<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { pattern, values, x, first, together, out } = self;
        let count = out.first().map_or(0, |out| out.len());
        let mut near = x.map(|_| Vec::new());
        for row in (0..count).step_by(together) {
            let start = pattern.row_ptr[first + row];
            let columns = &pattern.col_idx[start..pattern.row_ptr[first + row + 1]];
            for (near, x) in near.iter_mut().zip(x) {
                near.clear();
                near.extend(columns.iter().map(|&column| x[column]));
            }
            let width = columns.len();
            for k in 0..together {
                let values = &values[start + k * width..start + (k + 1) * width];
                let sums = dots(simd, values, near.each_ref().map(|near| &near[..]));
                for r in 0..R {
                    out[r][row + k] -= sums[r];
                }
            }
        }
    }
}

/// A row times several vectors, all as long as it.
#[inline(always)]
fn dots<S: Simd, const R: usize>(simd: S, row: &[f64], x: [&[f64]; R]) -> [f64; R] {
    let (wide, rest) = S::as_simd_f64s(row);
    let x = x.map(|x| S::as_simd_f64s(x));
    // Two sums of each, one after the other, keep the processor busy.
    let mut sums = [[simd.splat_f64s(0.0); 2]; R];
    for (i, &values) in wide.iter().enumerate() {
        for r in 0..R {
            sums[r][i % 2] = simd.mul_add_e_f64s(values, x[r].0[i], sums[r][i % 2]);
        }
    }
    let mut out = [0.0; R];
    for r in 0..R {
        out[r] = simd.reduce_sum_f64s(simd.add_f64s(sums[r][0], sums[r][1]));
        for (value, x) in rest.iter().zip(x[r].1) {
            out[r] += value * x;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_plain_sums() {
        let mesh = vec![(0..11).collect::<Vec<usize>>(); 12];
        let others = [vec![0, 3, 10], vec![1, 2, 4, 7], vec![5], vec![0, 9]];
        for (rows, together) in [(&mesh[..], 3), (&others[..], 1)] {
            let mut pattern = Pattern { row_ptr: vec![0], col_idx: Vec::new() };
            for row in rows {
                pattern.col_idx.extend(row);
                pattern.row_ptr.push(pattern.col_idx.len());
            }
            assert_eq!(pattern.rows_together(), together);
            let number = |k: usize| (0.7 * k as f64 + 0.3).sin();
            let values: Vec<f64> = (0..pattern.nnz()).map(number).collect();
            let vectors: Vec<Vec<f64>> =
                (1..7).map(|r| (0..12).map(|k| number(k * r + 5)).collect()).collect();
            let pairs = [0, 1, 2].map(|r| [&vectors[r][..], &vectors[r + 3][..pattern.dim()]]);
            let found = pattern.residuals(&values, &pairs, together);
            for (found, [x, b]) in found.iter().zip(pairs) {
                for row in 0..pattern.dim() {
                    let range = pattern.row_ptr[row]..pattern.row_ptr[row + 1];
                    let sum: f64 = range.map(|q| values[q] * x[pattern.col_idx[q]]).sum();
                    assert!((found[row] - (b[row] - sum)).abs() < 1e-14, "row {row}");
                }
            }
        }
    }
}
