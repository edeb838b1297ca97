//! Evaluation of patches of any type.

use kanagata_geometry::Vec3;

/// Point and derivatives of a patch at `(eta, zeta)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchDerivs {
    /// Point S [mm].
    pub s: Vec3,
    /// `S_eta`.
    pub d1: Vec3,
    /// `S_zeta`.
    pub d2: Vec3,
    /// `S_eta_eta`.
    pub d11: Vec3,
    /// `S_eta_zeta`.
    pub d12: Vec3,
    /// `S_zeta_zeta`.
    pub d22: Vec3,
}

impl PatchDerivs {
    /// Unit normal of a patch at `(eta, zeta)` with these derivatives (Eq. 23). Where a derivative vanishes on a side
    /// (a triangle as a Bezier patch) its limit grows along the other parameter at the rate `S_eta_zeta`.
    #[must_use]
    pub fn normal(&self, eta: f64, zeta: f64) -> Option<Vec3> {
        const DEGENERATE_RATIO: f64 = 1e-12;
        let inwards = |t: f64| if t < 0.5 { 1.0 } else { -1.0 };
        let (l1, l2) = (self.d1.norm(), self.d2.norm());
        let cross = if l2 <= DEGENERATE_RATIO * l1 {
            self.d1.cross(&self.d12) * inwards(eta)
        } else if l1 <= DEGENERATE_RATIO * l2 {
            self.d12.cross(&self.d2) * inwards(zeta)
        } else {
            self.d1.cross(&self.d2)
        };
        kanagata_geometry::frame::unit(cross)
    }
}

/// A patch for evaluation. `S_eta x S_zeta` points out of the tool, to the sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum Patch {
    /// Triangular Nagata patch: `c00 c10 c01 c11 c20 c02` of Eq. 9, on `0 <= zeta <= eta <= 1`.
    Triangle([Vec3; 6]),
    /// Quadrilateral Nagata patch: `c00 c10 c01 c11 c20 c02 c21 c12` of Eq. 11, on the unit square.
    Quad([Vec3; 8]),
    /// Bezier patch of Eq. 1: degrees along eta and zeta (1 to 6), control point (i, j) at
    /// `i * (degrees[1] + 1) + j`, on the unit square.
    Bezier {
        /// Degrees along eta and zeta.
        degrees: [usize; 2],
        /// Control points [mm].
        points: Vec<Vec3>,
    },
}

impl Patch {
    /// Point and derivatives; `(eta, zeta)` need not lie inside the domain.
    #[must_use]
    pub fn derivs(&self, eta: f64, zeta: f64) -> PatchDerivs {
        match self {
            Self::Triangle(c) => triangle(c, eta, zeta),
            Self::Quad(c) => quad(c, eta, zeta),
            Self::Bezier { degrees, points } => bezier(*degrees, points, eta, zeta),
        }
    }

    /// Unit normal `S_eta x S_zeta / |S_eta x S_zeta|` (Eq. 23), on a collapsed side its limit along the patch; `None`
    /// where the patch is otherwise degenerate.
    #[must_use]
    pub fn normal(&self, eta: f64, zeta: f64) -> Option<Vec3> {
        self.derivs(eta, zeta).normal(eta, zeta)
    }

    /// Area vector by the midpoint rule: area of the parameter domain times `S_eta x S_zeta` at its middle [mm²]; exact
    /// for a flat parallelogram.
    #[must_use]
    pub fn area_vector(&self) -> Vec3 {
        let (eta, zeta, area) =
            if self.sides() == 3 { (2.0 / 3.0, 1.0 / 3.0, 0.5) } else { (0.5, 0.5, 1.0) };
        let at = self.derivs(eta, zeta);
        at.d1.cross(&at.d2) * area
    }

    /// True for a patch that degenerates to a line or a point: its area is negligible relative to its size.
    #[must_use]
    pub fn is_degenerate(&self) -> bool {
        /// Ratio of the area to the squared size that is rounding.
        const DEGENERATE_RATIO: f64 = 1e-12;
        let (eta, zeta) = if self.sides() == 3 { (2.0 / 3.0, 1.0 / 3.0) } else { (0.5, 0.5) };
        let at = self.derivs(eta, zeta);
        let size = at.d1.norm().max(at.d2.norm());
        let is_point = size <= DEGENERATE_RATIO * at.s.norm();
        is_point || self.area_vector().norm() <= DEGENERATE_RATIO * size * size
    }

