//! Degrees of patches: the same on both sides of each, and as high as the tolerance asks.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::basis::Basis;
use super::map::{Shape, error, folds};
use super::side::Sides;
use crate::convert::searches::SearchedFace;
use crate::mesh::SurfaceMesh;
use crate::tool::Patch;
use crate::tool::patch::MAX_DEGREE;

/// Raises degrees until both sides of every patch, and both patches of every side, have the same one.
pub(super) fn agree(shapes: &mut [Shape]) {
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

/// A patch, its largest distance from its face and its edges, and whether it folds.
pub(super) struct Built {
    pub(super) patch: Patch,
    pub(super) error_mm: f64,
    pub(super) folds: bool,
}

/// The patch of a shape; `tolerance` [mm] as for [`error`].
pub(super) fn build(
    face: SearchedFace<'_>,
    shape: &Shape,
    (sides, basis): (&Sides, &Basis),
    tolerance: f64,
) -> Built {
    let points = shape.map.net(face, shape.degrees, sides, basis);
    let patch = Patch::Bezier { degrees: shape.degrees, points };
    let miss = |k: usize| shape.map.miss(k, shape.degrees[k], sides, basis);
    let error_mm = error(face, &patch, &shape.map, tolerance).max(miss(0)).max(miss(1));
    let folds = folds(face, &patch, tolerance);
    Built { patch, error_mm, folds }
}

/// Builds all patches; the degrees of those that miss the tolerance or fold are raised until they do not, or are the
/// largest: a degree more is cheaper than a finer mesh.
pub(super) fn raised(
    shapes: &mut [Shape],
    mesh: &SurfaceMesh,
    tolerance: f64,
    build: impl Fn(&Shape, u32) -> Built + Sync,
) -> Vec<Built> {
    let all = mesh.elements.par_iter().zip(&*shapes);
    let mut built: Vec<Built> = all.map(|(e, s)| build(s, e.face)).collect();
    loop {
        let before: Vec<[usize; 2]> = shapes.iter().map(|s| s.degrees).collect();
        for (s, b) in shapes.iter_mut().zip(&built) {
            if b.folds || b.error_mm > tolerance {
                s.degrees = s.degrees.map(|d| (d + 1).min(MAX_DEGREE));
            }
        }
        agree(shapes);
        let changed: Vec<usize> =
            (0..shapes.len()).filter(|&k| shapes[k].degrees != before[k]).collect();
        if changed.is_empty() {
            return built;
        }
        let again: Vec<Built> =
            changed.par_iter().map(|&k| build(&shapes[k], mesh.elements[k].face)).collect();
        changed.into_iter().zip(again).for_each(|(k, b)| built[k] = b);
    }
}
