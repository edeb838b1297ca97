//! Internal strain modes of an element, condensed out of its force and tangent.
//!
//! The assumed strain is enhanced by `Σ α_k G_k` with `∫ G_kᵀ σ dV = 0` for every constant stress σ (patch test). The
//! modes are unknowns of the global Newton iteration. Each full evaluation stores the linearisation of
//! `r_α(u, α) = 0`, and the next one starts from `α - K_αα⁻¹ (r_α + K_αu (u' - u))`. An evaluation of the residual
//! predicts the modes in the same way and stores nothing, so a line search leaves the state unchanged.
//!
//! At the onset of yielding or unloading one such step may be followed by its reverse indefinitely, and the global
//! iteration then cycles. The modes are therefore iterated at fixed displacements by further Newton steps. A line
//! search on the work of `r_α` limits the length of these steps.

use super::kernels;
use super::{DOFS, ElementMatrices, FailureReason, PointFailure, Want};
use crate::numbers::tensor::Mandel66;

/// Maximum change of the mode strain (norm) in one iterate.
const MODE_STRAIN_CHANGE_MAX: f64 = 0.1;
/// Norm of the remaining Newton step, as a strain, below which the modes are converged.
const MODE_STRAIN_TOLERANCE: f64 = 1e-5;
/// Maximum ratio of the remaining to the applied mode strain for which the predicted step is accepted without local
/// iteration.
const MODE_REMAINDER_RATIO_MAX: f64 = 0.1;
/// The line search accepts a step when the slope at its end is at most this fraction of the slope at its start.
const LINE_SEARCH_SLOPE_RATIO: f64 = 0.2;
/// Maximum trial lengths of one line search.
const LINE_SEARCH_TRIALS_MAX: usize = 4;

/// Number of stored values of an element with `modes` modes: α, u, `K_αα⁻¹ r_α`, `K_αα⁻¹ K_αu`.
#[must_use]
pub(crate) fn record_len(modes: usize) -> usize {
    if modes == 0 { 0 } else { modes + DOFS + modes + modes * DOFS }
}

/// One mode at one point: the strain direction `T0[.., column]` times a polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mode {
    /// Component of the natural strain the mode acts on; 6 denotes the volume strain.
    pub column: usize,
    /// Powers of the natural coordinates.
    pub powers: [u8; 3],
}

