//! Eigenvalues and eigenvectors of symmetric tensors in SIMD lanes.

use pulp::{Arch, Simd, WithSimd};

use crate::numbers::lanes::{Eight, Lane, POINTS};
use crate::numbers::tensor::Mandel;

/// Eigenvalues, and eigenvectors in the columns.
pub(super) type Eigen = ([f64; 3], [[f64; 3]; 3]);

/// Eigenvalues and eigenvectors of two tensors in one SIMD evaluation.
pub(super) fn eigen_pair(tensors: &[Mandel; 2]) -> [Eigen; 2] {
    let mut side_by_side = [[0.0; POINTS]; 6];
    for (k, tensor) in tensors.iter().enumerate() {
        side_by_side.iter_mut().zip(tensor).for_each(|(to, from)| to[k] = *from);
    }
    let [one, two, ..] = eigen_batch(&side_by_side, 2);
    [one, two]
}

/// Eigenvalues and eigenvectors of the first `count` of eight tensors.
pub(super) fn eigen_batch(tensors: &[Eight; 6], count: usize) -> [Eigen; POINTS] {
    Arch::new().dispatch(EigenBatch { tensors, count })
}

struct EigenBatch<'a> {
    tensors: &'a [Eight; 6],
    count: usize,
}

impl WithSimd for EigenBatch<'_> {
    type Output = [Eigen; POINTS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Eigen; POINTS] {
        let mut all: [Eight; 12] = [[0.0; POINTS]; 12];
        for first in Lane::<S>::groups_of(self.count) {
            let (values, q) = eigen(simd, Lane::load_all(simd, self.tensors, first));
            for (k, value) in values.iter().chain(q.as_flattened()).enumerate() {
                value.store(&mut all[k], first);
            }
        }
        let mut out = [([0.0; 3], [[0.0; 3]; 3]); POINTS];
        for (k, (values, q)) in out.iter_mut().enumerate().take(self.count) {
            for (to, from) in values.iter_mut().chain(q.as_flattened_mut()).zip(&all) {
                *to = from[k];
            }
        }
        out
    }
}

/// Eigenvalues and orthonormal eigenvectors of symmetric tensors (Mandel components) by cyclic Jacobi rotations.
/// Accurate to rounding for equal eigenvalues too. Returns `(values, q)` with the eigenvectors in the columns of `q`.
#[inline(always)]
pub(super) fn eigen<S: Simd>(simd: S, v: [Lane<S>; 6]) -> ([Lane<S>; 3], [[Lane<S>; 3]; 3]) {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut diagonal = [v[0], v[1], v[2]];
    // Off-diagonal entries by the index that is in neither: 12, 20, 01.
    let mut off_diagonal = [v[4] * half, v[5] * half, v[3] * half];
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let mut q = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let scale = Lane::dot(&v, &v) * 1e-34;
    for _ in 0..30 {
        if (Lane::dot(&off_diagonal, &off_diagonal) - scale).largest() <= 0.0 {
            break;
        }
        for k in [2, 0, 1] {
            rotate(simd, &mut diagonal, &mut off_diagonal, &mut q, k);
        }
    }
    (diagonal, q)
}

/// Jacobi rotation about axis `k`, which annihilates the off-diagonal entry of the other two axes.
#[inline(always)]
fn rotate<S: Simd>(
    simd: S,
    diagonal: &mut [Lane<S>; 3],
    off_diagonal: &mut [Lane<S>; 3],
    q: &mut [[Lane<S>; 3]; 3],
    k: usize,
) {
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let difference = diagonal[j] - diagonal[i];
    let double = off_diagonal[k] + off_diagonal[k];
    // t = tan of the rotation angle, the root with |t| <= 1; 0 if the entry vanishes.
    let root = difference.mul_add(difference, double * double).sqrt() + difference.abs();
    let t = double / root.max(Lane::splat(simd, f64::MIN_POSITIVE));
    let t = difference.if_less(zero, -t, t);
    let c = one / t.mul_add(t, one).sqrt();
    let s = t * c;
    diagonal[i] = diagonal[i] - t * off_diagonal[k];
    diagonal[j] = diagonal[j] + t * off_diagonal[k];
    // Entries ki and kj are stored at j and i.
    let (ki, kj) = (off_diagonal[j], off_diagonal[i]);
    off_diagonal[k] = zero;
    off_diagonal[j] = c * ki - s * kj;
    off_diagonal[i] = s * ki + c * kj;
    for row in q.iter_mut() {
        let (x, y) = (row[i], row[j]);
        row[i] = c * x - s * y;
        row[j] = s * x + c * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::algebra::congruence;
    use crate::numbers::tensor;

    /// Eigenvalues, in any order, and the tensors that they make with their vectors.
    fn assert_same(one: &Eigen, two: &Eigen) {
        let sorted = |(values, _): &Eigen| {
            let mut values = *values;
            values.sort_by(f64::total_cmp);
            values
        };
        let rebuilt = |([x, y, z], q): &Eigen| {
            tensor::apply(&tensor::congruence(q), &[*x, *y, *z, 0.0, 0.0, 0.0])
        };
        let pairs = sorted(one).into_iter().zip(sorted(two));
        for (a, b) in pairs.chain(rebuilt(one).into_iter().zip(rebuilt(two))) {
            assert!((a - b).abs() < 1e-14, "{one:?} {two:?}");
        }
    }

    #[test]
    fn they_are_those_of_one_tensor_at_a_time() {
        let simd = pulp::Scalar::new();
        let tensors: [Mandel; 6] = [
            [1.0, 2.0, 3.0, 0.5, -0.7, 0.2],
            [1.0; 6].map(|x| x * 1.5),
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1e-9, -2e-9, 1e-12],
            [1.0, 1.0, 2.0, 0.0, 1e-200, 0.0],
            [0.0; 6],
        ];
        for v in tensors {
            let (values, q) = eigen(simd, v.map(|x| Lane::splat(simd, x)));
            let map = congruence(simd, &q).map(|row| row.map(Lane::largest));
            let mut other = v;
            other.reverse();
            let [one, two] = eigen_pair(&[v, other]);
            assert_same(&one, &tensor::eigen(&v));
            assert_same(&two, &tensor::eigen(&other));
            let q = q.map(|row| row.map(Lane::largest));
            assert_eq!(map.as_flattened().len(), 36);
            for (found, expected) in map.iter().zip(tensor::congruence(&q)) {
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-15, "{v:?}");
                }
            }
            let [x, y, z] = values.map(Lane::largest);
            let rebuilt = tensor::apply(&map, &[x, y, z, 0.0, 0.0, 0.0]);
            for (a, b) in v.iter().zip(rebuilt) {
                assert!((a - b).abs() < 1e-14, "{v:?} {rebuilt:?}");
            }
        }
    }
}
