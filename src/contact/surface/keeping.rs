//! A tool surface whose search knows some of its patches only.

use super::{Hull, Piece, ToolSurface, bounds_of, group};
use crate::contact::tree::Tree;
use crate::geometry::Aabb;

impl ToolSurface {
    fn piece_bounds(&self) -> Vec<Aabb> {
        self.pieces.iter().zip(&self.hulls).map(|(piece, hull)| bounds_of(piece, hull)).collect()
    }

    /// A box around each patch [mm]; empty for a patch that the search does not know.
    #[must_use]
    pub fn patch_bounds(&self) -> Vec<Aabb> {
        let mut out = vec![Aabb::EMPTY; self.model.patches.len()];
        for (piece, bounds) in self.pieces.iter().zip(self.piece_bounds()) {
            let patch = &mut out[piece.patch as usize];
            *patch = patch.union(&bounds);
        }
        out
    }

    /// The surface of all patches of its model, where [`Self::keeping`] left some out; `None` where none are left out.
    #[must_use]
    pub fn complete(&self) -> Option<Self> {
        let left_out = self.patch_bounds().iter().any(Aabb::is_empty);
        left_out.then(|| Self::new(self.model.clone()))
    }

    /// The same surface for points that are nearer to the patches `kept` than to all others: those are not searched.
    /// Patches keep their numbers, borders and tolerances stay those of the whole, so that answers are the same bits.
    #[must_use]
    pub fn keeping(&self, kept: &[bool]) -> Self {
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
    use crate::contact::Projection;
    use crate::contact::test_tools::{arc, revolved};
    use crate::geometry::Vec3;

    #[test]
    fn near_the_patches_that_are_kept_answers_are_the_same_bits() {
        let profile = [arc(6, [0.0, 7.0], 7.0, [-FRAC_PI_2, 0.0], 1.0)];
        let whole = ToolSurface::new(revolved("ball", 4, FRAC_PI_2, &profile));
        let kept: Vec<bool> = whole.patch_bounds().iter().map(|b| b.min.z < 4.0).collect();
        let dropped = kept.iter().filter(|k| !**k).count();
        assert!(dropped > 0 && dropped < kept.len());
        let part = whole.keeping(&kept);
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
