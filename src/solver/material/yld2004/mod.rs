//! Yld2004-18p: Barlat's non-quadratic yield function for full stress states
//! (Barlat et al. 2005, Int. J. Plasticity 21, 1009-1039).
//!
//! | symbol | meaning |
//! |---|---|
//! | `L'`, `L''` | linear transformations `C' dev`, `C'' dev` of the stress |
//! | `s'_i`, `s''_j` | principal values of `L' T` and `L'' T` |
//! | `φ` | `Σ_ij |s'_i - s''_j|^a`, with `σ̄ = (φ / 4)^(1/a)` |
//!
//! With both transformations the identity this is Hosford's isotropic function, and with `a = 2` (or 4) von Mises.
//! `φ` is convex for every `a >= 1` and all coefficients. Value, gradient and Hessian are those of isotropic
//! functions of `L' T` and `L'' T` in their eigenframes. Equal principal values are a limit of the divided
//! differences, not a special case.

mod phi;

use self::phi::Phi;
use super::eigen::{Eigen, eigen_batch, eigen_pair};
use super::hill48::ISOTROPY_TOLERANCE_REL;
use crate::numbers::lanes::{Eight, POINTS};
use crate::numbers::tensor::{self, Mandel, Mandel66};

/// Coefficients of one transformation, in the order of [`NAMES`].
pub type Coefficients = [f64; 9];
/// Names of the coefficients as published; 44, 55, 66 belong to the shears 23 (yz), 31 (zx) and 12 (xy).
pub const NAMES: [&str; 9] = ["c12", "c13", "c21", "c23", "c31", "c32", "c44", "c55", "c66"];
/// Maximum exponent.
pub const EXPONENT_MAX: f64 = 60.0;
/// Relative distance of principal values below which the divided difference is integrated by Gauss quadrature.
const COINCIDENCE_TOLERANCE: f64 = 1e-3;

/// The yield function, scaled so that tension along the rolling direction gives the stress itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Yld2004 {
    exponent: f64,
    /// `(a - 2) / 2` if it is an integer: powers are then products.
    half: Option<i32>,
    maps: [Mandel66; 2],
}

/// Parameters that define no valid yield surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("Yld2004-18p: {field} is {found}, must be {allowed}")]
pub struct Yld2004Error {
    /// `exponent`, a coefficient of `first` or `second`, or a quantity derived from them.
    pub field: String,
    /// Value found.
    pub found: f64,
    /// Allowed values.
    pub allowed: &'static str,
}

/// Value, gradient and Hessian of a yield function at a stress.
#[derive(Debug, Clone, Copy)]
pub struct Derivatives {
    /// Equivalent stress `σ̄` [MPa].
    pub value: f64,
    /// `∂σ̄/∂T`.
    pub gradient: Mandel,
    /// `∂²σ̄/∂T²` [1/MPa].
    pub hessian: Mandel66,
}

/// Principal values and directions of both transformed stresses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Principal([Eigen; 2]);

/// One transformed stress in its eigenframe.
struct Frame {
    values: [f64; 3],
    /// Map from the stress to the eigenframe of the transformed stress.
    map: Mandel66,
}

impl Yld2004 {
    /// The function with exponent `a` (8 for face-centred, 6 for body-centred cubic metals).
    ///
    /// # Errors
    /// [`Yld2004Error`] if `a` is outside [2, 60], a coefficient is not finite, or the surface is not closed (some
    /// stress never yields).
    pub fn new(
        exponent: f64,
        first: &Coefficients,
        second: &Coefficients,
    ) -> Result<Self, Yld2004Error> {
        if !(2.0..=EXPONENT_MAX).contains(&exponent) {
            let field = "exponent".into();
            return Err(Yld2004Error { field, found: exponent, allowed: "in [2, 60]" });
        }
        for (list, coefficients) in [("first", first), ("second", second)] {
            for (k, &found) in coefficients.iter().enumerate() {
                if found.is_nan() || found.abs() >= 1e3 {
                    let field = format!("{list}[{k}] ({})", NAMES[k]);
                    return Err(Yld2004Error { field, found, allowed: "in (-1000, 1000)" });
                }
            }
        }
        let half = 0.5 * exponent - 1.0;
        let mut law = Self {
            exponent,
            half: (half.fract() == 0.0).then_some(half as i32),
            maps: [transformation(first), transformation(second)],
        };
        let closed = law.closedness();
        if closed.is_nan() || closed <= 1e-6 {
            return Err(Yld2004Error {
                field: "first and second, smallest over largest eigenvalue of the two together"
                    .into(),
                found: closed,
                allowed: "above 1e-6, so that every shear and tension yields",
            });
        }
        let rolling = law.equivalent(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for value in law.maps.iter_mut().flatten().flatten() {
            *value /= rolling;
        }
        Ok(law)
    }

    /// Hosford's isotropic function.
    ///
    /// # Errors
    /// [`Yld2004Error`] when the exponent is outside [2, 60].
    pub fn hosford(exponent: f64) -> Result<Self, Yld2004Error> {
        Self::new(exponent, &[1.0; 9], &[1.0; 9])
    }

    /// Whether both transformations are a multiple of the deviator, within [`ISOTROPY_TOLERANCE_REL`].
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        let deviator = transformation(&[1.0; 9]);
        self.maps.iter().all(|map| {
            let factor = map[3][3];
            let pairs = map.as_flattened().iter().zip(deviator.as_flattened());
            pairs
                .into_iter()
                .all(|(a, b)| (a - factor * b).abs() <= ISOTROPY_TOLERANCE_REL * factor.abs())
        })
    }

