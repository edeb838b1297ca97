//! Axis-aligned boxes.

use super::Vec3;

/// An axis-aligned box; empty while `min > max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates [mm].
    pub min: Vec3,
    /// Largest coordinates [mm].
    pub max: Vec3,
}

impl Aabb {
    /// The empty box, the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self {
        min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around `points`.
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Self {
        let mut out = Self::EMPTY;
        for p in points {
            out.grow(p);
        }
        out
    }

    /// Extends the box to contain `p`.
    pub fn grow(&mut self, p: &Vec3) {
        self.min = self.min.inf(p);
        self.max = self.max.sup(p);
    }

    /// The smallest box that contains both boxes.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// The box widened by `by` on every side.
    #[must_use]
    pub fn widened(&self, by: f64) -> Self {
        Self { min: self.min.add_scalar(-by), max: self.max.add_scalar(by) }
    }

    /// True for a box that contains no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|k| self.min[k] > self.max[k])
    }

    /// Middle of the box.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Length of the diagonal [mm]; 0 when empty.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.max - self.min).norm() }
    }

    /// The eight corners, x changing fastest.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        let pick =
            |k: usize, axis: usize| if k >> axis & 1 == 0 { self.min } else { self.max }[axis];
        std::array::from_fn(|k| Vec3::new(pick(k, 0), pick(k, 1), pick(k, 2)))
    }

    /// Squared distance from `p` to the box [mm^2]; 0 inside.
    #[must_use]
    pub fn distance_squared(&self, p: &Vec3) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let d = (self.min[k] - p[k]).max(0.0).max(p[k] - self.max[k]);
            sum += d * d;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_is_zero_inside_and_euclidean_outside() {
        let cube = Aabb::of_points(&[Vec3::zeros(), Vec3::new(1.0, 1.0, 1.0)]);
        assert_eq!(cube.distance_squared(&Vec3::new(0.5, 0.2, 0.9)), 0.0);
        assert_eq!(cube.distance_squared(&Vec3::new(4.0, 5.0, 0.5)), 25.0);
        assert!(Aabb::EMPTY.is_empty() && Aabb::EMPTY.diagonal() == 0.0);
    }
}
