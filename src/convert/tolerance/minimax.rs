//! Shifts that make the sum of the P-th powers of errors least that are linear in them: Newton's method, its equations summed
//! once a step over the points and solved by conjugate gradients.

use super::vertex_directions::Way;

/// Power of the error whose sum is made least: near enough to its largest.
const POWER: i32 = 12;
/// Newton steps.
const STEPS: usize = 60;
/// Stiffness that keeps vertices where they are that nothing asks to move.
const STIFFNESS: f64 = 1e-9;

/// A point's error, and how far it moves with each way of the vertices around it.
pub(super) struct Row {
    /// Error as it is [mm].
    pub delta: f64,
    /// Ways, and what each mm along them adds to it.
    pub rates: Vec<(usize, f64)>,
}

impl Row {
    fn at(&self, shifts: &[f64]) -> f64 {
        self.delta + self.rates.iter().map(|&(way, rate)| rate * shifts[way]).sum::<f64>()
    }
}

/// Largest error with such shifts [mm].
pub(super) fn left(rows: &[Row], shifts: &[f64]) -> f64 {
    rows.iter().fold(0.0, |most, row| most.max(row.at(shifts).abs()))
}

/// Shifts that make the sum of `|delta + N s|^P` least, with those there are within their ranges.
pub(super) fn least_shifts(rows: &[Row], there: &[f64], ways: &[Way]) -> Vec<f64> {
    let moves = |row: &&Row| row.rates.iter().any(|rate| rate.1.abs() > 1e-9);
    let rows: Vec<&Row> = rows.iter().filter(moves).collect();
    let mut shifts = vec![0.0; ways.len()];
    let within = |k: usize, shift: f64| {
        shift.clamp(ways[k].range[0] - there[k], ways[k].range[1] - there[k])
    };
    let residuals = |shifts: &[f64]| -> Vec<f64> { rows.iter().map(|r| r.at(shifts)).collect() };
    let mut couplings = Couplings::of(&rows, ways.len());
    let value = |r: &[f64], scale: f64| r.iter().map(|x| (x / scale).powi(POWER)).sum::<f64>();
    for _ in 0..STEPS {
        let r = residuals(&shifts);
        let scale = r.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if scale < 1e-12 {
            break;
        }
        // What is at the end of its range and would leave it stays there.
        let leaves = |k: usize, step: f64| step != 0.0 && within(k, shifts[k] + step) == shifts[k];
        let mut held = vec![false; ways.len()];
        let gradient = couplings.weigh(&rows, &r, scale);
        let step = loop {
            let step = couplings.newton_step(&gradient, &held);
            let more: Vec<usize> = (0..step.len()).filter(|&k| leaves(k, step[k])).collect();
            if more.is_empty() {
                break step;
            }
            more.into_iter().for_each(|k| held[k] = true);
        };
        let at = |length: f64| -> Vec<f64> {
            (0..shifts.len()).map(|k| within(k, shifts[k] + length * step[k])).collect()
        };
        let next = backtrack(at, |tried| value(&residuals(tried), scale), value(&r, scale));
        let Some(next) = next else { break };
        shifts = next;
    }
    shifts
}

/// Shifts at the first of the step lengths 1, 1/2, 1/4 ... that brings `value` below `now`; `None` below 1e-4.
fn backtrack(
    at: impl Fn(f64) -> Vec<f64>,
    value: impl Fn(&[f64]) -> f64,
    now: f64,
) -> Option<Vec<f64>> {
    let mut length = 1.0;
    loop {
        let tried = at(length);
        if value(&tried) < now {
            return Some(tried);
        }
        length *= 0.5;
        if length < 1e-4 {
            return None;
        }
    }
}

/// `J' W J`, `W = |r|^(P - 2)`: a value for every two ways that are on one patch.
struct Couplings {
    /// Where the pairs of each way begin, and those of the last one end.
    starts: Vec<usize>,
    /// The other way of each pair.
    others: Vec<usize>,
    values: Vec<f64>,
    /// Places of the pairs of the ways that some rows have, one after the other.
    patterns: Vec<Vec<usize>>,
    /// Which of these each row has.
    pattern_of: Vec<usize>,
}

