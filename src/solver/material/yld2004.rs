//! Yld2004-18p: Barlat's non-quadratic yield function for full stress states
//! (Barlat et al. 2005, Int. J. Plasticity 21, 1009-1039).
//!
//! | symbol | meaning |
//! |---|---|
//! | `L'`, `L''` | linear transformations `C' dev`, `C'' dev` of the stress |
//! | `s'_i`, `s''_j` | principal values of `L' T` and `L'' T` |
//! | `φ` | `Σ_ij |s'_i - s''_j|^a`, with `σ̄ = (φ / 4)^(1/a)` |
//!
//! With both transformations the identity this is Hosford's isotropic function, and with `a = 2` (or 4)
//! von Mises. `φ` is convex for every `a >= 1` and every choice of the coefficients. Value, gradient and
//! Hessian are those of isotropic functions of `L' T` and `L'' T`, taken in their eigenframes: equal
//! principal values are a limit of the divided differences, not a special case.

use crate::solver::tensor::{self, Mandel, Mandel66};

/// Coefficients of one transformation, in the order of [`NAMES`].
pub type Coefficients = [f64; 9];
/// Names of the coefficients as published; 44, 55, 66 belong to the shears 23 (yz), 31 (zx) and 12 (xy).
pub const NAMES: [&str; 9] = ["c12", "c13", "c21", "c23", "c31", "c32", "c44", "c55", "c66"];
/// Largest exponent taken.
pub const MAX_EXPONENT: f64 = 60.0;
/// Principal values closer than this (relative) take the integral form of the divided difference.
const CLOSE: f64 = 1e-3;

/// The yield function, scaled so that tension along the rolling direction gives the stress itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Yld2004 {
    exponent: f64,
    maps: [Mandel66; 2],
}

