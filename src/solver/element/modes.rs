//! Internal strain modes of an element, condensed out of its force and tangent.
//!
//! The assumed strain gets `Σ α_k G_k` with `∫ G_kᵀ σ dV = 0` for every constant stress σ (patch test). The
//! modes are unknowns of the global Newton iteration: each full evaluation stores the linearisation of
//! `r_α(u, α) = 0`, and the next one starts from `α - K_αα⁻¹ (r_α + K_αu (u' - u))`. A residual-only evaluation
//! predicts the modes the same way and stores nothing, so line searches leave no trace.
//!
//! Where points begin or cease to flow one such step may lead nowhere, and the next back: the modes of a single element go
//! round in a circle, and with them the whole sheet. They are then settled at the displacements there are, by further steps
//! of their own, no longer than the work of `r_α` along them allows.

use super::kernels;
use super::{DOFS, ElementMatrices, FailureReason, PointFailure, Want};
use crate::solver::numbers::tensor::Mandel66;

/// Largest change of the modes' strain in one iterate.
const MAX_STRAIN_CHANGE: f64 = 0.1;
/// Strain of the modes that is still to come where they count as settled.
const STRAIN_TOLERANCE: f64 = 1e-5;
/// Share of a step's strain that is still to come after it at most where it has led on.
const REMAINING_STRAIN_RATIO: f64 = 0.1;
/// A step of the modes is good when the slope at its end is at most this share of the slope at its beginning.
const SLOPE_RATIO: f64 = 0.2;
/// Trials of a step.
const MAX_TRIALS: usize = 4;

/// Stored values of an element with `modes` modes: α, u, `K_αα⁻¹ r_α`, `K_αα⁻¹ K_αu`.
#[must_use]
pub(crate) fn record_len(modes: usize) -> usize {
    if modes == 0 { 0 } else { modes + DOFS + modes + modes * DOFS }
}

/// One mode at one point: value of the strain direction `T0[.., column]` times a polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mode {
    /// Component of the natural strain the mode acts on; 6 stands for the volume strain.
    pub column: usize,
    /// Powers of the natural coordinates.
    pub powers: [u8; 3],
}

impl Mode {
    /// Size of the Cartesian strain of a mode of value one, `map` being `T0`.
    pub(crate) fn unit(&self, map: &Mandel66) -> f64 {
        if self.column < 6 {
            map.iter().map(|row| row[self.column].powi(2)).sum::<f64>().sqrt()
        } else {
            3.0_f64.sqrt()
        }
    }

    /// Value of the polynomial.
    #[inline]
    pub(crate) fn value(&self, xi: [f64; 3]) -> f64 {
        let mut product = 1.0;
        for (x, &power) in xi.iter().zip(&self.powers) {
            if power > 0 {
                product *= x;
            }
        }
        product
    }
}

/// What an evaluation says of the modes: `r_α` [N mm] and `K_αα⁻¹ r_α`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unsettled<const M: usize> {
    residual: [f64; M],
    step: [f64; M],
}

impl<const M: usize> Unsettled<M> {
    /// Work of `r_α` along minus the step `of`.
    fn slope(&self, of: &[f64; M]) -> f64 {
        -self.residual.iter().zip(of).map(|(r, s)| r * s).sum::<f64>()
    }
}

/// Size of the strain of modes with these values, `unit` being that of each per unit.
fn strain<const M: usize>(values: &[f64; M], unit: &[f64; M]) -> f64 {
    values.iter().zip(unit).map(|(value, unit)| (value * unit).powi(2)).sum::<f64>().sqrt()
}

/// Sums over the points of an element with `M` modes.
#[derive(Debug, Clone)]
pub(crate) struct ModeSums<const M: usize> {
    /// `r_α` [N mm].
    pub residual: [f64; M],
    /// `K_αα`.
    pub stiffness: [[f64; M]; M],
    /// `K_uα`, by mode.
    pub left: [[f64; DOFS]; M],
    /// `K_αu`, by mode.
    pub right: [[f64; DOFS]; M],
}

impl<const M: usize> ModeSums<M> {
    /// All zero.
    pub(crate) fn zero() -> Self {
        Self {
            residual: [0.0; M],
            stiffness: [[0.0; M]; M],
            left: [[0.0; DOFS]; M],
            right: [[0.0; DOFS]; M],
        }
    }

    /// The modes' values predicted at displacement `u` from the stored linearisation.
    fn predict(record: &[f64], u: &[f64; DOFS]) -> [f64; M] {
        let (alpha, rest) = record.split_at(M);
        let (reference, rest) = rest.split_at(DOFS);
        let (correction, coupling) = rest.split_at(M);
        std::array::from_fn(|k| {
            let row = &coupling[k * DOFS..(k + 1) * DOFS];
            let moved: f64 =
                row.iter().zip(u).zip(reference).map(|((c, u), u0)| c * (u - u0)).sum();
            alpha[k] - correction[k] - moved
        })
    }