impl Mode {
    /// Norm of the Cartesian strain of the mode at unit value; `map` is `T0`.
    pub(crate) fn strain_norm(&self, map: &Mandel66) -> f64 {
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

/// Residual of the modes at one evaluation: `r_α` [N mm] and the Newton step `K_αα⁻¹ r_α`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModeResidual<const M: usize> {
    residual: [f64; M],
    step: [f64; M],
}

impl<const M: usize> ModeResidual<M> {
    /// Directional derivative of the energy along `-step`: the work of `r_α`.
    fn slope(&self, of: &[f64; M]) -> f64 {
        -self.residual.iter().zip(of).map(|(r, s)| r * s).sum::<f64>()
    }
}

/// Norm of the strain of modes with these values; `unit` is the norm for each mode at unit value.
fn strain_norm<const M: usize>(values: &[f64; M], unit: &[f64; M]) -> f64 {
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

    /// Values of the modes at displacement `u`, predicted from the stored linearisation.
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

    /// Runs `evaluate` with the predicted modes and iterates them at fixed displacements if necessary.
    ///
    /// The predicted change is limited to [`MODE_STRAIN_CHANGE_MAX`]; `unit` is the strain norm of each mode at unit
    /// value. If the constitutive update fails (a step far beyond the linearisation), the change is halved up to
    /// three times. At most `max_iterations` local Newton steps follow; if they do not converge, the predicted values are
    /// kept.
    ///
    /// # Errors
    /// The error of `evaluate` with the stored modes.
    pub(crate) fn with_prediction(
        record: &mut [f64],
        u: &[f64; DOFS],
        unit: &[f64; M],
        max_iterations: usize,
        mut evaluate: impl FnMut(&[f64; M], &mut [f64]) -> Result<ModeResidual<M>, PointFailure>,
    ) -> Result<(), PointFailure> {
        let predicted = Self::predict(record, u);
        let mut stored = [0.0; M];
        stored.copy_from_slice(&record[..M]);
        let change = strain_norm(&std::array::from_fn(|k| predicted[k] - stored[k]), unit);
        let allowed =
            if change > MODE_STRAIN_CHANGE_MAX { MODE_STRAIN_CHANGE_MAX / change } else { 1.0 };
        for length in [1.0, 0.5, 0.25, 0.125] {
            let length = length * allowed;
            let alpha = std::array::from_fn(|k| stored[k] + length * (predicted[k] - stored[k]));
            if let Ok(found) = evaluate(&alpha, record) {
                // A predicted step that leaves a small remainder needs no local iteration.
                if max_iterations == 0
                    || strain_norm(&found.step, unit) <= MODE_REMAINDER_RATIO_MAX * length * change
                {
                    return Ok(());
                }
                if Self::iterate_at_fixed_displacement(
                    record,
                    unit,
                    max_iterations,
                    (alpha, found),
                    &mut evaluate,
                ) {
                    return Ok(());
                }
                return evaluate(&alpha, record).map(|_| ());
            }
        }
        evaluate(&stored, record).map(|_| ())
    }

    /// Local Newton iteration of the modes from `alpha`, the values evaluated last. Returns whether it has converged.
    fn iterate_at_fixed_displacement(
        record: &mut [f64],
        unit: &[f64; M],
        max_iterations: usize,
        (mut alpha, mut found): ([f64; M], ModeResidual<M>),
        mut evaluate: impl FnMut(&[f64; M], &mut [f64]) -> Result<ModeResidual<M>, PointFailure>,
    ) -> bool {
        for _ in 0..max_iterations {
            let (step, start) = (found.step, found.slope(&found.step));
            let size = strain_norm(&step, unit);
            if size <= MODE_STRAIN_TOLERANCE {
                return true;
            }
            if start >= 0.0 {
                return false;
            }
            let mut length = (MODE_STRAIN_CHANGE_MAX / size).min(1.0);
            let mut last = None;
            for _ in 0..LINE_SEARCH_TRIALS_MAX {
                let trial = std::array::from_fn(|k| alpha[k] - length * step[k]);
                last = evaluate(&trial, record).ok().map(|found| (trial, found));
                let end = last.map_or(f64::INFINITY, |(_, found)| found.slope(&step));
                if end <= -LINE_SEARCH_SLOPE_RATIO * start {
                    break;
                }
                length *=
                    if end.is_finite() { (start / (start - end)).clamp(0.1, 0.7) } else { 0.5 };
            }
            let Some(next) = last else { return false };
            (alpha, found) = next;
        }
        strain_norm(&found.step, unit) <= MODE_STRAIN_TOLERANCE
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
    ) -> Result<ModeResidual<M>, FailureReason> {
        let residual = self.residual;
        self.solve()?;
        let mode_residual = ModeResidual { residual, step: self.residual };
        let mut disturbance = 0.0;
        for dof in 0..DOFS {
            let change: f64 = (0..M).map(|k| self.left[k][dof] * self.residual[k]).sum();
            out.force[dof] -= change;
            disturbance += change * change;
        }
        out.internal_residual = disturbance.sqrt();
        if want == Want::Residual {
            return Ok(mode_residual);
        }
        self.left.as_flattened_mut().iter_mut().for_each(|value| *value = -*value);
        kernels::add_gram(&self.left, &self.right, &mut out.tangent);
        record[..M].copy_from_slice(alpha);
        record[M..M + DOFS].copy_from_slice(u);
        record[M + DOFS..2 * M + DOFS].copy_from_slice(&self.residual);
        for (chunk, row) in record[2 * M + DOFS..].chunks_exact_mut(DOFS).zip(&self.right) {
            chunk.copy_from_slice(row);
        }
        Ok(mode_residual)
    }

    /// Replaces `right` and `residual` by their products with `K_αα⁻¹` (Gauss-Jordan elimination with row pivoting).
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
