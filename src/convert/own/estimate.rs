//! Normals from vertices: the mean of the facets at each, by their area.
//!
//! Where a flat runs out into a fillet the flat's facet is the larger one, so its normal counts most; a mean by angle would
//! tilt it by half of what the fillet's first facet is turned. What CAD knows exactly stays wrong by a little all the same:
//! docs/results/patches.md has the figures.

use super::fans::Fans;
use crate::geometry::Vec3;
use crate::geometry::frame::unit;
use crate::mesh::SurfaceMesh;

/// The normal of every fan; zero where its elements have no area.
pub(super) fn normals(mesh: &SurfaceMesh, fans: &Fans) -> Vec<Vec3> {
    let mut sums = vec![Vec3::zeros(); fans.count];
    for (k, element) in mesh.elements.iter().enumerate() {
        let x = mesh.corners(element);
        for (at, here) in x.iter().enumerate() {
            let next = x[(at + 1) % x.len()] - here;
            let last = x[(at + x.len() - 1) % x.len()] - here;
            sums[fans.of(k, at)] += next.cross(&last);
        }
    }
    sums.into_iter().map(|sum| unit(sum).unwrap_or_default()).collect()
}
