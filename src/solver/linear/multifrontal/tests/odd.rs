//! Graphs unrelated to coordinates: minimum degree, and the same solutions.

use super::super::order::tests::{from_ties, scattered};
use super::*;
use crate::linear::pattern::Pattern;
use crate::linear::{Groups, LinearSolver, MultifrontalLu, SparseLu};

/// Solutions by the multifrontal LU and faer's LU differ by less than 1e-10 of the largest.
fn agrees_with_faer(m: &Matrix, what: &str) {
    let col_idx = m.columns.iter().map(|&c| c as usize).collect();
    let pattern = Pattern { row_ptr: m.row_start.clone(), col_idx };
    let groups = Groups { of_unknown: m.block.clone(), centers: m.centers.clone() };
    let solution = |solver: &mut dyn LinearSolver| {
        let mut x: Vec<f64> = (0..m.block.len()).map(|i| (i as f64 * 0.37).sin()).collect();
        solver.analyze(&pattern, &groups).unwrap();
        solver.factor(&m.values, &[]).unwrap();
        solver.solve(&mut [&mut x]);
        x
    };
    let (ours, theirs) =
        (solution(&mut MultifrontalLu::default()), solution(&mut SparseLu::default()));
    let largest = theirs.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let off = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-10 * largest, "{what}: {off:e} of {largest:e}");
}

/// Every block coupled to three arbitrary others.
fn random_graph(blocks: usize) -> BlockGraph {
    let mut seed = 3;
    let mut anywhere = || ((random(&mut seed) + 0.5) * blocks as f64) as u32 % blocks as u32;
    from_ties(blocks, (0..3 * blocks as u32).map(|k| [k / 3, anywhere()]))
}

#[test]
fn random_graphs_and_arrows_are_solved_as_by_faer() {
    let nowhere = [Vec::new(), vec![Vec3::x(); 300], vec![Vec3::repeat(f64::NAN); 300]];
    // The head of the arrow comes first: eliminated first it would fill the whole matrix.
    let arrow = from_ties(300, (1..300).map(|k| [0, k]));
    for (graph, what) in [(random_graph(300), "random"), (arrow, "arrow")] {
        for centers in &nowhere {
            let m = on_graph(&graph, centers.clone(), 3, 30.0);
            assert_eq!(m.plan().ordering(), Ordering::MinimumDegree, "{what}");
            agrees_with_faer(&m, what);
        }
    }
}

#[test]
fn an_arrow_takes_operations_by_its_length() {
    let flops = |blocks: u32| {
        let arrow = from_ties(blocks as usize, (1..blocks).map(|k| [0, k]));
        on_graph(&arrow, Vec::new(), 3, 30.0).plan().flops()
    };
    assert!(flops(4000) < 2.1 * flops(2000), "{} {}", flops(4000), flops(2000));
}

#[test]
fn a_grid_in_space_with_shuffled_coordinates_is_solved_as_by_faer() {
    let (graph, centers) = scattered(8);
    let m = on_graph(&graph, centers, 3, 60.0);
    assert_eq!(m.plan().ordering(), Ordering::MinimumDegree);
    agrees_with_faer(&m, "shuffled");
}

#[test]
fn groups_without_unknowns_do_no_harm() {
    let mut m = matrix(7, 5, 3, 30.0);
    m.block.iter_mut().for_each(|b| *b *= 2);
    for centers in [Vec::new(), (0..70).map(|k| Vec3::x() * f64::from(k)).collect()] {
        m.centers = centers;
        agrees_with_faer(&m, "gaps");
    }
}
