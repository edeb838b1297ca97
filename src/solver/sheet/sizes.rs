//! Characteristic lengths for tolerances and step sizes.

use super::hex_mesh::HexMesh;
use kanagata_geometry::Aabb;

/// Characteristic lengths of the problem [mm].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lengths {
    /// Shortest element edge; for a sheet its minimum thickness.
    pub(crate) shortest_edge: f64,
    /// Longest element edge.
    pub(crate) longest_edge: f64,
    /// Diagonal of the bounding box of the sheet.
    pub(crate) size: f64,
    /// Largest distance of a node from the origin; determines the rounding of coordinates.
    pub(crate) farthest: f64,
    /// Slip over which friction is regularised; 0: exact stick.
    pub(crate) transition: f64,
}

/// Lengths of the mesh of a sheet, without regularisation of friction.
pub(crate) fn edge_lengths(mesh: &HexMesh) -> Lengths {
    const EDGES: [(usize, usize); 12] = [
        (0, 1),
        (1, 2),
        (2, 3),
        (3, 0),
        (4, 5),
        (5, 6),
        (6, 7),
        (7, 4),
        (0, 4),
        (1, 5),
        (2, 6),
        (3, 7),
    ];
    let size = Aabb::of_points(&mesh.nodes).diagonal();
    let farthest = mesh.nodes.iter().map(|x| x.norm()).fold(0.0, f64::max);
    let mut out = Lengths {
        shortest_edge: f64::INFINITY,
        longest_edge: 0.0,
        size,
        farthest,
        transition: 0.0,
    };
    for element in &mesh.elements {
        for (a, b) in EDGES {
            let x = |k: usize| mesh.nodes[element[k] as usize];
            let length = (x(a) - x(b)).norm();
            out.shortest_edge = out.shortest_edge.min(length);
            out.longest_edge = out.longest_edge.max(length);
        }
    }
    out
}
