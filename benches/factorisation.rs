//! Factorisation and solve of the 62 x 62 x 2 sheet's pattern (35,721 unknowns).

use criterion::{Criterion, criterion_group, criterion_main};
use kanagata::geometry::Vec3;
use kanagata::solver::linear::multifrontal::{Factors, PatternRef, Symbolic};

/// Columns of nine unknowns on a grid, each tied to its eight neighbours; diagonally dominant, unsymmetric.
struct Plate {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    block: Vec<u32>,
    centers: Vec<Vec3>,
}

fn plate(n: usize, per_column: usize) -> Plate {
    let mut m = Plate {
        row_start: vec![0],
        columns: vec![],
        values: vec![],
        block: vec![],
        centers: vec![],
    };
    let mut seed = 7u64;
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        m.centers.push(Vec3::new(i as f64, j as f64, 0.0));
        for d in 0..per_column {
            let row = (i * n + j) * per_column + d;
            m.block.push((i * n + j) as u32);
            for ii in i.saturating_sub(1)..(i + 2).min(n) {
                for jj in j.saturating_sub(1)..(j + 2).min(n) {
                    for column in (0..per_column).map(|e| (ii * n + jj) * per_column + e) {
                        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                        let noise = (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5;
                        m.columns.push(column as u32);
                        m.values.push(if column == row { 60.0 } else { noise });
                    }
                }
            }
            m.row_start.push(m.columns.len());
        }
    }
    m
}

/// The mean of a matrix and its transpose, with a diagonal that makes it positive definite.
fn symmetric(m: &Plate) -> Vec<f64> {
    let row = |q: usize| m.row_start.partition_point(|&start| start <= q) - 1;
    let mirror = |q: usize| {
        let from = m.columns[q] as usize;
        let columns = &m.columns[m.row_start[from]..m.row_start[from + 1]];
        let at = columns.binary_search(&(row(q) as u32));
        m.row_start[from] + at.expect("the pattern is its own mirror")
    };
    let mean = |q: usize| 0.5 * (m.values[q] + m.values[mirror(q)]);
    (0..m.values.len()).map(mean).collect()
}

fn factorisation(c: &mut Criterion) {
    let m = plate(63, 9);
    let pattern = PatternRef { row_start: &m.row_start, columns: &m.columns };
    let plan = Symbolic::new(pattern, &m.block, &m.centers).expect("the pattern is sound");
    let mut factors = Factors::default();
    let mut group = c.benchmark_group("factorisation");
    group.sample_size(10);
    group.bench_function("lu 62x62x2", |b| b.iter(|| plan.factor(&m.values, &mut factors, &[])));
    let rhs = vec![1.0; m.block.len()];
    group.bench_function("solve 62x62x2", |b| {
        b.iter(|| {
            let mut x = rhs.clone();
            plan.solve(&factors, &mut [&mut x]);
            x
        });
    });
    let positive = symmetric(&m);
    group.bench_function("llt 62x62x2", |b| {
        b.iter(|| plan.factor_symmetric(&positive, &mut factors));
    });
    group.finish();
}

criterion_group!(benches, factorisation);
criterion_main!(benches);
