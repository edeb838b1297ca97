//! Coincident nodes of the blank that are not joined, for example between unmerged parts of a mesh: the sheet is slit
//! there.

use rustc_hash::FxHashMap;

use super::finding::Finding;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Distance over the layer thickness below which two nodes coincide.
const COINCIDENCE_REL: f64 = 1e-3;

/// A doubt about a blank with coincident nodes.
pub(super) fn finding(mesh: &HexMesh) -> Option<Finding> {
    let layers = (mesh.nodes_per_column.max(2) - 1) as f64;
    let found = coincident(&mesh.nodes, COINCIDENCE_REL * mesh.mean_thickness() / layers);
    let [x, y, z]: [f64; 3] = (*found.first()?).into();
    Some(Finding::doubt(
        DoubtCode::UnjoinedNodes,
        format!("({x:.3}, {y:.3}, {z:.3}) mm"),
        format!(
            "{} nodes of the blank coincide with another node and are not joined to it, first at ({x:.3}, {y:.3}, {z:.3}) mm: the sheet is slit there and opens.",
            found.len()
        ),
        "Merge coincident nodes in the mesh file, unless a slit is intended.".into(),
    ))
}

/// Cell size of the search over the search distance. Larger cells: fewer points need more than one cell, but more points
/// share a cell.
const CELL_SIZE_REL: f64 = 16.0;

/// Points closer than `near` to an earlier point [mm].
fn coincident(points: &[Vec3], near: f64) -> Vec<Vec3> {
    // The offset keeps nodes of regular meshes off cell borders.
    let cell = |x: f64| (x / (CELL_SIZE_REL * near) + std::f64::consts::FRAC_1_PI).floor() as i64;
    let cells = |x: &Vec3, by: f64| [0, 1, 2].map(|k| cell(x[k] + by));
    // The last point of each cell, and for each point the previous one in its cell.
    let mut last: FxHashMap<[i64; 3], usize> = FxHashMap::default();
    last.reserve(points.len());
    let mut before = vec![usize::MAX; points.len()];
    let mut out = Vec::new();
    for (node, x) in points.iter().enumerate() {
        let ([i0, j0, k0], [i1, j1, k1]) = (cells(x, -near), cells(x, near));
        let within =
            (i0..=i1).flat_map(|i| (j0..=j1).flat_map(move |j| (k0..=k1).map(move |k| [i, j, k])));
        let chain = |cell: [i64; 3]| {
            std::iter::successors(last.get(&cell).copied(), |&n| {
                Some(before[n]).filter(|n| *n != usize::MAX)
            })
        };
        if within.flat_map(chain).any(|other| (points[other] - x).norm() < near) {
            out.push(*x);
        }
        if let Some(other) = last.insert(cells(x, 0.0), node) {
            before[node] = other;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    #[test]
    fn unmerged_nodes_are_found() {
        let mut mesh = rectangle(20.0, 10.0, 1.0, 4, 2, 2);
        assert_eq!(finding(&mesh), None);
        // The elements on one side of a node get a copy of it.
        let column = mesh.nodes.iter().position(|x| (x.x, x.y) == (10.0, 5.0)).unwrap();
        let doubled = mesh.nodes[column] + Vec3::new(1e-5, 0.0, 0.0);
        mesh.nodes.push(doubled);
        let own = mesh.nodes.len() as u32 - 1;
        for element in &mut mesh.elements {
            let right = element.iter().all(|&n| mesh.nodes[n as usize].x > 9.0);
            element.iter_mut().filter(|n| right && **n as usize == column).for_each(|n| *n = own);
        }
        let text = finding(&mesh).unwrap().to_string();
        assert!(
            text.contains("1 nodes of the blank coincide") && text.contains("(10.000, 5.000"),
            "{text}"
        );
    }
}