    /// Runs `evaluate` with the predicted modes, their change kept under [`MAX_STRAIN_CHANGE`] of strain (`unit` is
    /// the size of the strain per unit of each mode); where the prediction still collapses the material (a
    /// step far beyond the linearisation), again with the modes nearer to the stored ones. Then settles them in up to
    /// `rounds` steps, or leaves them where they were predicted.
    ///
    /// # Errors
    /// What `evaluate` returns with the stored modes.
    pub(crate) fn with_prediction(
        record: &mut [f64],
        u: &[f64; DOFS],
        unit: &[f64; M],
        rounds: usize,
        mut evaluate: impl FnMut(&[f64; M], &mut [f64]) -> Result<Unsettled<M>, PointFailure>,
    ) -> Result<(), PointFailure> {
        let predicted = Self::predict(record, u);
        let mut stored = [0.0; M];
        stored.copy_from_slice(&record[..M]);
        let change = strain(&std::array::from_fn(|k| predicted[k] - stored[k]), unit);
        let allowed = if change > MAX_STRAIN_CHANGE { MAX_STRAIN_CHANGE / change } else { 1.0 };
        for share in [1.0, 0.5, 0.25, 0.125] {
            let share = share * allowed;
            let alpha = std::array::from_fn(|k| stored[k] + share * (predicted[k] - stored[k]));
            if let Ok(found) = evaluate(&alpha, record) {
                // A step that leads on leaves little to come.
                if rounds == 0
                    || strain(&found.step, unit) <= REMAINING_STRAIN_RATIO * share * change
                {
                    return Ok(());
                }
                if Self::settle(record, unit, rounds, (alpha, found), &mut evaluate) {
                    return Ok(());
                }
                return evaluate(&alpha, record).map(|_| ());
            }
        }
        evaluate(&stored, record).map(|_| ())
    }

    /// Goes on from modes `alpha`, which were evaluated last, until they are settled; whether they are.
    fn settle(
        record: &mut [f64],
        unit: &[f64; M],
        rounds: usize,
        (mut alpha, mut found): ([f64; M], Unsettled<M>),
        mut evaluate: impl FnMut(&[f64; M], &mut [f64]) -> Result<Unsettled<M>, PointFailure>,
    ) -> bool {
        for _ in 0..rounds {
            let (step, start) = (found.step, found.slope(&found.step));
            let size = strain(&step, unit);
            if size <= STRAIN_TOLERANCE {
                return true;
            }
            if start >= 0.0 {
                return false;
            }
            let mut share = (MAX_STRAIN_CHANGE / size).min(1.0);
            let mut last = None;
            for _ in 0..MAX_TRIALS {
                let there = std::array::from_fn(|k| alpha[k] - share * step[k]);
                last = evaluate(&there, record).ok().map(|found| (there, found));
                let end = last.map_or(f64::INFINITY, |(_, found)| found.slope(&step));
                if end <= -SLOPE_RATIO * start {
                    break;
                }
                share *=
                    if end.is_finite() { (start / (start - end)).clamp(0.1, 0.7) } else { 0.5 };
            }
            let Some(next) = last else { return false };
            (alpha, found) = next;
        }
        strain(&found.step, unit) <= STRAIN_TOLERANCE
    }

    /// Condenses the modes out of `out`; a full evaluation stores its linearisation in `record`.
    ///
    /// # Errors
    /// [`FailureReason::SingularModes`] when `K_αα` cannot be inverted.
    pub(crate) fn condense(
        mut self,
        alpha: &[f64; M],
        u: &[f64; DOFS],
        want: Want,
        record: &mut [f64],
        out: &mut ElementMatrices,
    ) -> Result<Unsettled<M>, FailureReason> {
        let residual = self.residual;
        self.solve()?;
        let unsettled = Unsettled { residual, step: self.residual };
        let mut disturbance = 0.0;
        for dof in 0..DOFS {
            let change: f64 = (0..M).map(|k| self.left[k][dof] * self.residual[k]).sum();
            out.force[dof] -= change;
            disturbance += change * change;
        }
        out.internal_residual = disturbance.sqrt();
        if want == Want::Residual {
            return Ok(unsettled);
        }
        self.left.as_flattened_mut().iter_mut().for_each(|value| *value = -*value);
        kernels::add_gram(&self.left, &self.right, &mut out.tangent);
        record[..M].copy_from_slice(alpha);
        record[M..M + DOFS].copy_from_slice(u);
        record[M + DOFS..2 * M + DOFS].copy_from_slice(&self.residual);
        for (chunk, row) in record[2 * M + DOFS..].chunks_exact_mut(DOFS).zip(&self.right) {
            chunk.copy_from_slice(row);
        }
        Ok(unsettled)
    }

    /// Replaces `right` and `residual` by `K_αα⁻¹` times themselves (elimination with row pivoting).
    fn solve(&mut self) -> Result<(), FailureReason> {
        for pivot in 0..M {
            let largest = |row: usize| self.stiffness[row][pivot].abs();
            let best = (pivot..M)
                .fold(pivot, |best, row| if largest(row) > largest(best) { row } else { best });
            let value = self.stiffness[best][pivot];
            if !(value.abs() > 0.0 && value.is_finite()) {
                return Err(FailureReason::SingularModes { pivot: value });
            }
            self.stiffness.swap(pivot, best);
            self.right.swap(pivot, best);
            self.residual.swap(pivot, best);
            let inverse = 1.0 / value;
            self.stiffness[pivot].iter_mut().for_each(|x| *x *= inverse);
            self.right[pivot].iter_mut().for_each(|x| *x *= inverse);
            self.residual[pivot] *= inverse;
            let (row, right, residual) =
                (self.stiffness[pivot], self.right[pivot], self.residual[pivot]);
            for other in 0..M {
                let factor = self.stiffness[other][pivot];
                if other == pivot || factor == 0.0 {
                    continue;
                }
                self.stiffness[other].iter_mut().zip(&row).for_each(|(x, y)| *x -= factor * y);
                self.right[other].iter_mut().zip(&right).for_each(|(x, y)| *x -= factor * y);
                self.residual[other] -= factor * residual;
            }
        }
        Ok(())
    }
}
