//! Corners of elements at a vertex that have one normal.

use super::orient::{edges, vector_area};
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
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
        let mut corners = Sets::new(starts[starts.len() - 1]);
        let mut elements = Sets::new(mesh.elements.len());
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

/// Disjoint sets of numbers.
struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The least member of the set of `k`.
    fn root(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }

    /// Number of every member's set, in the order of their least members, and how many sets there are.
    fn numbered(mut self) -> (Vec<usize>, usize) {
        let mut count = 0;
        let mut numbers = vec![0; self.parent.len()];
        for k in 0..numbers.len() {
            let root = self.root(k);
            if root == k {
                numbers[k] = count;
                count += 1;
            } else {
                numbers[k] = numbers[root];
            }
        }
        (numbers, count)
    }
}
