//! From the right Cauchy-Green tensor to the logarithmic strain and back
//! (Miehe, Apel & Lambrecht 2002, Comput. Methods Appl. Mech. Engrg. 191, 5383-5425).
//!
//! | symbol | meaning |
//! |---|---|
//! | `C` | right Cauchy-Green tensor, eigenvalues `λ_a`, eigenvectors the columns of `Q` |
//! | `E` | logarithmic strain `½ ln C` |
//! | `T`, `D` | stress and tangent of the law in logarithmic strain space [MPa] |
//! | `S` | second Piola-Kirchhoff stress, `S = T : 2 ∂E/∂C` [MPa] |
//!
//! With `f = ½ ln`, in the eigenframe of `C`: `dE_ab = f[λ_a, λ_b] dC_ab` and
//! `d²E_ab = 2 Σ_c f[λ_a, λ_c, λ_b] dC_ac dC_cb`, where `f[..]` are divided differences. Near-equal
//! eigenvalues take the series of the divided difference, so nothing is perturbed and no case is special.

use super::{LogResponse, Material, MaterialError};
use crate::solver::tensor::{self, Mandel, Mandel66, PAIRS};

/// Stress and tangent at a point, as the elements use them.
#[derive(Debug, Clone, Copy)]
pub struct PointResponse {
    /// Second Piola-Kirchhoff stress [MPa].
    pub stress: Mandel,
    /// Tangent `dS/dE_GL` with respect to the Green-Lagrange strain [MPa].
    pub tangent: Mandel66,
    /// Stored elastic energy per reference volume [N mm / mm³].
    pub elastic_energy: f64,
    /// Plastic work per reference volume since the beginning [N mm / mm³].
    pub plastic_work: f64,
}

/// Updates a point at the right Cauchy-Green tensor `c`; with `want_tangent` false the tangent is left zero.
///
/// # Errors
/// [`MaterialError::Collapsed`] unless `c` is positive definite and finite; whatever the law itself returns.
#[inline(always)]
pub fn update(
    material: &dyn Material,
    c: &Mandel,
    old: &[f64],
    new: &mut [f64],
    want_tangent: bool,
) -> Result<PointResponse, MaterialError> {
    let (values, q) = tensor::eigen(c);
    for value in values {
        if !(value > 0.0 && value.is_finite()) {
            return Err(MaterialError::Collapsed { value });
        }
    }
    let to_global = tensor::congruence(&q);
    let log_values = values.map(|value| 0.5 * value.ln());
    let strain: Mandel = std::array::from_fn(|row| {
        let r = &to_global[row];
        r[0] * log_values[0] + r[1] * log_values[1] + r[2] * log_values[2]
    });
    let mut law = LogResponse::zero();
    material.update(&strain, old, new, &mut law)?;

    let first: Mandel = std::array::from_fn(|pair| {
        let (a, b) = PAIRS[pair];
        2.0 * first_difference(values[a], values[b])
    });
    // S = P T with P = R diag(2 f[a,b]) Rᵀ; T in the eigenframe is kept for the second-order term.
    let from_global = tensor::transpose(&to_global);
    let t_eigen = tensor::apply(&from_global, &law.stress);
    let s_eigen: Mandel = std::array::from_fn(|i| first[i] * t_eigen[i]);
    let stress = tensor::apply(&to_global, &s_eigen);
    let mut tangent = [[0.0; 6]; 6];
    if want_tangent {
        let mut eigen_tangent =
            tensor::product(&tensor::product(&from_global, &law.tangent), &to_global);
        for (row, factor) in eigen_tangent.iter_mut().zip(first) {
            for (value, column) in row.iter_mut().zip(first) {
                *value *= factor * column;
            }
        }
        add_second_order(&mut eigen_tangent, &values, &first, &t_eigen);
        tangent = tensor::product(&tensor::product(&to_global, &eigen_tangent), &from_global);
    }
    Ok(PointResponse {
        stress,
        tangent,
        elastic_energy: law.elastic_energy,
        plastic_work: law.plastic_work,
    })
}

