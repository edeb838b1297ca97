//! Foot points at joints ([`super::joints`]): among the foot points on other faces that are farther than the nearest by
//! at most the gap, the most facing one is used.

use super::project::Descent;
use super::search::{Best, Search};
use super::tree::Walk;
use super::wide::Wide;

/// Difference of the facing values (fraction of the distance along the normal) below which they are equal.
const FACING_TOLERANCE: f64 = 1e-9;

impl<W: Wide> Search<'_, W> {
    /// Where the best foot point is on a joint, replaces it by the most facing one within `reach` [mm].
    #[inline(always)]
    pub(super) fn select_at_joints(&mut self, reach: f64) {
        let surface = self.surface;
        if surface.borders.has_joints() && self.best.patch != u32::MAX {
            let location = surface.location(self.best.patch, self.best.at);
            if surface.borders.is_joint(self.best.patch, location) {
                self.best = self.most_facing(reach);
            }
        }
    }

    /// The most facing foot point among the best one and those on other faces at nearly the same distance; ties are
    /// resolved by distance, then by patch id.
    #[cold]
    fn most_facing(&self, reach: f64) -> Best {
        let surface = self.surface;
        let model = surface.model();
        let farthest = ((2.0 * self.best.value).sqrt() + model.border_gap_mm).min(reach);
        let limit = 0.5 * farthest * farthest;
        let own = model.faces[self.best.patch as usize];
        let mut feet = vec![Best { facing: self.facing(&self.best), ..self.best }];
        let (mut walk, threshold) = (Walk::new(), self.probe.threshold(farthest));
        while let Some(k) = walk.next(self.wide, &surface.tree, &self.probe, threshold) {
            let (piece, chart) = (&surface.pieces[k], &surface.charts[k]);
            if model.faces[piece.patch as usize] == own {
                continue;
            }
            let w = self.p - piece.form.centre;
            let floor = piece.floor(self.wide, &w);
            if floor.value > limit {
                continue;
            }
            let (wide, form, shape) = (self.wide, &piece.form, piece.shape);
            let descent = Descent {
                wide,
                form,
                shape,
                scale: 1.0,
                w,
                min_curvature: floor.min_curvature,
                limit,
            };
            let found = descent.run(piece.start(&floor)).filter(|found| found.value <= limit);
            feet.extend(found.map(|found| {
                let (patch, at) = (piece.patch, chart.at(&found.at));
                let foot = Best { patch, at, value: found.value, ..self.best };
                Best { facing: self.facing(&foot), ..foot }
            }));
        }
        let max_facing = feet.iter().map(|foot| foot.facing).fold(f64::NEG_INFINITY, f64::max);
        let order = |a: &Best, b: &Best| a.value.total_cmp(&b.value).then(a.patch.cmp(&b.patch));
        let facing = feet.into_iter().filter(|foot| foot.facing >= max_facing - FACING_TOLERANCE);
        facing.min_by(order).unwrap_or(self.best)
    }
}
