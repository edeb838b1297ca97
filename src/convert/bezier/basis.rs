//! Interpolation at Chebyshev points in Bernstein form.

use nalgebra::DMatrix;

use kanagata_geometry::Vec3;
use kanagata_tool::patch::{MAX_DEGREE, bernstein};

/// Number of nodes of the maximum degree.
pub const NODES: usize = MAX_DEGREE + 1;

/// Node `k` of `degree`: Chebyshev point of the second kind on [0, 1], `(1 - cos(pi k / degree)) / 2`. Both ends are
/// nodes.
pub fn node(degree: usize, k: usize) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * k as f64 / degree as f64).cos()
}

/// Matrices from values at the nodes to control points.
pub struct Basis {
    /// Inverse of `B_i(t_k)` for degree 1 to 6.
    inverse: Vec<DMatrix<f64>>,
}

impl Basis {
    /// Inverts the Bernstein matrices of degree 1 to 6.
    pub fn new() -> Self {
        let matrix = |degree: usize| {
            let size = degree + 1;
            let b = DMatrix::from_fn(size, size, |k, i| bernstein(degree, node(degree, k))[0][i]);
            // The matrix is regular because the Bernstein polynomials are linearly independent.
            b.try_inverse().unwrap_or_else(|| DMatrix::identity(size, size))
        };
        Self { inverse: (1..=MAX_DEGREE).map(matrix).collect() }
    }

    /// Node `k` of `degree`.
    pub fn node(&self, degree: usize, k: usize) -> f64 {
        node(degree, k)
    }

    /// Control points of the curve of `degree` that interpolates `values` at the nodes.
    pub fn curve(&self, degree: usize, values: &[Vec3]) -> Vec<Vec3> {
        let m = &self.inverse[degree - 1];
        (0..=degree).map(|i| (0..=degree).map(|k| values[k] * m[(i, k)]).sum()).collect()
    }

    /// Point of the curve with these control points at `t`.
    pub fn value(&self, control: &[Vec3], t: f64) -> Vec3 {
        let b = bernstein(control.len() - 1, t)[0];
        control.iter().zip(b).map(|(p, b)| p * b).sum()
    }

    /// Control points of the patch of degrees `n` by `m` that interpolates `values` at the tensor grid of nodes. Values
    /// and control points are stored with the second index fastest.
    pub fn tensor(&self, [n, m]: [usize; 2], values: &[Vec3]) -> Vec<Vec3> {
        let rows: Vec<Vec<Vec3>> =
            (0..=n).map(|i| self.curve(m, &values[i * (m + 1)..(i + 1) * (m + 1)])).collect();
        let mut net = vec![Vec3::zeros(); (n + 1) * (m + 1)];
        for j in 0..=m {
            let column: Vec<Vec3> = rows.iter().map(|r| r[j]).collect();
            for (i, p) in self.curve(n, &column).into_iter().enumerate() {
                net[i * (m + 1) + j] = p;
            }
        }
        net
    }
}
