//! Estimated vertex normals: area-weighted means of the facet normals.
//!
//! At the border of a flat and a fillet the facet of the flat is the larger one and dominates the mean. A mean weighted
//! by angle would be tilted by half the angle of the first facet of the fillet. docs/results/patches.md has the
//! remaining errors against CAD normals.

use super::fans::Fans;
use kanagata_geometry::Vec3;
use kanagata_geometry::frame::unit;
use kanagata_mesh::SurfaceMesh;

/// Unit normal of each fan, `sum_e a x b` over its corners with the adjacent sides a and b; zero where the sum
/// vanishes.
pub(super) fn mean_normals(mesh: &SurfaceMesh, fans: &Fans) -> Vec<Vec3> {
    let mut sums = vec![Vec3::zeros(); fans.count];
    for (k, element) in mesh.elements.iter().enumerate() {
        let x = mesh.corners(element);
        for (at, here) in x.iter().enumerate() {
            let next = x[(at + 1) % x.len()] - here;
            let last = x[(at + x.len() - 1) % x.len()] - here;
            sums[fans.fan_at(k, at)] += next.cross(&last);
        }
    }
    sums.into_iter().map(|sum| unit(sum).unwrap_or_default()).collect()
}
