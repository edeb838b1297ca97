//! Hill's 1948 yield function in its eigenbasis.
//!
//! `σ̄² = F (σ22-σ33)² + G (σ33-σ11)² + H (σ11-σ22)² + 2L σ23² + 2M σ31² + 2N σ12² = Tᵀ P T = Σ_i π_i (v_i · T)²`.
//! The five deviatoric eigenvectors `v_i` of `P` are also eigenvectors of isotropic elasticity, which reduces the
//! return mapping to one scalar equation.

use crate::numbers::tensor::Mandel;

/// Hill's parameters, dimensionless; axes 1 rolling, 2 transverse, 3 thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hill48 {
    /// `F`.
    pub f: f64,
    /// `G`.
    pub g: f64,
    /// `H`.
    pub h: f64,
    /// `L` (shear 23).
    pub l: f64,
    /// `M` (shear 31).
    pub m: f64,
    /// `N` (shear 12).
    pub n: f64,
}

/// Parameters of a yield surface that is not convex.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("Hill48: {condition} is {found}, must be above zero for a convex yield surface")]
pub struct Hill48Error {
    /// Condition that is violated.
    pub condition: &'static str,
    /// Its value.
    pub found: f64,
}

impl Hill48 {
    /// The isotropic case, von Mises.
    pub const MISES: Self = Self { f: 0.5, g: 0.5, h: 0.5, l: 1.5, m: 1.5, n: 1.5 };

    /// Parameters from the r values at 0, 45 and 90 degrees to the rolling direction, with `G + H = 1` and isotropic
    /// out-of-plane shear (`L = M = 1.5`).
    #[must_use]
    pub fn from_r_values(r0: f64, r45: f64, r90: f64) -> Self {
        let g = 1.0 / (1.0 + r0);
        let h = r0 * g;
        let f = h / r90;
        Self { f, g, h, l: 1.5, m: 1.5, n: (r45 + 0.5) * (f + g) }
    }

    /// The same surface scaled to `G + H = 1`: the equivalent stress equals the stress in tension along the rolling
    /// direction.
    #[must_use]
    pub fn normalised(&self) -> Self {
        let scale = 1.0 / (self.g + self.h);
        let Self { f, g, h, l, m, n } = *self;
        Self { f: f * scale, g: g * scale, h: h * scale, l: l * scale, m: m * scale, n: n * scale }
    }

    /// Checks convexity.
    ///
    /// # Errors
    /// [`Hill48Error`] with the violated condition.
    pub fn check(&self) -> Result<(), Hill48Error> {
        let Self { f, g, h, l, m, n } = *self;
        let conditions = [
            ("L", l),
            ("M", m),
            ("N", n),
            ("F + G", f + g),
            ("G + H", g + h),
            ("F + H", f + h),
            ("F G + G H + H F", f * g + g * h + h * f),
        ];
        for (condition, found) in conditions {
            if !(found > 0.0 && found.is_finite()) {
                return Err(Hill48Error { condition, found });
            }
        }
        Ok(())
    }

    /// `r` value (width over thickness plastic strain) in tension at `angle` [rad] to the rolling direction.
    #[must_use]
    pub fn r_value(&self, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let (s2, c2) = (s * s, c * c);
        let Self { f, g, h, n, .. } = *self;
        (h + (2.0 * n - f - g - 4.0 * h) * s2 * c2) / (f * s2 + g * c2)
    }

    /// Yield stress in tension at `angle` [rad] over the equivalent stress.
    #[must_use]
    pub fn yield_ratio(&self, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let (s2, c2) = (s * s, c * c);
        let Self { f, g, h, n, .. } = *self;
        (f * s2 * s2 + g * c2 * c2 + h * (c2 - s2).powi(2) + 2.0 * n * s2 * c2).sqrt().recip()
    }

    /// Balanced biaxial yield stress over the equivalent stress.
    #[must_use]
    pub fn biaxial_ratio(&self) -> f64 {
        (self.f + self.g).sqrt().recip()
    }
}

/// Eigenvalues `π_i` and deviatoric unit eigenvectors `v_i` of `P`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// `π_i`.
    pub values: [f64; 5],
    /// `v_i`: two normal ones, then shear 12, 23, 31.
    pub normal: [[f64; 3]; 2],
}

