//! Solve, look at what is left, refine; a solver that cannot is replaced by the next one.

use std::time::Instant;

use rayon::prelude::*;

use super::update::{ChangedRows, Update};
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
    factored: bool,
    /// Right-hand sides and solutions with these factors.
    known: Vec<(Vec<f64>, Vec<f64>)>,
    /// Times a later solver had to help.
    pub fallbacks: usize,
    /// Wall time of all factorisations so far [s].
    pub factor_s: f64,
    /// Factorisations so far.
    pub factorisations: usize,
    /// Times factors were brought up to date instead.
    pub updates: usize,
    /// Wall time of all substitutions and refinements so far [s].
    pub solve_s: f64,
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
            factored: false,
            known: Vec::new(),
            updates: 0,
            fallbacks: 0,
            factor_s: 0.0,
            factorisations: 0,
            solve_s: 0.0,
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

    /// As [`CheckedSolver::solve`] for a symmetric matrix, by LL^T if it is positive definite.
    ///
    /// # Errors
    /// The last solver's error when none succeeds.
    pub fn solve_symmetric(
        &mut self,
        values: &[f64],
        rhs: &mut [Vec<f64>],
    ) -> Result<(), LinearError> {
        let given: Vec<Vec<f64>> = rhs.to_vec();
        if self.solve_with(0, true, values, rhs, &given).is_ok() {
            return Ok(());
        }
        rhs.clone_from_slice(&given);
        self.solve(values, rhs)
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
            if k > 0 {
                self.fallbacks += 1;
                rhs.clone_from_slice(&given);
            }
            last = self.solve_with(k, false, values, rhs, &given);
            if last.is_ok() {
                break;
            }
        }
        last
    }

    /// Factors and solves by one solver.
    fn solve_with(
        &mut self,
        k: usize,
        symmetric: bool,
        values: &[f64],
        rhs: &mut [Vec<f64>],
        given: &[Vec<f64>],
    ) -> Result<(), LinearError> {
        self.current = k;
        let start = Instant::now();
        let solver = &mut self.solvers[k];
        let factored =
            if symmetric { solver.factor_symmetric(values) } else { solver.factor(values) };
        self.factor_s += start.elapsed().as_secs_f64();
        self.factorisations += 1;
        self.factored = factored.is_ok();
        factored?;
        let start = Instant::now();
        let solver = self.solvers[k].as_ref();
        let solve = |_: usize, x: &mut [f64]| solver.solve(x);
        let solved = self.refined_all(values, rhs, given, [&solve, &solve]);
        self.known = given.iter().cloned().zip(rhs.iter().cloned()).collect();
        self.solve_s += start.elapsed().as_secs_f64();
        solved
    }

    /// Solves for every right-hand side in place with the factors of an earlier matrix; `values` is the matrix now,
    /// which differs by `changed`. Without factors, where too much has changed or the accuracy is not met, as
    /// [`CheckedSolver::solve`].
    ///
    /// # Errors
    /// The last solver's error when none succeeds.
    pub fn solve_changed(
        &mut self,
        values: &[f64],
        changed: &ChangedRows,
        rhs: &mut [Vec<f64>],
    ) -> Result<(), LinearError> {
        let start = Instant::now();
        let given: Vec<Vec<f64>> = rhs.to_vec();
        let solver = self.solvers[self.current].as_ref();
        if self.factored
            && let Some(update) = Update::new(solver, &self.pattern, changed)
        {
            let again = |x: &mut [f64]| update.solve(solver, x);
            let first = |k: usize, x: &mut [f64]| match self.known.get(k) {
                Some((b, known)) => update.solve_from(solver, x, (b, known)),
                None => again(x),
            };
            let solved = self.refined_all(values, rhs, &given, [&first, &|_, x| again(x)]);
            if solved.is_ok() {
                self.updates += 1;
                self.solve_s += start.elapsed().as_secs_f64();
                return Ok(());
            }
            rhs.clone_from_slice(&given);
        }
        self.solve_s += start.elapsed().as_secs_f64();
        self.solve(values, rhs)
    }

    /// Right-hand sides at the same time, each on its own.
    fn refined_all(
        &self,
        values: &[f64],
        rhs: &mut [Vec<f64>],
        given: &[Vec<f64>],
        [first, next]: [&Solve<'_>; 2],
    ) -> Result<(), LinearError> {
        let each = rhs.par_iter_mut().zip(given).enumerate();
        let done: Vec<_> = each
            .map(|(k, (x, b))| self.refined(values, x, b, [&|x| first(k, x), &|x| next(k, x)]))
            .collect();
        done.into_iter().collect()
    }

    fn refined(
        &self,
        values: &[f64],
        x: &mut [f64],
        b: &[f64],
        [first, next]: [SolveOne<'_>; 2],
    ) -> Result<(), LinearError> {
        let size = norm(b);
        if size == 0.0 {
            x.fill(0.0);
            return Ok(());
        }
        first(x);
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
            next(&mut residual);
            x.iter_mut().zip(&residual).for_each(|(x, d)| *x += d);
        }
        if left <= ALLOWED {
            return Ok(());
        }
        Err(LinearError::Inaccurate { relative: left, allowed: ALLOWED })
    }
}

/// Solves in place.
type SolveOne<'a> = &'a dyn Fn(&mut [f64]);

/// Solves in place for the right-hand side of this number.
type Solve<'a> = dyn Fn(usize, &mut [f64]) + Sync + 'a;

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Pattern {
    /// `b - A x` for the matrix with these values.
    #[must_use]
    pub fn residual(&self, values: &[f64], x: &[f64], b: &[f64]) -> Vec<f64> {
        let row = |r: usize| {
            let range = self.row_ptr[r]..self.row_ptr[r + 1];
            let dot: f64 = range.map(|q| values[q] * x[self.col_idx[q]]).sum();
            b[r] - dot
        };
        (0..self.dim()).into_par_iter().with_min_len(2048).map(row).collect()
    }
}
