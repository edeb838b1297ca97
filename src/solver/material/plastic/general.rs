//! Return mapping for any smooth convex yield function.
//!
//! Unknowns are the deviator `ξ` and the increment `x` of equivalent plastic strain, with
//! `λ = x / σ_y(p + x)`, `g = σ̄ ∂σ̄/∂ξ`, `B(x) = dev T_trial - Σ θ_k X_k`, `m(x) = 2μ + Σ ⅔ C_k φ_k`:
//!
//! - `ξ + m λ g(ξ) = B`, the minimum of the strictly convex `½ |ξ - B|² + ½ m λ σ̄(ξ)²`;
//! - `σ_y(p + x) / σ̄(ξ) = 1`.
//!
//! The square keeps the first equation smooth at `ξ = 0` and its derivative independent of the norm of `ξ`. For a
//! quadratic criterion the equation is linear and gives the closed form. Newton's method on both equations, with a
//! line search on the residual, converges in nearly all cases. Otherwise `x` is bracketed, and for each `x` the
//! convex minimum is found by Newton's method with a line search, which is globally convergent.

use super::{BACKSTRESS, EQUIVALENT, MaterialError, Plastic};
use crate::material::yield_function::YieldFunction;
use crate::material::yld2004::{Derivatives, Principal};
use crate::numbers::tensor::{self, Mandel, Mandel66};

type Matrix = nalgebra::SMatrix<f64, 6, 6>;
type Vector = nalgebra::SVector<f64, 6>;

/// Convergence tolerance of the residual, relative to the flow stress.
const RESIDUAL_TOLERANCE: f64 = 1e-13;
/// Residual accepted if rounding stops the iteration.
const RESIDUAL_ACCEPTED: f64 = 2e-11;
const NEWTON_ITERATIONS_MAX: usize = 40;
const BISECTIONS_MAX: usize = 200;

/// One return mapping.
pub(super) struct General<'a> {
    material: &'a Plastic,
    old: &'a [f64],
    /// Deviator of the trial stress.
    trial: Mandel,
    /// Principal values of the trial stress minus the backstresses, if already computed.
    principal: Option<&'a Principal>,
}

/// Converged state of a return mapping.
pub(super) struct Returned {
    /// Increment of equivalent plastic strain.
    pub increment: f64,
    /// Increment of plastic strain.
    pub flow: Mandel,
    at: Iterate,
}

/// All quantities at one iterate `(ξ, x)`.
struct Iterate {
    x: f64,
    xi: Mandel,
    /// `B` and `m`.
    target: Mandel,
    modulus: f64,
    lambda: f64,
    lambda_rate: f64,
    yield_stress: f64,
    slope: f64,
    equivalent: f64,
    /// `N = ∂σ̄/∂ξ`.
    normal: Vector,
    /// `∂g/∂ξ = N ⊗ N + σ̄ ∂²σ̄/∂ξ²`.
    curvature: Matrix,
    /// `ξ + m λ g - B`.
    first: Vector,
    /// `σ_y / σ̄ - 1`.
    second: f64,
    /// `A = 1 + m λ ∂g/∂ξ`.
    matrix: Matrix,
    /// `∂first/∂x`.
    rate: Vector,
}

impl Iterate {
    /// Larger of the two residuals, relative to the flow stress.
    fn residual(&self) -> f64 {
        (self.first.norm() / self.yield_stress).max(self.second.abs())
    }

    /// `½ |ξ - B|² + ½ m λ σ̄²`.
    fn energy(&self) -> f64 {
        let gap: Mandel = std::array::from_fn(|i| self.xi[i] - self.target[i]);
        0.5 * (tensor::dot(&gap, &gap) + self.modulus * self.lambda * self.equivalent.powi(2))
    }
}

impl<'a> General<'a> {
    pub(super) fn new(
        material: &'a Plastic,
        trial: &Mandel,
        old: &'a [f64],
        principal: Option<&'a Principal>,
    ) -> Self {
        let mean = (trial[0] + trial[1] + trial[2]) / 3.0;
        let trial = std::array::from_fn(|i| trial[i] - if i < 3 { mean } else { 0.0 });
        Self { material, old, trial, principal }
    }

