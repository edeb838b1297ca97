//! Nodes of the blank that lie at one place and are not joined, as a mesh has them whose parts were not merged: a slit.

use rustc_hash::FxHashMap;

use super::Finding;
use crate::geometry::Vec3;
use crate::report::doubt::DoubtCode;
use crate::solver::blank::HexMesh;

/// Nearer to each other than this share of a layer's thickness, two nodes are at one place.
const SAME: f64 = 1e-3;

/// A remark on a blank that has such nodes.
pub(super) fn remark(mesh: &HexMesh) -> Option<Finding> {
    let layers = (mesh.nodes_per_column.max(2) - 1) as f64;
    let found = coinciding(&mesh.nodes, SAME * mesh.mean_thickness() / layers);
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

/// Points that are `near` an earlier one [mm].
fn coinciding(points: &[Vec3], near: f64) -> Vec<Vec3> {
    let cell = |x: &Vec3| [0, 1, 2].map(|k| (x[k] / near).floor() as i64);
    let mut by_cell: FxHashMap<[i64; 3], Vec<usize>> = FxHashMap::default();
    let mut out = Vec::new();
    for (node, x) in points.iter().enumerate() {
        let at = cell(x);
        let beside = (0..27).map(|k| [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1]);
        let mut earlier = beside.filter_map(|cell| by_cell.get(&cell)).flatten();
        if earlier.any(|&other| (points[other] - x).norm() < near) {
            out.push(*x);
        }
        by_cell.entry(at).or_default().push(node);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::blank::rectangle;

    #[test]
    fn a_seam_that_was_not_merged_is_told() {
        let mut mesh = rectangle(20.0, 10.0, 1.0, 4, 2, 2);
        assert_eq!(remark(&mesh), None);
        // The elements on one side of a node have one of their own.
        let column = mesh.nodes.iter().position(|x| (x.x, x.y) == (10.0, 5.0)).unwrap();
        let doubled = mesh.nodes[column] + Vec3::new(1e-5, 0.0, 0.0);
        mesh.nodes.push(doubled);
        let own = mesh.nodes.len() as u32 - 1;
        for element in &mut mesh.elements {
            let right = element.iter().all(|&n| mesh.nodes[n as usize].x > 9.0);
            element.iter_mut().filter(|n| right && **n as usize == column).for_each(|n| *n = own);
        }
        let said = remark(&mesh).unwrap().to_string();
        assert!(
            said.contains("1 nodes of the blank coincide") && said.contains("(10.000, 5.000"),
            "{said}"
        );
    }
}
