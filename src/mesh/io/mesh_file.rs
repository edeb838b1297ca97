//! Contents of a mesh file, assembled from polygons or single triangles.

use std::collections::HashMap;

use crate::{Element, SurfaceMesh};
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;

/// Face index of elements without a face in the file; assigned by [`attach()`](crate::attach()).
pub const UNATTACHED: u32 = u32::MAX;

/// Unit normals at the corners of an element, in the order of its nodes; zero where the file has none.
pub type CornerNormals = [Vec3; 4];

/// Contents of a mesh file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh.
    pub mesh: SurfaceMesh,
    /// Corner normals of every element, empty when the file has none. Sources: `vn` of OBJ, the point array `Normals`
    /// of VTU, and a point array of that name (or `nx`, `ny`, `nz`) in files read by meshio.
    pub normals: Vec<CornerNormals>,
}

impl From<SurfaceMesh> for MeshFile {
    fn from(mesh: SurfaceMesh) -> Self {
        Self { mesh, normals: Vec::new() }
    }
}

/// Element over a ring of vertices with normals, and the normals of its corners; `None` when fewer than three vertices
/// differ.
pub(super) fn with_normals(ring: &[(u32, Vec3)], face: u32) -> Option<(Element, CornerNormals)> {
    let ids: Vec<u32> = ring.iter().map(|corner| corner.0).collect();
    let element = Element::from_ring(&ids, face)?;
    let mut normals = [Vec3::zeros(); 4];
    for (normal, node) in normals.iter_mut().zip(element.nodes()) {
        let given = ring.iter().find(|corner| corner.0 == *node).map(|corner| corner.1);
        *normal = given.and_then(unit).unwrap_or_default();
    }
    Some((element, normals))
}

/// A mesh of such elements; without normals when all of them are zero.
pub(super) fn of_elements(
    vertices: Vec<Vec3>,
    elements: Vec<(Element, CornerNormals)>,
) -> MeshFile {
    let (elements, normals): (Vec<_>, Vec<_>) = elements.into_iter().unzip();
    let mut mesh = SurfaceMesh { vertices, elements, ..SurfaceMesh::default() };
    mesh.compact();
    let none = normals.iter().flatten().all(|n| *n == Vec3::zeros());
    MeshFile { mesh, normals: if none { Vec::new() } else { normals } }
}

/// Builds a mesh by merging vertices with identical coordinates.
#[derive(Default)]
pub(super) struct Merger {
    pub(super) mesh: SurfaceMesh,
    known: HashMap<[u64; 3], u32>,
}

impl Merger {
    pub(super) fn vertex(&mut self, p: Vec3) -> u32 {
        // 0.0 and -0.0 are equal coordinates.
        let key = [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
        *self.known.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(p);
            self.mesh.vertices.len() as u32 - 1
        })
    }

    pub(super) fn triangle(&mut self, corners: [Vec3; 3]) {
        let ids = corners.map(|p| self.vertex(p));
        self.mesh.elements.extend(Element::from_ring(&ids, UNATTACHED));
    }
}
