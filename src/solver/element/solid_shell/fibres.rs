//! Removal of the false stretch of fibres that in-plane bending only rotates.
//!
//! Base vectors of the mid-surface are `g_1 = c_1 + η h` and `g_2 = c_2 + ξ h`; `c` are those of the centre. In-plane
//! bending rotates the fibres of an element. One of the two families rotates by an internal displacement (`stretch`)
//! that the nodes do not have. The in-plane part of `η h` normal to `c_1` therefore causes no stretch: `½ η² F_1`
//! with `F_1 = |h|² - (h·c_1)² / |c_1|²` is subtracted from `E_11`, and likewise from `E_22`. Without this correction
//! the stress of the other fibres drives the element into bending that only their hardening resists.
//!
//! `h` excludes the uniform strain of the centre, so that a uniform strain stays uniform in an element of any shape.

use super::in_plane::tangents;
use super::pairs::{Pairs, Plane, blend};
use crate::element::DOFS;
use kanagata_geometry::Vec3;

/// Weights of the node pairs in `h`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hourglass([f64; 4]);

/// Arguments `q_1, q_2, m_11, m_12, m_22` with `q_i = h·c_i`, `m_ij = c_i·c_j`.
const ARGUMENTS: usize = 5;

type Gradient = [f64; ARGUMENTS];
type Hessian = [Gradient; ARGUMENTS];

/// `F_1` and `F_2` of one configuration, with derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fibres {
    pub value: [f64; 2],
    /// Derivatives with respect to the mean of each node pair.
    pub gradient: [[Vec3; 4]; 2],
    /// Derivatives of the arguments by the means.
    arguments: [[Vec3; 4]; ARGUMENTS],
    /// Derivatives with respect to the arguments.
    first: [Gradient; 2],
    second: [Hessian; 2],
    hourglass: Hourglass,
}

impl Hourglass {
    /// Weights for an element with these pairs in the reference configuration.
    pub fn new(reference: &Pairs) -> Self {
        let plain = [0.25, -0.25, 0.25, -0.25];
        let (middle, (c1, c2)) = (Plane::at(0.0, 0.0), tangents(reference));
        let (h, det) = (blend(&plain, &reference.mean), c1.cross(&c2).norm_squared());
        // Components of h along c_1 and c_2.
        let along =
            [c1.cross(&c2).dot(&h.cross(&c2)) / det, c1.cross(&c2).dot(&c1.cross(&h)) / det];
        Self(std::array::from_fn(|k| {
            plain[k] - along[0] * middle.by_xi[k] - along[1] * middle.by_eta[k]
        }))
    }
}

/// `N² / (m_11 det m)` with `N = m_11 q_2 - m_12 q_1`, its gradient and its Hessian.
fn correction([q1, q2, m11, m12, m22]: Gradient) -> (f64, Gradient, Hessian) {
    let n = m11 * q2 - m12 * q1;
    let dn = [-m12, m11, q2, -q1, 0.0];
    let mut ddn: Hessian = [[0.0; ARGUMENTS]; ARGUMENTS];
    (ddn[0][3], ddn[3][0], ddn[1][2], ddn[2][1]) = (-1.0, -1.0, 1.0, 1.0);
    let r = m11 * (m11 * m22 - m12 * m12);
    let dr = [0.0, 0.0, 2.0 * m11 * m22 - m12 * m12, -2.0 * m11 * m12, m11 * m11];
    let mut ddr: Hessian = [[0.0; ARGUMENTS]; ARGUMENTS];
    (ddr[2][2], ddr[3][3]) = (2.0 * m22, -2.0 * m11);
    (ddr[2][3], ddr[3][2]) = (-2.0 * m12, -2.0 * m12);
    (ddr[2][4], ddr[4][2]) = (2.0 * m11, 2.0 * m11);
    let ratio = n / r;
    let first = std::array::from_fn(|a| ratio * (2.0 * dn[a] - ratio * dr[a]));
    let second = std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let (a_turned, b_turned) = (dn[a] - ratio * dr[a], dn[b] - ratio * dr[b]);
            2.0 * a_turned * b_turned / r + ratio * (2.0 * ddn[a][b] - ratio * ddr[a][b])
        })
    });
    (n * ratio, first, second)
}

/// Exchanges the two axes.
fn swap<T: Copy>([q1, q2, m11, m12, m22]: [T; ARGUMENTS]) -> [T; ARGUMENTS] {
    [q2, q1, m22, m12, m11]
}

impl Hourglass {
    /// `F_1` and `F_2` of the current configuration, with derivatives.
    pub fn fibres(self, current: &Pairs) -> Fibres {
        let ((c1, c2), h) = (tangents(current), blend(&self.0, &current.mean));
        let values = [h.dot(&c1), h.dot(&c2), c1.norm_squared(), c1.dot(&c2), c2.norm_squared()];
        let middle = Plane::at(0.0, 0.0);
        let (n1, n2) = (middle.by_xi, middle.by_eta);
        let arguments = [
            std::array::from_fn(|k| c1 * self.0[k] + h * n1[k]),
            std::array::from_fn(|k| c2 * self.0[k] + h * n2[k]),
            std::array::from_fn(|k| c1 * (2.0 * n1[k])),
            std::array::from_fn(|k| c2 * n1[k] + c1 * n2[k]),
            std::array::from_fn(|k| c2 * (2.0 * n2[k])),
        ];
        let along = correction(values);
        let across = correction(swap(values));
        let first = [along.1, swap(across.1)];
        let gradient = first.map(|first| {
            std::array::from_fn(|k| {
                (0..ARGUMENTS).fold(Vec3::zeros(), |sum, a| sum + arguments[a][k] * first[a])
            })
        });
        Fibres {
            value: [along.0, across.0],
            gradient,
            arguments,
            first,
            second: [along.2, swap(across.2.map(swap))],
            hourglass: self,
        }
    }
}

