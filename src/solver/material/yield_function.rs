//! Yield criteria: equivalent stress, derivatives, r values and yield ratios.

use super::hill48::{Hill48, Hill48Error, Spectrum};
use super::yld2004::{Derivatives, Yld2004, Yld2004Error};
use crate::numbers::tensor::{Mandel, Mandel66};

/// Yield criterion `σ̄(T)`, scaled so that tension along the rolling direction gives the stress itself.
#[derive(Debug, Clone)]
pub enum YieldFunction {
    /// Hill 1948 and von Mises: quadratic; the return mapping has a closed form in one scalar unknown.
    Hill48(Spectrum),
    /// Yld2004-18p and Hosford.
    Yld2004(Box<Yld2004>),
}

/// Invalid parameters of a yield criterion.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum YieldError {
    /// Hill48 is not convex.
    #[error(transparent)]
    Hill48(#[from] Hill48Error),
    /// A parameter of Yld2004-18p is out of range.
    #[error(transparent)]
    Yld2004(#[from] Yld2004Error),
}

impl YieldFunction {
    /// Hill's criterion, scaled to `G + H = 1`.
    ///
    /// # Errors
    /// [`YieldError::Hill48`] if it is not convex.
    pub fn hill48(hill: &Hill48) -> Result<Self, YieldError> {
        hill.check()?;
        Ok(Self::Hill48(Spectrum::new(&hill.normalised())))
    }

    /// Whether the criterion is isotropic.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        match self {
            Self::Hill48(spectrum) => spectrum.is_isotropic(),
            Self::Yld2004(law) => law.is_isotropic(),
        }
    }

    /// Equivalent stress [MPa].
    #[must_use]
    pub fn equivalent(&self, t: &Mandel) -> f64 {
        match self {
            Self::Hill48(spectrum) => spectrum.equivalent(t),
            Self::Yld2004(law) => law.equivalent(t),
        }
    }

    /// Value, gradient and Hessian; all zero at zero stress.
    #[must_use]
    pub fn derivatives(&self, t: &Mandel) -> Derivatives {
        match self {
            Self::Hill48(spectrum) => quadratic(spectrum, t),
            Self::Yld2004(law) => law.derivatives(t),
        }
    }

    /// `r` value (width over thickness plastic strain) in tension at `angle` [rad] to the rolling direction.
    #[must_use]
    pub fn r_value(&self, angle: f64) -> f64 {
        let n = self.derivatives(&tension(angle)).gradient;
        let across = tension(angle + std::f64::consts::FRAC_PI_2);
        crate::numbers::tensor::dot(&n, &across) / n[2]
    }

    /// Yield stress in tension at `angle` [rad] over that along the rolling direction.
    #[must_use]
    pub fn yield_ratio(&self, angle: f64) -> f64 {
        self.equivalent(&tension(angle)).recip()
    }

    /// Balanced biaxial yield stress over that in tension along the rolling direction.
    #[must_use]
    pub fn biaxial_ratio(&self) -> f64 {
        self.equivalent(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]).recip()
    }

    /// Distance from the origin to the yield locus in plane stress, along the unit vector (rolling, transverse), over the
    /// yield stress along the rolling direction. `shear`: fraction below 1 of the shear yield stress that acts as well.
    #[must_use]
    pub fn locus_radius(&self, [c, s]: [f64; 2], shear: f64) -> f64 {
        let unit = std::f64::consts::SQRT_2;
        let shear = shear * unit / self.equivalent(&[0.0, 0.0, 0.0, unit, 0.0, 0.0]);
        let (mut low, mut high) = (0.0, 20.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let t = [middle * c, middle * s, 0.0, shear, 0.0, 0.0];
            if self.equivalent(&t) < 1.0 { low = middle } else { high = middle }
        }
        low
    }

    /// Transverse over rolling plastic strain in balanced biaxial tension.
    #[must_use]
    pub fn biaxial_r_value(&self) -> f64 {
        let n = self.derivatives(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]).gradient;
        n[1] / n[0]
    }
}

/// Unit tension in the plane of the sheet.
fn tension(angle: f64) -> Mandel {
    let (s, c) = angle.sin_cos();
    [c * c, s * s, 0.0, std::f64::consts::SQRT_2 * s * c, 0.0, 0.0]
}

fn quadratic(spectrum: &Spectrum, t: &Mandel) -> Derivatives {
    let value = spectrum.equivalent(t);
    if value == 0.0 {
        return Derivatives { value, gradient: [0.0; 6], hessian: [[0.0; 6]; 6] };
    }
    let gradient = spectrum.apply(t).map(|x| x / value);
    let mut hessian: Mandel66 = [[0.0; 6]; 6];
    for column in 0..6 {
        let mut unit = [0.0; 6];
        unit[column] = 1.0;
        let p = spectrum.apply(&unit);
        for row in 0..6 {
            hessian[row][column] = (p[row] - gradient[row] * gradient[column]) / value;
        }
    }
    Derivatives { value, gradient, hessian }
}
