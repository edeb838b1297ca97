//! What a mesh file holds, and how it is put together from rings of vertices or loose triangles.

use std::collections::HashMap;

use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::mesh::{Element, SurfaceMesh};

/// Face number of elements whose file names none; [`attach()`](crate::mesh::attach()) finds it.
pub const UNATTACHED: u32 = u32::MAX;

/// Unit normals at the corners of an element, in the order of its nodes; zero where the file has none.
pub type CornerNormals = [Vec3; 4];

/// What a mesh file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh.
    pub mesh: SurfaceMesh,
    /// Normals of every element's corners: those of OBJ (`vn`), of the point array `Normals` of VTU, and of a point array
    /// of that name (or `nx`, `ny`, `nz`) in what meshio reads; none when the file has none.
    pub normals: Vec<CornerNormals>,
}

impl From<SurfaceMesh> for MeshFile {
    fn from(mesh: SurfaceMesh) -> Self {
        Self { mesh, normals: Vec::new() }
    }
}

/// The element over a ring of vertices that each have a normal, if enough of them differ; with the normals of its corners.
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
    let mut mesh = SurfaceMesh { vertices, elements };
    mesh.compact();
    let none = normals.iter().flatten().all(|n| *n == Vec3::zeros());
    MeshFile { mesh, normals: if none { Vec::new() } else { normals } }
}

/// Merges vertices with the same coordinates (to the bit) into a mesh.
#[derive(Default)]
pub(super) struct Merger {
    pub(super) mesh: SurfaceMesh,
    known: HashMap<[u64; 3], u32>,
}

impl Merger {
    pub(super) fn vertex(&mut self, p: Vec3) -> u32 {
        // 0.0 and -0.0 are the same place.
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