    /// Number of sides: 3 or 4. Side k runs from corner k to k + 1. Corners of a triangle: (0,0), (1,0), (1,1); of a
    /// quadrilateral: (0,0), (1,0), (1,1), (0,1).
    #[must_use]
    pub fn sides(&self) -> usize {
        if matches!(self, Self::Triangle(_)) { 3 } else { 4 }
    }
}

/// Eq. 9: `c00 + c10 e + c01 z + c11 e z + c20 e^2 + c02 z^2`.
fn triangle([c00, c10, c01, c11, c20, c02]: &[Vec3; 6], e: f64, z: f64) -> PatchDerivs {
    PatchDerivs {
        s: c00 + (c10 + c20 * e) * e + (c01 + c11 * e + c02 * z) * z,
        d1: c10 + c11 * z + c20 * (2.0 * e),
        d2: c01 + c11 * e + c02 * (2.0 * z),
        d11: c20 * 2.0,
        d12: *c11,
        d22: c02 * 2.0,
    }
}

/// Eq. 11: Eq. 9 and `c21 e^2 z + c12 e z^2`.
fn quad(c: &[Vec3; 8], e: f64, z: f64) -> PatchDerivs {
    let [c00, c10, c01, c11, c20, c02, c21, c12] = c;
    PatchDerivs {
        s: c00 + (c10 + c20 * e) * e + (c01 + (c11 + c21 * e) * e + (c02 + c12 * e) * z) * z,
        d1: c10 + c20 * (2.0 * e) + (c11 + c21 * (2.0 * e) + c12 * z) * z,
        d2: c01 + (c11 + c21 * e) * e + (c02 + c12 * e) * (2.0 * z),
        d11: (c20 + c21 * z) * 2.0,
        d12: c11 + c21 * (2.0 * e) + c12 * (2.0 * z),
        d22: (c02 + c12 * e) * 2.0,
    }
}

/// Eq. 1 by Bernstein polynomials and their derivatives. Control points are taken relative to the first one, so that
/// the derivative along a collapsed side is exactly zero.
fn bezier(degrees: [usize; 2], points: &[Vec3], e: f64, z: f64) -> PatchDerivs {
    let (be, bz) = (bernstein(degrees[0], e), bernstein(degrees[1], z));
    let origin = points.first().copied().unwrap_or_else(Vec3::zeros);
    let mut sums = [[Vec3::zeros(); 3]; 3];
    for (i, row) in points.chunks_exact(degrees[1] + 1).enumerate() {
        for (order_z, weights) in bz.iter().enumerate() {
            let along = row.iter().zip(weights).map(|(p, b)| (p - origin) * *b).sum::<Vec3>();
            for order_e in 0..3 - order_z {
                sums[order_e][order_z] += along * be[order_e][i];
            }
        }
    }
    let [[s, d2, d22], [d1, d12, _], [d11, _, _]] = sums;
    PatchDerivs { s: origin + s, d1, d2, d11, d12, d22 }
}

/// Largest degree of a Bezier patch in each direction; keeps the monomial form stable, as required by the paper.
pub const MAX_DEGREE: usize = 6;

