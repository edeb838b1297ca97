//! Direct solve with residual check and iterative refinement; if a solver fails, the next one is used.

use std::time::Instant;

use super::pattern::Pattern;
use super::rows::NodeRows;
use super::update::{ChangedRows, Update};
use super::{Groups, LinearError, LinearSolver, MultifrontalLu, SparseLu};
use kanagata_cancel::Cancel;

/// Direct solvers in order of preference; the first one that meets the accuracy is used.
pub struct CheckedSolver {
    pattern: Pattern,
    nodes: Option<NodeRows>,
    groups: Groups,
    solvers: Vec<Box<dyn LinearSolver>>,
    planned: usize,
    /// Index of the solver that holds the current factors.
    current: usize,
    factored: bool,
    /// Largest plausible entry of the first solution if its residual is limited by rounding only ([`RESIDUAL_LIMIT_REL`]
    /// exceeded). The solution of a singular matrix consists of amplified rounding errors.
    pub max_plausible_entry: f64,
    /// Right-hand sides and solutions with these factors.
    solutions: Vec<(Vec<f64>, Vec<f64>)>,
    /// Wall time of all factorisations [s].
    pub factor_s: f64,
    /// Number of factorisations.
    pub factorisations: usize,
    /// Number of low-rank updates that replaced a factorisation.
    pub updates: usize,
    /// Wall time of these updates [s].
    pub update_s: f64,
    /// Wall time of all substitutions and refinements [s].
    pub solve_s: f64,
}

/// Relative residual at which refinement stops, and the largest one accepted.
const RESIDUAL_TARGET_REL: f64 = 1e-11;
const RESIDUAL_LIMIT_REL: f64 = 1e-6;

/// Largest accepted relative residual if it does not exceed the rounding error of its products ([`PRODUCT_ROUNDING_REL`]
/// of their sum). This occurs for a thin unsupported sheet, whose bending stiffness is 1e-9 of its membrane
/// stiffness.
const ROUNDING_RESIDUAL_LIMIT_REL: f64 = 1e-4;
const PRODUCT_ROUNDING_REL: f64 = 1e-14;

impl CheckedSolver {
    /// The multifrontal LU first, faer's sparse LU as fallback.
    ///
    /// # Errors
    /// [`LinearError::Pattern`].
    pub fn new(pattern: &Pattern, groups: Groups) -> Result<Self, LinearError> {
        let solvers: Vec<Box<dyn LinearSolver>> =
            vec![Box::new(MultifrontalLu::default()), Box::new(SparseLu::default())];
        Self::with(pattern, groups, solvers)
    }

