//! What the return mapping and the reports ask of a yield criterion.

use super::hill48::{Hill48, Hill48Error, Spectrum};
use super::yld2004::{Derivatives, Yld2004, Yld2004Error};
use crate::solver::numbers::tensor::{Mandel, Mandel66};

/// A yield criterion `σ̄(T)`, scaled so that tension along the rolling direction gives the stress itself.
#[derive(Debug, Clone)]
pub enum YieldFunction {
    /// Hill 1948 and von Mises: quadratic, returned in closed form up to one scalar.
    Hill48(Spectrum),
    /// Yld2004-18p and Hosford.
    Yld2004(Box<Yld2004>),
}

/// A yield criterion with numbers it cannot work with.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum YieldError {
    /// Hill48 is not convex.
    #[error(transparent)]
    Hill48(#[from] Hill48Error),
    /// Yld2004-18p out of range.
    #[error(transparent)]
    Yld2004(#[from] Yld2004Error),
}

impl YieldFunction {
    /// Hill's criterion, scaled to `G + H = 1`.
    ///
    /// # Errors
    /// [`YieldError::Hill48`] unless it is convex.
    pub fn hill48(hill: &Hill48) -> Result<Self, YieldError> {
        hill.check()?;
        Ok(Self::Hill48(Spectrum::new(&hill.normalised())))
    }

    /// Whether it is the same in all axes.
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

    /// `r` value (width over thickness plastic strain) of tension at `angle` [rad] to rolling.
    #[must_use]
    pub fn r_value(&self, angle: f64) -> f64 {
        let n = self.derivatives(&tension(angle)).gradient;
        let across = tension(angle + std::f64::consts::FRAC_PI_2);
        crate::solver::numbers::tensor::dot(&n, &across) / n[2]
    }

    /// Yield stress of tension at `angle` [rad] over that along rolling.
    #[must_use]
    pub fn yield_ratio(&self, angle: f64) -> f64 {
        self.equivalent(&tension(angle)).recip()
    }

    /// Balanced biaxial yield stress over that of tension along rolling.
    #[must_use]
    pub fn biaxial_ratio(&self) -> f64 {
        self.equivalent(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]).recip()
    }

    /// Transverse over rolling plastic strain in balanced biaxial tension.
    #[must_use]
    pub fn biaxial_r_value(&self) -> f64 {
        let n = self.derivatives(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]).gradient;
        n[1] / n[0]
    }
}

/// Unit tension in the sheet's plane.
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
