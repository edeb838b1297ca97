//! `φ` with its derivatives, and its Hessian with respect to the stress.

use crate::numbers::tensor::{Mandel, Mandel66};

/// `φ` and its derivatives with respect to the transformed stresses `S` and `Z`, each in its eigenframe.
pub(super) struct Phi {
    pub(super) value: f64,
    /// `∂φ/∂s_i` and `∂φ/∂z_j`.
    pub(super) gradients: [[f64; 3]; 2],
    /// Diagonals of `∂²φ/∂S²` and `∂²φ/∂Z²` by Mandel component.
    pub(super) hessians: [[f64; 6]; 2],
    /// `-∂²φ/∂s_i∂z_j`.
    pub(super) mixed: [[f64; 3]; 3],
}

impl Phi {
    /// Upper triangle of `∂²φ/∂T²`, from the maps of `T` to the two eigenframes; zero below it.
    #[inline]
    pub(super) fn hessian(&self, one: &Mandel66, two: &Mandel66) -> Mandel66 {
        let [d_s, d_z] = &self.hessians;
        let mixed: [Mandel; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|n| (0..3).map(|j| self.mixed[i][j] * two[j][n]).sum())
        });
        let mut out = [[0.0; 6]; 6];
        for m in 0..6 {
            for n in m..6 {
                let mut sum = 0.0;
                for k in 0..6 {
                    sum += d_s[k] * one[k][m] * one[k][n] + d_z[k] * two[k][m] * two[k][n];
                }
                for (row, mixed) in one.iter().zip(&mixed) {
                    sum -= row[m] * mixed[n] + mixed[m] * row[n];
                }
                out[m][n] = sum;
            }
        }
        out
    }
}
