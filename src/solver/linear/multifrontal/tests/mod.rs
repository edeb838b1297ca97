//! Properties of the complete factorisation.

mod odd;

use super::order::BlockGraph;
use super::order::tests::grid;
use super::*;
use kanagata_geometry::Vec3;

struct Matrix {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    block: Vec<u32>,
    centers: Vec<Vec3>,
}

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64 - 0.5
}

/// Unsymmetric matrix on a grid of blocks of `size` unknowns; with dominance 0 the diagonal is weak.
fn matrix(nx: usize, ny: usize, size: usize, dominance: f64) -> Matrix {
    let (graph, centers) = grid(nx, ny);
    on_graph(&graph, centers, size, dominance)
}

/// Unsymmetric matrix on any graph of blocks.
fn on_graph(graph: &BlockGraph, centers: Vec<Vec3>, size: usize, dominance: f64) -> Matrix {
    let mut seed = 7;
    let mut m =
        Matrix { row_start: vec![0], columns: vec![], values: vec![], block: vec![], centers };
    for b in 0..graph.len() {
        let mut near: Vec<u32> = graph.of(b).to_vec();
        near.push(b as u32);
        near.sort_unstable();
        for d in 0..size {
            m.block.push(b as u32);
            for &other in &near {
                for e in 0..size {
                    let diagonal = other as usize == b && d == e;
                    m.columns.push((other as usize * size + e) as u32);
                    m.values.push(random(&mut seed) + if diagonal { dominance } else { 0.0 });
                }
            }
            m.row_start.push(m.columns.len());
        }
    }
    m
}

impl Matrix {
    fn pattern(&self) -> PatternRef<'_> {
        PatternRef { row_start: &self.row_start, columns: &self.columns }
    }

    fn plan(&self) -> Symbolic {
        Symbolic::new(self.pattern(), &self.block, &self.centers).unwrap()
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let row = |r: usize| self.row_start[r]..self.row_start[r + 1];
        (0..x.len())
            .map(|r| row(r).map(|q| self.values[q] * x[self.columns[q] as usize]).sum())
            .collect()
    }

    fn relative_residual(&self) -> f64 {
        let n = self.block.len();
        let exact: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 0.37).sin()).collect();
        let rhs = self.times(&exact);
        let (plan, mut factors) = (self.plan(), Factors::default());
        plan.factor(&self.values, &mut factors, &[]).unwrap();
        let mut x = rhs.clone();
        plan.solve(&factors, &mut [&mut x]);
        let worst = self.times(&x).iter().zip(&rhs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        worst / rhs.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }
}

#[test]
fn dominant_systems_are_solved_to_rounding() {
    for (nx, ny, size) in [(1, 1, 1), (2, 1, 3), (7, 5, 9), (31, 17, 6), (40, 40, 3)] {
        let residual = matrix(nx, ny, size, 40.0).relative_residual();
        assert!(residual < 1e-13, "{nx} x {ny} x {size}: {residual:e}");
    }
}

#[test]
fn pivoting_inside_fronts_carries_weak_diagonals() {
    let residual = matrix(12, 12, 9, 0.0).relative_residual();
    assert!(residual < 1e-6, "{residual:e}");
}

#[test]
fn right_hand_sides_solved_together_agree_with_single_ones() {
    for dominance in [30.0, 0.0] {
        let m = matrix(31, 17, 6, dominance);
        let (plan, mut factors) = (m.plan(), Factors::default());
        plan.factor(&m.values, &mut factors, &[]).unwrap();
        let n = m.block.len();
        let rhs = [0.3, 0.7, 1.1].map(|f| (0..n).map(|i| (i as f64 * f).cos()).collect());
        let mut together: [Vec<f64>; 3] = rhs.clone();
        plan.solve(&factors, &mut together.each_mut().map(Vec::as_mut_slice));
        for (mut alone, one) in rhs.into_iter().zip(&together) {
            plan.solve(&factors, &mut [&mut alone]);
            assert!(alone.iter().zip(one).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}

#[test]
fn factors_have_the_same_bits_for_any_number_of_threads_and_when_reused() {
    let m = matrix(40, 36, 9, 30.0);
    let plan = m.plan();
    assert!(plan.fronts.iter().any(|f| f.parallel), "the case must fork");
    let solve_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut factors = Factors::default();
            let others: Vec<f64> = m.values.iter().map(|v| 1.5 * v + 1.0).collect();
            plan.factor(&others, &mut factors, &[]).unwrap();
            plan.factor(&m.values, &mut factors, &[]).unwrap();
            let mut x: Vec<f64> = (0..m.block.len()).map(|i| i as f64).collect();
            plan.solve(&factors, &mut [&mut x]);
            x
        })
    };
    let one = solve_with(1);
    for threads in [1, 2, 4] {
        let other = solve_with(threads);
        assert!(one.iter().zip(&other).all(|(a, b)| a.to_bits() == b.to_bits()), "{threads}");
    }
}

impl Matrix {
    /// Symmetric part of the matrix.
    fn symmetric(mut self) -> Self {
        let row = |q: usize| self.row_start.partition_point(|&start| start <= q) - 1;
        let mirror = |q: usize| {
            let from = self.columns[q] as usize;
            (self.row_start[from]..self.row_start[from + 1])
                .find(|&other| self.columns[other] as usize == row(q))
                .unwrap()
        };
        let mean = |q: usize| 0.5 * (self.values[q] + self.values[mirror(q)]);
        self.values = (0..self.values.len()).map(mean).collect();
        self
    }
}

