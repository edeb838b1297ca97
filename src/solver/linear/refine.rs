//! Solve, look at what is left, refine; a solver that cannot is replaced by the next one.

use std::time::Instant;

use super::pattern::Pattern;
use super::rows::NodeRows;
use super::update::{ChangedRows, Update};
use super::{Groups, LinearError, LinearSolver, MultifrontalLu, SparseLu};
use crate::cancel::Cancel;

/// Direct solvers in order of preference; the first that meets the accuracy answers.
pub struct CheckedSolver {
    pattern: Pattern,
    nodes: Option<NodeRows>,
    groups: Groups,
    solvers: Vec<Box<dyn LinearSolver>>,
    planned: usize,
    /// Solver that holds the present factors.
    current: usize,
    factored: bool,
    /// The largest entry of the first solution that is believed where rounding leaves more of its right-hand side than
    /// [`RESIDUAL_MAX`]: of a singular matrix it is whatever rounding makes of it.
    pub plausible: f64,
    /// Right-hand sides and solutions with these factors.
    known: Vec<(Vec<f64>, Vec<f64>)>,
    /// Wall time of all factorisations so far [s].
    pub factor_s: f64,
    /// Factorisations so far.
    pub factorisations: usize,
    /// Times factors were brought up to date instead.
    pub updates: usize,
    /// Wall time of these updates so far [s].
    pub update_s: f64,
    /// Wall time of all substitutions and refinements so far [s].
    pub solve_s: f64,
}

/// Residual over right-hand side that is good enough at once, and the most that is accepted.
const RESIDUAL_GOOD: f64 = 1e-11;
const RESIDUAL_MAX: f64 = 1e-6;