    /// `B`, `dB/dx`, `m`, `dm/dx`.
    fn data(&self, x: f64) -> (Mandel, Mandel, f64, f64) {
        let (mut b, mut b_rate) = (self.trial, [0.0; 6]);
        let mut modulus = 2.0 * self.material.elastic.shear_modulus();
        let mut modulus_rate = 0.0;
        for (k, one) in self.material.backstresses.iter().enumerate() {
            let decay = one.decay(x);
            modulus += 2.0 / 3.0 * one.modulus * decay.growth;
            modulus_rate += 2.0 / 3.0 * one.modulus * decay.growth_rate;
            for i in 0..6 {
                let start = self.old[BACKSTRESS + 6 * k + i];
                b[i] -= decay.remaining * start;
                b_rate[i] -= decay.remaining_rate * start;
            }
        }
        (b, b_rate, modulus, modulus_rate)
    }

    fn at(&self, xi: Mandel, x: f64) -> Iterate {
        self.iterate_with(xi, x, self.material.criterion.derivatives(&xi))
    }

    /// Iterate at the trial stress minus the backstresses.
    fn start(&self) -> Iterate {
        let xi = self.data(0.0).0;
        match (&self.material.criterion, self.principal) {
            (YieldFunction::Yld2004(law), Some(principal)) => {
                self.iterate_with(xi, 0.0, law.derivatives_of(principal))
            }
            _ => self.at(xi, 0.0),
        }
    }

    fn iterate_with(&self, xi: Mandel, x: f64, derivatives: Derivatives) -> Iterate {
        let (target, b_rate, modulus, modulus_rate) = self.data(x);
        let (yield_stress, slope) = self.material.hardening.flow_stress(self.old[EQUIVALENT] + x);
        let lambda = x / yield_stress;
        let lambda_rate = (1.0 - lambda * slope) / yield_stress;
        let Derivatives { value: equivalent, gradient, hessian } = derivatives;
        let normal = Vector::from_column_slice(&gradient);
        let curvature =
            Matrix::from_fn(|r, c| gradient[r] * gradient[c] + equivalent * hessian[r][c]);
        let g = normal * equivalent;
        let first = Vector::from_fn(|i, _| xi[i] - target[i] + modulus * lambda * g[i]);
        let product_rate = modulus_rate * lambda + modulus * lambda_rate;
        let rate = Vector::from_fn(|i, _| product_rate * g[i] - b_rate[i]);
        let matrix = Matrix::identity() + curvature * (modulus * lambda);
        let second = yield_stress / equivalent - 1.0;
        Iterate {
            x,
            xi,
            target,
            modulus,
            lambda,
            lambda_rate,
            yield_stress,
            slope,
            equivalent,
            normal,
            curvature,
            first,
            second,
            matrix,
            rate,
        }
    }

    /// Solves for the state on the yield surface.
    pub(super) fn solve(&self) -> Result<Returned, MaterialError> {
        self.accept(self.newton().unwrap_or_else(|best| self.bracketed(*best)))
    }

    /// Solves by the bracketed search only.
    #[cfg(test)]
    pub(super) fn solve_bracketed(&self) -> Result<Returned, MaterialError> {
        self.accept(self.bracketed(self.at(self.trial, 0.0)))
    }

    fn accept(&self, at: Iterate) -> Result<Returned, MaterialError> {
        let residual = at.residual();
        // A distant trial stress limits the number of significant digits.
        let rounding = 4.0 * f64::EPSILON * tensor::dot(&at.target, &at.target).sqrt();
        if residual.is_nan() || residual > RESIDUAL_ACCEPTED.max(rounding / at.yield_stress) {
            return Err(MaterialError::ReturnMapping { residual, iterations: BISECTIONS_MAX });
        }
        // Plastic strain increment for which stress and backstress agree with ξ to rounding.
        let flow = std::array::from_fn(|i| (at.target[i] - at.xi[i]) / at.modulus);
        Ok(Returned { increment: at.x, flow, at })
    }

    /// Newton's method on both equations, started at the radial return. On failure returns the last iterate.
    fn newton(&self) -> Result<Iterate, Box<Iterate>> {
        let start = self.start();
        let slope = if start.slope.is_finite() { start.slope } else { 0.0 };
        let excess = start.equivalent - start.yield_stress;
        let x = excess / (start.modulus * start.normal.norm_squared() + slope);
        let shrink = start.yield_stress / start.equivalent;
        let mut at = self.at(start.target.map(|t| t * shrink), x);
        for _ in 0..NEWTON_ITERATIONS_MAX {
            let residual = at.residual();
            if residual <= RESIDUAL_TOLERANCE {
                return Ok(at);
            }
            let Some((step, increment)) = newton_step(&at) else { return Err(Box::new(at)) };
            let mut length = if at.x + increment > 0.0 { 1.0 } else { 0.9 * at.x / -increment };
            let next = loop {
                let xi = std::array::from_fn(|i| at.xi[i] + length * step[i]);
                let next = self.at(xi, at.x + length * increment);
                if next.residual() < (1.0 - 1e-4 * length) * residual {
                    break Some(next);
                }
                length *= 0.5;
                if length < 1e-3 {
                    break None;
                }
            };
            match next {
                Some(next) => at = next,
                // At a converged state rounding prevents further descent.
                None if residual <= 0.1 * RESIDUAL_ACCEPTED => return Ok(at),
                None => return Err(Box::new(at)),
            }
        }
        if at.residual() <= 0.1 * RESIDUAL_ACCEPTED { Ok(at) } else { Err(Box::new(at)) }
    }

