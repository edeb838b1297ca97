//! Degrees of patches: equal on shared sides, and as high as the tolerance requires.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::basis::Basis;
use super::map::{PatchShape, is_folded, surface_error};
use super::side::Sides;
use crate::searches::SearchedFace;
use kanagata_mesh::SurfaceMesh;
use kanagata_tool::Patch;
use kanagata_tool::patch::MAX_DEGREE;

/// Raises degrees until opposite sides of each patch, and both patches at each side, have the same degree.
pub(super) fn equalise(shapes: &mut [PatchShape]) {
    let mut of_side: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut changed = true;
    while changed {
        changed = false;
        for s in shapes.iter_mut() {
            for (k, curve) in s.map.sides.iter().enumerate() {
                let Some(side) = curve.side else { continue };
                let degree = of_side.entry(side).or_insert(1);
                let both = s.degrees[k % 2].max(*degree);
                changed |= both != *degree || both != s.degrees[k % 2];
                (*degree, s.degrees[k % 2]) = (both, both);
            }
        }
    }
}

/// A patch and its checks.
pub(super) struct BuiltPatch {
    pub(super) patch: Patch,
    /// Maximum distance from the face and from CAD edges [mm].
    pub(super) error_mm: f64,
    /// True when the patch is folded.
    pub(super) is_folded: bool,
}

/// Builds and checks the patch of a shape; `tolerance` [mm] as for [`surface_error`].
pub(super) fn build(
    face: SearchedFace<'_>,
    shape: &PatchShape,
    (sides, basis): (&Sides, &Basis),
    tolerance: f64,
) -> BuiltPatch {
    let points = shape.map.net(face, shape.degrees, sides, basis);
    let patch = Patch::Bezier { degrees: shape.degrees, points };
    let at_edges = |k: usize| shape.map.edge_deviation(k, shape.degrees[k], sides, basis);
    let in_face = surface_error(face, &patch, &shape.map, tolerance);
    let error_mm = in_face.max(at_edges(0)).max(at_edges(1));
    let is_folded = is_folded(face, &patch, tolerance);
    BuiltPatch { patch, error_mm, is_folded }
}

/// Builds all patches. The degrees of patches above the tolerance [mm] and of folded patches are raised, up to the
/// maximum degree. A higher degree costs less than a finer mesh.
pub(super) fn build_within_tolerance(
    shapes: &mut [PatchShape],
    mesh: &SurfaceMesh,
    tolerance: f64,
    build: impl Fn(&PatchShape, u32) -> BuiltPatch + Sync,
) -> Vec<BuiltPatch> {
    let all = mesh.elements.par_iter().zip(&*shapes);
    let mut built: Vec<BuiltPatch> = all.map(|(e, s)| build(s, e.face)).collect();
    loop {
        let before: Vec<[usize; 2]> = shapes.iter().map(|s| s.degrees).collect();
        for (s, b) in shapes.iter_mut().zip(&built) {
            if b.is_folded || b.error_mm > tolerance {
                s.degrees = s.degrees.map(|d| (d + 1).min(MAX_DEGREE));
            }
        }
        equalise(shapes);
        let changed: Vec<usize> =
            (0..shapes.len()).filter(|&k| shapes[k].degrees != before[k]).collect();
        if changed.is_empty() {
            return built;
        }
        let again: Vec<BuiltPatch> =
            changed.par_iter().map(|&k| build(&shapes[k], mesh.elements[k].face)).collect();
        changed.into_iter().zip(again).for_each(|(k, b)| built[k] = b);
    }
}
