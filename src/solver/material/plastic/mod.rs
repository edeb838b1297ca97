//! Elastoplasticity in logarithmic strain space: Hill48 or Yld2004-18p, isotropic and Chaboche kinematic hardening.
//! The return mapping of quadratic criteria is in [`quadratic`], that of any other in [`general`].
//!
//! | symbol | meaning |
//! |---|---|
//! | `Ep`, `p` | plastic logarithmic strain, equivalent plastic strain |
//! | `X_k` | backstresses [MPa], `dX_k = ⅔ C_k dEp - γ_k X_k dp` |
//! | `ξ` | `T - Σ X_k`, yield when `σ̄(ξ) = σ_y(p)` |
//! | `x` | increment of `p` |
//! | `π_i`, `v_i` | eigenvalues and eigenvectors of Hill's form, also eigenvectors of the elasticity |
//!
//! Backward Euler with `dEp = x P ξ / σ̄`; backstresses are exact for flow in that direction:
//! `X_k = θ_k X_k + ⅔ C_k φ_k dEp` with `θ_k = exp(-γ_k x)`, `φ_k = (1 - θ_k) / (γ_k x)`. In the eigenbasis, with
//! `λ = x / σ_y(p + x)`, `m = 2μ + Σ ⅔ C_k φ_k`: `ξ_i = (T_trial - Σ θ_k X_k)_i / (1 + m λ π_i)`.
//!
//! One scalar equation remains, `Ψ(x) = σ_trial (σ_y / σ̄ - 1) = 0`, linear for von Mises with linear hardening.
//! Newton's method safeguarded by a bracket solves it for every increment.

use crate::material::error::MaterialDataError;

use super::elastic::Elastic;
use super::hardening::Hardening;
use super::hill48::Hill48;
use super::law::{LogResponse, LogResponses, MaterialError};
use super::yield_function::YieldFunction;
use crate::numbers::tensor::{self, Mandel66};
use kanagata_geometry::Mat3;

/// One backstress of Chaboche's law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backstress {
    /// `C` [MPa].
    pub modulus: f64,
    /// `γ`, zero for linear (Prager) hardening.
    pub recovery: f64,
}

/// Factors of dynamic recovery over an increment, with their derivatives with respect to `x`.
#[derive(Debug, Clone, Copy)]
struct Decay {
    /// `θ`: remaining fraction of the backstress.
    remaining: f64,
    remaining_rate: f64,
    /// `φ`: remaining fraction of its growth.
    growth: f64,
    growth_rate: f64,
}

impl Backstress {
    fn decay(&self, x: f64) -> Decay {
        /// Value of `γ x` below which `φ'` is computed from its series. Here the cancellation error of the closed
        /// form equals the truncation error.
        const SERIES_LIMIT: f64 = 1e-4;
        let y = self.recovery * x;
        let remaining = (-y).exp();
        let (growth, slope) = if y < SERIES_LIMIT {
            (1.0 - y * (0.5 - y * (1.0 / 6.0 - y / 24.0)), -0.5 + y * (1.0 / 3.0 - y * 0.125))
        } else {
            let growth = -(-y).exp_m1() / y;
            (growth, (remaining - growth) / y)
        };
        Decay {
            remaining,
            remaining_rate: -self.recovery * remaining,
            growth,
            growth_rate: self.recovery * slope,
        }
    }
}

/// Layout of a history: `Ep` (6), `p`, plastic work, `E` (6, in the axes of the caller), then six values for each
/// backstress.
const STRAIN: usize = 0;
const EQUIVALENT: usize = 6;
const WORK: usize = 7;
const LOG_STRAIN: usize = 8;
const BACKSTRESS: usize = 14;
/// Tolerance of the yield check, relative to the flow stress.
const YIELD_TOLERANCE: f64 = 1e-12;
const RETURN_ITERATIONS_MAX: usize = 200;

/// An elastoplastic material.
#[derive(Debug, Clone)]
pub struct Plastic {
    elastic: Elastic,
    criterion: YieldFunction,
    hardening: Hardening,
    backstresses: Vec<Backstress>,
    /// Rotation of tensors into material axes; `None` if the axes coincide.
    to_material: Option<Mandel66>,
}

impl Plastic {
    /// Material with axes along x (rolling), y, z. The yield surface is scaled to `G + H = 1`, so that the hardening
    /// curve is that of tension along the rolling direction.
    ///
    /// # Errors
    /// [`MaterialDataError`] for the first value out of range.
    pub fn new(
        elastic: Elastic,
        hill: &Hill48,
        hardening: Hardening,
    ) -> Result<Self, MaterialDataError> {
        Self::with_yield(elastic, YieldFunction::hill48(hill)?, hardening)
    }

    /// Material with any yield function and axes along x (rolling), y, z.
    ///
    /// # Errors
    /// [`MaterialDataError`] for the first value out of range.
    pub fn with_yield(
        elastic: Elastic,
        criterion: YieldFunction,
        hardening: Hardening,
    ) -> Result<Self, MaterialDataError> {
        elastic.check()?;
        hardening.check()?;
        Ok(Self { elastic, criterion, hardening, backstresses: Vec::new(), to_material: None })
    }

    /// Adds kinematic hardening.
    ///
    /// # Errors
    /// [`MaterialDataError::Elastic`] for a negative modulus or recovery.
    pub fn with_backstresses(
        mut self,
        backstresses: Vec<Backstress>,
    ) -> Result<Self, MaterialDataError> {
        for (k, one) in backstresses.iter().enumerate() {
            for (key, found) in [("c_mpa", one.modulus), ("gamma", one.recovery)] {
                if !(found >= 0.0 && found.is_finite()) {
                    let field = format!("backstresses[{k}].{key}");
                    let allowed = "zero or above";
                    return Err(MaterialDataError::Elastic { field, found, allowed });
                }
            }
        }
        self.backstresses = backstresses;
        Ok(self)
    }

    /// Sets the material axes: the columns of the rotation `axes` are the rolling, transverse and thickness
    /// directions in the undeformed body.
    #[must_use]
    pub fn with_axes(mut self, axes: &Mat3) -> Self {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| axes[(j, i)]));
        self.to_material = Some(tensor::congruence(&rows));
        self
    }
}

mod general;
#[cfg(test)]
mod lanes;
mod points;
mod quadratic;
#[cfg(test)]
mod random_paths;
pub(super) mod tension;
#[cfg(test)]
mod tests;
mod update;
