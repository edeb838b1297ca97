//! Nodal forces on the blank.

use std::collections::BTreeSet;

use super::blank::{Fault, nodes_in};
use super::types::Scene;
use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Corners of the faces and of the edges of an element.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [1, 2],
    [2, 3],
    [3, 0],
    [4, 5],
    [5, 6],
    [6, 7],
    [7, 4],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// Nodal forces on the modelled part [N], those of hanging nodes on their masters, for a process of `share` symmetric fractions; empty without loads.
pub(super) fn loads(scene: &Scene, mesh: &HexMesh, share: f64) -> Result<Vec<f64>, Fault> {
    if scene.loads.is_empty() {
        return Ok(Vec::new());
    }
    let mut forces = vec![0.0; 3 * mesh.nodes.len()];
    for (k, load) in scene.loads.iter().enumerate() {
        let there = nodes_in(&load.region, &mesh.nodes, &format!("loads[{k}].where"))?;
        for (&node, part) in there.iter().zip(fractions(mesh, &there)) {
            for (axis, force) in load.force_n.iter().enumerate() {
                forces[3 * node + axis] += force * part / share;
            }
        }
    }
    mesh.move_to_masters(&mut forces);
    Ok(forces)
}

/// Fractions of a uniform load for some nodes. The load is distributed over the volume of elements whose nodes are all
/// loaded, otherwise over such faces, otherwise over such edges. If there are none, all nodes get the same fraction.
fn fractions(mesh: &HexMesh, there: &[usize]) -> Vec<f64> {
    let mut inside = vec![false; mesh.nodes.len()];
    there.iter().for_each(|&node| inside[node] = true);
    let all = |nodes: &[u32]| nodes.iter().all(|&node| inside[node as usize]);
    let elements = || mesh.elements.iter();
    let volumes: BTreeSet<Vec<u32>> = elements().filter(|e| all(*e)).map(|e| e.to_vec()).collect();
    // Sides of a coarser element with hanging nodes are those of the finer ones beside it.
    let levels = mesh.nodes_per_column.max(1) as u32;
    let between = mesh.hanging.between();
    let is_divided = |e: &[u32; 8], corners: &[usize]| {
        let mut columns: Vec<u32> = corners.iter().map(|&k| e[k] / levels).collect();
        columns.sort_unstable();
        columns.dedup();
        <[u32; 2]>::try_from(columns).is_ok_and(|side| between.contains_key(&side))
    };
    let each = |corners: &[&[usize]]| -> BTreeSet<Vec<u32>> {
        let of = |e: &[u32; 8]| {
            let whole = corners.iter().filter(|corners| !is_divided(e, corners));
            let fractions = whole.map(|corners| corners.iter().map(|&k| e[k]).collect());
            fractions.filter(|nodes: &Vec<u32>| all(nodes)).map(canonical_order).collect::<Vec<_>>()
        };
        elements().flat_map(of).collect()
    };
    let faces = each(&FACES.each_ref().map(|face| &face[..]));
    let edges = each(&EDGES.each_ref().map(|edge| &edge[..]));
    for cells in [volumes, faces, edges] {
        let mut weights = vec![0.0; mesh.nodes.len()];
        for cell in &cells {
            let size =
                size(&cell.iter().map(|&node| mesh.nodes[node as usize]).collect::<Vec<_>>());
            cell.iter().for_each(|&node| weights[node as usize] += size);
        }
        let own: Vec<f64> = there.iter().map(|&node| weights[node]).collect();
        let sum: f64 = own.iter().sum();
        if own.iter().all(|&weight| weight > 0.0) {
            return own.into_iter().map(|weight| weight / sum).collect();
        }
    }
    vec![1.0 / there.len() as f64; there.len()]
}

/// Canonical order of the nodes of a face or an edge, the same for both adjacent elements: from the smallest index
/// towards its smaller neighbour.
fn canonical_order(mut nodes: Vec<u32>) -> Vec<u32> {
    let smallest = (0..nodes.len()).min_by_key(|&k| nodes[k]).unwrap_or(0);
    nodes.rotate_left(smallest);
    if nodes.len() > 2 && nodes[1] > nodes[nodes.len() - 1] {
        nodes[1..].reverse();
    }
    nodes
}

