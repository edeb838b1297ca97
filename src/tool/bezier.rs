//! Conversion between Bezier and Nagata patches (Eq. 13-15), and the monomial form (Eq. 4-6).
//!
//! The paper's Eq. 14 has the coefficient +2 for P21 in the term of `eta^2 zeta^2`. The correct coefficient is -2, with
//! which Eq. 15 makes that term vanish.

use super::patch::Patch;
use kanagata_geometry::Vec3;

/// The biquadratic Bezier patch identical to a Nagata patch: Eq. 15 for a quadrilateral. A triangle becomes a patch
/// whose side at `eta = 0` is its first corner: with `zeta = eta v` Eq. 9 is quadratic in `eta` and in `v`. A Bezier
/// patch is unchanged.
#[must_use]
pub fn of_nagata(patch: &Patch) -> Patch {
    let points = match patch {
        Patch::Bezier { .. } => return patch.clone(),
        Patch::Quad(c) => eq15(c),
        Patch::Triangle([c00, c10, c01, c11, c20, c02]) => {
            let z = Vec3::zeros();
            // Monomials in (eta, v): eta^2 v^2 has the coefficient c02, which is not in Eq. 15 and is added to P22.
            let mut points = eq15(&[*c00, *c10, z, *c01, *c20, z, *c11, z]);
            points[8] += c02;
            points
        }
    };
    Patch::Bezier { degrees: [2, 2], points: points.to_vec() }
}

/// Eq. 15; control point (i, j) at `3 i + j`.
fn eq15(c: &[Vec3; 8]) -> [Vec3; 9] {
    let [c00, c10, c01, c11, c20, c02, c21, c12] = c;
    [
        *c00,
        c00 + c01 * 0.5,
        c00 + c01 + c02,
        c00 + c10 * 0.5,
        c00 + (c10 + c01) * 0.5 + c11 * 0.25,
        c00 + c01 + c02 + (c10 + c11 + c12) * 0.5,
        c00 + c10 + c20,
        c00 + c10 + c20 + (c01 + c11 + c21) * 0.5,
        c00 + c10 + c01 + c11 + c20 + c02 + c21 + c12,
    ]
}

/// Monomial coefficients b_ij of Eq. 4 from control points, in the same order (Eq. 5, 6).
#[must_use]
pub fn monomial(degrees: [usize; 2], points: &[Vec3]) -> Vec<Vec3> {
    along_both(degrees, points, to_powers)
}

/// Applies `change` to every row, then to every column of a net, (i, j) at `i (m + 1) + j`.
pub fn along_both([n, m]: [usize; 2], net: &[Vec3], change: impl Fn(&mut [Vec3])) -> Vec<Vec3> {
    let mut net = net.to_vec();
    net.chunks_exact_mut(m + 1).for_each(&change);
    let mut column = vec![Vec3::zeros(); n + 1];
    for j in 0..=m {
        column.iter_mut().enumerate().for_each(|(i, x)| *x = net[i * (m + 1) + j]);
        change(&mut column);
        column.iter().enumerate().for_each(|(i, x)| net[i * (m + 1) + j] = *x);
    }
    net
}

/// Monomial coefficients of a curve from its control points: `b_k = binomial(n, k) D^k P_0` with forward differences D.
fn to_powers(points: &mut [Vec3]) {
    let n = points.len() - 1;
    for level in 1..=n {
        for k in (level..=n).rev() {
            points[k] -= points[k - 1];
        }
    }
    let mut binomial = 1.0;
    for (k, p) in points.iter_mut().enumerate() {
        *p *= binomial;
        binomial *= (n - k) as f64 / (k + 1) as f64;
    }
}