/// The most that is accepted of a residual that is no more than what its products are rounded by, over their sum: of a thin
/// sheet that no tool carries, which resists bending by a billionth of what it resists otherwise.
const RESIDUAL_MAX_OF_ROUNDING: f64 = 1e-4;
const PRODUCT_ROUNDING: f64 = 1e-14;

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
            nodes: NodeRows::of(pattern),
            groups,
            solvers,
            planned: 0,
            current: 0,
            factored: false,
            plausible: f64::INFINITY,
            known: Vec::new(),
            updates: 0,
            factor_s: 0.0,
            factorisations: 0,
            update_s: 0.0,
            solve_s: 0.0,
        };
        out.plan(0)?;
        Ok(out)
    }

    /// Gives up factorisations from when the request is made on.
    pub fn heed(&mut self, cancel: &Cancel) {
        self.solvers.iter_mut().for_each(|solver| solver.heed(cancel));
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
        let found = self.solve_with(0, true, values, rhs, &given);
        if matches!(found, Ok(()) | Err(LinearError::Cancelled)) {
            return found;
        }
        rhs.clone_from_slice(&given);
        self.solve(values, rhs)
    }

    /// Whether a symmetric matrix is positive definite. There are no factors afterwards.
    pub fn is_definite(&mut self, values: &[f64]) -> bool {
        self.factored = false;
        self.solvers[0].factor_symmetric(values).is_ok()
    }

    /// Factors `values` and solves for every right-hand side in place.
    ///
    /// # Errors
    /// The first solver's error when none succeeds: it says where the matrix is singular.
    pub fn solve(&mut self, values: &[f64], rhs: &mut [Vec<f64>]) -> Result<(), LinearError> {
        let given: Vec<Vec<f64>> = rhs.to_vec();
        let mut done = Ok(());
        for k in 0..self.solvers.len() {
            self.plan(k)?;
            if k > 0 {
                rhs.clone_from_slice(&given);
            }
            let found = self.solve_with(k, false, values, rhs, &given);
            if matches!(found, Ok(()) | Err(LinearError::Cancelled)) {
                return found;
            }
            done = done.and(found);
        }
        done
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
        let factored = if symmetric {
            solver.factor_symmetric(values)
        } else {
            solver.factor(values, &given.iter().map(Vec::as_slice).collect::<Vec<_>>())
        };
        self.factor_s += start.elapsed().as_secs_f64();
        self.factorisations += 1;
        self.factored = factored.is_ok();
        factored?;
        let start = Instant::now();
        let solver = self.solvers[k].as_mut();
        solver.finish(&mut slices(rhs));
        let solver = self.solvers[k].as_ref();
        let solved = self.refined(values, rhs, given, &|x| solver.solve(x));
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
        let solver = self.solvers[self.current].as_ref();
        let update = if self.factored { Update::new(solver, &self.pattern, changed) } else { None };
        self.update_s += start.elapsed().as_secs_f64();
        if let Some(update) = update {
            let start = Instant::now();
            let given: Vec<Vec<f64>> = rhs.to_vec();
            update.solve(solver, &mut slices(rhs), &self.known);
            let solved = self.refined(values, rhs, &given, &|x| update.solve(solver, x, &[]));
            self.solve_s += start.elapsed().as_secs_f64();
            if solved.is_ok() {
                self.updates += 1;
                return Ok(());
            }
            rhs.clone_from_slice(&given);
        }
        self.solve(values, rhs)
    }

    /// Looks at what solutions leave of the right-hand sides that were `given`, and solves again for those of which it is
    /// too much.
    fn refined(
        &self,
        values: &[f64],
        rhs: &mut [Vec<f64>],
        given: &[Vec<f64>],
        again_for: &Solve<'_>,
    ) -> Result<(), LinearError> {
        let mut left = vec![f64::INFINITY; rhs.len()];
        let mut open: Vec<usize> = (0..rhs.len()).collect();
        for _ in 0..6 {
            let pairs: Vec<_> = open.iter().map(|&k| [&rhs[k][..], &given[k][..]]).collect();
            let mut again = Vec::new();
            let residuals = self.pattern.residuals(values, &pairs, self.nodes.as_ref());
            for (&k, residual) in open.iter().zip(residuals) {
                let now = norm(&residual) / norm(&given[k]).max(f64::MIN_POSITIVE);
                let wrong = now.is_nan() || now >= 0.5 * left[k];
                left[k] = if wrong { left[k].min(now) } else { now };
                if !wrong && now > RESIDUAL_GOOD {
                    again.push((k, residual));
                }
            }
            open = again.iter().map(|&(k, _)| k).collect();
            if open.is_empty() {
                break;
            }
            again_for(&mut again.iter_mut().map(|(_, d)| d.as_mut_slice()).collect::<Vec<_>>());
            for (k, d) in again {
                rhs[k].iter_mut().zip(&d).for_each(|(x, d)| *x += d);
            }
        }
        let wrong = |k: usize| {
            let left = left[k];
            left.is_nan()
                || left > RESIDUAL_MAX && !self.is_rounded(values, k, (&rhs[k], &given[k]), left)
        };
        match (0..rhs.len()).find(|&k| wrong(k)) {
            Some(k) => Err(LinearError::Inaccurate { relative: left[k], allowed: RESIDUAL_MAX }),
            None => Ok(()),
        }
    }

    /// Whether what the k-th solution `x` leaves of `b`, a share `left` of it, is rounding, and the solution is not.
    fn is_rounded(&self, values: &[f64], k: usize, (x, b): (&[f64], &[f64]), left: f64) -> bool {
        let most = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        left <= RESIDUAL_MAX_OF_ROUNDING
            && (k > 0 || most <= self.plausible)
            && left * norm(b) <= PRODUCT_ROUNDING * self.sum_of_products(values, x, b)
    }

    /// Norm of what the rows sum up, without signs.
    fn sum_of_products(&self, values: &[f64], x: &[f64], b: &[f64]) -> f64 {
        let rows = self.pattern.row_ptr.windows(2).zip(b);
        let of_row = |(ends, b): (&[usize], &f64)| {
            let products = (ends[0]..ends[1]).map(|q| values[q] * x[self.pattern.col_idx[q]]);
            products.map(f64::abs).sum::<f64>() + b.abs()
        };
        rows.map(of_row).map(|sum| sum * sum).sum::<f64>().sqrt()
    }
}

/// Solves in place for every right-hand side.
type Solve<'a> = dyn Fn(&mut [&mut [f64]]) + 'a;

fn slices(all: &mut [Vec<f64>]) -> Vec<&mut [f64]> {
    all.iter_mut().map(Vec::as_mut_slice).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