impl Spectrum {
    /// The spectrum of `hill`.
    #[must_use]
    pub fn new(hill: &Hill48) -> Self {
        let Hill48 { f, g, h, l, m, n } = *hill;
        let (one, two) = (
            [1.0, -1.0, 0.0].map(|x| x / 2.0_f64.sqrt()),
            [1.0, 1.0, -2.0].map(|x| x / 6.0_f64.sqrt()),
        );
        let form = |u: &[f64; 3], w: &[f64; 3]| {
            f * (u[1] - u[2]) * (w[1] - w[2])
                + g * (u[2] - u[0]) * (w[2] - w[0])
                + h * (u[0] - u[1]) * (w[0] - w[1])
        };
        let (a, b, d) = (form(&one, &one), form(&one, &two), form(&two, &two));
        let angle = 0.5 * (2.0 * b).atan2(a - d);
        let (s, c) = angle.sin_cos();
        let combination =
            |x: f64, y: f64| -> [f64; 3] { std::array::from_fn(|i| x * one[i] + y * two[i]) };
        let normal = [combination(c, s), combination(-s, c)];
        let values = [form(&normal[0], &normal[0]), form(&normal[1], &normal[1]), n, l, m];
        Self { values, normal }
    }

    /// Whether it is the von Mises form, within [`ISOTROPY_TOLERANCE_REL`].
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        let [first, ref rest @ ..] = self.values;
        rest.iter().all(|value| (value - first).abs() <= ISOTROPY_TOLERANCE_REL * first)
    }

    /// Components `v_i · t`.
    #[must_use]
    #[inline]
    pub fn components(&self, t: &Mandel) -> [f64; 5] {
        let normal = |v: &[f64; 3]| v[0] * t[0] + v[1] * t[1] + v[2] * t[2];
        [normal(&self.normal[0]), normal(&self.normal[1]), t[3], t[4], t[5]]
    }

    /// The deviatoric tensor with components `x`.
    #[must_use]
    #[inline]
    pub fn tensor(&self, x: &[f64; 5]) -> Mandel {
        let n = |i: usize| x[0] * self.normal[0][i] + x[1] * self.normal[1][i];
        [n(0), n(1), n(2), x[2], x[3], x[4]]
    }

    /// Equivalent stress of a stress tensor [MPa].
    #[must_use]
    pub fn equivalent(&self, t: &Mandel) -> f64 {
        let x = self.components(t);
        (0..5).map(|i| self.values[i] * x[i] * x[i]).sum::<f64>().sqrt()
    }

    /// `P t`, the derivative of `½ σ̄²`.
    #[must_use]
    pub fn apply(&self, t: &Mandel) -> Mandel {
        let x = self.components(t);
        self.tensor(&std::array::from_fn(|i| self.values[i] * x[i]))
    }
}

/// Relative tolerance within which the parameters of a criterion count as isotropic.
pub(super) const ISOTROPY_TOLERANCE_REL: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::tensor::dot;

    const PAPER: Hill48 = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };

    #[test]
    fn spectrum_is_the_quadratic_form() {
        let Hill48 { f, g, h, l, m, n } = PAPER;
        let t: Mandel = [310.0, -120.0, 45.0, 77.0, -31.0, 60.0];
        let direct = f * (t[1] - t[2]).powi(2)
            + g * (t[2] - t[0]).powi(2)
            + h * (t[0] - t[1]).powi(2)
            + n * t[3] * t[3]
            + l * t[4] * t[4]
            + m * t[5] * t[5];
        let spectrum = Spectrum::new(&PAPER);
        assert!((spectrum.equivalent(&t) - direct.sqrt()).abs() < 1e-12 * direct.sqrt());
        assert!((dot(&spectrum.apply(&t), &t) - direct).abs() < 1e-12 * direct);
    }

    #[test]
    fn closed_forms_of_the_paper_sheet() {
        let quarter = std::f64::consts::FRAC_PI_4;
        for (angle, r) in [(0.0, 2.367), (quarter, 1.854), (2.0 * quarter, 2.801)] {
            assert!((PAPER.r_value(angle) - r).abs() < 5e-4, "{}", PAPER.r_value(angle));
        }
        assert!((PAPER.yield_ratio(quarter) - 1.1308).abs() < 5e-5);
        assert!((PAPER.yield_ratio(2.0 * quarter) - 1.0238).abs() < 5e-5);
        assert!((PAPER.biaxial_ratio() - 1.3509).abs() < 5e-5);
    }

    #[test]
    fn r_values_give_the_parameters_back() {
        let quarter = std::f64::consts::FRAC_PI_4;
        let r = [0.0, 1.0, 2.0].map(|k| PAPER.r_value(k * quarter));
        let again = Hill48::from_r_values(r[0], r[1], r[2]);
        for (a, b) in
            [(again.f, PAPER.f), (again.g, PAPER.g), (again.h, PAPER.h), (again.n, PAPER.n)]
        {
            assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn mises_is_isotropic() {
        let values = Spectrum::new(&Hill48::MISES).values;
        assert!(values.iter().all(|v| (v - 1.5).abs() < 1e-15), "{values:?}");
        let alike = |r45| Spectrum::new(&Hill48::from_r_values(1.0, r45, 1.0)).is_isotropic();
        assert!(alike(1.0) && !alike(1.001) && !Spectrum::new(&PAPER).is_isotropic());
    }
}
