//! Elastoplasticity in logarithmic strain space: Hill48 or Yld2004-18p, isotropic and Chaboche kinematic
//! hardening. This file returns quadratic criteria; [`general`] any other.
//!
//! | symbol | meaning |
//! |---|---|
//! | `Ep`, `p` | plastic logarithmic strain, equivalent plastic strain |
//! | `X_k` | backstresses [MPa], `dX_k = ⅔ C_k dEp - γ_k X_k dp` |
//! | `ξ` | `T - Σ X_k`, yield when `σ̄(ξ) = σ_y(p)` |
//! | `x` | increment of `p` |
//! | `π_i`, `v_i` | eigenvalues and eigenvectors of Hill's form, also eigenvectors of the elasticity |
//!
//! Backward Euler with `dEp = x P ξ / σ̄`, backstresses exact for flow in that direction: `X_k = θ_k X_k + ⅔ C_k φ_k dEp` with
//! `θ_k = exp(-γ_k x)`, `φ_k = (1 - θ_k) / (γ_k x)`. In the eigenbasis, with `λ = x / σ_y(p + x)`,
//! `m = 2μ + Σ ⅔ C_k φ_k`: `ξ_i = (T_trial - Σ θ_k X_k)_i / (1 + m λ π_i)`. What remains is one scalar
//! equation, `Ψ(x) = σ_trial (σ_y / σ̄ - 1) = 0`, a straight line for von Mises with linear hardening;
//! Newton's method kept inside a bracket solves it for every increment.

use crate::solver::material::error::MaterialDataError;

use super::elastic::Elastic;
use super::hardening::Hardening;
use super::hill48::Hill48;
use super::law::{LogResponse, LogResponses, MaterialError};
use super::yield_function::YieldFunction;
use crate::geometry::Mat3;
use crate::solver::numbers::tensor::{self, Mandel66};

/// One backstress of Chaboche's law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backstress {
    /// `C` [MPa].
    pub modulus: f64,
    /// `γ`, zero for linear (Prager) hardening.
    pub recovery: f64,
}

/// What recovery leaves of a backstress and of its growth over an increment, and the derivatives by that.
#[derive(Debug, Clone, Copy)]
struct Decay {
    /// `θ`.
    left: f64,
    left_rate: f64,
    /// `φ`.
    grown: f64,
    grown_rate: f64,
}

impl Backstress {
    fn decay(&self, x: f64) -> Decay {
        /// Where the closed form of `φ'` has lost as many digits as the series leaves out.
        const SMALL: f64 = 1e-4;
        let y = self.recovery * x;
        let left = (-y).exp();
        let (grown, slope) = if y < SMALL {
            (1.0 - y * (0.5 - y * (1.0 / 6.0 - y / 24.0)), -0.5 + y * (1.0 / 3.0 - y * 0.125))
        } else {
            let grown = -(-y).exp_m1() / y;
            (grown, (left - grown) / y)
        };
        Decay { left, left_rate: -self.recovery * left, grown, grown_rate: self.recovery * slope }
    }
}

/// History of a point: `Ep` (6), `p`, plastic work, `E` (6, in the axes in which it was asked), then six values for each backstress.
const STRAIN: usize = 0;
const EQUIVALENT: usize = 6;
const WORK: usize = 7;
const LOG_STRAIN: usize = 8;
const BACKSTRESS: usize = 14;
/// Yield check, relative to the flow stress.
const YIELD_TOLERANCE: f64 = 1e-12;
const MAX_ITERATIONS: usize = 200;

/// An elastoplastic material.
#[derive(Debug, Clone)]
pub struct Plastic {
    elastic: Elastic,
    criterion: YieldFunction,
    hardening: Hardening,
    backstresses: Vec<Backstress>,
    /// Turns the tensors that it is asked with into material axes; `None` when the axes coincide.
    to_material: Option<Mandel66>,
}

impl Plastic {
    /// A material with axes along x (rolling), y, z. The yield surface is scaled to `G + H = 1`, so the
    /// hardening curve is that of tension along the rolling direction.
    ///
    /// # Errors
    /// [`MaterialDataError`] for the first value out of its range.
    pub fn new(
        elastic: Elastic,
        hill: &Hill48,
        hardening: Hardening,
    ) -> Result<Self, MaterialDataError> {
        Self::with_yield(elastic, YieldFunction::hill48(hill)?, hardening)
    }

    /// A material with any yield function, axes along x (rolling), y, z.
    ///
    /// # Errors
    /// [`MaterialDataError`] for the first value out of its range.
    pub fn with_yield(
        elastic: Elastic,
        criterion: YieldFunction,
        hardening: Hardening,
    ) -> Result<Self, MaterialDataError> {
        elastic.check()?;
        hardening.check()?;
        Ok(Self { elastic, criterion, hardening, backstresses: Vec::new(), to_material: None })
    }

    /// The material with kinematic hardening.
    ///
    /// # Errors
    /// [`MaterialDataError::Elastic`] for a modulus or recovery below zero.
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

    /// The material with other axes: the columns of the rotation `axes` are rolling, transverse and
    /// thickness direction in the undeformed body.
    #[must_use]
    pub fn with_axes(mut self, axes: &Mat3) -> Self {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| axes[(j, i)]));
        self.to_material = Some(tensor::congruence(&rows));
        self
    }
}

mod general;
mod points;
mod quadratic;
#[cfg(test)]
mod random_paths;
pub(super) mod tension;
#[cfg(test)]
mod tests;
mod update;
