//! Surface meshes of a CAD model: the built-in mapped mesher, the gmsh driver, mesh files.

use crate::geometry::Vec3;

/// A surface mesh whose elements know their CAD face.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Vertex positions [mm]; shared over faces where the mesh is conforming.
    pub vertices: Vec<Vec3>,
    /// Triangles and quadrilaterals, turning counter-clockwise seen from outside (from where the face's
    /// outward normal points).
    pub elements: Vec<Element>,
}

/// A triangle or quadrilateral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Element {
    nodes: [u32; 4],
    count: u8,
    /// Index of the CAD face it lies on.
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

    /// Its three or four vertex ids.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..usize::from(self.count)]
    }
}
