//! Approximate minimax problem: shifts s that minimise `sum_i |delta_i + (N s)_i|^P` over all points i.
//!
//! The errors are linear in the shifts. Newton's method is used; its equations are assembled once for each step and
//! solved by conjugate gradients. The shifts are bounded by an active set of fixed components.

use super::vertex_directions::VertexDirection;

/// Power P of the error. The P-norm of n errors of equal size exceeds their maximum by the factor n^(1/P).
const ERROR_POWER: i32 = 12;
/// Maximum number of Newton steps.
const NEWTON_STEPS_MAX: usize = 60;
/// Relative reduction of the P-norm by a Newton step below which the iteration ends. Doubled: errors up to 0.1 % larger,
/// a fifth fewer steps.
const NORM_REDUCTION_MIN: f64 = 1e-3;
/// Regularisation added to the diagonal of the scaled matrix. Shifts without effect on the errors stay zero.
const REGULARISATION: f64 = 1e-9;

/// Error of a point and its derivatives with respect to the shifts.
pub(super) struct Row {
    /// Error without further shifts [mm].
    pub delta: f64,
    /// Indices of vertex directions, and the change of the error for a unit shift along each [mm/mm].
    pub rates: Vec<(usize, f64)>,
}

impl Row {
    /// Error with these shifts [mm].
    fn error(&self, shifts: &[f64]) -> f64 {
        self.delta + self.rates.iter().map(|&(k, rate)| rate * shifts[k]).sum::<f64>()
    }
}

/// Maximum absolute error with these shifts [mm].
pub(super) fn largest_error(rows: &[Row], shifts: &[f64]) -> f64 {
    rows.iter().fold(0.0, |most, row| most.max(row.error(shifts).abs()))
}

/// Shifts that minimise `sum |delta + N s|^P` [mm]. They are added to the shifts `current`; the sums stay within the
/// ranges of the directions.
pub(super) fn minimax_shifts(
    rows: &[Row],
    current: &[f64],
    directions: &[VertexDirection],
) -> Vec<f64> {
    let moves = |row: &&Row| row.rates.iter().any(|rate| rate.1.abs() > 1e-9);
    let rows: Vec<&Row> = rows.iter().filter(moves).collect();
    let mut shifts = vec![0.0; directions.len()];
    let within = |k: usize, shift: f64| {
        shift.clamp(directions[k].range[0] - current[k], directions[k].range[1] - current[k])
    };
    let residuals = |shifts: &[f64]| -> Vec<f64> { rows.iter().map(|r| r.error(shifts)).collect() };
    let mut matrix = NormalMatrix::of(&rows, directions.len());
    let mut r = residuals(&shifts);
    for _ in 0..NEWTON_STEPS_MAX {
        let scale = r.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if scale < 1e-12 {
            break;
        }
        // A shift at a bound is fixed if its step would violate the bound.
        let leaves = |k: usize, step: f64| step != 0.0 && within(k, shifts[k] + step) == shifts[k];
        let right = matrix.assemble(&rows, &r, scale);
        let step = bounded_step(&mut matrix, &right, leaves);
        let before = power_sum(&r, scale);
        let tried = |length: f64| {
            let at = |k: usize| within(k, shifts[k] + length * step[k]);
            let next: Vec<f64> = (0..shifts.len()).map(at).collect();
            let errors = residuals(&next);
            (power_sum(&errors, scale), (next, errors))
        };
        let Some((after, next)) = backtrack(tried, before) else { break };
        (shifts, r) = next;
        if (after / before).powf(1.0 / f64::from(ERROR_POWER)) > 1.0 - NORM_REDUCTION_MIN {
            break;
        }
    }
    shifts
}

/// Newton's step with those shifts fixed whose step leaves their bounds.
fn bounded_step(
    matrix: &mut NormalMatrix,
    right: &[f64],
    leaves: impl Fn(usize, f64) -> bool,
) -> Vec<f64> {
    let mut fixed = vec![false; right.len()];
    loop {
        let step = matrix.newton_step(right, &fixed);
        let more: Vec<usize> = (0..step.len()).filter(|&k| leaves(k, step[k])).collect();
        if more.is_empty() {
            return step;
        }
        more.into_iter().for_each(|k| fixed[k] = true);
    }
}

