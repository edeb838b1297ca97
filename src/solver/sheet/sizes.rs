//! Lengths that the solver measures its tolerances and steps by.

use super::hex_mesh::HexMesh;
use crate::geometry::Aabb;

/// Lengths of the problem [mm].
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Lengths {
    /// Smallest thickness of the mesh: the shortest element edge.
    pub(in crate::solver) shortest_edge: f64,
    /// Longest element edge.
    pub(in crate::solver) longest_edge: f64,
    /// Diagonal of the box around the sheet.
    pub(in crate::solver) size: f64,
    /// Largest distance of a node from the origin, which its place is rounded with.
    pub(in crate::solver) farthest: f64,
    /// Slip over which friction rises; 0: exact stick.
    pub(in crate::solver) transition: f64,
}

/// Lengths of a sheet's mesh, without a transition of friction.
pub(in crate::solver) fn edge_lengths(mesh: &HexMesh) -> Lengths {
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
