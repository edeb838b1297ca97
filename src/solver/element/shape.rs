//! Trilinear shape functions and the reference geometry of integration points.

use kanagata_geometry::{Mat3, Vec3};

/// Natural coordinates (±1) of the eight nodes.
pub(crate) const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Reference geometry of one integration point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointGeometry {
    /// `∂N_a/∂X_J` [1/mm]: `gradient[J][a]`.
    pub gradient: [[f64; 8]; 3],
    /// Reference volume of the point [mm³].
    pub weight: f64,
}

/// Derivatives of the shape functions with respect to the natural coordinates: `[direction][node]`.
#[must_use]
pub(crate) fn natural_gradient(xi: [f64; 3]) -> [[f64; 8]; 3] {
    std::array::from_fn(|direction| {
        CORNERS.map(|c| {
            let mut product = 0.125 * c[direction];
            for other in 0..3 {
                if other != direction {
                    product *= 1.0 + c[other] * xi[other];
                }
            }
            product
        })
    })
}

/// Jacobian `∂X_i/∂ξ_j` of the isoparametric map; its columns are the covariant base vectors.
#[must_use]
pub(crate) fn jacobian(nodes: &[Vec3; 8], xi: [f64; 3]) -> Mat3 {
    jacobian_at(nodes, &natural_gradient(xi))
}

/// Jacobian from given gradients of the shape functions.
fn jacobian_at(nodes: &[Vec3; 8], gradient: &[[f64; 8]; 3]) -> Mat3 {
    let mut jacobian = Mat3::zeros();
    for (a, node) in nodes.iter().enumerate() {
        for j in 0..3 {
            for i in 0..3 {
                jacobian[(i, j)] += node[i] * gradient[j][a];
            }
        }
    }
    jacobian
}

/// Natural coordinates of the point `x`, by Newton's method. `None` if the iteration leaves [`XI_MAX`] or does not
/// converge.
pub fn natural_coordinates(nodes: &[Vec3; 8], x: &Vec3) -> Option<Vec3> {
    const ITERATIONS_MAX: usize = 12;
    const XI_MAX: f64 = 10.0;
    let mut xi = Vec3::zeros();
    for _ in 0..ITERATIONS_MAX {
        let shape_function =
            |c: &[f64; 3]| (0..3).map(|k| 0.5 * (1.0 + c[k] * xi[k])).product::<f64>();
        let position: Vec3 =
            nodes.iter().zip(&CORNERS).map(|(node, c)| node * shape_function(c)).sum();
        let step = jacobian(nodes, xi.into()).try_inverse()? * (x - position);
        xi += step;
        if step.norm() < 1e-9 {
            return Some(xi);
        }
        if xi.abs().max() > XI_MAX {
            return None;
        }
    }
    None
}

/// Geometry of the point at `xi` with quadrature weight `quadrature`. `Err(det)` if the Jacobian determinant is not
/// positive (inverted or flat reference element).
pub(crate) fn point_geometry(
    nodes: &[Vec3; 8],
    xi: [f64; 3],
    quadrature: f64,
) -> Result<PointGeometry, f64> {
    let natural = natural_gradient(xi);
    let jacobian = jacobian(nodes, xi);
    let det = jacobian.determinant();
    let inverse = jacobian.try_inverse().filter(|_| det > 0.0 && det.is_finite()).ok_or(det)?;
    let gradient = std::array::from_fn(|direction| {
        std::array::from_fn(|a| (0..3).map(|k| natural[k][a] * inverse[(k, direction)]).sum())
    });
    Ok(PointGeometry { gradient, weight: det * quadrature })
}

/// The 2 x 2 x 2 Gauss points in the order of the nodes.
#[must_use]
pub(crate) fn gauss_2x2x2() -> [[f64; 3]; 8] {
    let g = 1.0 / 3.0_f64.sqrt();
    CORNERS.map(|c| c.map(|x| x * g))
}

/// Reference geometry of the eight Gauss points.
///
/// # Errors
/// The first Jacobian determinant [mm³] that is not positive.
pub fn reference_points(nodes: &[Vec3; 8]) -> Result<[PointGeometry; 8], f64> {
    let zero = PointGeometry { gradient: [[0.0; 8]; 3], weight: 0.0 };
    let mut points = [zero; 8];
    for (point, xi) in points.iter_mut().zip(gauss_2x2x2()) {
        *point = point_geometry(nodes, xi, 1.0)?;
    }
    Ok(points)
}

/// Checks the Jacobian determinant at the eight Gauss points, without the gradients of [`reference_points`].
#[derive(Debug, Clone)]
pub struct ReferenceCheck([[[f64; 8]; 3]; 8]);

impl ReferenceCheck {
    /// Evaluates the gradients of the shape functions at the points.
    #[must_use]
    pub fn new() -> Self {
        Self(gauss_2x2x2().map(natural_gradient))
    }

    /// Checks the reference geometry of one element.
    ///
    /// # Errors
    /// The first Jacobian determinant [mm³] that is not positive.
    pub fn check(&self, nodes: &[Vec3; 8]) -> Result<(), f64> {
        let determinants = self.0.iter().map(|gradient| jacobian_at(nodes, gradient).determinant());
        let mut bad = determinants.filter(|det| !(*det > 0.0 && det.is_finite()));
        bad.next().map_or(Ok(()), Err)
    }
}

impl Default for ReferenceCheck {
    fn default() -> Self {
        Self::new()
    }
}

