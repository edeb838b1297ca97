//! Self-penetration of the sheet, and penetration beyond a symmetry plane (into its image). Self-contact is not
//! modelled; the check only reports.

use std::collections::HashMap;

use rayon::prelude::*;

use kanagata_geometry::box_tree::BoxTree;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_report::record::SelfPenetrationRecord;
use kanagata_scene::types::SymmetryPlane;
use kanagata_solver::element::natural_coordinates;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Bounds of the natural coordinates (-1 to 1) of a node inside an element. Towards the faces of the sheet, which may
/// touch: 0.95. Towards edges and other elements: the whole element.
const FACE_COORDINATE_MAX: f64 = 0.95;
const EDGE_COORDINATE_MAX: f64 = 1.0 + 1e-6;

/// Nodes of the faces of an element: at the lower and the upper end of each natural coordinate.
const FACES: [[usize; 4]; 6] =
    [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]];
/// Smallest reported penetration of a symmetry plane, over the thickness.
const PLANE_PENETRATION_MIN_REL: f64 = 0.025;

/// Checks an increment: nodes inside elements they do not belong to, or beyond a symmetry plane, with the nodes at
/// `positions` [mm].
#[must_use]
pub fn self_penetration(
    mesh: &HexMesh,
    positions: &[Vec3],
    planes: &[SymmetryPlane],
    increment: usize,
) -> Option<SelfPenetrationRecord> {
    let beyond: Vec<_> = planes.iter().map(|plane| beyond(mesh, plane)).collect();
    let image = |node: &usize| beyond.iter().any(|beyond| beyond(&positions[*node]));
    let mut nodes: Vec<usize> = (0..positions.len()).filter(image).collect();
    nodes.extend(inside_elements(mesh, positions));
    nodes.sort_unstable();
    nodes.dedup();
    let first = *nodes.first()?;
    Some(SelfPenetrationRecord {
        first_increment: increment,
        nodes: nodes.len(),
        at_mm: positions[first].into(),
    })
}

/// Nodes inside elements they do not belong to; a node may occur several times.
fn inside_elements(mesh: &HexMesh, positions: &[Vec3]) -> Vec<usize> {
    let corners = |element: &[u32; 8]| element.map(|node| positions[node as usize]);
    let boxes: Vec<Aabb> =
        mesh.elements.iter().map(|element| Aabb::of_points(&corners(element))).collect();
    let tree = BoxTree::build(&boxes);
    let inside = |node: usize| {
        let (x, mut found) = (&positions[node], Vec::new());
        tree.overlapping(&Aabb { min: *x, max: *x }, |k| {
            let (element, region) = (&mesh.elements[k as usize], &boxes[k as usize]);
            let belongs = |node: usize| element.contains(&(node as u32));
            // A hanging node lies on the side of a coarser element.
            let hangs = mesh.masters(node).is_some_and(|masters| masters.into_iter().all(belongs));
            if belongs(node) || hangs || region.distance_squared(x) > 0.0 {
                return;
            }
            let at = natural_coordinates(&corners(element), x);
            found.extend(
                at.filter(|at| at.abs().max() < EDGE_COORDINATE_MAX)
                    .map(|at| (node, k as usize, at)),
            );
        });
        found
    };
    let found: Vec<(usize, usize, Vec3)> =
        (0..positions.len()).into_par_iter().flat_map_iter(inside).collect();
    if found.is_empty() {
        return Vec::new();
    }
    let limits = limits(mesh);
    let deep = |(_, k, at): &&(usize, usize, Vec3)| {
        let limits = &limits[*k];
        (0..3).all(|axis| -limits[2 * axis] < at[axis] && at[axis] < limits[2 * axis + 1])
    };
    found.iter().filter(deep).map(|(node, ..)| *node).collect()
}

/// Whether a point is beyond a symmetry plane, seen from the undeformed sheet.
fn beyond(mesh: &HexMesh, plane: &SymmetryPlane) -> impl Fn(&Vec3) -> bool {
    let (axis, at) = (plane.normal.index(), plane.at_mm);
    let side: f64 = mesh.nodes.iter().map(|x| x[axis] - at).sum();
    let (side, allowed) = (side.signum(), PLANE_PENETRATION_MIN_REL * mesh.mean_thickness());
    move |x: &Vec3| side * (x[axis] - at) < -allowed
}

