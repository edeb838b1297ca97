//! Elements with a corner inverted against the CAD normal: mended by moving nodes inside faces and by splitting
//! quadrilaterals, or named.

use std::collections::{BTreeMap, BTreeSet};

use super::mapped::corner_sine;
use super::quality::corner_jacobians;
use super::{Element, MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_cad::closest::ClosestPoint;
use kanagata_geometry::Vec3;

/// Sine of an inverted corner. Corners up to this value are straight: chords of a bent border turn them a little.
const INVERTED_SINE_MIN: f64 = 1e-3;
/// Maximum number of sweeps over the nodes.
const SWEEPS_MAX: usize = 12;
/// Bisections of the step in the search for a better position.
const STEP_BISECTIONS: usize = 6;
/// Message of [`check`]: what to do.
const REMEDY: &str =
    "choose another algorithm of gmsh or a smaller size, or use the built-in mesher";

/// Changes of a mesh by [`mend`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mended {
    /// Inverted elements found.
    pub inverted: usize,
    /// Inverted elements left.
    pub left: usize,
    /// Nodes moved on their face.
    pub moved: usize,
    /// Quadrilaterals split in two triangles.
    pub split: usize,
}

/// Mends inverted elements: nodes inside a face are moved on it, quadrilaterals that remain inverted are split in two
/// triangles. Nodes on the border of a face keep their position, so that the mesh remains conforming.
pub fn mend(mesh: &mut SurfaceMesh, model: &Model) -> Mended {
    let index = ClosestPoint::new(model);
    let inverted = |mesh: &SurfaceMesh| {
        let corners = corner_jacobians(mesh, model);
        (0..corners.len()).filter(|&k| corners[k] < -INVERTED_SINE_MIN).collect::<Vec<usize>>()
    };
    let found = inverted(mesh);
    let moved = smooth(mesh, &index, &found);
    let folded = if moved > 0 { inverted(mesh) } else { found.clone() };
    let split = split(mesh, &index, &folded);
    let left = if split > 0 { inverted(mesh).len() } else { folded.len() };
    Mended { inverted: found.len(), left, moved, split }
}

/// Rejects a mesh with inverted elements.
///
/// # Errors
/// [`MeshError::Check`] with their number, the face with most of them, and the place of the worst.
pub fn check(mesh: &SurfaceMesh, model: &Model) -> Result<(), MeshError> {
    let corners = corner_jacobians(mesh, model);
    let mut on: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for k in (0..corners.len()).filter(|&k| corners[k] < -INVERTED_SINE_MIN) {
        on.entry(model.cut_with(mesh.elements[k].face as usize).start).or_default().push(k);
    }
    let total: usize = on.values().map(Vec::len).sum();
    let most = on.iter().max_by_key(|(face, all)| (all.len(), std::cmp::Reverse(**face)));
    let Some((&face, all)) = most else { return Ok(()) };
    let worst = all.iter().copied().min_by(|a, b| corners[*a].total_cmp(&corners[*b]));
    let place = worst.map_or_else(String::new, |k| {
        let p = mesh.corners(&mesh.elements[k]);
        let p = p.iter().sum::<Vec3>() / p.len() as f64;
        format!(
            "worst at ({:.4}, {:.4}, {:.4}) mm with a corner Jacobian of {:.3}",
            p.x, p.y, p.z, corners[k]
        )
    });
    let source = model.faces.get(face).map_or("", |f| &f.source);
    Err(MeshError::Check {
        found: format!(
            "{total} of {} elements are inverted against the CAD normal, on {} faces, most on face {face} ({source}): {} \
             elements, {place}",
            mesh.elements.len(),
            on.len(),
            all.len()
        ),
        allowed: format!("corner Jacobians of at least {}", -INVERTED_SINE_MIN),
        remedy: REMEDY,
    })
}