impl Couplings {
    fn of(rows: &[&Row], count: usize) -> Self {
        // Rows of one patch follow each other and have the same ways.
        let same = |a: &&Row, b: &&Row| a.rates.iter().map(|r| r.0).eq(b.rates.iter().map(|r| r.0));
        let runs: Vec<&[&Row]> = rows.chunk_by(same).collect();
        let mut beside: Vec<Vec<usize>> = (0..count).map(|k| vec![k]).collect();
        for run in &runs {
            for (way, _) in &run[0].rates {
                beside[*way].extend(run[0].rates.iter().map(|r| r.0));
            }
        }
        let mut starts = vec![0];
        for others in &mut beside {
            others.sort_unstable();
            others.dedup();
            starts.push(starts[starts.len() - 1] + others.len());
        }
        let place = |a: usize, b: usize| starts[a] + beside[a].partition_point(|&other| other < b);
        let pattern = |run: &&[&Row]| {
            let pairs =
                run[0].rates.iter().flat_map(|a| run[0].rates.iter().map(move |b| (a.0, b.0)));
            pairs.map(|(a, b)| place(a, b)).collect()
        };
        let patterns = runs.iter().map(pattern).collect();
        let numbers = runs.iter().enumerate();
        let pattern_of = numbers.flat_map(|(k, run)| std::iter::repeat_n(k, run.len())).collect();
        let others = beside.concat();
        Self { values: vec![0.0; others.len()], starts, others, patterns, pattern_of }
    }

    /// Sums the values for these errors; returns `-J' W r / (P - 1)`.
    fn weigh(&mut self, rows: &[&Row], r: &[f64], scale: f64) -> Vec<f64> {
        let mut gradient = vec![0.0; self.starts.len() - 1];
        self.values.fill(0.0);
        for ((row, x), &pattern) in rows.iter().zip(r).zip(&self.pattern_of) {
            let weight = (x / scale).powi(POWER - 2);
            let mut places = self.patterns[pattern].iter();
            for &(way, n) in &row.rates {
                gradient[way] -= weight * x * n / f64::from(POWER - 1);
                for (&(_, m), &place) in row.rates.iter().zip(places.by_ref()) {
                    self.values[place] += weight * n * m;
                }
            }
        }
        gradient
    }

    /// Newton's step `d` of the sum of P-th powers, `(P - 1) J' W J d = -J' W r`; zero for what is held.
    fn newton_step(&self, gradient: &[f64], held: &[bool]) -> Vec<f64> {
        let pairs = |k: usize| {
            let range = self.starts[k]..self.starts[k + 1];
            self.others[range.clone()].iter().zip(&self.values[range])
        };
        let free = |k: usize, x: f64| if held[k] { 0.0 } else { x };
        let own = |k: usize| pairs(k).find(|p| *p.0 == k).map_or(0.0, |p| *p.1);
        let diagonal: Vec<f64> = (0..held.len()).map(|k| STIFFNESS + own(k)).collect();
        let right: Vec<f64> = gradient.iter().enumerate().map(|(k, &g)| free(k, g)).collect();
        let apply = |d: &[f64]| -> Vec<f64> {
            let row = |k: usize| pairs(k).map(|(&other, value)| value * d[other]).sum::<f64>();
            (0..d.len()).map(|k| free(k, STIFFNESS * d[k] + row(k))).collect()
        };
        conjugate_gradients(apply, &right, &diagonal)
    }
}

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
    use crate::geometry::Vec3;

    fn row(delta: f64, rates: &[(usize, f64)]) -> Row {
        Row { delta, rates: rates.to_vec() }
    }

    #[test]
    fn couplings_are_the_sums_over_the_rows() {
        let rows = [
            row(1.0, &[(0, 0.5), (2, 1.0)]),
            row(-0.7, &[(0, 0.2), (2, -1.0)]),
            row(0.9, &[(1, 1.0), (2, 0.3)]),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let r: Vec<f64> = rows.iter().map(|row| row.delta).collect();
        let mut couplings = Couplings::of(&rows, 4);
        let gradient = couplings.weigh(&rows, &r, 1.0);
        let held = [false, true, false, false];
        let step = couplings.newton_step(&gradient, &held);
        assert!(step[1] == 0.0 && step[3] == 0.0, "{step:?}");
        let along = |row: &Row| row.rates.iter().map(|&(k, n)| n * step[k]).sum::<f64>();
        for k in [0, 2] {
            let sum = |row: &&Row| {
                let n = row.rates.iter().find(|rate| rate.0 == k).map_or(0.0, |rate| rate.1);
                let weight = row.delta.powi(POWER - 2);
                n * weight * (f64::from(POWER - 1) * along(row) + row.delta)
            };
            let left = rows.iter().map(sum).sum::<f64>();
            assert!(left.abs() < 1e-6, "{k}: {left}");
        }
    }

    #[test]
    fn the_largest_error_is_halved_where_it_is_of_one_sign() {
        let rows = [row(0.0, &[(0, -1.0)]), row(1.0, &[(0, -1.0)])];
        let way = Way { vertex: 0, direction: Vec3::z(), range: [-1.0, 1.0], slides: false };
        let shifts = least_shifts(&rows, &[0.0], &[way]);
        assert!((shifts[0] - 0.5).abs() < 1e-3 && left(&rows, &shifts) < 0.501, "{shifts:?}");
    }
}
