//! Fans: groups of element corners at a vertex with a common normal.

use super::orient::{edge_elements, vector_area};
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;
use kanagata_geometry::sets::DisjointSets;
use kanagata_mesh::SurfaceMesh;

/// Fans of the corners and smooth regions of the elements of a mesh.
pub(super) struct Fans {
    /// Index of the first corner of each element.
    starts: Vec<usize>,
    /// Fan of each corner.
    fan_of: Vec<usize>,
    /// Number of fans.
    pub count: usize,
    /// Region of each element.
    pub region_of: Vec<u32>,
    /// Number of regions.
    pub regions: usize,
}

impl Fans {
    /// Computes fans and regions of an oriented mesh. An edge is smooth when it has exactly two facets, of opposite
    /// direction along it, with the cosine between their normals at least `cosine_min`. Facets of zero area have no
    /// smooth edges.
    pub fn new(mesh: &SurfaceMesh, cosine_min: f64) -> Self {
        let mut starts = vec![0];
        for element in &mesh.elements {
            starts.push(starts[starts.len() - 1] + element.nodes().len());
        }
        let facets: Vec<Option<Vec3>> =
            mesh.elements.iter().map(|e| unit(vector_area(mesh, e))).collect();
        let mut corners = DisjointSets::new(starts[starts.len() - 1]);
        let mut elements = DisjointSets::new(mesh.elements.len());
        let corner = |k: usize, vertex: u32| {
            let at = mesh.elements[k].nodes().iter().position(|&n| n == vertex);
            starts[k] + at.unwrap_or(0)
        };
        for (vertices, sides) in edge_elements(mesh) {
            let [(a, forward), (b, other)] = sides[..] else { continue };
            let (Some(one), Some(two)) = (facets[a], facets[b]) else { continue };
            if forward != other && one.dot(&two) >= cosine_min {
                elements.join(a, b);
                vertices.iter().for_each(|&v| corners.join(corner(a, v), corner(b, v)));
            }
        }
        let (fan_of, count) = corners.numbered();
        let (region_of, regions) = elements.numbered();
        let region_of = region_of.into_iter().map(|r| r as u32).collect();
        Self { starts, fan_of, count, region_of, regions }
    }

    /// Fan of corner `at` of element `k`.
    pub fn fan_at(&self, k: usize, at: usize) -> usize {
        self.fan_of[self.starts[k] + at]
    }
}
