//! Solve, look at what is left, refine; a solver that cannot is replaced by the next one.

use super::{Groups, LinearError, LinearSolver, MultifrontalLu, SparseLu};
use crate::solver::pattern::Pattern;

/// Direct solvers in order of preference; the first that meets the accuracy answers.
pub struct CheckedSolver {
    pattern: Pattern,
    groups: Groups,
    solvers: Vec<Box<dyn LinearSolver>>,
    planned: usize,
    /// Solver that holds the present factors.
    current: usize,
    /// Times a later solver had to help.
    pub fallbacks: usize,
}

/// Residual over right-hand side that is good enough at once, and the most that is ever accepted.
const WANTED: f64 = 1e-11;
const ALLOWED: f64 = 1e-6;

impl CheckedSolver {
    /// Our multifrontal LU first, faer's sparse LU behind it.
    ///
    /// # Errors
    /// [`LinearError::Pattern`].
    pub fn new(pattern: &Pattern, groups: Groups) -> Result<Self, LinearError> {
        let solvers: Vec<Box<dyn LinearSolver>> =
            vec![Box::new(MultifrontalLu::default()), Box::new(SparseLu::default())];
        Self::with(pattern, groups, solvers)
    }

    /// These solvers, tried in order.
    ///
    /// # Errors
    /// [`LinearError::Pattern`].
    pub fn with(
        pattern: &Pattern,
        groups: Groups,
        solvers: Vec<Box<dyn LinearSolver>>,
    ) -> Result<Self, LinearError> {
        let mut out = Self {
            pattern: pattern.clone(),
            groups,
            solvers,
            planned: 0,
            current: 0,
            fallbacks: 0,
        };
        out.plan(0)?;
        Ok(out)
    }

    fn plan(&mut self, upto: usize) -> Result<(), LinearError> {
        while self.planned <= upto {
            self.solvers[self.planned].analyze(&self.pattern, &self.groups)?;
            self.planned += 1;
        }
        Ok(())
    }

    /// Factors `values` and solves for every right-hand side in place.
    ///
    /// # Errors
    /// The last solver's error when none succeeds.
    pub fn solve(&mut self, values: &[f64], rhs: &mut [Vec<f64>]) -> Result<(), LinearError> {
        let given: Vec<Vec<f64>> = rhs.to_vec();
        let mut last = Ok(());
        for k in 0..self.solvers.len() {
            self.plan(k)?;
            self.current = k;
            if k > 0 {
                self.fallbacks += 1;
                rhs.clone_from_slice(&given);
            }
            last = self.solvers[k].factor(values).and_then(|()| {
                rhs.iter_mut().zip(&given).try_for_each(|(x, b)| self.refined(values, x, b))
            });
            if last.is_ok() {
                break;
            }
        }
        last
    }

    fn refined(&mut self, values: &[f64], x: &mut [f64], b: &[f64]) -> Result<(), LinearError> {
        let size = norm(b);
        if size == 0.0 {
            x.fill(0.0);
            return Ok(());
        }
        let solver = &mut self.solvers[self.current];
        solver.solve(x);
        let mut left = f64::INFINITY;
        for _ in 0..6 {
            let mut residual = self.pattern.residual(values, x, b);
            let now = norm(&residual) / size;
            if now <= WANTED {
                return Ok(());
            }
            if now.is_nan() || now >= 0.5 * left {
                left = left.min(now);
                break;
            }
            left = now;
            solver.solve(&mut residual);
            x.iter_mut().zip(&residual).for_each(|(x, d)| *x += d);
        }
        if left <= ALLOWED {
            return Ok(());
        }
        Err(LinearError::Inaccurate { relative: left, allowed: ALLOWED })
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Pattern {
    /// `b - A x` for the matrix with these values.
    #[must_use]
    pub fn residual(&self, values: &[f64], x: &[f64], b: &[f64]) -> Vec<f64> {
        use rayon::prelude::*;
        let row = |r: usize| {
            let range = self.row_ptr[r]..self.row_ptr[r + 1];
            let dot: f64 = range.map(|q| values[q] * x[self.col_idx[q]]).sum();
            b[r] - dot
        };
        (0..self.dim()).into_par_iter().with_min_len(2048).map(row).collect()
    }
}