    /// The exponent `a`.
    #[must_use]
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// Equivalent stress [MPa].
    #[must_use]
    pub fn equivalent(&self, t: &Mandel) -> f64 {
        self.equivalent_of(&Principal(eigen_pair(&self.transformed(t))))
    }

    /// Principal values and directions of the transformed stresses of the first `count` of eight points.
    pub(super) fn principal(&self, stress: &[Eight; 6], count: usize) -> [Principal; POINTS] {
        let of = |map: &Mandel66| {
            let mut transformed = [[0.0; POINTS]; 6];
            for (row, factors) in transformed.iter_mut().zip(map) {
                for (of, factor) in stress.iter().zip(factors) {
                    row.iter_mut().zip(of).for_each(|(sum, value)| *sum += factor * value);
                }
            }
            eigen_batch(&transformed, count)
        };
        let (one, two) = (of(&self.maps[0]), of(&self.maps[1]));
        std::array::from_fn(|k| Principal([one[k], two[k]]))
    }

    /// [`Self::equivalent`] from the principal values of the transformed stresses; NaN if one of them is NaN.
    pub(super) fn equivalent_of(&self, &Principal([(one, _), (two, _)]): &Principal) -> f64 {
        let largest = largest_difference(&one, &two);
        if largest == 0.0 {
            return 0.0;
        }
        let mut sum = 0.0;
        for a in one {
            for b in two {
                let d = (a - b) / largest;
                sum += self.power(d) * d * d;
            }
        }
        largest * (0.25 * sum).powf(1.0 / self.exponent)
    }

    /// Value, gradient and Hessian; all zero at zero stress, and NaN at one that is NaN.
    #[must_use]
    pub fn derivatives(&self, t: &Mandel) -> Derivatives {
        self.derivatives_of(&Principal(eigen_pair(&self.transformed(t))))
    }

    /// [`Self::derivatives`] from the principal values of the transformed stresses.
    pub(super) fn derivatives_of(&self, &Principal([first, second]): &Principal) -> Derivatives {
        let [one, two] = [Frame::new(&self.maps[0], first), Frame::new(&self.maps[1], second)];
        let largest = largest_difference(&one.values, &two.values);
        if largest == 0.0 {
            return Derivatives { value: 0.0, gradient: [0.0; 6], hessian: [[0.0; 6]; 6] };
        }
        // Computed at the stress T / largest; the degree of homogeneity of each result restores the scale.
        let a = self.exponent;
        let phi = self.phi(one.values.map(|x| x / largest), two.values.map(|x| x / largest));
        let value = (0.25 * phi.value).powf(1.0 / a);
        let scale = value / (a * phi.value);
        let [g_s, g_z] = &phi.gradients;
        let gradient: Mandel = std::array::from_fn(|m| {
            let sum: f64 = (0..3).map(|i| g_s[i] * one.map[i][m] + g_z[i] * two.map[i][m]).sum();
            scale * sum
        });
        let mut hessian = phi.hessian(&one.map, &two.map);
        for m in 0..6 {
            for n in m..6 {
                let entry = scale * hessian[m][n] - (a - 1.0) / value * gradient[m] * gradient[n];
                hessian[m][n] = entry / largest;
                hessian[n][m] = hessian[m][n];
            }
        }
        Derivatives { value: value * largest, gradient, hessian }
    }

    /// `φ` and its derivatives at principal values `s` and `z` of the two transformed stresses.
    #[inline]
    fn phi(&self, s: [f64; 3], z: [f64; 3]) -> Phi {
        let a = self.exponent;
        let mut value = 0.0;
        let (mut differences, mut slope, mut mixed) = ([[0.0; 3]; 3], [[0.0; 3]; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let d = s[i] - z[j];
                let power = self.power(d);
                value += power * d * d;
                differences[i][j] = d;
                slope[i][j] = a * power * d;
                mixed[i][j] = a * (a - 1.0) * power;
            }
        }
        let transposed_slope = scaled_transpose(&slope, -1.0);
        Phi {
            value,
            gradients: [&slope, &transposed_slope].map(|of| of.map(|row| row.iter().sum::<f64>())),
            hessians: [
                self.eigenframe_hessian(&differences, &slope, &mixed),
                self.eigenframe_hessian(
                    &scaled_transpose(&differences, -1.0),
                    &transposed_slope,
                    &scaled_transpose(&mixed, 1.0),
                ),
            ],
            mixed,
        }
    }