/// Bernstein polynomials of degree n (Eq. 2) and their first two derivatives at t.
pub fn bernstein(n: usize, t: f64) -> [[f64; MAX_DEGREE + 1]; 3] {
    let rise = |degree: usize| {
        let mut b = [0.0; MAX_DEGREE + 1];
        b[0] = 1.0;
        for k in 1..=degree {
            for i in (0..=k).rev() {
                let left = if i > 0 { b[i - 1] } else { 0.0 };
                b[i] = (1.0 - t) * b[i] + t * left;
            }
        }
        b
    };
    let difference = |b: [f64; MAX_DEGREE + 1], degree: usize| {
        let mut d = [0.0; MAX_DEGREE + 1];
        for i in 0..=degree {
            let left = if i > 0 { b[i - 1] } else { 0.0 };
            let own = if i < degree { b[i] } else { 0.0 };
            d[i] = degree as f64 * (left - own);
        }
        d
    };
    let first = difference(rise(n - 1), n);
    let second =
        if n >= 2 { difference(difference(rise(n - 2), n - 1), n) } else { [0.0; MAX_DEGREE + 1] };
    [rise(n), first, second]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: &mut u64) -> f64 {
        *seed =
            seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*seed >> 33) as f64) / (1u64 << 31) as f64 - 0.5
    }

    fn random_points<const N: usize>(seed: &mut u64) -> [Vec3; N] {
        std::array::from_fn(|_| Vec3::new(random(seed), random(seed), random(seed)))
    }

    fn patches() -> Vec<Patch> {
        let mut seed = 11;
        let mut all =
            vec![Patch::Triangle(random_points(&mut seed)), Patch::Quad(random_points(&mut seed))];
        for degrees in [[1, 1], [2, 2], [3, 1], [6, 4]] {
            let count = (degrees[0] + 1) * (degrees[1] + 1);
            let points: [Vec3; 49] = random_points(&mut seed);
            all.push(Patch::Bezier { degrees, points: points[..count].to_vec() });
        }
        all
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let h = 1e-5;
        for patch in patches() {
            let (e, z) = (0.37, 0.21);
            let d = patch.derivs(e, z);
            let (ep, em) = (patch.derivs(e + h, z), patch.derivs(e - h, z));
            let (zp, zm) = (patch.derivs(e, z + h), patch.derivs(e, z - h));
            for (found, plus, minus) in [
                (d.d1, ep.s, em.s),
                (d.d2, zp.s, zm.s),
                (d.d11, ep.d1, em.d1),
                (d.d12, zp.d1, zm.d1),
                (d.d22, zp.d2, zm.d2),
            ] {
                let difference = (plus - minus) / (2.0 * h);
                assert!((found - difference).norm() < 1e-7, "{patch:?}");
            }
        }
    }

    #[test]
    fn patches_drawn_together_have_no_area() {
        assert!(patches().iter().all(|patch| !patch.is_degenerate()));
        let at = |x: f64| Vec3::new(3.0 + x, 4.0, 5.0);
        for x in [1.0, 1e-15] {
            let line = Patch::Bezier {
                degrees: [1, 1],
                points: [0.0, 1.0, 0.5, 1.0].map(|fraction| at(fraction * x)).to_vec(),
            };
            assert!(line.is_degenerate(), "{x}");
        }
    }

    /// A quarter of a cone's apex region as a Bezier patch with the apex at eta = 0, then rotated to every other side.
    #[test]
    fn normals_on_a_side_of_no_length_are_limits() {
        let p = |x: f64, y: f64, z: f64| Vec3::new(100.3 + x, y, z);
        let net = [p(0.0, 0.0, 0.0), p(0.0, 0.0, 0.0), p(1.0, 0.1, 0.2), p(0.7, 0.9, -0.1)];
        let (mut degrees, mut points) = ([1, 1], net.to_vec());
        for at in [[0.0, 0.4], [0.6, 0.0], [1.0, 0.6], [0.4, 1.0]] {
            let patch = Patch::Bezier { degrees, points: points.clone() };
            let inside = at.map(|t| 0.5 + (t - 0.5) * 0.999_999);
            let (limit, near) = (patch.normal(at[0], at[1]), patch.normal(inside[0], inside[1]));
            assert!((limit.unwrap() - near.unwrap()).norm() < 1e-5, "{at:?}");
            (degrees, points) = crate::bezier::turned(degrees, &points);
        }
    }

    #[test]
    fn bezier_corners_are_control_points() {
        for patch in patches() {
            let Patch::Bezier { degrees: [n, m], points } = &patch else { continue };
            assert!((patch.derivs(0.0, 0.0).s - points[0]).norm() < 1e-15);
            assert!((patch.derivs(1.0, 0.0).s - points[n * (m + 1)]).norm() < 1e-15);
            assert!((patch.derivs(1.0, 1.0).s - points[n * (m + 1) + m]).norm() < 1e-15);
        }
    }
}
