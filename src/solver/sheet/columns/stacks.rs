//! Stacks of hexahedra along one direction of each, with their nodes in columns.

use super::error::SheetError;
use super::families::FACES_BY_DIRECTION;
use super::turning::{columns_to_reverse, points_down};
use crate::sheet::hanging::Hanging;
use crate::sheet::hex_mesh::HexMesh;
use kanagata_geometry::Vec3;

/// Nodes in columns, bottom first.
pub(super) struct Stacks {
    directions: Vec<usize>,
    columns: Vec<Vec<u32>>,
}

impl Stacks {
    pub(super) fn new(
        points: &[Vec3],
        elements: &[[u32; 8]],
        directions: &[usize],
    ) -> Result<Self, SheetError> {
        let Links { in_use, next } = &Links::new(points.len(), elements, directions)?;
        let mut columns: Vec<Vec<u32>> = Vec::new();
        let mut taken = vec![false; points.len()];
        for &first in in_use.iter().filter(|n| next[**n as usize].len() == 1) {
            if taken[first as usize] {
                continue;
            }
            let column = column_from(first, next, &mut taken);
            let others = columns.first().map_or(column.len(), Vec::len);
            if column.len() != others {
                let at = points[first as usize];
                let found = column.len();
                return Err(SheetError::Levels { found, others, x: at.x, y: at.y, z: at.z });
            }
            columns.push(column);
        }
        // A ring of elements closed through the thickness has no end.
        if in_use.iter().any(|n| !taken[*n as usize]) {
            return Err(SheetError::NoDirection);
        }
        Ok(Self { directions: directions.to_vec(), columns })
    }

    /// Mean length of the columns, and mean of its component along z [mm].
    pub(super) fn measures(&self, points: &[Vec3]) -> [f64; 2] {
        let steps = self.columns.iter().flat_map(|c| c.windows(2));
        let sum = steps.fold([0.0; 2], |sum, w| {
            let step = points[w[1] as usize] - points[w[0] as usize];
            [sum[0] + step.norm(), sum[1] + step.z.abs()]
        });
        sum.map(|s| s / self.columns.len().max(1) as f64)
    }

    /// Orients all columns consistently, upwards in the mean along z.
    fn orient_columns(&mut self, points: &[Vec3], elements: &[[u32; 8]]) -> Result<(), SheetError> {
        let mut place = vec![(0u32, 0u32); points.len()];
        for (c, column) in self.columns.iter().enumerate() {
            column.iter().enumerate().for_each(|(l, &n)| place[n as usize] = (c as u32, l as u32));
        }
        // Lower rings of the elements, as columns; columns of one element have the same orientation.
        let ring = |e: usize| FACES_BY_DIRECTION[self.directions[e]][0].map(|k| elements[e][k]);
        let up = |e: usize, k: usize| {
            let d = self.directions[e];
            let [a, b] =
                [0, 1].map(|side| place[elements[e][FACES_BY_DIRECTION[d][side][k]] as usize].1);
            b > a
        };
        let of_column = |e: usize| ring(e).map(|n| place[n as usize].0);
        let reverse = columns_to_reverse(elements.len(), self.columns.len(), of_column, up)?;
        for (column, reverse) in self.columns.iter_mut().zip(reverse) {
            if reverse {
                column.reverse();
            }
        }
        let sum: Vec3 = self
            .columns
            .iter()
            .map(|c| points[c[c.len() - 1] as usize] - points[c[0] as usize])
            .sum();
        if points_down(&sum) {
            self.columns.iter_mut().for_each(|c| c.reverse());
        }
        Ok(())
    }

    /// The mesh with all columns oriented consistently.
    pub(super) fn mesh(
        mut self,
        points: &[Vec3],
        elements: &[[u32; 8]],
    ) -> Result<HexMesh, SheetError> {
        self.orient_columns(points, elements)?;
        let levels = self.columns.first().map_or(1, Vec::len);
        let mut number = vec![0u32; points.len()];
        let mut nodes = Vec::with_capacity(levels * self.columns.len());
        for n in self.columns.iter().flatten() {
            number[*n as usize] = nodes.len() as u32;
            nodes.push(points[*n as usize]);
        }
        let elements = elements.iter().zip(&self.directions);
        let elements = elements.map(|(e, &d)| upright(&nodes, &e.map(|n| number[n as usize]), d));
        Ok(HexMesh {
            elements: elements.collect(),
            nodes,
            nodes_per_column: levels,
            hanging: Hanging::default(),
        })
    }
}

/// Adjacency of nodes through the thickness.
struct Links {
    /// Nodes of the elements, in element order.
    in_use: Vec<u32>,
    /// One or two neighbours of each node in use.
    next: Vec<Vec<u32>>,
}

impl Links {
    /// # Errors
    /// [`SheetError::Branches`] if a node has more than two neighbours.
    fn new(nodes: usize, elements: &[[u32; 8]], directions: &[usize]) -> Result<Self, SheetError> {
        let mut next: Vec<Vec<u32>> = vec![Vec::new(); nodes];
        let mut in_use = Vec::new();
        let mut seen = vec![false; nodes];
        for (e, (nodes, &d)) in elements.iter().zip(directions).enumerate() {
            for (low, high) in FACES_BY_DIRECTION[d][0].iter().zip(&FACES_BY_DIRECTION[d][1]) {
                let (a, b) = (nodes[*low], nodes[*high]);
                for (from, to) in [(a, b), (b, a)] {
                    let next = &mut next[from as usize];
                    if !next.contains(&to) {
                        next.push(to);
                    }
                    if next.len() > 2 {
                        return Err(SheetError::Branches { element: e });
                    }
                }
            }
            for &n in nodes {
                if !std::mem::replace(&mut seen[n as usize], true) {
                    in_use.push(n);
                }
            }
        }
        Ok(Self { in_use, next })
    }
}

/// Nodes of the column that starts at the end node `first`; marks them as `taken`.
fn column_from(first: u32, next: &[Vec<u32>], taken: &mut [bool]) -> Vec<u32> {
    let mut column = vec![first];
    taken[first as usize] = true;
    let mut now = first;
    while let Some(&other) = next[now as usize].iter().find(|n| !taken[**n as usize]) {
        taken[other as usize] = true;
        column.push(other);
        now = other;
    }
    column
}

/// The element with its lower ring first, counter-clockwise seen from the upper one.
fn upright(nodes: &[Vec3], e: &[u32; 8], direction: usize) -> [u32; 8] {
    let [mut low, mut high] = FACES_BY_DIRECTION[direction].map(|face| face.map(|k| e[k]));
    if low[0] > high[0] {
        std::mem::swap(&mut low, &mut high);
    }
    let x = |n: u32| nodes[n as usize];
    let normal = (x(low[2]) - x(low[0])).cross(&(x(low[3]) - x(low[1])));
    let up: Vec3 = (0..4).map(|k| x(high[k]) - x(low[k])).sum();
    if normal.dot(&up) < 0.0 {
        low.reverse();
        high.reverse();
    }
    [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]
}