    /// Bracketed search for `x` with the convex minimum for each value.
    fn bracketed(&self, best: Iterate) -> Iterate {
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut at = self.minimum(best.xi, best.x.max(1e-12));
        for _ in 0..BISECTIONS_MAX {
            if at.second.abs() <= RESIDUAL_TOLERANCE {
                break;
            }
            let x = at.x;
            if at.second < 0.0 {
                low = x
            } else {
                high = x
            }
            let (step, increment) = newton_step(&at).unwrap_or((Vector::zeros(), f64::NAN));
            let (mut next, mut xi) = (x + increment, std::array::from_fn(|i| at.xi[i] + step[i]));
            if !(next > low && next < high) {
                next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * low };
                xi = at.xi;
            }
            if next == x || next == low || next == high {
                break;
            }
            at = self.minimum(xi, next);
        }
        at
    }

    /// Minimum of `½ |ξ - B|² + ½ m λ σ̄(ξ)²` over `ξ` for given `x`.
    fn minimum(&self, start: Mandel, x: f64) -> Iterate {
        let mut at = self.at(start, x);
        for _ in 0..BISECTIONS_MAX {
            if at.first.norm() <= RESIDUAL_TOLERANCE * at.equivalent {
                break;
            }
            let Some(factor) = at.matrix.cholesky() else { break };
            let step = -factor.solve(&at.first);
            let (energy, descent) = (at.energy(), at.first.dot(&step));
            let mut length = 1.0;
            let next = loop {
                let next = self.at(std::array::from_fn(|i| at.xi[i] + length * step[i]), x);
                let falls = next.energy() <= energy + 1e-4 * length * descent;
                // Near the minimum the energy is limited by rounding, the residual is not.
                if falls && length * descent.abs() > 1e-12 * energy
                    || next.first.norm() < 0.9 * at.first.norm()
                {
                    break Some(next);
                }
                length *= 0.5;
                if length < 1e-10 {
                    break None;
                }
            };
            let Some(next) = next else { break };
            at = next;
        }
        at
    }

    /// Consistent tangent `dT/dE` at the converged state.
    pub(super) fn tangent(&self, returned: &Returned) -> Mandel66 {
        let at = &returned.at;
        let elastic = &self.material.elastic;
        let two_mu = 2.0 * elastic.shear_modulus();
        let Some(inverse) = at.matrix.cholesky().map(|factor| factor.inverse()) else {
            return elastic.stiffness();
        };
        let v = inverse * at.rate;
        let increment = inverse * at.normal / (at.slope + at.normal.dot(&v));
        // dξ = (A⁻¹ - v ⊗ increment) dB, dEp = d(λ g), dB = 2μ dev dE.
        let xi = inverse - v * increment.transpose();
        let flow = at.normal * increment.transpose() * (at.equivalent * at.lambda_rate)
            + at.curvature * xi * at.lambda;
        let bulk = elastic.bulk_modulus();
        let deviator = Matrix::from_fn(|r, c| {
            f64::from(u8::from(r == c)) - if r < 3 && c < 3 { 1.0 / 3.0 } else { 0.0 }
        });
        let shear = (Matrix::identity() - flow * two_mu) * deviator * two_mu;
        std::array::from_fn(|r| {
            std::array::from_fn(|c| shear[(r, c)] + if r < 3 && c < 3 { bulk } else { 0.0 })
        })
    }
}

/// Newton step of `(ξ, x)`; `None` if the matrix is not positive definite.
fn newton_step(at: &Iterate) -> Option<(Vector, f64)> {
    let factor = at.matrix.cholesky()?;
    let v = factor.solve(&at.rate);
    let r = factor.solve(&at.first);
    let weight = at.yield_stress / (at.equivalent * at.equivalent);
    let increment = -(at.second + weight * at.normal.dot(&r))
        / (at.slope / at.equivalent + weight * at.normal.dot(&v));
    increment.is_finite().then(|| (-r - v * increment, increment))
}