/// Gauss-Legendre points and weights on [-1, 1], ascending; roots of the Legendre polynomial by Newton's method.
#[must_use]
pub(crate) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let legendre = |x: f64| {
        let (mut before, mut value) = (1.0, x);
        for k in 2..=count {
            let k = k as f64;
            (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
        }
        (value, n * (x * value - before) / (x * x - 1.0))
    };
    let root = |index: usize| {
        let mut x = -(std::f64::consts::PI * (index as f64 + 0.75) / (n + 0.5)).cos();
        for _ in 0..20 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        if 2 * index + 1 == count { 0.0 } else { x }
    };
    let lower: Vec<f64> = (0..count.div_ceil(2)).map(root).collect();
    let mirrored = lower[..count / 2].iter().rev().map(|x| -x);
    let points = lower.iter().copied().chain(mirrored);
    points.map(|x| (x, 2.0 / ((1.0 - x * x) * legendre(x).1.powi(2)))).collect()
}

/// Points and weights through the thickness on [-1, 1], ascending.
///
/// An even `count` from 4 to 10: half of it in each half of the interval, with equal weights (Chebyshev's rule, exact for
/// polynomials of degree 3). The stress of a bent sheet changes its sign at the middle surface. A Gauss rule over the whole
/// interval misses the moment by 3 to 6 % there; six points in halves miss 1 % while the elastic core is below 0.17 of the
/// thickness, and 2 % for any core. Where tension has moved that place, equal weights miss least. Other counts:
/// Gauss-Legendre.
#[must_use]
pub(crate) fn thickness_rule(count: usize) -> Vec<(f64, f64)> {
    let Some(upper) = (count.is_multiple_of(2)).then(|| chebyshev_upper(count / 2)).flatten()
    else {
        return gauss_legendre(count);
    };
    let whole = upper.iter().rev().map(|x| -x).chain(upper.iter().copied().filter(|x| *x > 0.0));
    let half: Vec<f64> = whole.map(|x| 0.5 + 0.5 * x).collect();
    let points = half.iter().rev().map(|x| -x).chain(half.iter().copied());
    points.map(|x| (x, 2.0 / count as f64)).collect()
}

/// Points >= 0 of Chebyshev's rule with equal weights on [-1, 1], ascending; closed forms for 2 to 5 points.
fn chebyshev_upper(count: usize) -> Option<Vec<f64>> {
    let pair =
        |mean: f64, difference: f64| [(mean - difference).sqrt(), (mean + difference).sqrt()];
    match count {
        2 => Some(vec![(1.0_f64 / 3.0).sqrt()]),
        3 => Some(vec![0.0, 0.5_f64.sqrt()]),
        4 => Some(pair(1.0 / 3.0, 2.0 / (3.0 * 5.0_f64.sqrt())).to_vec()),
        5 => {
            let [a, b] = pair(5.0 / 12.0, 11.0_f64.sqrt() / 12.0);
            Some(vec![0.0, a, b])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_of_two_halves_integrate_cubes_and_their_absolute_values_exactly() {
        for count in [4, 6, 8, 10] {
            let rule = thickness_rule(count);
            assert_eq!(rule.len(), count);
            assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0), "{rule:?}");
            for power in 0..=3 {
                let sum = |f: &dyn Fn(f64) -> f64| rule.iter().map(|(x, w)| w * f(*x)).sum::<f64>();
                let exact = 2.0 / (power as f64 + 1.0);
                let (signed, absolute) = (sum(&|x| x.powi(power)), sum(&|x| x.abs().powi(power)));
                assert!((absolute - exact).abs() < 1e-14, "{count} points, power {power}");
                let exact = if power % 2 == 0 { exact } else { 0.0 };
                assert!((signed - exact).abs() < 1e-14, "{count} points, power {power}");
            }
        }
        assert_eq!(thickness_rule(5), gauss_legendre(5));
    }

    /// Moment of a bilinear law (yield strain 0.00088, hardening E/200) in pure bending, against a quadrature with many
    /// points: largest error over R/t from 5 to 100.
    #[test]
    fn six_points_bend_within_one_per_cent() {
        let stress = |e: f64| {
            let beyond = (e.abs() - 8.8e-4).max(0.0);
            e.signum() * (e.abs() - beyond + beyond / 200.0)
        };
        let moment = |rule: &[(f64, f64)], radius: f64| -> f64 {
            rule.iter().map(|(z, w)| w * z * stress(0.5 * z / radius)).sum()
        };
        let fine: Vec<(f64, f64)> =
            (0..20_000).map(|k| ((f64::from(k) + 0.5) / 1e4 - 1.0, 1e-4)).collect();
        let error = |count: usize| {
            let off = |radius: f64| {
                (moment(&thickness_rule(count), radius) / moment(&fine, radius) - 1.0).abs()
            };
            [5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0]
                .map(off)
                .into_iter()
                .fold(0.0, f64::max)
        };
        let errors = [4, 5, 6, 8, 9, 10].map(error);
        assert!(errors[2] < 0.0065 && errors[3] < 0.011 && errors[5] < 0.0075, "{errors:?}");
        assert!(errors[0] < 0.0115 && errors[1] > 0.04 && errors[4] > 0.012, "{errors:?}");
    }

    #[test]
    fn gauss_rules_integrate_polynomials_exactly() {
        for count in 2..=9 {
            let rule = gauss_legendre(count);
            for power in 0..2 * count {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "{count} points, power {power}: {sum}");
            }
        }
    }
}