/// Bounds of the natural coordinates of every element towards each of its faces.
fn limits(mesh: &HexMesh) -> Vec<[f64; 6]> {
    let face = |element: &[u32; 8], k: usize| {
        let mut nodes = FACES[k].map(|corner| element[corner]);
        nodes.sort_unstable();
        nodes
    };
    let mut owners: HashMap<[u32; 4], usize> = HashMap::new();
    for element in &mesh.elements {
        (0..6).for_each(|k| *owners.entry(face(element, k)).or_default() += 1);
    }
    let limits = |element: &[u32; 8]| {
        let across = thickness_direction(mesh, element);
        let is_outer = |k: usize| k / 2 == across && owners[&face(element, k)] == 1;
        std::array::from_fn(|k| if is_outer(k) { FACE_COORDINATE_MAX } else { EDGE_COORDINATE_MAX })
    };
    mesh.elements.iter().map(limits).collect()
}

/// The natural coordinate through the thickness; for a mesh without columns the one with the smallest initial extent.
fn thickness_direction(mesh: &HexMesh, element: &[u32; 8]) -> usize {
    if mesh.nodes_per_column > 1 {
        return 2;
    }
    let middle =
        |k: usize| -> Vec3 { FACES[k].map(|c| mesh.nodes[element[c] as usize]).iter().sum() };
    let length = |axis: &usize| (middle(2 * axis + 1) - middle(2 * axis)).norm();
    (0..3).min_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_scene::types::Axis;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// A strip of 40 x 2 x 1 mm, folded at its middle about y to this radius: its legs are `2 radius` apart.
    fn folded(radius: f64) -> (HexMesh, Vec<Vec3>) {
        let mesh = rectangle(40.0, 2.0, 1.0, 40, 2, 1);
        let half = 0.5 * std::f64::consts::PI * (radius + 0.5);
        let place = |x: &Vec3| {
            let (s, h) = (x.x - 20.0, x.z - 0.5);
            let angle = (s / half).clamp(-1.0, 1.0) * std::f64::consts::FRAC_PI_2;
            let out = radius + 0.5 - h;
            let straight = s.abs() - half;
            let down = if straight > 0.0 { straight } else { 0.0 };
            Vec3::new(out * angle.sin(), x.y, out * angle.cos() - down)
        };
        let positions = mesh.nodes.iter().map(place).collect();
        (mesh, positions)
    }

    #[test]
    fn a_hairpin_is_through_itself_where_its_legs_cross_and_not_where_they_touch() {
        let (mesh, open) = folded(3.0);
        assert_eq!(self_penetration(&mesh, &open, &[], 1), None);
        // Legs bent inwards by 0.2 per millimetre of height: they cross.
        let crossed: Vec<Vec3> = open
            .iter()
            .map(|x| Vec3::new(x.x + 0.4 * x.z.min(0.0) * x.x.signum(), x.y, x.z))
            .collect();
        let found = self_penetration(&mesh, &crossed, &[], 7).unwrap();
        assert!(found.nodes > 3 && found.first_increment == 7, "{found:?}");
        assert!(found.at_mm[0].abs() < 1.0 && found.at_mm[2] < 0.0, "{found:?}");
        // Pressed together until the inner faces touch, without penetration.
        let shut: Vec<Vec3> = open
            .iter()
            .map(|x| Vec3::new(x.x - 3.0 * x.x.signum() * (-x.z / 10.0).clamp(0.0, 1.0), x.y, x.z))
            .collect();
        assert_eq!(self_penetration(&mesh, &shut, &[], 1), None);
    }

    #[test]
    fn hanging_nodes_on_the_sides_of_coarser_elements_are_not_inside_them() {
        use kanagata_solver::sheet::refine::{Refinement, plan_elements};
        let base = rectangle(6.0, 6.0, 1.0, 3, 3, 2);
        let levels = vec![0, 0, 0, 0, 2, 0, 0, 0, 0];
        let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, None);
        let mut u: Vec<f64> = mesh
            .nodes
            .iter()
            .flat_map(|x| [-0.02 * x.x * x.z, 0.0, 0.01 * x.x * x.x + 0.02 * x.x * x.y])
            .collect();
        mesh.set_means(&mut u);
        let bent: Vec<Vec3> = mesh
            .nodes
            .iter()
            .zip(u.chunks_exact(3))
            .map(|(x, u)| x + Vec3::from_column_slice(u))
            .collect();
        for positions in [&mesh.nodes, &bent] {
            assert_eq!(self_penetration(&mesh, positions, &[], 1), None);
        }
    }

    #[test]
    fn half_a_hairpin_is_through_its_image_beyond_the_plane() {
        let mesh = rectangle(10.0, 2.0, 1.0, 10, 2, 1);
        let plane = [SymmetryPlane { normal: Axis::X, at_mm: 0.0 }];
        assert_eq!(self_penetration(&mesh, &mesh.nodes, &plane, 1), None);
        let beyond: Vec<Vec3> = mesh.nodes.iter().map(|x| x - Vec3::x() * 0.5).collect();
        let found = self_penetration(&mesh, &beyond, &plane, 2).unwrap();
        assert_eq!(found.nodes, 6, "{found:?}");
    }
}
