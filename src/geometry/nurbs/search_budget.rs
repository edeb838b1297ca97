//! Work that the closest-point searches of one task may take together.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use super::surface::Surface;
use crate::{Vec2, Vec3};

/// Cells (parts of Bezier pieces) that the searches of one task may examine together. Threads may share it.
///
/// A search that exceeds it is cut short and returns the best point so far. Which searches these are depends on the order
/// of the threads; whether the budget is spent does not. The results of a task whose budget is spent must be discarded.
#[derive(Debug)]
pub struct SearchBudget {
    limit: u64,
    used: AtomicU64,
}

impl SearchBudget {
    /// A budget of `limit` cells.
    #[must_use]
    pub const fn new(limit: u64) -> Self {
        Self { limit, used: AtomicU64::new(0) }
    }

    /// Cells the searches may examine together.
    #[must_use]
    pub const fn limit(&self) -> u64 {
        self.limit
    }

    /// Cells examined so far.
    #[must_use]
    pub fn used(&self) -> u64 {
        self.used.load(Relaxed)
    }

    /// True when the searches so far needed the whole budget or more.
    #[must_use]
    pub fn is_spent(&self) -> bool {
        self.left() == 0
    }

    fn left(&self) -> u64 {
        self.limit.saturating_sub(self.used())
    }

    /// As [`Surface::closest`].
    #[must_use]
    pub fn closest(&self, surface: &Surface, p: &Vec3) -> (Vec2, f64) {
        self.search(surface, p, None)
    }

    /// As [`Surface::closest_from`].
    #[must_use]
    pub fn closest_from(&self, surface: &Surface, p: &Vec3, start: Vec2) -> (Vec2, f64) {
        self.search(surface, p, Some(start))
    }

    /// As [`Surface::closest_near`].
    #[must_use]
    pub fn closest_near(
        &self,
        surface: &Surface,
        p: &Vec3,
        start: Vec2,
        enough: f64,
    ) -> (Vec2, f64) {
        surface.closest_near_or(p, start, enough, || self.closest(surface, p))
    }

    fn search(&self, surface: &Surface, p: &Vec3, start: Option<Vec2>) -> (Vec2, f64) {
        let left = u32::try_from(self.left()).unwrap_or(u32::MAX);
        let (uv, distance, cells) = surface.closest_in(p, start, left);
        self.used.fetch_add(u64::from(cells), Relaxed);
        (uv, distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spent_budget_says_so_and_ends_its_searches() {
        let corners = [
            Vec3::zeros(),
            Vec3::new(0.0, 1.0, 1.0),
            Vec3::new(1.0, 0.0, 1.0),
            Vec3::new(1.0, 1.0, 0.0),
        ];
        let knots = [0.0, 0.0, 1.0, 1.0].to_vec();
        let turn =
            Surface::try_new([1, 1], [knots.clone(), knots], corners.to_vec(), None).unwrap();
        let p = Vec3::new(0.5, 0.4, 2.0);
        let wide = SearchBudget::new(1000);
        assert_eq!(wide.closest(&turn, &p), turn.closest(&p));
        assert!(!wide.is_spent());
        let needed = 1000 - wide.left();
        for (limit, spent) in [(needed - 1, true), (needed, true), (needed + 1, false)] {
            let budget = SearchBudget::new(limit);
            let _ = budget.closest(&turn, &p);
            assert_eq!(budget.is_spent(), spent, "{limit} of {needed}");
        }
        let none = SearchBudget::new(0);
        assert!(none.closest(&turn, &p).1.is_finite(), "a point of the surface, whatever is left");
    }
}
