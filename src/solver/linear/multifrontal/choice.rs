//! Choice of the elimination order: nested dissection by coordinates, or minimum degree for graphs unrelated to
//! coordinates.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::order::{BlockGraph, nested_dissection};
use super::pattern::{Members, PatternError};
use super::supernodes::{Supernodes, supernodes};
use kanagata_geometry::Vec3;

/// Method that produced the elimination order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Ordering {
    /// Nested dissection by the coordinates of the blocks.
    #[default]
    Coordinates,
    /// Approximate minimum degree of the block graph.
    MinimumDegree,
}

/// An elimination order and its fronts.
pub(super) struct Elimination {
    pub ordering: Ordering,
    /// Block ids in elimination order; blocks without unknowns are excluded.
    pub order: Vec<u32>,
    pub nodes: Supernodes,
}

impl Elimination {
    fn new(ordering: Ordering, mut order: Vec<u32>, graph: &BlockGraph, members: &Members) -> Self {
        order.retain(|&b| !members.of(b as usize).is_empty());
        let nodes = supernodes(graph, &order, members);
        Self { ordering, order, nodes }
    }

    /// Number of multiply-add operations of a factorisation.
    fn operations(&self, members: &Members) -> f64 {
        let unknowns = |positions: &[u32]| -> usize {
            positions.iter().map(|&p| members.of(self.order[p as usize] as usize).len()).sum()
        };
        let one = |pivots, below| front_operations(unknowns(pivots), unknowns(below));
        self.nodes.list.iter().map(|node| one(&node.blocks, &node.below)).sum()
    }
}

/// Number of multiply-add operations of one front.
pub(super) fn front_operations(pivots: usize, below: usize) -> f64 {
    let (np, m) = (pivots as f64, below as f64);
    2.0 / 3.0 * np.powi(3) + 2.0 * np * np * m + 2.0 * np * m * m
}

/// Ratio of the operation counts (minimum degree over dissection) below which minimum degree is used. Sheets have
/// ratios of 0.7 to 1.7. Strips one or two elements wide, which cost little, have 0.47 and more and keep dissection.
const MINIMUM_DEGREE_WORK_RATIO: f64 = 0.35;

/// Minimum degree if there are no coordinates or if it needs far fewer operations; otherwise dissection by `centers`.
pub(super) fn elimination(
    graph: &BlockGraph,
    centers: &[Vec3],
    members: &Members,
) -> Result<Elimination, PatternError> {
    let by = |ordering, order| Elimination::new(ordering, order, graph, members);
    let degree = by(Ordering::MinimumDegree, minimum_degree(graph)?);
    if !are_distinct(centers) {
        return Ok(degree);
    }
    let dissected = by(Ordering::Coordinates, nested_dissection(graph, centers));
    let better =
        degree.operations(members) < MINIMUM_DEGREE_WORK_RATIO * dissected.operations(members);
    Ok(if better { degree } else { dissected })
}

/// Whether the coordinates are known and not all equal.
fn are_distinct(centers: &[Vec3]) -> bool {
    let known = centers.iter().all(|c| c.iter().all(|x| x.is_finite()));
    known && (centers.len() == 1 || centers.iter().any(|c| *c != centers[0]))
}

/// Elimination order of a graph (block ids in elimination order) by approximate minimum degree.
fn minimum_degree(graph: &BlockGraph) -> Result<Vec<u32>, PatternError> {
    let n = graph.len();
    // Upper triangle in compressed columns.
    let mut start = vec![0u32];
    let mut rows: Vec<u32> = Vec::with_capacity(graph.neighbours.len() / 2);
    for b in 0..n {
        rows.extend(graph.of(b).iter().filter(|&&other| (other as usize) < b));
        start.push(rows.len() as u32);
    }
    let upper = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &rows);
    let (mut order, mut position) = (vec![0u32; n], vec![0u32; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, rows.len()));
    let stack = MemStack::new(&mut memory);
    amd::order(&mut order, &mut position, upper, amd::Control::default(), stack)
        .map_err(|_| PatternError("more than 2^31 ties between blocks"))?;
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::super::order::tests::{grid, scattered};
    use super::*;
    use crate::linear::multifrontal::pattern::members_of;

    /// `size` unknowns in each block.
    fn members(graph: &BlockGraph, size: usize) -> Members {
        let block: Vec<u32> = (0..graph.len() * size).map(|i| (i / size) as u32).collect();
        members_of(&block, graph.len())
    }

    /// Operations with minimum degree over those with coordinates.
    fn ratio(graph: &BlockGraph, centers: &[Vec3], size: usize) -> f64 {
        let members = members(graph, size);
        let by = |order| {
            Elimination::new(Ordering::Coordinates, order, graph, &members).operations(&members)
        };
        by(minimum_degree(graph).unwrap()) / by(nested_dissection(graph, centers))
    }

    #[test]
    fn sheets_and_strips_keep_the_order_by_coordinates() {
        for (nx, ny) in [(125, 125), (63, 63), (100, 20), (71, 2), (200, 1), (7, 5), (2, 2), (1, 1)]
        {
            let (graph, centers) = grid(nx, ny);
            for size in [3, 6, 9, 15] {
                let ratio = ratio(&graph, &centers, size);
                println!("{nx} x {ny} columns of {size}: operations by minimum degree {ratio:.2}");
                assert!(ratio < 1.4, "{nx} x {ny}, {size}: {ratio}");
                let found = elimination(&graph, &centers, &members(&graph, size)).unwrap();
                assert_eq!(found.ordering, Ordering::Coordinates, "{nx} x {ny}, {size}: {ratio}");
                assert_eq!(found.order, nested_dissection(&graph, &centers));
            }
        }
    }

    #[test]
    fn unrelated_coordinates_cost_many_times_the_operations() {
        for (n, most) in [(6, 0.3), (8, 0.15), (12, 0.04)] {
            let (graph, centers) = scattered(n);
            let ratio = ratio(&graph, &centers, 3);
            println!("{n}^3 blocks, coordinates shuffled: operations by minimum degree {ratio:.3}");
            assert!(ratio < most, "{n}: {ratio}");
            let found = elimination(&graph, &centers, &members(&graph, 3)).unwrap();
            assert_eq!(found.ordering, Ordering::MinimumDegree);
        }
    }
}