    /// `L' T` and `L'' T`.
    fn transformed(&self, t: &Mandel) -> [Mandel; 2] {
        self.maps.each_ref().map(|map| tensor::apply(map, t))
    }

    /// `|d|^(a - 2)`.
    fn power(&self, d: f64) -> f64 {
        match self.half {
            Some(half) => (d * d).powi(half),
            None => d.abs().powf(self.exponent - 2.0),
        }
    }

    /// Part of `∂²φ/∂S²` that is diagonal in the eigenframe of `S`: second derivatives with respect to its principal
    /// values, and divided differences of the first derivatives for the rotation of the frame. `differences` are the
    /// differences of each principal value from those of the other stress; `slope` and `second` are `h` and `h'`
    /// there.
    fn eigenframe_hessian(
        &self,
        differences: &[[f64; 3]; 3],
        slope: &[[f64; 3]; 3],
        second: &[[f64; 3]; 3],
    ) -> [f64; 6] {
        std::array::from_fn(|k| {
            let (i, j) = tensor::PAIRS[k];
            if i == j {
                return second[i].iter().sum();
            }
            let of =
                |k: usize| [(differences[i][k], slope[i][k]), (differences[j][k], slope[j][k])];
            (0..3).map(|k| self.divided_difference(of(k))).sum()
        })
    }

    /// `(h(x) - h(y)) / (x - y)` of `h(x) = a |x|^(a-2) x` from `(x, h(x))` and `(y, h(y))`, including the limit
    /// `x = y`.
    fn divided_difference(&self, [(x, h_x), (y, h_y)]: [(f64, f64); 2]) -> f64 {
        if (x - y).abs() > COINCIDENCE_TOLERANCE {
            return (h_x - h_y) / (x - y);
        }
        // Mean of h' between y and x by three-point Gauss quadrature.
        let a = self.exponent;
        let slope = |t: f64| a * (a - 1.0) * self.power(y + t * (x - y));
        let away = 0.5 * 0.6_f64.sqrt();
        (5.0 * slope(0.5 - away) + 8.0 * slope(0.5) + 5.0 * slope(0.5 + away)) / 18.0
    }

    /// Smallest over largest eigenvalue of the quadratic form with the same null space as `σ̄`.
    fn closedness(&self) -> f64 {
        let mut form = nalgebra::SMatrix::<f64, 6, 6>::zeros();
        let trace = |map: &Mandel66, c: usize| map[0][c] + map[1][c] + map[2][c];
        for r in 0..6 {
            for c in 0..6 {
                let mut sum = 0.0;
                for map in &self.maps {
                    sum += (0..6).map(|k| map[k][r] * map[k][c]).sum::<f64>()
                        - trace(map, r) * trace(map, c) / 3.0;
                }
                let gap = |c| trace(&self.maps[0], c) - trace(&self.maps[1], c);
                sum += gap(r) * gap(c);
                // The hydrostatic direction is free by construction.
                form[(r, c)] = sum + if r < 3 && c < 3 { 1.0 / 3.0 } else { 0.0 };
            }
        }
        let values = form.symmetric_eigenvalues();
        values.min() / values.max()
    }
}

impl Frame {
    fn new(map: &Mandel66, (values, q): Eigen) -> Self {
        let from_frame = tensor::congruence(&q);
        let mut out = [[0.0; 6]; 6];
        for (r, out) in out.iter_mut().enumerate() {
            for (c, out) in out.iter_mut().enumerate() {
                // Transformations couple only normal stresses with each other.
                let rows = if c < 3 { 0..3 } else { c..c + 1 };
                *out = rows.map(|k| from_frame[k][r] * map[k][c]).sum();
            }
        }
        Self { values, map: out }
    }
}

/// Transpose times a number.
fn scaled_transpose(m: &[[f64; 3]; 3], by: f64) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| by * m[j][i]))
}

/// Largest `|s'_i - s''_j|`; NaN where one is.
fn largest_difference(one: &[f64; 3], two: &[f64; 3]) -> f64 {
    let mut largest = 0.0_f64;
    for a in one {
        for b in two {
            let difference = (a - b).abs();
            // `f64::max` would pass over NaN.
            if difference > largest || difference.is_nan() {
                largest = difference;
            }
        }
    }
    largest
}

/// `C dev` in the Mandel basis.
fn transformation(c: &Coefficients) -> Mandel66 {
    let normal = [[0.0, -c[0], -c[1]], [-c[2], 0.0, -c[3]], [-c[4], -c[5], 0.0]];
    let mut map = [[0.0; 6]; 6];
    for (row, line) in normal.iter().enumerate() {
        let mean = line.iter().sum::<f64>() / 3.0;
        for column in 0..3 {
            map[row][column] = line[column] - mean;
        }
    }
    (map[3][3], map[4][4], map[5][5]) = (c[8], c[6], c[7]);
    map
}

#[cfg(test)]
mod tests;
