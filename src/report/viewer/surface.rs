//! Surfaces of a 3-D view and what is derived from them.

use std::collections::HashMap;

use kanagata_geometry::Vec3;

/// Where a field has its values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Location {
    /// At every point.
    #[default]
    Points,
    /// In every cell.
    Cells,
}

/// A quantity on a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Field {
    /// Name with unit. Fields of the same name share a colour scale.
    pub name: String,
    /// Where it has values.
    pub location: Location,
    /// The colour scale is centred on zero.
    pub signed: bool,
    /// One value per point, or per cell number.
    pub values: Vec<f64>,
}

/// A surface at an earlier step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// Displacement of the whole surface from its final place [mm].
    pub shift: Vec3,
    /// Points [mm]; empty: those of the surface.
    pub points: Vec<Vec3>,
    /// Values of every field; empty: those of the surface.
    pub values: Vec<Vec<f64>>,
}

/// How a surface is shown at first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Visibility {
    /// Opaque.
    #[default]
    Shown,
    /// Transparent.
    Transparent,
    /// Not shown.
    Hidden,
}

/// A triangulated surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Name.
    pub name: String,
    /// Points [mm].
    pub points: Vec<Vec3>,
    /// Triangles by point.
    pub triangles: Vec<[u32; 3]>,
    /// Number of the cell (element, patch) that each triangle belongs to; empty: every triangle is a cell.
    pub cells: Vec<u32>,
    /// What a cell is called: `element`, `patch`.
    pub cell_name: &'static str,
    /// Number of the first point in the result files, and the difference from point to point.
    pub numbering: [u32; 2],
    /// Fields; none: one colour.
    pub fields: Vec<Field>,
    /// How it is shown at first.
    pub visibility: Visibility,
    /// Its state at each of the view's earlier steps; empty: it does not move.
    pub frames: Vec<Frame>,
}

impl Surface {
    /// Cell of each triangle.
    pub(super) fn owners(&self) -> Vec<u32> {
        if self.cells.len() == self.triangles.len() {
            return self.cells.clone();
        }
        (0..self.triangles.len() as u32).collect()
    }

    /// Edges of the cells: sides of triangles that only one triangle of their cell has. Each once, by its two points.
    pub(super) fn cell_edges(&self) -> Vec<[u32; 2]> {
        let owners = self.owners();
        let mut counts: HashMap<(u32, [u32; 2]), usize> = HashMap::new();
        let sides = |triangle: &[u32; 3]| {
            let [a, b, c] = *triangle;
            [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
        };
        for (triangle, &owner) in self.triangles.iter().zip(&owners) {
            for side in sides(triangle) {
                *counts.entry((owner, side)).or_default() += 1;
            }
        }
        let single = counts.iter().filter(|(_, count)| **count == 1);
        let mut edges: Vec<[u32; 2]> = single.map(|((_, side), _)| *side).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Box around the points: its smallest and largest coordinates; `None` without points.
    pub(super) fn bounds(&self) -> Option<[Vec3; 2]> {
        let frames = self.frames.iter().flat_map(|frame| &frame.points);
        let mut points = self.points.iter().chain(frames).copied();
        let first = points.next()?;
        Some(points.fold([first, first], |[low, high], p| [low.inf(&p), high.sup(&p)]))
    }
}

/// Triangles of polygons, as fans from their first points, with the number of each one's polygon.
pub fn fans<'a>(polygons: impl Iterator<Item = &'a [u32]>) -> (Vec<[u32; 3]>, Vec<u32>) {
    let (mut triangles, mut cells) = (Vec::new(), Vec::new());
    for (cell, ids) in polygons.enumerate() {
        for k in 2..ids.len() {
            triangles.push([ids[0], ids[k - 1], ids[k]]);
            cells.push(cell as u32);
        }
    }
    (triangles, cells)
}

/// Triangles that are connected by common points have the same number; numbers ascend from 0.
#[must_use]
pub fn connected(triangles: &[[u32; 3]], points: usize) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..points as u32).collect();
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (a, b) = (root(&mut parent, a), root(&mut parent, other));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers = HashMap::new();
    let number = |triangle: &[u32; 3]| {
        let root = root(&mut parent, triangle[0]);
        let next = numbers.len() as u32;
        *numbers.entry(root).or_insert(next)
    };
    triangles.iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares side by side.
    fn squares() -> Surface {
        let points = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)];
        let quads: [[u32; 4]; 2] = [[0, 1, 4, 3], [1, 2, 5, 4]];
        let (triangles, cells) = fans(quads.iter().map(|q| &q[..]));
        let points = points.iter().map(|&(x, y)| Vec3::new(f64::from(x), f64::from(y), 0.0));
        Surface { points: points.collect(), triangles, cells, ..Surface::default() }
    }

    #[test]
    fn edges_are_those_of_cells_without_diagonals() {
        let mut surface = squares();
        let expected = [[0, 1], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [4, 5]];
        assert_eq!(surface.cell_edges(), expected);
        // Of one cell: without the edge between the squares.
        surface.cells = vec![0; 4];
        assert!(surface.cell_edges().len() == 6 && !surface.cell_edges().contains(&[1, 4]));
        surface.cells.clear();
        assert_eq!((surface.cell_edges().len(), surface.owners()), (9, vec![0, 1, 2, 3]));
    }

    #[test]
    fn bounds_hold_every_step() {
        let mut surface = squares();
        let moved = surface.points.iter().map(|p| p + Vec3::new(0.0, 0.0, -3.0)).collect();
        surface.frames.push(Frame { points: moved, ..Frame::default() });
        let [low, high] = surface.bounds().unwrap();
        assert_eq!((low, high), (Vec3::new(0.0, 0.0, -3.0), Vec3::new(2.0, 1.0, 0.0)));
        assert_eq!(Surface::default().bounds(), None);
    }

    #[test]
    fn triangles_with_common_points_are_one_cell() {
        let triangles = [[0, 1, 2], [5, 4, 3], [2, 1, 6], [3, 7, 8]];
        assert_eq!(connected(&triangles, 9), [0, 1, 0, 1]);
        assert!(connected(&[], 0).is_empty());
    }
}