/// Numbers that are no yield surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("Yld2004-18p: {field} is {found}, must be {allowed}")]
pub struct Yld2004Error {
    /// Which number.
    pub field: &'static str,
    /// What was found.
    pub found: f64,
    /// What is allowed.
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

/// One transformed stress in its eigenframe.
struct Frame {
    values: [f64; 3],
    /// From stress to the eigenframe of the transformed stress.
    map: Mandel66,
}

impl Yld2004 {
    /// The function with exponent `a` (8 for face-centred, 6 for body-centred cubic metals).
    ///
    /// # Errors
    /// [`Yld2004Error`] when `a` is outside [2, 60], a coefficient is not finite, or some stress would
    /// never yield (the surface is not closed).
    pub fn new(
        exponent: f64,
        first: &Coefficients,
        second: &Coefficients,
    ) -> Result<Self, Yld2004Error> {
        if !(2.0..=MAX_EXPONENT).contains(&exponent) {
            return Err(Yld2004Error { field: "exponent", found: exponent, allowed: "in [2, 60]" });
        }
        for (name, &found) in NAMES.iter().zip(first).chain(NAMES.iter().zip(second)) {
            if found.is_nan() || found.abs() >= 1e3 {
                return Err(Yld2004Error { field: name, found, allowed: "in (-1000, 1000)" });
            }
        }
        let mut law = Self { exponent, maps: [transformation(first), transformation(second)] };
        let closed = law.closedness();
        if closed.is_nan() || closed <= 1e-6 {
            return Err(Yld2004Error {
                field: "smallest over largest eigenvalue of the transformations together",
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

    /// The exponent `a`.
    #[must_use]
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// Equivalent stress [MPa].
    #[must_use]
    pub fn equivalent(&self, t: &Mandel) -> f64 {
        let [one, two] = [0, 1].map(|k| tensor::eigen(&tensor::apply(&self.maps[k], t)).0);
        let largest = largest_difference(&one, &two);
        if largest == 0.0 {
            return 0.0;
        }
        let mut sum = 0.0;
        for a in one {
            for b in two {
                sum += ((a - b) / largest).abs().powf(self.exponent);
            }
        }
        largest * (0.25 * sum).powf(1.0 / self.exponent)
    }

    /// Value, gradient and Hessian; all zero at zero stress.
    #[must_use]
    pub fn derivatives(&self, t: &Mandel) -> Derivatives {
        let [one, two] = [0, 1].map(|k| Frame::new(&self.maps[k], t));
        let largest = largest_difference(&one.values, &two.values);
        if largest.is_nan() || largest <= 0.0 {
            return Derivatives { value: 0.0, gradient: [0.0; 6], hessian: [[0.0; 6]; 6] };
        }
        // Everything below is at the stress T / largest; the degree of each result puts it back.
        let a = self.exponent;
        let s = one.values.map(|x| x / largest);
        let z = two.values.map(|x| x / largest);
        let mut phi = 0.0;
        let mut cross = [[0.0; 3]; 3];
        let (mut g_s, mut g_z) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let d = s[i] - z[j];
                let power = d.abs().powf(a - 2.0);
                phi += power * d * d;
                g_s[i] += a * power * d;
                g_z[j] -= a * power * d;
                cross[i][j] = a * (a - 1.0) * power;
            }
        }
        let d_s = self.eigenframe_hessian(&s, &z, &std::array::from_fn(|i| cross[i].iter().sum()));
        let columns = std::array::from_fn(|j| (0..3).map(|i| cross[i][j]).sum());
        let d_z = self.eigenframe_hessian(&z, &s, &columns);

        let value = (0.25 * phi).powf(1.0 / a);
        let scale = value / (a * phi);
        let gradient: Mandel = std::array::from_fn(|m| {
            let sum: f64 = (0..3).map(|i| g_s[i] * one.map[i][m] + g_z[i] * two.map[i][m]).sum();
            scale * sum
        });
        let mut hessian = [[0.0; 6]; 6];
        for m in 0..6 {
            for n in m..6 {
                let mut sum = 0.0;
                for k in 0..6 {
                    sum += d_s[k] * one.map[k][m] * one.map[k][n]
                        + d_z[k] * two.map[k][m] * two.map[k][n];
                }
                for i in 0..3 {
                    for j in 0..3 {
                        sum -= cross[i][j]
                            * (one.map[i][m] * two.map[j][n] + two.map[j][m] * one.map[i][n]);
                    }
                }
                let entry = scale * sum - (a - 1.0) / value * gradient[m] * gradient[n];
                hessian[m][n] = entry / largest;
                hessian[n][m] = hessian[m][n];
            }
        }
        Derivatives { value: value * largest, gradient, hessian }
    }

    /// The part of `∂²φ/∂S²` that is diagonal in the eigenframe of `S`: second derivatives with respect to
    /// its principal values, then divided differences of the first ones for the turning of the frame.
    fn eigenframe_hessian(&self, s: &[f64; 3], z: &[f64; 3], second: &[f64; 3]) -> [f64; 6] {
        std::array::from_fn(|k| {
            if k < 3 {
                return second[k];
            }
            let (i, j) = tensor::PAIRS[k];
            z.iter().map(|z| self.divided_difference(s[i] - z, s[j] - z)).sum()
        })
    }

    /// `(h(x) - h(y)) / (x - y)` of `h(x) = a |x|^(a-2) x`, also for `x = y`.
    fn divided_difference(&self, x: f64, y: f64) -> f64 {
        let a = self.exponent;
        if (x - y).abs() > CLOSE {
            let h = |x: f64| a * x.abs().powf(a - 2.0) * x;
            return (h(x) - h(y)) / (x - y);
        }
        // The mean of h' between y and x by Gauss' rule with three points.
        let slope = |t: f64| a * (a - 1.0) * (y + t * (x - y)).abs().powf(a - 2.0);
        let away = 0.5 * 0.6_f64.sqrt();
        (5.0 * slope(0.5 - away) + 8.0 * slope(0.5) + 5.0 * slope(0.5 + away)) / 18.0
    }

    /// Smallest over largest eigenvalue of the quadratic form that vanishes exactly where `σ̄` does.
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
    fn new(map: &Mandel66, t: &Mandel) -> Self {
        let (values, q) = tensor::eigen(&tensor::apply(map, t));
        let to_frame = tensor::transpose(&tensor::congruence(&q));
        Self { values, map: tensor::product(&to_frame, map) }
    }
}

fn largest_difference(one: &[f64; 3], two: &[f64; 3]) -> f64 {
    let mut largest = 0.0_f64;
    for a in one {
        for b in two {
            largest = largest.max((a - b).abs());
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