/// The Bezier patch with its corners rotated by one: `S'(eta, zeta) = S(1 - zeta, eta)`.
pub(super) fn turned(degrees: [usize; 2], points: &[Vec3]) -> ([usize; 2], Vec<Vec3>) {
    let [n, m] = degrees;
    let at = |i: usize, j: usize| points[i * (m + 1) + j];
    let net = (0..=m).flat_map(|i| (0..=n).map(move |j| (n - j, i))).map(|(a, b)| at(a, b));
    ([m, n], net.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points<const N: usize>(seed: u64) -> [Vec3; N] {
        let mut s = seed;
        let mut random = || {
            s = s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((s >> 33) as f64) / (1u64 << 31) as f64 - 0.5
        };
        std::array::from_fn(|_| Vec3::new(random(), random(), random()))
    }

    const AT: [(f64, f64); 5] = [(0.0, 0.0), (1.0, 1.0), (0.3, 0.8), (0.9, 0.2), (0.5, 0.5)];

    #[test]
    fn a_quadrilateral_and_its_biquadratic_bezier_are_one() {
        let quad = Patch::Quad(points(1));
        let bezier = of_nagata(&quad);
        for (e, z) in AT {
            let (a, b) = (quad.derivs(e, z), bezier.derivs(e, z));
            assert!((a.s - b.s).norm() < 1e-14 && (a.d12 - b.d12).norm() < 1e-13);
        }
    }

    #[test]
    fn a_triangle_is_the_bezier_patch_with_one_side_at_its_first_corner() {
        let triangle = Patch::Triangle(points(2));
        let bezier = of_nagata(&triangle);
        for (e, v) in AT {
            assert!((triangle.derivs(e, e * v).s - bezier.derivs(e, v).s).norm() < 1e-14);
        }
        assert!((bezier.derivs(0.0, 0.7).s - triangle.derivs(0.0, 0.0).s).norm() < 1e-15);
    }

    /// Eq. 14 with the corrected sign of P21: the coefficient of eta^2 zeta^2 vanishes for the points of Eq. 15, and
    /// does not with the printed sign.
    #[test]
    fn the_last_term_of_eq_14_vanishes_with_minus_two() {
        let p = eq15(&points(3));
        let at = |i: usize, j: usize| p[3 * i + j];
        let rest = at(0, 0) - at(0, 1) * 2.0 + at(0, 2) - at(1, 0) * 2.0 + at(1, 1) * 4.0
            - at(1, 2) * 2.0
            + at(2, 0)
            + at(2, 2);
        assert!((rest - at(2, 1) * 2.0).norm() < 1e-14);
        assert!((rest + at(2, 1) * 2.0).norm() > 0.1);
        assert!(monomial([2, 2], &p)[8].norm() < 1e-14);
    }

    #[test]
    fn the_monomial_form_is_the_same_patch() {
        for degrees in [[1, 1], [2, 2], [3, 5], [6, 6]] {
            let all: [Vec3; 49] = points(4);
            let [n, m] = degrees;
            let net = &all[..(n + 1) * (m + 1)];
            let b = monomial(degrees, net);
            let bezier = Patch::Bezier { degrees, points: net.to_vec() };
            for (e, z) in AT {
                let power = |i: usize, j: usize| e.powi(i as i32) * z.powi(j as i32);
                let s: Vec3 = (0..=n)
                    .flat_map(|i| (0..=m).map(move |j| (i, j)))
                    .map(|(i, j)| b[i * (m + 1) + j] * power(i, j))
                    .sum();
                assert!((s - bezier.derivs(e, z).s).norm() < 1e-11, "{degrees:?}");
            }
        }
    }

    #[test]
    fn four_quarter_turns_are_none() {
        let net: [Vec3; 12] = points(5);
        let patch = Patch::Bezier { degrees: [3, 2], points: net.to_vec() };
        let (degrees, once) = turned([3, 2], &net);
        let turn = Patch::Bezier { degrees, points: once.clone() };
        assert!((turn.derivs(0.2, 0.7).s - patch.derivs(0.3, 0.2).s).norm() < 1e-14);
        let (d, p) = (0..3).fold((degrees, once), |(d, p), _| turned(d, &p));
        assert_eq!((d, &p[..]), ([3, 2], &net[..]));
    }
}
