//! Restriction of a tool surface to some of its patches.

use super::{Hull, Piece, ToolSurface, bounds_of, group};
use crate::tree::Tree;
use kanagata_geometry::Aabb;

impl ToolSurface {
    fn piece_bounds(&self) -> Vec<Aabb> {
        self.pieces.iter().zip(&self.hulls).map(|(piece, hull)| bounds_of(piece, hull)).collect()
    }

    /// Bounding box of each patch [mm]; empty for an excluded patch.
    #[must_use]
    pub fn patch_bounds(&self) -> Vec<Aabb> {
        let mut out = vec![Aabb::EMPTY; self.model.patches.len()];
        for (piece, bounds) in self.pieces.iter().zip(self.piece_bounds()) {
            let patch = &mut out[piece.patch as usize];
            *patch = patch.union(&bounds);
        }
        out
    }

    /// The surface of all patches, if [`Self::restricted_to`] excluded some; `None` otherwise.
    #[must_use]
    pub fn complete(&self) -> Option<Self> {
        let left_out = self.patch_bounds().iter().any(Aabb::is_empty);
        left_out.then(|| Self::new(self.model.clone()))
    }

    /// The surface for points that are closer to the patches `kept` than to all others, which are not searched. Patch
    /// ids, borders and tolerances are those of the whole tool, so that results are bit-identical.
    #[must_use]
    pub fn restricted_to(&self, kept: &[bool]) -> Self {
        let stays = |piece: &Piece| kept.get(piece.patch as usize).copied().unwrap_or(true);
        let left: Vec<usize> = (0..self.pieces.len()).filter(|&k| stays(&self.pieces[k])).collect();
        let all = self.piece_bounds();
        let boxes: Vec<Aabb> = left.iter().map(|&k| all[k]).collect();
        let mut order: Vec<u32> = (0..left.len() as u32).collect();
        let tree = Tree::build(&boxes, &mut order);
        let position = |k: &u32| left[*k as usize];
        let pieces: Vec<Piece> = order.iter().map(|k| self.pieces[position(k)].clone()).collect();
        let hulls: Vec<Hull> = order.iter().map(|k| self.hulls[position(k)].clone()).collect();
        let (by_patch, starts) = group(&pieces, self.model.patches.len());
        Self {
            model: self.model.clone(),
            charts: order.iter().map(|k| self.charts[position(k)]).collect(),
            pieces,
            hulls,
            by_patch,
            starts,
            tree,
            borders: self.borders.clone(),
            bounds: self.bounds,
            rounding: self.rounding,
            tolerance: self.tolerance,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::Projection;
    use crate::test_tools::{arc, revolved};
    use kanagata_geometry::Vec3;

    #[test]
    fn near_the_patches_that_are_kept_answers_are_the_same_bits() {
        let profile = [arc(6, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
        let whole = ToolSurface::new(revolved("ball", 4, FRAC_PI_2, &profile));
        let kept: Vec<bool> = whole.patch_bounds().iter().map(|b| b.min.z < 4.0).collect();
        let dropped = kept.iter().filter(|k| !**k).count();
        assert!(dropped > 0 && dropped < kept.len());
        let part = whole.restricted_to(&kept);
        assert_eq!(part.bounds(), whole.bounds());
        let empty = part.patch_bounds().iter().filter(|b| b.is_empty()).count();
        assert_eq!(empty, dropped);
        let bits = |p: &Projection| {
            let place = [p.eta, p.zeta, p.gap, p.point.x, p.point.y, p.point.z].map(f64::to_bits);
            (p.patch, place, p.location, p.past_border)
        };
        for k in 0..200_u32 {
            let f = |m: u32| f64::from(k.wrapping_mul(m) % 97) / 97.0;
            let p = Vec3::new(5.0 * f(31), 5.0 * f(57), 0.5 * f(89) - 0.2);
            let (a, b) = (whole.within(&p, None, 1.0), part.within(&p, None, 1.0));
            assert_eq!(bits(&a), bits(&b), "{p:?}");
        }
    }
}