#[test]
fn symmetric_factors_solve_as_well_with_the_same_bits_for_any_number_of_threads() {
    for (nx, ny, size) in [(1, 1, 1), (2, 1, 3), (7, 5, 9), (40, 36, 9)] {
        let m = matrix(nx, ny, size, 40.0).symmetric();
        let n = m.block.len();
        let exact: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 0.37).sin()).collect();
        let (plan, rhs) = (m.plan(), m.times(&exact));
        let solve_with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut factors = Factors::default();
                // Data left by an unsymmetric factorisation must have no effect.
                plan.factor(&m.values, &mut factors, &[]).unwrap();
                plan.factor_symmetric(&m.values, &mut factors).unwrap();
                let mut x = rhs.clone();
                plan.solve(&factors, &mut [&mut x]);
                x
            })
        };
        let one = solve_with(1);
        let off = one.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{nx} x {ny} x {size}: {off:e}");
        assert!(one.iter().zip(&solve_with(3)).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_has_no_symmetric_factors() {
    let mut m = matrix(9, 9, 3, 40.0).symmetric();
    let row = 100;
    let diagonal = (m.row_start[row]..m.row_start[row + 1]).find(|&q| m.columns[q] == row as u32);
    m.values[diagonal.unwrap()] = -40.0;
    let mut factors = Factors::default();
    assert!(m.plan().factor_symmetric(&m.values, &mut factors).is_err());
    assert!(m.plan().factor(&m.values, &mut factors, &[]).is_ok());
}

#[test]
fn a_singular_matrix_is_named_not_solved() {
    let mut m = matrix(6, 6, 3, 20.0);
    let row = 50;
    for q in m.row_start[row]..m.row_start[row + 1] {
        m.values[q] = 0.0;
    }
    let singular = m.plan().factor(&m.values, &mut Factors::default(), &[]).unwrap_err();
    assert!(singular.unknown < m.block.len());
    m.values[m.row_start[row]] = f64::NAN;
    assert!(m.plan().factor(&m.values, &mut Factors::default(), &[]).is_err());
}

#[test]
fn separate_pieces_have_separate_roots() {
    let mut m = matrix(1, 1, 4, 5.0);
    let other = m.columns.len();
    for r in 0..4 {
        m.columns.extend((4..8).map(|c| c as u32));
        m.values.extend_from_within(r * 4..r * 4 + 4);
        m.row_start.push(other + 4 * (r + 1));
    }
    m.block.extend([1; 4]);
    m.centers.push(Vec3::x());
    assert!(m.relative_residual() < 1e-13);
}

#[test]
fn a_structure_with_one_sided_entries_is_solved_too() {
    let m = Matrix {
        row_start: vec![0, 2, 3, 5, 7],
        columns: vec![0, 2, 1, 1, 2, 3, 0],
        values: vec![2.0, 1.0, 3.0, -1.0, 2.0, 5.0, 0.5],
        block: vec![0, 1, 2, 3],
        centers: vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()],
    };
    assert!(m.relative_residual() < 1e-15);
}

#[test]
fn patterns_that_do_not_fit_are_refused() {
    let centers = [Vec3::zeros()];
    let refused = |row_start: &[usize], columns: &[u32], block: &[u32]| {
        Symbolic::new(PatternRef { row_start, columns }, block, &centers).is_err()
    };
    assert!(refused(&[0, 1], &[1], &[0]), "column outside");
    assert!(refused(&[0, 2], &[0], &[0]), "row starts beyond the columns");
    assert!(refused(&[0, 1], &[0], &[1]), "block without a centre");
}

#[test]
fn products_with_the_inverse_are_those_of_whole_solutions() {
    let m = matrix(23, 17, 6, 5.0);
    let n = m.block.len();
    let (plan, mut factors) = (m.plan(), Factors::default());
    plan.factor(&m.values, &mut factors, &[]).unwrap();
    let columns: Vec<usize> = (0..20).map(|k| (k * 613 + 5) % n).collect();
    // Rows with entries close together and far apart, one of them empty.
    let places = |i: usize| (0..i).map(|k| (i * 337 + k * (1 + i * 91)) % n).collect::<Vec<_>>();
    let rows: Vec<(Vec<usize>, Vec<f64>)> = (0..30)
        .map(|i| (places(i), (0..i).map(|k| (1.0 + k as f64 + i as f64).sin()).collect()))
        .collect();
    let rows: Vec<SparseRow<'_>> = rows.iter().map(|(c, v)| (&c[..], &v[..])).collect();
    let product = plan.plan_inverse_product(&rows, &columns);
    let found = plan.products(&factors, &product);
    for (column, found) in columns.iter().zip(found.chunks_exact(rows.len())) {
        let mut x = vec![0.0; n];
        x[*column] = 1.0;
        plan.solve(&factors, &mut [&mut x]);
        for ((columns, values), found) in rows.iter().zip(found) {
            let sought: f64 = columns.iter().zip(*values).map(|(&c, v)| v * x[c]).sum();
            assert!((found - sought).abs() < 1e-13, "{found} {sought}");
        }
    }
    let near = plan.plan_inverse_product(&[(&[0, 1], &[1.0, 2.0])], &[0, 1, 2]);
    let (few, many) = (plan.relative_cost(&near), plan.relative_cost(&product));
    assert!(few > 0.0 && few < 0.2 * many, "{few} {many}");
}
