//! Corners of elements at a vertex that have one normal.

use super::orient::{edges, vector_area};
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::geometry::sets::DisjointSets;
use crate::mesh::SurfaceMesh;

/// Which corners have one normal, and which elements are on one smooth region.
pub(super) struct Fans {
    /// First corner of every element.
    starts: Vec<usize>,
    /// Fan of every corner.
    fan_of: Vec<usize>,
    /// Number of fans.
    pub count: usize,
    /// Region of every element.
    pub region_of: Vec<u32>,
    /// Number of regions.
    pub regions: usize,
}

impl Fans {
    /// Fans of an oriented mesh; facets whose normals have a cosine below `least` meet in a crease, as do those at an edge
    /// that more than two have, and at one without area.
    pub fn new(mesh: &SurfaceMesh, least: f64) -> Self {
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
        for (vertices, sides) in edges(mesh) {
            let [(a, forward), (b, other)] = sides[..] else { continue };
            let (Some(one), Some(two)) = (facets[a], facets[b]) else { continue };
            if forward != other && one.dot(&two) >= least {
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
    pub fn of(&self, k: usize, at: usize) -> usize {
        self.fan_of[self.starts[k] + at]
    }
}
