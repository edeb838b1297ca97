//! Surface meshes of a CAD model: built-in mapped mesher, gmsh driver, mesh files.
//!
//! - [`mapped`]: quadrilaterals on four-sided faces, triangulation of all others, consistent divisions of edges
//! - [`gmsh`]: the external program, with its result checked and attached
//! - [`io`]: mesh files; [`attach()`]: assignment of foreign meshes to CAD faces
//! - [`quality`]: area, conformity, corner Jacobians

pub mod attach;
pub mod error;
mod external;
mod feet;
pub mod gmsh;
mod inverted;
pub mod io;
pub mod mapped;
pub mod quality;

use kanagata_geometry::{Aabb, Vec3};

pub use attach::attach;
pub use error::MeshError;
pub use feet::MeshFeet;
pub use quality::MeshReport;

/// A surface mesh whose elements refer to their CAD face.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Vertex positions [mm]; shared across faces where the mesh is conforming.
    pub vertices: Vec<Vec3>,
    /// Triangles and quadrilaterals, counter-clockwise seen from outside (against the outward normal of the face).
    pub elements: Vec<Element>,
    /// Parameters of the vertices on the CAD, where the mesher knows them.
    pub feet: MeshFeet,
}

/// A triangle or quadrilateral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Element {
    nodes: [u32; 4],
    count: u8,
    /// Index of the CAD face.
    pub face: u32,
}

impl Element {
    /// A triangle.
    #[must_use]
    pub fn triangle(nodes: [u32; 3], face: u32) -> Self {
        Self { nodes: [nodes[0], nodes[1], nodes[2], u32::MAX], count: 3, face }
    }

    /// A quadrilateral.
    #[must_use]
    pub fn quad(nodes: [u32; 4], face: u32) -> Self {
        Self { nodes, count: 4, face }
    }

    /// A triangle or quadrilateral over a ring of vertex ids. Repeated neighbours in the ring (poles) are merged;
    /// `None` when fewer than three ids remain.
    #[must_use]
    pub fn from_ring(ring: &[u32], face: u32) -> Option<Self> {
        let mut kept: Vec<u32> = ring.to_vec();
        kept.dedup();
        if kept.len() > 1 && kept.first() == kept.last() {
            kept.pop();
        }
        match kept[..] {
            [a, b, c] => Some(Self::triangle([a, b, c], face)),
            [a, b, c, d] if a != c && b != d => Some(Self::quad([a, b, c, d], face)),
            _ => None,
        }
    }

    /// The three or four vertex ids.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..usize::from(self.count)]
    }

    /// The element with reversed orientation.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut out = *self;
        out.nodes[..usize::from(self.count)].reverse();
        out
    }

    /// Sides as pairs of vertex ids, in order.
    pub fn sides(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let nodes = self.nodes();
        (0..nodes.len()).map(move |k| [nodes[k], nodes[(k + 1) % nodes.len()]])
    }
}

impl SurfaceMesh {
    /// Corner positions of an element.
    #[must_use]
    pub fn corners(&self, element: &Element) -> Vec<Vec3> {
        element.nodes().iter().map(|&n| self.vertices[n as usize]).collect()
    }

    /// Bounding box of all vertices.
    #[must_use]
    pub fn bbox(&self) -> Aabb {
        Aabb::of_points(&self.vertices)
    }

    /// The mesh with every quadrilateral split along its shorter diagonal.
    #[must_use]
    pub fn to_triangles(&self) -> Self {
        let mut elements = Vec::with_capacity(2 * self.elements.len());
        for e in &self.elements {
            let [a, b, c, d] = *e.nodes() else {
                elements.push(*e);
                continue;
            };
            let p = |n: u32| self.vertices[n as usize];
            if (p(c) - p(a)).norm() <= (p(d) - p(b)).norm() {
                elements.push(Element::triangle([a, b, c], e.face));
                elements.push(Element::triangle([a, c, d], e.face));
            } else {
                elements.push(Element::triangle([a, b, d], e.face));
                elements.push(Element::triangle([b, c, d], e.face));
            }
        }
        Self { vertices: self.vertices.clone(), elements, feet: self.feet.clone() }
    }

    /// Removes unused vertices, preserving the order of the others.
    pub fn compact(&mut self) {
        let mut new_id = vec![u32::MAX; self.vertices.len()];
        for e in &self.elements {
            e.nodes().iter().for_each(|&n| new_id[n as usize] = 0);
        }
        let mut kept = 0;
        for (old, id) in new_id.iter_mut().enumerate() {
            if *id == 0 {
                *id = kept as u32;
                self.vertices[kept] = self.vertices[old];
                kept += 1;
            }
        }
        self.vertices.truncate(kept);
        self.feet.renumber(&new_id);
        for e in &mut self.elements {
            let count = usize::from(e.count);
            e.nodes[..count].iter_mut().for_each(|n| *n = new_id[*n as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_with_a_pole_become_triangles_and_flat_rings_vanish() {
        assert_eq!(Element::from_ring(&[1, 2, 3, 3], 0).unwrap().nodes(), [1, 2, 3]);
        assert_eq!(Element::from_ring(&[4, 2, 3, 4], 0).unwrap().nodes(), [4, 2, 3]);
        assert_eq!(Element::from_ring(&[1, 2, 2, 1], 0), None);
        assert_eq!(Element::from_ring(&[1, 2, 1, 3], 0), None);
    }

    #[test]
    fn compact_keeps_shape_and_order() {
        let p = |x: f64| Vec3::new(x, 0.0, 0.0);
        let mut mesh = SurfaceMesh {
            vertices: vec![p(0.0), p(1.0), p(2.0), p(3.0)],
            elements: vec![Element::triangle([3, 0, 2], 5)],
            ..SurfaceMesh::default()
        };
        mesh.compact();
        assert_eq!(mesh.vertices, vec![p(0.0), p(2.0), p(3.0)]);
        assert_eq!(mesh.elements[0].nodes(), [2, 0, 1]);
    }
}

#[cfg(test)]
#[path = "../../tests/skipping/mod.rs"]
mod skipping;

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "../cad/query_tests/shapes.rs"]
mod shapes;
