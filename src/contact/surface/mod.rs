//! A tool prepared for contact: the pieces of its patches and the search tree.

mod restriction;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use super::foot::locate;
use super::form::Chart;
use super::hull::Hull;
use super::piece::{Piece, pieces_of};
use super::projection::Location;
use super::topology::Borders;
use super::tree::Tree;
use kanagata_geometry::{Aabb, Vec2, Vec3};
use kanagata_tool::ToolModel;

/// A tool model with its search tree.
pub struct ToolSurface {
    model: ToolModel,
    /// Pieces, in tree order.
    pub(super) pieces: Vec<Piece>,
    /// Map from each piece to its patch.
    pub(super) charts: Vec<Chart>,
    /// Further bounds of each piece.
    pub(super) hulls: Vec<Hull>,
    /// Pieces of patch k: `by_patch[starts[k]..starts[k + 1]]`.
    by_patch: Vec<u32>,
    starts: Vec<u32>,
    pub(super) tree: Tree,
    pub(super) borders: Borders,
    bounds: Aabb,
    /// Length that is rounding only [mm].
    pub(super) rounding: f64,
    /// Largest excess of a result over the smallest distance where the distance is not convex [mm].
    pub(super) tolerance: f64,
}

impl ToolSurface {
    /// Divides the patches into pieces and builds the tree.
    #[must_use]
    pub fn new(model: ToolModel) -> Self {
        let cut: Vec<Vec<(Piece, Chart)>> = model
            .patches
            .par_iter()
            .enumerate()
            .map(|(id, patch)| pieces_of(id as u32, patch))
            .collect();
        let cut: Vec<(Piece, Chart)> = cut.into_iter().flatten().collect();
        let hulls: Vec<Hull> = cut.par_iter().map(|(piece, _)| Hull::of(piece)).collect();
        let boxes: Vec<Aabb> =
            cut.iter().zip(&hulls).map(|((piece, _), hull)| bounds_of(piece, hull)).collect();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(b));
        let mut order: Vec<u32> = (0..cut.len() as u32).collect();
        let tree = Tree::build(&boxes, &mut order);
        let (pieces, charts): (Vec<Piece>, Vec<Chart>) =
            order.iter().map(|&k| cut[k as usize].clone()).unzip();
        let hulls = order.iter().map(|&k| hulls[k as usize].clone()).collect();
        let (by_patch, starts) = group(&pieces, model.patches.len());
        let size = bounds.diagonal() + bounds.center().amax();
        let borders = Borders::of(&model);
        Self {
            model,
            pieces,
            charts,
            hulls,
            by_patch,
            starts,
            tree,
            borders,
            bounds,
            rounding: 4e-16 * if size.is_finite() { size } else { 0.0 },
            tolerance: 2e-10_f64.min(1e-12 * bounds.diagonal()),
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &ToolModel {
        &self.model
    }

    /// Bounding box of all patches [mm].
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The piece of a patch with the nearest centre.
    pub(super) fn nearest_piece(&self, patch: u32, p: &Vec3) -> Option<usize> {
        let pieces = self.pieces_of(patch).iter().map(|&k| k as usize);
        let far = |k: &usize| (p - self.pieces[*k].form.centre).norm_squared();
        pieces.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Indices of the pieces of a patch; empty for an invalid one.
    #[inline(always)]
    pub(super) fn pieces_of(&self, patch: u32) -> &[u32] {
        let k = patch as usize;
        match (self.starts.get(k), self.starts.get(k.wrapping_add(1))) {
            (Some(&a), Some(&b)) => &self.by_patch[a as usize..b as usize],
            _ => &[],
        }
    }

    /// Location of `at` on a patch.
    pub(super) fn location(&self, patch: u32, at: Vec2) -> Location {
        locate(self.model.patches[patch as usize].sides(), at).0
    }
}

/// Bounding box of the control net of a piece, with a margin for rounding.
fn bounds_of(piece: &Piece, hull: &Hull) -> Aabb {
    let mut b = Aabb::EMPTY;
    hull.net().iter().for_each(|p| b.grow(&(p + piece.form.centre)));
    b.widened(1e-14 * (1.0 + b.diagonal() + b.center().amax()))
}

/// Indices of the pieces by patch, and the start of each patch.
fn group(pieces: &[Piece], patches: usize) -> (Vec<u32>, Vec<u32>) {
    let mut by_patch: Vec<u32> = (0..pieces.len() as u32).collect();
    by_patch.sort_by_key(|&k| pieces[k as usize].patch);
    let mut starts = vec![0; patches + 1];
    for piece in pieces {
        starts[piece.patch as usize + 1] += 1;
    }
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    (by_patch, starts)
}