/// Logarithmic strain `½ ln C`.
///
/// # Errors
/// [`MaterialError::Collapsed`] unless `c` is positive definite and finite.
pub fn logarithmic_strain(c: &Mandel) -> Result<Mandel, MaterialError> {
    let (values, q) = tensor::eigen(c);
    for value in values {
        if !(value > 0.0 && value.is_finite()) {
            return Err(MaterialError::Collapsed { value });
        }
    }
    let logs = values.map(|value| 0.5 * value.ln());
    Ok(tensor::apply(&tensor::congruence(&q), &[logs[0], logs[1], logs[2], 0.0, 0.0, 0.0]))
}

/// Adds `4 T : ∂²E/∂C²`, everything in the eigenframe; `first` holds `2 f[a,b]` by pair.
///
/// For unit Mandel directions `I = (a,b)`, `J = (c,d)` the bilinear form is
/// `Σ_pqr T_pr f[p,q,r] (H_pq G_qr + G_pq H_qr)`.
#[inline(always)]
fn add_second_order(tangent: &mut Mandel66, values: &[f64; 3], first: &Mandel, t_eigen: &Mandel) {
    // twice[a][b] = f[a,a,b] for a, b of three; distinct = f[0,1,2].
    let (twice, distinct) = second_differences(values, first);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let t = [
        [t_eigen[0], t_eigen[3] * half, t_eigen[5] * half],
        [t_eigen[3] * half, t_eigen[1], t_eigen[4] * half],
        [t_eigen[5] * half, t_eigen[4] * half, t_eigen[2]],
    ];
    // Diagonal-diagonal: H = e_a e_a, only I = J contributes: 2 f[a,a,a] T_aa.
    for a in 0..3 {
        tangent[a][a] += 8.0 * twice[a][a] * t[a][a];
    }
    for shear in 3..6 {
        let (a, b) = PAIRS[shear];
        // Diagonal c with shear (a, b), nonzero only for c in {a, b}: √2 T_ab f[c,c,other].
        for (c, other) in [(a, b), (b, a)] {
            let value = 4.0 * std::f64::consts::SQRT_2 * twice[c][other] * t[a][b];
            tangent[c][shear] += value;
            tangent[shear][c] += value;
        }
        // Shear with itself: T_aa f[a,b,a] + T_bb f[b,a,b].
        tangent[shear][shear] += 4.0 * (t[a][a] * twice[a][b] + t[b][b] * twice[b][a]);
    }
    // Two different shears share one index q: T_pr f[p,q,r].
    for (i, j, p, r) in [(3, 4, 0, 2), (4, 5, 1, 0), (3, 5, 1, 2)] {
        let value = 4.0 * t[p][r] * distinct;
        tangent[i][j] += value;
        tangent[j][i] += value;
    }
}

/// `f[a, b]` of `f = ½ ln` for positive `a`, `b`: `atanh(x) / (x (a + b))`, `x = (a - b) / (a + b)`.
fn first_difference(a: f64, b: f64) -> f64 {
    let x = (a - b) / (a + b);
    let y = x * x;
    let quotient = if y < 2.5e-3 {
        1.0 + y
            * (1.0 / 3.0
                + y * (0.2 + y * (1.0 / 7.0 + y * (1.0 / 9.0 + y * (1.0 / 11.0 + y / 13.0)))))
    } else {
        x.atanh() / x
    };
    quotient / (a + b)
}

/// Relative distance of arguments from their mean below which divided differences take their series.
const NEAR: f64 = 0.05;