impl Fibres {
    /// No correction: `F_1 = F_2 = 0`.
    pub const ZERO: Self = Self {
        value: [0.0; 2],
        gradient: [[Vec3::new(0.0, 0.0, 0.0); 4]; 2],
        arguments: [[Vec3::new(0.0, 0.0, 0.0); 4]; ARGUMENTS],
        first: [[0.0; ARGUMENTS]; 2],
        second: [[[0.0; ARGUMENTS]; ARGUMENTS]; 2],
        hourglass: Hourglass([0.0; 4]),
    };

    /// Adds `weights[0] ∂²F_1 + weights[1] ∂²F_2`. Terms that are scalar between the means of the pairs go to `form`,
    /// the others to `tangent`.
    pub fn add_curvature(
        &self,
        weights: [f64; 2],
        form: &mut [[f64; 8]; 8],
        tangent: &mut [[f64; DOFS]; DOFS],
    ) {
        let middle = Plane::at(0.0, 0.0);
        let (g, n1, n2) = (&self.hourglass.0, &middle.by_xi, &middle.by_eta);
        let total = |of: &dyn Fn(usize) -> f64| weights[0] * of(0) + weights[1] * of(1);
        let first: Gradient = std::array::from_fn(|a| total(&|f| self.first[f][a]));
        let both = |x: &[f64; 4], y: &[f64; 4], i: usize, j: usize| x[i] * y[j] + y[i] * x[j];
        for i in 0..4 {
            for j in 0..4 {
                form[i][j] += first[0] * both(g, n1, i, j)
                    + first[1] * both(g, n2, i, j)
                    + first[2] * both(n1, n1, i, j)
                    + first[3] * both(n1, n2, i, j)
                    + first[4] * both(n2, n2, i, j);
            }
        }
        // With respect to the nodes: each takes half of a mean.
        let rows: [[f64; DOFS]; ARGUMENTS] = self
            .arguments
            .map(|by_mean| std::array::from_fn(|dof| 0.5 * by_mean[(dof / 3) % 4][dof % 3]));
        for (a, left) in rows.iter().enumerate() {
            let weighted: [f64; DOFS] = std::array::from_fn(|dof| {
                (0..ARGUMENTS).map(|b| total(&|f| self.second[f][a][b]) * rows[b][dof]).sum()
            });
            for (row, value) in tangent.iter_mut().zip(left) {
                row.iter_mut().zip(&weighted).for_each(|(sum, other)| *sum += value * other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Mat3;

    fn pairs(mean: [Vec3; 4]) -> Pairs {
        Pairs { mean, half: [Vec3::new(0.0, 0.0, 0.4); 4] }
    }

    #[test]
    fn only_in_plane_bending_is_corrected() {
        let skew = [[-1.0, -1.2, 0.0], [1.3, -1.0, 0.0], [1.1, 0.7, 0.0], [-0.8, 1.0, 0.0]];
        let reference = pairs(skew.map(Vec3::from));
        let hourglass = Hourglass::new(&reference);
        // A uniform strain and out-of-plane warping give no correction.
        let f = Mat3::new(1.4, 0.3, 0.1, -0.2, 0.7, 0.0, 0.3, 0.1, 1.0);
        let uniform = reference.mean.map(|x| f * x);
        let normal = (f * Vec3::x()).cross(&(f * Vec3::y())).normalize();
        for warp in [0.0, 0.3] {
            let mut mean = uniform;
            (0..4).for_each(|k| mean[k] += normal * if k % 2 == 0 { warp } else { -warp });
            for value in hourglass.fibres(&pairs(mean)).value {
                assert!(value.abs() < 1e-14, "{warp} {value}");
            }
        }
        // A square with sides of length 2 rotated by 0.1 at either end: F_2 is the square of that, F_1 vanishes.
        let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        let square = pairs(square.map(Vec3::from));
        let mut mean = square.mean;
        (0..4).for_each(|k| mean[k].x += if k % 2 == 0 { 0.1 } else { -0.1 });
        let [along, across] = Hourglass::new(&square).fibres(&pairs(mean)).value;
        assert!(along.abs() < 1e-15 && (across - 0.01).abs() < 1e-15, "{along} {across}");
    }

    #[test]
    fn derivatives_of_the_correction_agree_with_differences() {
        let values = [0.2, -0.1, 1.3, 0.4, 0.8];
        let (_, first, second) = correction(values);
        let step = 1e-5;
        for a in 0..ARGUMENTS {
            let at = |step: f64| {
                let mut other = values;
                other[a] += step;
                correction(other)
            };
            let (more, less) = (at(step), at(-step));
            assert!((first[a] - (more.0 - less.0) / (2.0 * step)).abs() < 1e-9);
            for b in 0..ARGUMENTS {
                assert!((second[a][b] - (more.1[b] - less.1[b]) / (2.0 * step)).abs() < 1e-8);
            }
        }
    }
}