/// Length, area or volume, up to a constant factor per kind.
fn size(x: &[Vec3]) -> f64 {
    match *x {
        [a, b] => (b - a).norm(),
        [a, b, c, d] => (c - a).cross(&(d - b)).norm(),
        [a, b, c, d, e, f, g, h] => {
            let along =
                |p: [Vec3; 4], q: [Vec3; 4]| q.iter().sum::<Vec3>() - p.iter().sum::<Vec3>();
            let (x, y) = (along([a, d, e, h], [b, c, f, g]), along([a, b, e, f], [c, d, g, h]));
            x.cross(&y).dot(&along([a, b, c, d], [e, f, g, h])).abs()
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    fn at(mesh: &HexMesh, inside: impl Fn(&Vec3) -> bool) -> Vec<usize> {
        (0..mesh.nodes.len()).filter(|&node| inside(&mesh.nodes[node])).collect()
    }

    /// A uniform force on a plane between coarse and fine elements: each of the two sides counts once.
    #[test]
    fn a_force_on_a_border_of_refinement_is_spread_over_its_area() {
        use kanagata_solver::sheet::refine::{Refinement, plan_elements};
        let base = rectangle(4.0, 4.0, 1.0, 2, 2, 1);
        let mesh = Refinement::balanced(plan_elements(&base), vec![1, 0, 0, 0]).mesh(&base, None);
        let there = at(&mesh, |x| (x.x - 2.0).abs() < 1e-9);
        let mut forces = vec![0.0; 3 * mesh.nodes.len()];
        for (&node, part) in there.iter().zip(fractions(&mesh, &there)) {
            forces[3 * node] = part;
        }
        mesh.move_to_masters(&mut forces);
        for node in there {
            let x = mesh.nodes[node];
            let expected = match mesh.masters(node) {
                Some(_) => 0.0,
                None if (x.y - 2.0).abs() < 1e-9 => 0.25,
                None => 0.125,
            };
            assert!((forces[3 * node] - expected).abs() < 1e-15, "{x}: {}", forces[3 * node]);
        }
    }

    #[test]
    fn a_force_is_spread_over_what_its_nodes_make_up() {
        // 4 x 3 x 1 mm; the second row of elements is twice as wide as the first.
        let mut mesh = rectangle(4.0, 2.0, 1.0, 4, 2, 2);
        mesh.nodes.iter_mut().for_each(|x| x.y = if x.y > 1.5 { 3.0 } else { x.y });
        let across = |y: f64| {
            if y < 0.5 {
                1.0
            } else if y < 1.5 {
                3.0
            } else {
                2.0
            }
        };
        let through = |z: f64| if (z - 0.5).abs() < 0.1 { 2.0 } else { 1.0 };
        let along = |x: f64| if (0.5..3.5).contains(&x) { 2.0 } else { 1.0 };
        // An end face, an interior face, an edge, all nodes, and two separate nodes.
        let end = |x: &Vec3| across(x.y) * through(x.z) / 24.0;
        type Case<'a> = (Vec<usize>, &'a dyn Fn(&Vec3) -> f64);
        let cases: [Case<'_>; 5] = [
            (at(&mesh, |x| x.x > 3.9), &end),
            (at(&mesh, |x| (x.x - 2.0).abs() < 0.1), &end),
            (at(&mesh, |x| x.x > 3.9 && x.z > 0.9), &|x| across(x.y) / 6.0),
            (at(&mesh, |_| true), &|x| across(x.y) * through(x.z) * along(x.x) / 192.0),
            (at(&mesh, |x| x.y < 0.1 && x.z < 0.1 && !(0.5..3.5).contains(&x.x)), &|_| 0.5),
        ];
        for (there, expected) in cases {
            for (&node, part) in there.iter().zip(fractions(&mesh, &there)) {
                let x = &mesh.nodes[node];
                assert!((part - expected(x)).abs() < 1e-15, "{x}: {part} {}", expected(x));
            }
        }
    }
}