/// `f[a,a,b]` for all pairs and `f[0,1,2]`, from the first differences (`first` holds `2 f[a,b]` by pair).
#[inline(always)]
fn second_differences(values: &[f64; 3], first: &Mandel) -> ([[f64; 3]; 3], f64) {
    let mut twice = [[0.0; 3]; 3];
    for a in 0..3 {
        twice[a][a] = -0.25 / (values[a] * values[a]);
    }
    for shear in 3..6 {
        let (a, b) = PAIRS[shear];
        let apart = values[b] - values[a];
        if apart.abs() < 3.0 * NEAR * values[a].min(values[b]) {
            twice[a][b] = near_difference(values[a], values[a], values[b]);
            twice[b][a] = near_difference(values[b], values[b], values[a]);
        } else {
            twice[a][b] = 0.5 * (first[shear] - first[a]) / apart;
            twice[b][a] = 0.5 * (first[b] - first[shear]) / apart;
        }
    }
    // The pair farthest apart divides best: f[a,b,c] = (f[a,c] - f[c,b]) / (a - b).
    let (shear, apart) =
        (3..6).map(|shear| (shear, values[PAIRS[shear].0] - values[PAIRS[shear].1])).fold(
            (3, 0.0),
            |best: (usize, f64), now| if now.1.abs() > best.1.abs() { now } else { best },
        );
    let least = values[0].min(values[1]).min(values[2]);
    let distinct = if apart.abs() < 3.0 * NEAR * least {
        near_difference(values[0], values[1], values[2])
    } else {
        // Shears are the pairs 01, 12, 20: the two others share the third index.
        let (with_first, with_second) = match shear {
            3 => (first[5], first[4]),
            4 => (first[3], first[5]),
            _ => (first[4], first[3]),
        };
        0.5 * (with_first - with_second) / apart
    };
    (twice, distinct)
}

/// `f[a, b, c]` of `f = ½ ln` for arguments near each other:
/// `½ Σ_k (-1)^{k+1}/k h_{k-2}(δ) / m²` (complete homogeneous polynomials of the relative deviations `δ` from
/// their mean `m`).
fn near_difference(a: f64, b: f64, c: f64) -> f64 {
    /// `(-1)^{k+1} / k`, k = 3 ..
    const SERIES: [f64; 16] = [
        1.0 / 3.0,
        -0.25,
        0.2,
        -1.0 / 6.0,
        1.0 / 7.0,
        -0.125,
        1.0 / 9.0,
        -0.1,
        1.0 / 11.0,
        -1.0 / 12.0,
        1.0 / 13.0,
        -1.0 / 14.0,
        1.0 / 15.0,
        -1.0 / 16.0,
        1.0 / 17.0,
        -1.0 / 18.0,
    ];
    let mean = (a + b + c) / 3.0;
    let (x, y, z) = (a / mean - 1.0, b / mean - 1.0, c / mean - 1.0);
    let spread = x.abs().max(y.abs()).max(z.abs());
    let (mut one, mut two, mut three) = (1.0, 1.0, 1.0);
    let mut sum = -0.5;
    let mut size = 1.0;
    for coefficient in SERIES {
        one *= z;
        two = y * two + one;
        three = x * three + two;
        sum += coefficient * three;
        size *= spread;
        if size < 1e-18 {
            break;
        }
    }
    0.5 * sum / (mean * mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the divided difference written out, where that does not cancel.
    #[test]
    fn second_differences_agree_across_the_switch() {
        let f = |a: f64, b: f64| if a == b { 0.5 / a } else { 0.5 * (a / b).ln() / (a - b) };
        for spread in [0.5, 0.2, 0.16, 0.155, 0.145, 0.14, 0.1] {
            let values: [f64; 3] = [1.3 * (1.0 + spread), 1.3, 1.3 * (1.0 + 0.4 * spread)];
            let first: Mandel = std::array::from_fn(|pair| {
                let (a, b) = PAIRS[pair];
                2.0 * first_difference(values[a], values[b])
            });
            let (twice, distinct) = second_differences(&values, &first);
            for a in 0..3 {
                for b in 0..3 {
                    if a != b {
                        let (x, y) = (values[a], values[b]);
                        let exact = (f(x, y) - f(x, x)) / (y - x);
                        assert!((twice[a][b] / exact - 1.0).abs() < 1e-12, "{spread} {a} {b}");
                    }
                }
            }
            let [x, y, z] = values;
            let exact = (f(x, z) - f(z, y)) / (x - y);
            assert!((distinct / exact - 1.0).abs() < 1e-12, "{spread}");
        }
        let equal = [2.0, 2.0, 2.0];
        let first = [0.5; 6];
        let (twice, distinct) = second_differences(&equal, &first);
        assert!((twice[0][1] + 0.0625).abs() < 1e-16 && (distinct + 0.0625).abs() < 1e-16);
    }
}
