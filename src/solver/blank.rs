//! The blank: a mesh of 8-node hexahedra whose nodes are grouped by columns through the thickness.

use crate::geometry::{Vec2, Vec3};

/// A hexahedral mesh of a sheet.
///
/// Local nodes 0..4 of an element are its bottom face seen counter-clockwise from the top, 4..8 the nodes
/// above them. In a structured blank all nodes of one column are consecutive, bottom first: node
/// `column * nodes_per_column + level`.
#[derive(Debug, Clone, PartialEq)]
pub struct HexMesh {
    /// Node coordinates [mm].
    pub nodes: Vec<Vec3>,
    /// Node ids of each element.
    pub elements: Vec<[u32; 8]>,
    /// Nodes in each through-thickness column (levels); 1 for a mesh without columns.
    pub nodes_per_column: usize,
}

/// A rectangle `[0, size_x] x [0, size_y] x [0, thickness]` [mm] of `nx` x `ny` elements and `nz` layers.
///
/// Column `i * (ny + 1) + j` stands over `(i, j)`. Counts of zero are taken as one.
#[must_use]
pub fn rectangle(
    size_x: f64,
    size_y: f64,
    thickness: f64,
    nx: usize,
    ny: usize,
    nz: usize,
) -> HexMesh {
    let (nx, ny, nz) = (nx.max(1), ny.max(1), nz.max(1));
    let levels = nz + 1;
    let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1) * levels);
    let part = |size: f64, index: usize, count: usize| size * index as f64 / count as f64;
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                nodes.push(Vec3::new(
                    part(size_x, i, nx),
                    part(size_y, j, ny),
                    part(thickness, k, nz),
                ));
            }
        }
    }
    let id = |i: usize, j: usize, k: usize| ((i * (ny + 1) + j) * levels + k) as u32;
    let mut elements = Vec::with_capacity(nx * ny * nz);
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let layer =
                    |k: usize| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                let (low, high) = (layer(k), layer(k + 1));
                elements.push([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]);
            }
        }
    }
    HexMesh { nodes, elements, nodes_per_column: levels }
}

impl HexMesh {
    /// Number of through-thickness columns.
    #[must_use]
    pub fn column_count(&self) -> usize {
        self.nodes.len() / self.nodes_per_column.max(1)
    }

    /// Node ids of the bottom surface (first of each column), by column.
    #[must_use]
    pub fn bottom_nodes(&self) -> Vec<u32> {
        (0..self.column_count()).map(|column| (column * self.nodes_per_column) as u32).collect()
    }

    /// Node ids of the top surface (last of each column), by column.
    #[must_use]
    pub fn top_nodes(&self) -> Vec<u32> {
        (1..=self.column_count())
            .map(|column| (column * self.nodes_per_column - 1) as u32)
            .collect()
    }

    /// Plan coordinates `(x, y)` [mm] of each column's bottom node: the input of nested dissection.
    #[must_use]
    pub fn column_coordinates(&self) -> Vec<Vec2> {
        self.bottom_nodes()
            .iter()
            .map(|&node| {
                let p = self.nodes[node as usize];
                Vec2::new(p.x, p.y)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangle_has_columns_of_consecutive_nodes() {
        let mesh = rectangle(3.0, 2.0, 0.5, 3, 2, 2);
        assert_eq!(mesh.nodes.len(), 4 * 3 * 3);
        assert_eq!(mesh.elements.len(), 12);
        let plan = mesh.column_coordinates();
        for (column, (&low, &high)) in mesh.bottom_nodes().iter().zip(&mesh.top_nodes()).enumerate()
        {
            for node in low..=high {
                let p = mesh.nodes[node as usize];
                assert_eq!(Vec2::new(p.x, p.y), plan[column]);
            }
            assert_eq!(mesh.nodes[low as usize].z, 0.0);
            assert_eq!(mesh.nodes[high as usize].z, 0.5);
        }
    }

    #[test]
    fn rectangle_elements_are_right_handed() {
        for element in &rectangle(3.0, 2.0, 0.5, 3, 2, 2).elements {
            let mesh = rectangle(3.0, 2.0, 0.5, 3, 2, 2);
            let p = |local: usize| mesh.nodes[element[local] as usize];
            let volume = (p(1) - p(0)).cross(&(p(3) - p(0))).dot(&(p(4) - p(0)));
            assert!((volume - 0.25).abs() < 1e-15);
        }
    }
}
