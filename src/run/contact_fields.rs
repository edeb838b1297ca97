//! Normals of the sheet, and contact pressure, state and tool of its nodes.

use kanagata_geometry::Vec3;
use kanagata_report::DataArray;
use kanagata_solver::NodeContact;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Contact states in the VTU.
const FREE: u8 = 0;
const STICK: u8 = 1;
const SLIP: u8 = 2;

/// Half the cross product of the diagonals of a quadrilateral: its area vector [mm²].
fn area_vector([a, b, c, d]: [Vec3; 4]) -> Vec3 {
    0.5 * (c - a).cross(&(d - b))
}

/// Unit normal of the mid-surface at every column, from the lower to the upper face: the mean of the adjacent elements,
/// weighted by area. Zero for a column without elements.
#[must_use]
pub fn normals(mesh: &HexMesh, positions: &[Vec3]) -> Vec<Vec3> {
    let levels = mesh.nodes_per_column.max(1);
    let mut sums = vec![Vec3::zeros(); mesh.column_count()];
    for element in &mesh.elements {
        let x = element.map(|node| positions[node as usize]);
        let middle = std::array::from_fn(|k| 0.5 * (x[k] + x[k + 4]));
        let area = area_vector(middle);
        for node in &element[..4] {
            sums[*node as usize / levels] += area;
        }
    }
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

/// Area of the faces of the sheet that belongs to each node [mm²]: a quarter of each adjacent face. Zero inside the sheet,
/// and at hanging nodes, whose area is that of their masters as their contact force is.
#[must_use]
pub fn face_areas(mesh: &HexMesh, positions: &[Vec3]) -> Vec<f64> {
    let levels = mesh.nodes_per_column.max(1) as u32;
    let mut areas = vec![0.0; positions.len()];
    for element in &mesh.elements {
        for (face, level) in [([0, 1, 2, 3], 0), ([4, 5, 6, 7], levels - 1)] {
            let nodes = face.map(|k: usize| element[k]);
            if nodes.iter().any(|node| node % levels != level) {
                continue;
            }
            let area = area_vector(nodes.map(|node| positions[node as usize])).norm();
            nodes.iter().for_each(|&node| areas[node as usize] += 0.25 * area);
        }
    }
    mesh.share_with_masters(&mut areas);
    areas
}

/// Contact pressure, state and tool of every node. Tools are numbered from 1, as the parts of `run.pvd`. A hanging node has
/// the mean pressure of its masters, and their state and tool if both touch the same tool.
#[must_use]
pub fn arrays(mesh: &HexMesh, positions: &[Vec3], contacts: &[NodeContact]) -> [DataArray; 3] {
    let areas = face_areas(mesh, positions);
    let mut pressure = vec![0.0; positions.len()];
    let (mut state, mut tool) = (vec![FREE; positions.len()], vec![0; positions.len()]);
    // A node of a damaged checkpoint may not exist.
    for contact in contacts.iter().filter(|contact| contact.node < positions.len()) {
        let node = contact.node;
        if areas[node] > 0.0 {
            pressure[node] = contact.normal_force / areas[node];
        }
        state[node] = if contact.slips { SLIP } else { STICK };
        tool[node] = i32::try_from(contact.tool.saturating_add(1)).unwrap_or(i32::MAX);
    }
    for (node, [a, b]) in mesh.hanging_nodes() {
        pressure[node] = 0.5 * (pressure[a] + pressure[b]);
        if tool[a] == tool[b] {
            (state[node], tool[node]) = (state[a].min(state[b]), tool[a]);
        }
    }
    [
        DataArray::single("contact_pressure_mpa", pressure),
        DataArray::byte("contact_state", state),
        DataArray::integer("contact_tool", tool),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Mat3;
    use kanagata_report::{CellKind, Vtu, vtu_read};
    use kanagata_solver::sheet::hex_mesh::{disc, rectangle, thickened};

    /// A disc on a sphere of radius 50 mm: the normal at a column is that of the sphere up to the chords.
    #[test]
    fn normals_point_from_the_lower_to_the_upper_face() {
        // Elements turn by 0.95 degrees; around a corner of the core they are unequal, and the mean of their normals is off.
        let (points, quads) = disc(20.0, 24, 24);
        let mesh = thickened(&points, &quads, 0.8, 2);
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 2.0, 0.9).into_inner();
        let at = |x: &Vec3| {
            let (polar, radius) = (x.xy().norm() / 50.0, 50.0 + x.z);
            let around = x.xy().try_normalize(0.0).unwrap_or_default() * polar.sin();
            turn * Vec3::new(around.x, around.y, polar.cos()) * radius
        };
        let positions: Vec<Vec3> = mesh.nodes.iter().map(at).collect();
        let found = normals(&mesh, &positions);
        for (normal, &top) in found.iter().zip(&mesh.top_nodes()) {
            assert!((normal.norm() - 1.0).abs() < 1e-15);
            let rim = mesh.nodes[top as usize].xy().norm() > 19.9;
            let angle = normal.angle(&positions[top as usize]).to_degrees();
            assert!(angle < if rim { 1.5 } else { 0.2 }, "{angle}");
        }
        let flat = rectangle(2.0, 2.0, 1.0, 2, 2, 1);
        let back = Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
        let below: Vec<Vec3> = flat.nodes.iter().map(|x| back * x).collect();
        assert!(normals(&flat, &below).iter().all(|n| (n + Vec3::z()).norm() < 1e-15));
    }

    /// A uniform pressure on a refined sheet is uniform at all nodes, those that hang too.
    #[test]
    fn the_pressure_of_a_hanging_node_is_that_of_its_masters() {
        use kanagata_solver::sheet::refine::{Refinement, plan_elements};
        let base = rectangle(6.0, 6.0, 0.9, 3, 3, 2);
        let levels = vec![0, 0, 0, 0, 2, 0, 0, 0, 0];
        let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, None);
        let areas = face_areas(&mesh, &mesh.nodes);
        assert!((areas.iter().sum::<f64>() - 72.0).abs() < 1e-12);
        let carrying = (0..mesh.nodes.len()).filter(|&node| areas[node] > 0.0);
        let of = |node: usize| NodeContact {
            node,
            tool: 1,
            slips: true,
            normal_force: 3.0 * areas[node],
        };
        let contacts: Vec<NodeContact> = carrying.map(of).collect();
        assert!(contacts.iter().all(|c| mesh.masters(c.node).is_none()));
        let mut grid = Vtu::new(mesh.nodes.clone());
        mesh.elements.iter().for_each(|element| grid.push_cell(CellKind::Hexahedron, element));
        grid.point_data.extend(arrays(&mesh, &mesh.nodes, &contacts));
        let folder = tempfile::tempdir().unwrap();
        grid.write(&folder.path().join("a.vtu")).unwrap();
        let read = vtu_read::read(&folder.path().join("a.vtu")).unwrap().point_data;
        for node in (0..mesh.nodes.len()).filter(|node| node % 3 != 1) {
            let found: [f64; 3] = std::array::from_fn(|k| read[k].values[node]);
            assert!((found[0] - 3.0).abs() < 1e-6 && found[1..] == [2.0, 2.0], "{node}: {found:?}");
        }
    }

    /// Areas add up to that of both faces; pressure times area is the normal force.
    #[test]
    fn pressure_is_force_over_area_and_states_are_numbered() {
        let mesh = rectangle(6.0, 4.0, 0.9, 3, 2, 3);
        let areas = face_areas(&mesh, &mesh.nodes);
        assert!((areas.iter().sum::<f64>() - 48.0).abs() < 1e-12);
        let inside = areas.iter().enumerate().filter(|(node, _)| !matches!(node % 4, 0 | 3));
        assert!(inside.into_iter().all(|(_, area)| *area == 0.0));
        // A corner, and a node within the upper face.
        let (corner, middle) = (0, 4 * 4 + 3);
        assert!((areas[corner] - 1.0).abs() < 1e-15 && (areas[middle] - 4.0).abs() < 1e-15);
        let contact = |node, tool, slips| NodeContact { node, tool, slips, normal_force: 12.0 };
        let contacts =
            [contact(corner, 0, false), contact(middle, 2, true), contact(usize::MAX, 1, true)];
        let mut grid = Vtu::new(mesh.nodes.clone());
        mesh.elements.iter().for_each(|element| grid.push_cell(CellKind::Hexahedron, element));
        grid.point_data.extend(arrays(&mesh, &mesh.nodes, &contacts));
        let folder = tempfile::tempdir().unwrap();
        grid.write(&folder.path().join("a.vtu")).unwrap();
        let read = vtu_read::read(&folder.path().join("a.vtu")).unwrap().point_data;
        let values: Vec<[f64; 3]> =
            [corner, middle, 1].map(|node| std::array::from_fn(|k| read[k].values[node])).to_vec();
        assert_eq!(values, [[12.0, 1.0, 1.0], [3.0, 2.0, 3.0], [0.0; 3]]);
    }
}