/// Sum of the P-th powers of `r / scale`.
fn power_sum(r: &[f64], scale: f64) -> f64 {
    r.iter().map(|x| (x / scale).powi(ERROR_POWER)).sum()
}

/// Backtracking line search: value and state at the first step length 1, 1/2, 1/4 ... at which `tried` has a value below
/// `now`. `None` below 1e-4.
fn backtrack<S>(tried: impl Fn(f64) -> (f64, S), now: f64) -> Option<(f64, S)> {
    let lengths = std::iter::successors(Some(1.0), |length| Some(0.5 * length));
    lengths.take_while(|length| *length >= 1e-4).map(tried).find(|found| found.0 < now)
}

/// Sparse matrix `N' W N` with the diagonal weights `W = |r|^(P - 2)`, in compressed rows. Two directions couple when a
/// patch has both.
struct NormalMatrix {
    /// Start of each row in `columns`, and the end of the last one.
    starts: Vec<usize>,
    /// Column of each entry.
    columns: Vec<usize>,
    values: Vec<f64>,
    /// Positions of the entries of consecutive points with the same directions, all pairs in order.
    patterns: Vec<Vec<usize>>,
    /// Pattern of each point.
    pattern_of: Vec<usize>,
}

impl NormalMatrix {
    /// Determines the sparsity pattern for `count` directions.
    fn of(rows: &[&Row], count: usize) -> Self {
        // The points of one patch are consecutive and have the same directions.
        let same = |a: &&Row, b: &&Row| a.rates.iter().map(|r| r.0).eq(b.rates.iter().map(|r| r.0));
        let runs: Vec<&[&Row]> = rows.chunk_by(same).collect();
        let mut coupled: Vec<Vec<usize>> = (0..count).map(|k| vec![k]).collect();
        for run in &runs {
            for (k, _) in &run[0].rates {
                coupled[*k].extend(run[0].rates.iter().map(|r| r.0));
            }
        }
        let mut starts = vec![0];
        for columns in &mut coupled {
            columns.sort_unstable();
            columns.dedup();
            starts.push(starts[starts.len() - 1] + columns.len());
        }
        let position = |a: usize, b: usize| starts[a] + coupled[a].partition_point(|&c| c < b);
        let pattern = |run: &&[&Row]| {
            let pairs =
                run[0].rates.iter().flat_map(|a| run[0].rates.iter().map(move |b| (a.0, b.0)));
            pairs.map(|(a, b)| position(a, b)).collect()
        };
        let patterns = runs.iter().map(pattern).collect();
        let numbers = runs.iter().enumerate();
        let pattern_of = numbers.flat_map(|(k, run)| std::iter::repeat_n(k, run.len())).collect();
        let columns = coupled.concat();
        Self { values: vec![0.0; columns.len()], starts, columns, patterns, pattern_of }
    }

    /// Assembles the matrix for the errors `r`, scaled by `scale`; returns the right-hand side `-N' W r / (P - 1)`.
    fn assemble(&mut self, rows: &[&Row], r: &[f64], scale: f64) -> Vec<f64> {
        let mut right = vec![0.0; self.starts.len() - 1];
        self.values.fill(0.0);
        for ((row, x), &pattern) in rows.iter().zip(r).zip(&self.pattern_of) {
            let weight = (x / scale).powi(ERROR_POWER - 2);
            let mut positions = self.patterns[pattern].iter();
            for &(k, n) in &row.rates {
                right[k] -= weight * x * n / f64::from(ERROR_POWER - 1);
                for (&(_, m), &position) in row.rates.iter().zip(positions.by_ref()) {
                    self.values[position] += weight * n * m;
                }
            }
        }
        right
    }