/// Nodes inside a face: every element around them is on it and none of their sides is a border.
fn nodes_inside(mesh: &SurfaceMesh) -> Vec<Option<u32>> {
    let mut face: Vec<Option<u32>> = vec![None; mesh.vertices.len()];
    let mut border = BTreeSet::new();
    let mut sides: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for e in &mesh.elements {
        for &n in e.nodes() {
            match face[n as usize] {
                Some(f) if f != e.face => {
                    border.insert(n);
                }
                _ => face[n as usize] = Some(e.face),
            }
        }
        for [a, b] in e.sides() {
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    border.extend(sides.iter().filter(|(_, uses)| **uses != 2).flat_map(|(ends, _)| *ends));
    border.iter().for_each(|&n| face[n as usize] = None);
    face
}

/// Moves nodes of the inverted elements until no move helps; returns the number of nodes moved.
fn smooth(mesh: &mut SurfaceMesh, index: &ClosestPoint<'_>, inverted: &[usize]) -> usize {
    let inside = nodes_inside(mesh);
    let nodes: BTreeSet<u32> =
        inverted.iter().flat_map(|&k| mesh.elements[k].nodes().iter().copied()).collect();
    let nodes: Vec<u32> = nodes.into_iter().filter(|&n| inside[n as usize].is_some()).collect();
    let mut around: BTreeMap<u32, Vec<usize>> = nodes.iter().map(|&n| (n, Vec::new())).collect();
    for (k, e) in mesh.elements.iter().enumerate() {
        for n in e.nodes() {
            if let Some(elements) = around.get_mut(n) {
                elements.push(k);
            }
        }
    }
    let mut moved = BTreeSet::new();
    for _ in 0..SWEEPS_MAX {
        let mut better = false;
        for (&n, elements) in &around {
            if worst_of(mesh, index, elements) < INVERTED_SINE_MIN
                && improve(mesh, index, n, elements)
            {
                moved.insert(n);
                better = true;
            }
        }
        if !better {
            break;
        }
    }
    moved.len()
}

/// Worst corner of one element against the normals of its face.
fn worst(mesh: &SurfaceMesh, index: &ClosestPoint<'_>, e: &Element) -> f64 {
    let p = mesh.corners(e);
    let corner = |k: usize| {
        let normal = index.closest_on_face(e.face as usize, &p[k]).map(|f| f.normal);
        let normal = normal.filter(|n| n.norm() > 0.5);
        let (before, after) = (&p[(k + p.len() - 1) % p.len()], &p[(k + 1) % p.len()]);
        normal.map_or(1.0, |normal| corner_sine(before, &p[k], after, &normal))
    };
    (0..p.len()).map(corner).fold(1.0, f64::min)
}

fn worst_of(mesh: &SurfaceMesh, index: &ClosestPoint<'_>, elements: &[usize]) -> f64 {
    elements.iter().map(|&k| worst(mesh, index, &mesh.elements[k])).fold(1.0, f64::min)
}

/// Pattern search for a better position of node `n` on its face, from the mean of its neighbours; true when it moved.
fn improve(mesh: &mut SurfaceMesh, index: &ClosestPoint<'_>, n: u32, elements: &[usize]) -> bool {
    let start = mesh.vertices[n as usize];
    let face = mesh.elements[elements[0]].face as usize;
    let ring: BTreeSet<u32> =
        elements.iter().flat_map(|&k| mesh.elements[k].nodes().iter().copied()).collect();
    let ring: Vec<Vec3> =
        ring.iter().filter(|&&m| m != n).map(|&m| mesh.vertices[m as usize]).collect();
    let middle = ring.iter().sum::<Vec3>() / ring.len().max(1) as f64;
    let Some(foot) = index.closest_on_face(face, &middle) else { return false };
    let across = foot.normal.cross(&Vec3::ith(foot.normal.iamin(), 1.0));
    let Some(x) = across.try_normalize(0.0) else { return false };
    let y = foot.normal.cross(&x);
    let (mut best, mut value) = (start, worst_of(mesh, index, elements));
    let mut offer = |mesh: &mut SurfaceMesh, p: Vec3, best: &mut Vec3| {
        let Some(foot) = index.closest_on_face(face, &p) else { return };
        mesh.vertices[n as usize] = foot.point;
        let found = worst_of(mesh, index, elements);
        if found > value {
            (*best, value) = (foot.point, found);
        }
    };
    offer(mesh, middle, &mut best);
    let mut step = 0.5 * ring.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    for _ in 0..STEP_BISECTIONS {
        let centre = best;
        for k in (0..9_i32).filter(|&k| k != 4) {
            let [a, b] = [k % 3 - 1, k / 3 - 1].map(f64::from);
            offer(mesh, centre + (x * a + y * b) * step, &mut best);
        }
        if best == centre {
            step *= 0.5;
        }
    }
    mesh.vertices[n as usize] = best;
    best != start
}

/// Splits inverted quadrilaterals along the better diagonal where neither triangle is inverted; returns their number.
fn split(mesh: &mut SurfaceMesh, index: &ClosestPoint<'_>, inverted: &[usize]) -> usize {
    let mut count = 0;
    for &k in inverted {
        let [a, b, c, d] = *mesh.elements[k].nodes() else { continue };
        let face = mesh.elements[k].face;
        let pairs = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
        let pairs = pairs.map(|pair| pair.map(|t| Element::triangle(t, face)));
        let quality =
            pairs.map(|pair| worst(mesh, index, &pair[0]).min(worst(mesh, index, &pair[1])));
        let best = usize::from(quality[1] > quality[0]);
        if quality[best] > 0.0 {
            mesh.elements[k] = pairs[best][0];
            mesh.elements.push(pairs[best][1]);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::whole;
    use kanagata_geometry::Frame;
    use kanagata_geometry::nurbs::Surface;

    /// A flat face of side 2 and nodes on it.
    fn flat(nodes: &[[f64; 2]], elements: &[&[u32]]) -> (Model, SurfaceMesh) {
        let model = whole(Surface::plane(&Frame::world(), [0.0, 2.0], [0.0, 2.0]));
        let element = |e: &&[u32]| Element::from_ring(e, 0).unwrap();
        let vertices = nodes.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect();
        (
            model,
            SurfaceMesh {
                vertices,
                elements: elements.iter().map(element).collect(),
                ..SurfaceMesh::default()
            },
        )
    }

    #[test]
    fn a_node_inside_is_moved_until_no_element_is_inverted() {
        let nodes = [
            [0.0, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [0.0, 1.0],
            [1.9, 1.9],
            [2.0, 1.0],
            [0.0, 2.0],
            [1.0, 2.0],
            [2.0, 2.0],
        ];
        let quads: [&[u32]; 4] = [&[0, 1, 4, 3], &[1, 2, 5, 4], &[3, 4, 7, 6], &[4, 5, 8, 7]];
        let (model, mut mesh) = flat(&nodes, &quads);
        let before = mesh.clone();
        assert!(check(&mesh, &model).is_err());
        let mended = mend(&mut mesh, &model);
        assert_eq!((mended.left, mended.moved, mended.split), (0, 1, 0));
        assert_eq!(mended.inverted, 1);
        check(&mesh, &model).unwrap();
        for k in (0..9).filter(|&k| k != 4) {
            assert_eq!(mesh.vertices[k], before.vertices[k]);
        }
    }

    #[test]
    fn a_quadrilateral_with_a_concave_corner_on_the_border_is_split() {
        let nodes = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.3, 0.7]];
        let (model, mut mesh) = flat(&nodes, &[&[0, 1, 2, 3]]);
        let expected = Mended { inverted: 1, left: 0, moved: 0, split: 1 };
        assert_eq!(mend(&mut mesh, &model), expected);
        assert_eq!(mesh.elements.len(), 2);
        assert!(corner_jacobians(&mesh, &model).iter().all(|&j| j > 0.1));
    }

    #[test]
    fn inverted_elements_on_border_nodes_are_refused_by_face_and_place() {
        let nodes = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let (model, mut mesh) = flat(&nodes, &[&[0, 1, 2], &[0, 3, 2]]);
        let before = mesh.clone();
        assert_eq!(mend(&mut mesh, &model).left, 1);
        assert_eq!(mesh, before);
        let text = check(&mesh, &model).unwrap_err().to_string();
        assert!(text.contains("1 of 2 elements are inverted"), "{text}");
        assert!(
            text.contains("face 0 (") && text.contains("(0.6667, 1.3333, 0.0000) mm"),
            "{text}"
        );
        assert!(text.contains("another algorithm of gmsh or a smaller size"), "{text}");
    }
}
