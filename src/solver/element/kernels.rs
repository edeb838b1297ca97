//! Small dense products of the element loop, compiled for each SIMD width and dispatched at run time (`pulp`).
//!
//! All rows have 24 entries, the degrees of freedom of an element. The SIMD width does not depend on the number of
//! threads, so results are bit-identical on one machine. Another machine may round differently.

use pulp::{Arch, Simd, WithSimd};

use super::DOFS;

/// A row over the degrees of freedom of an element.
pub(crate) type Row = [f64; DOFS];

/// Register block of [`add_gram`]: rows and SIMD vectors for each row. Twelve accumulators fit every register file.
const GRAM_BLOCK_ROWS: usize = 4;
const BLOCK_VECTORS: usize = 3;
/// Rows of [`combine`] in one register block.
const COMBINE_BLOCK_ROWS: usize = 3;

/// `tangent += leftᵀ right`, summed over the rows of both.
pub(crate) fn add_gram(left: &[Row], right: &[Row], tangent: &mut [Row; DOFS]) {
    debug_assert_eq!(left.len(), right.len());
    Arch::new().dispatch(Gram { left, right, tangent });
}

/// `out_i = Σ_k coefficients[i][k] rows[k]`.
pub(crate) fn combine<const N: usize>(coefficients: &[[f64; N]], rows: &[Row; N], out: &mut [Row]) {
    debug_assert_eq!(coefficients.len(), out.len());
    Arch::new().dispatch(Combine { coefficients, rows, out });
}

struct Gram<'a> {
    left: &'a [Row],
    right: &'a [Row],
    tangent: &'a mut [Row; DOFS],
}

impl WithSimd for Gram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let lanes = S::F64_LANES;
        for first in (0..DOFS).step_by(BLOCK_VECTORS * lanes) {
            for (block, rows) in self.tangent.chunks_exact_mut(GRAM_BLOCK_ROWS).enumerate() {
                let mut sums = [[simd.splat_f64s(0.0); BLOCK_VECTORS]; GRAM_BLOCK_ROWS];
                for (left, right) in self.left.iter().zip(self.right) {
                    let values = S::as_simd_f64s(&right[first..first + BLOCK_VECTORS * lanes]).0;
                    let factors =
                        &left[GRAM_BLOCK_ROWS * block..GRAM_BLOCK_ROWS * block + GRAM_BLOCK_ROWS];
                    for (sum, &factor) in sums.iter_mut().zip(factors) {
                        let factor = simd.splat_f64s(factor);
                        for (sum, &value) in sum.iter_mut().zip(values) {
                            *sum = simd.mul_add_e_f64s(factor, value, *sum);
                        }
                    }
                }
                for (row, sums) in rows.iter_mut().zip(sums) {
                    let row = S::as_mut_simd_f64s(&mut row[first..first + BLOCK_VECTORS * lanes]).0;
                    for (value, sum) in row.iter_mut().zip(sums) {
                        *value = simd.add_f64s(*value, sum);
                    }
                }
            }
        }
    }
}

struct Combine<'a, const N: usize> {
    coefficients: &'a [[f64; N]],
    rows: &'a [Row; N],
    out: &'a mut [Row],
}

impl<const N: usize> WithSimd for Combine<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let blocks = self
            .out
            .chunks_mut(COMBINE_BLOCK_ROWS)
            .zip(self.coefficients.chunks(COMBINE_BLOCK_ROWS));
        for (out, coefficients) in blocks {
            match (out, coefficients) {
                ([a, b, c], [x, y, z]) => block(simd, [a, b, c], [x, y, z], self.rows),
                (out, coefficients) => {
                    for (out, coefficients) in out.iter_mut().zip(coefficients) {
                        block(simd, [out], [coefficients], self.rows);
                    }
                }
            }
        }
    }
}

/// One register block of [`combine`]: `R` independent sums hide the latency of the fused multiply-add.
#[inline(always)]
fn block<S: Simd, const R: usize, const N: usize>(
    simd: S,
    mut out: [&mut Row; R],
    coefficients: [&[f64; N]; R],
    rows: &[Row; N],
) {
    let width = BLOCK_VECTORS * S::F64_LANES;
    for first in (0..DOFS).step_by(width) {
        let mut sums = [[simd.splat_f64s(0.0); BLOCK_VECTORS]; R];
        for (k, row) in rows.iter().enumerate() {
            let values = S::as_simd_f64s(&row[first..first + width]).0;
            for (sums, coefficients) in sums.iter_mut().zip(&coefficients) {
                let factor = simd.splat_f64s(coefficients[k]);
                for (sum, &value) in sums.iter_mut().zip(values) {
                    *sum = simd.mul_add_e_f64s(factor, value, *sum);
                }
            }
        }
        for (out, sums) in out.iter_mut().zip(sums) {
            let out = S::as_mut_simd_f64s(&mut out[first..first + width]).0;
            for (value, sum) in out.iter_mut().zip(sums) {
                *value = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows<const N: usize>(seed: f64) -> [Row; N] {
        std::array::from_fn(|i| std::array::from_fn(|j| (seed * (1 + i * DOFS + j) as f64).sin()))
    }

    #[test]
    fn products_agree_with_plain_sums() {
        let (left, right) = (rows::<5>(0.7), rows::<5>(1.3));
        let mut tangent: [Row; DOFS] = rows(0.4);
        let start = tangent;
        add_gram(&left, &right, &mut tangent);
        for a in 0..DOFS {
            for b in 0..DOFS {
                let sum: f64 = (0..5).map(|k| left[k][a] * right[k][b]).sum();
                assert!((tangent[a][b] - start[a][b] - sum).abs() < 1e-14);
            }
        }
        let coefficients = [[0.3, -1.0, 2.0, 0.5, 0.0], [1.0, 0.0, 0.25, -4.0, 7.0]];
        let mut out: [Row; 2] = rows(2.0);
        combine(&coefficients, &left, &mut out);
        for (row, c) in out.iter().zip(coefficients) {
            for b in 0..DOFS {
                let sum: f64 = (0..5).map(|k| c[k] * left[k][b]).sum();
                assert!((row[b] - sum).abs() < 1e-14);
            }
        }
    }
}