    /// Newton step d of the sum of P-th powers: `(P - 1) N' W N d = -N' W r`. Fixed components are zero.
    fn newton_step(&self, right: &[f64], fixed: &[bool]) -> Vec<f64> {
        let pairs = |k: usize| {
            let range = self.starts[k]..self.starts[k + 1];
            self.columns[range.clone()].iter().zip(&self.values[range])
        };
        let free = |k: usize, x: f64| if fixed[k] { 0.0 } else { x };
        let own = |k: usize| pairs(k).find(|p| *p.0 == k).map_or(0.0, |p| *p.1);
        let diagonal: Vec<f64> = (0..fixed.len()).map(|k| REGULARISATION + own(k)).collect();
        let right: Vec<f64> = right.iter().enumerate().map(|(k, &g)| free(k, g)).collect();
        let apply = |d: &[f64]| -> Vec<f64> {
            let row = |k: usize| pairs(k).map(|(&column, value)| value * d[column]).sum::<f64>();
            (0..d.len()).map(|k| free(k, REGULARISATION * d[k] + row(k))).collect()
        };
        conjugate_gradients(apply, &right, &diagonal)
    }
}

/// Conjugate gradients with diagonal preconditioning: at most 200 iterations, until `r . z` has fallen to 1e-6 of its
/// initial value.
fn conjugate_gradients(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    right: &[f64],
    diagonal: &[f64],
) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let scaled = |r: &[f64]| r.iter().zip(diagonal).map(|(x, d)| x / d).collect::<Vec<f64>>();
    let mut x = vec![0.0; right.len()];
    let mut r = right.to_vec();
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let end = 1e-6 * rz;
    for _ in 0..200 {
        if rz <= end || rz <= 0.0 {
            break;
        }
        let q = apply(&p);
        let a = rz / dot(&p, &q);
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += a * p);
        r.iter_mut().zip(&q).for_each(|(r, q)| *r -= a * q);
        z = scaled(&r);
        let next = dot(&r, &z);
        let b = next / rz;
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + b * *p);
        rz = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Vec3;

    fn row(delta: f64, rates: &[(usize, f64)]) -> Row {
        Row { delta, rates: rates.to_vec() }
    }

    #[test]
    fn the_newton_step_satisfies_its_equations() {
        let rows = [
            row(1.0, &[(0, 0.5), (2, 1.0)]),
            row(-0.7, &[(0, 0.2), (2, -1.0)]),
            row(0.9, &[(1, 1.0), (2, 0.3)]),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let r: Vec<f64> = rows.iter().map(|row| row.delta).collect();
        let mut matrix = NormalMatrix::of(&rows, 4);
        let right = matrix.assemble(&rows, &r, 1.0);
        let fixed = [false, true, false, false];
        let step = matrix.newton_step(&right, &fixed);
        assert!(step[1] == 0.0 && step[3] == 0.0, "{step:?}");
        let along = |row: &Row| row.rates.iter().map(|&(k, n)| n * step[k]).sum::<f64>();
        for k in [0, 2] {
            let sum = |row: &&Row| {
                let n = row.rates.iter().find(|rate| rate.0 == k).map_or(0.0, |rate| rate.1);
                let weight = row.delta.powi(ERROR_POWER - 2);
                n * weight * (f64::from(ERROR_POWER - 1) * along(row) + row.delta)
            };
            let residual = rows.iter().map(sum).sum::<f64>();
            assert!(residual.abs() < 1e-6, "{k}: {residual}");
        }
    }

    #[test]
    fn the_largest_error_is_halved_where_it_is_of_one_sign() {
        let rows = [row(0.0, &[(0, -1.0)]), row(1.0, &[(0, -1.0)])];
        let range = [-1.0, 1.0];
        let direction = VertexDirection { vertex: 0, vector: Vec3::z(), range, slides: false };
        let shifts = minimax_shifts(&rows, &[0.0], &[direction]);
        assert!(
            (shifts[0] - 0.5).abs() < 1e-3 && largest_error(&rows, &shifts) < 0.501,
            "{shifts:?}"
        );
    }
}
