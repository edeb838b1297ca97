//! A tool ready for contact: the pieces of its patches and the tree over them.

mod keeping;
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
use crate::geometry::{Aabb, Vec2, Vec3};
use crate::tool::ToolModel;

/// A tool model with its search tree.
pub struct ToolSurface {
    model: ToolModel,
    /// In the order of the tree.
    pub(super) pieces: Vec<Piece>,
    /// From each piece to its patch.
    pub(super) charts: Vec<Chart>,
    /// What else bounds each piece.
    pub(super) hulls: Vec<Hull>,
    /// Pieces of patch k: `by_patch[starts[k]..starts[k + 1]]`.
    by_patch: Vec<u32>,
    starts: Vec<u32>,
    pub(super) tree: Tree,
    pub(super) borders: Borders,
    bounds: Aabb,
    /// A length that is nothing but rounding [mm].
    pub(super) rounding: f64,
    /// How much farther than the closest point an answer may be where the distance is not convex [mm].
    pub(super) tolerance: f64,
}

impl ToolSurface {
    /// Cuts the patches into pieces and builds the tree.
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

    /// A box around every patch [mm].
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The piece of a patch whose centre is nearest.
    pub(super) fn nearest_piece(&self, patch: u32, p: &Vec3) -> Option<usize> {
        let pieces = self.pieces_of(patch).iter().map(|&k| k as usize);
        let far = |k: &usize| (p - self.pieces[*k].form.centre).norm_squared();
        pieces.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Positions of the pieces of a patch; none of a patch that is not there.
    #[inline(always)]
    pub(super) fn pieces_of(&self, patch: u32) -> &[u32] {
        let k = patch as usize;
        match (self.starts.get(k), self.starts.get(k.wrapping_add(1))) {
            (Some(&a), Some(&b)) => &self.by_patch[a as usize..b as usize],
            _ => &[],
        }
    }

    /// Location at `at` on a patch with so many sides.
    pub(super) fn location(&self, patch: u32, at: Vec2) -> Location {
        locate(self.model.patches[patch as usize].sides(), at).0
    }
}

/// Box of a piece's control net, with room for rounding.
fn bounds_of(piece: &Piece, hull: &Hull) -> Aabb {
    let mut b = Aabb::EMPTY;
    hull.net().iter().for_each(|p| b.grow(&(p + piece.form.centre)));
    b.widened(1e-14 * (1.0 + b.diagonal() + b.center().amax()))
}

/// Positions of the pieces by patch, and where each patch's begin.
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