    /// The given solvers, tried in order.
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
            max_plausible_entry: f64::INFINITY,
            solutions: Vec::new(),
            updates: 0,
            factor_s: 0.0,
            factorisations: 0,
            update_s: 0.0,
            solve_s: 0.0,
        };
        out.plan(0)?;
        Ok(out)
    }

    /// Aborts factorisations once cancellation is requested.
    pub fn set_cancel(&mut self, cancel: &Cancel) {
        self.solvers.iter_mut().for_each(|solver| solver.set_cancel(cancel));
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
    /// The error of the first solver if none succeeds.
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

    /// Whether a symmetric matrix is positive definite. The factors are discarded.
    pub fn is_definite(&mut self, values: &[f64]) -> bool {
        self.factored = false;
        self.solvers[0].factor_symmetric(values).is_ok()
    }

    /// Factors `values` and solves in place for every right-hand side.
    ///
    /// # Errors
    /// The error of the first solver if none succeeds; it locates the singularity.
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

    /// Factors and solves with one solver.
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
        let solved = self.refine(values, rhs, given, &|x| solver.solve(x));
        self.solutions = given.iter().cloned().zip(rhs.iter().cloned()).collect();
        self.solve_s += start.elapsed().as_secs_f64();
        solved
    }

    /// Solves in place for every right-hand side with the factors of an earlier matrix; `values` is the current
    /// matrix, which differs by `changed`. Falls back to [`CheckedSolver::solve`] without factors, after too many
    /// changes, or if the accuracy is not met.
    ///
    /// # Errors
    /// The error of the first solver if none succeeds.
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
            update.solve(solver, &mut slices(rhs), &self.solutions);
            let solved = self.refine(values, rhs, &given, &|x| update.solve(solver, x, &[]));
            self.solve_s += start.elapsed().as_secs_f64();
            if solved.is_ok() {
                self.updates += 1;
                return Ok(());
            }
            rhs.clone_from_slice(&given);
        }
        self.solve(values, rhs)
    }

    /// Iterative refinement of solutions of the right-hand sides `given` until their residuals are small enough.
    fn refine(
        &self,
        values: &[f64],
        rhs: &mut [Vec<f64>],
        given: &[Vec<f64>],
        solve_correction: &Solve<'_>,
    ) -> Result<(), LinearError> {
        let mut residual_ratio = vec![f64::INFINITY; rhs.len()];
        let mut pending: Vec<usize> = (0..rhs.len()).collect();
        for _ in 0..6 {
            let pairs: Vec<_> = pending.iter().map(|&k| [&rhs[k][..], &given[k][..]]).collect();
            let mut corrections = Vec::new();
            let residuals = self.pattern.residuals(values, &pairs, self.nodes.as_ref());
            for (&k, residual) in pending.iter().zip(residuals) {
                let now = norm(&residual) / norm(&given[k]).max(f64::MIN_POSITIVE);
                let diverging = now.is_nan() || now >= 0.5 * residual_ratio[k];
                residual_ratio[k] = if diverging { residual_ratio[k].min(now) } else { now };
                if !diverging && now > RESIDUAL_TARGET_REL {
                    corrections.push((k, residual));
                }
            }
            let mut vectors: Vec<Vec<f64>>;
            (pending, vectors) = corrections.into_iter().unzip();
            if pending.is_empty() {
                break;
            }
            solve_correction(&mut slices(&mut vectors));
            for (&k, d) in pending.iter().zip(&vectors) {
                rhs[k].iter_mut().zip(d).for_each(|(x, d)| *x += d);
            }
        }
        self.check_accuracy(values, rhs, given, &residual_ratio)
    }

    /// Refuses the first solution whose residual, relative to its right-hand side, is too large and no rounding.
    fn check_accuracy(
        &self,
        values: &[f64],
        solutions: &[Vec<f64>],
        given: &[Vec<f64>],
        residual_ratios: &[f64],
    ) -> Result<(), LinearError> {
        let inaccurate = |&(k, ratio): &(usize, f64)| {
            ratio.is_nan()
                || ratio > RESIDUAL_LIMIT_REL
                    && !self.is_rounding_limited(values, k, (&solutions[k], &given[k]), ratio)
        };
        match residual_ratios.iter().copied().enumerate().find(inaccurate) {
            Some((_, relative)) => {
                Err(LinearError::Inaccurate { relative, allowed: RESIDUAL_LIMIT_REL })
            }
            None => Ok(()),
        }
    }

    /// Whether the residual of the k-th solution `x` of `b`, of relative size `residual_ratio`, is pure rounding and the
    /// solution is plausible.
    fn is_rounding_limited(
        &self,
        values: &[f64],
        k: usize,
        (x, b): (&[f64], &[f64]),
        residual_ratio: f64,
    ) -> bool {
        let largest = x.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        residual_ratio <= ROUNDING_RESIDUAL_LIMIT_REL
            && (k > 0 || largest <= self.max_plausible_entry)
            && residual_ratio * norm(b) <= PRODUCT_ROUNDING_REL * self.sum_of_products(values, x, b)
    }

    /// Norm of the row sums of the absolute products, `| |A| |x| + |b| |`.
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
