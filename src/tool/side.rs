//! Sides of patches as space curves: points, bounding boxes, distances.

use rustc_hash::FxHashMap;

use super::Patch;
use kanagata_geometry::golden::minimize;
use kanagata_geometry::{Aabb, Vec3};

/// Number of intervals in which the nearest point is bracketed.
const INTERVALS: usize = 16;

/// Parameters of the corners of a patch with `sides` sides, in order; side k runs from corner k to the next.
#[must_use]
pub fn corners(sides: usize) -> &'static [(f64, f64)] {
    if sides == 3 {
        &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]
    } else {
        &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    }
}

/// Vertices at the ends of side `side` of a patch, given by the vertex ids of its corners.
#[must_use]
pub fn side_ends(ring: &[u32], side: usize) -> [u32; 2] {
    [ring[side % ring.len()], ring[(side + 1) % ring.len()]]
}

/// A side of a patch as a curve over [0, 1].
#[derive(Debug, Clone)]
pub struct SideCurve<'a> {
    patch: &'a Patch,
    ends: [(f64, f64); 2],
    points: [Vec3; INTERVALS + 1],
}

impl<'a> SideCurve<'a> {
    /// Side `side` (from 0) of `patch`.
    #[must_use]
    pub fn new(patch: &'a Patch, side: usize) -> Self {
        let ring = corners(patch.sides());
        let ends = [ring[side % ring.len()], ring[(side + 1) % ring.len()]];
        let mut out = Self { patch, ends, points: [Vec3::zeros(); INTERVALS + 1] };
        out.points = std::array::from_fn(|k| out.point(k as f64 / INTERVALS as f64));
        out
    }

    /// Parameters (eta, zeta) of the patch at `t` in [0, 1].
    #[must_use]
    pub fn parameters(&self, t: f64) -> (f64, f64) {
        let [a, b] = self.ends;
        (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t)
    }

    /// Point at `t` in [0, 1] [mm].
    #[must_use]
    pub fn point(&self, t: f64) -> Vec3 {
        let (eta, zeta) = self.parameters(t);
        self.patch.derivs(eta, zeta).s
    }

    /// Distance between its ends [mm].
    #[must_use]
    pub fn chord(&self) -> f64 {
        (self.points[INTERVALS] - self.points[0]).norm()
    }

    /// A bounding box [mm].
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let around = Aabb::of_points(&self.points);
        // The deviation of a side between its points is less than their distance.
        around.widened(around.diagonal() / INTERVALS as f64)
    }

    /// Distance from `p` to the nearest point of the side [mm].
    #[must_use]
    pub fn distance(&self, p: &Vec3) -> f64 {
        let off = |k: usize| (self.points[k] - p).norm_squared();
        let nearest = (0..=INTERVALS).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
        let at = |k: usize| k as f64 / INTERVALS as f64;
        let between = [at(nearest.saturating_sub(1)), at((nearest + 1).min(INTERVALS))];
        let (_, minimum) = minimize(|t| (self.point(t) - p).norm_squared(), between, 40);
        minimum.min(off(nearest)).sqrt()
    }
}

/// For each patch, given by the vertex ids of its corners, the sides that are used once; collapsed sides are excluded.
#[must_use]
pub fn sides_used_once(rings: &[&[u32]]) -> Vec<Vec<usize>> {
    let ends = |ring: &[u32], k: usize| {
        let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
        [a.min(b), a.max(b)]
    };
    let mut users: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for ring in rings {
        (0..ring.len()).for_each(|k| *users.entry(ends(ring, k)).or_default() += 1);
    }
    let once = |ring: &[u32], k: usize| {
        let [a, b] = ends(ring, k);
        a != b && users[&[a, b]] == 1
    };
    rings.iter().map(|ring| (0..ring.len()).filter(|&k| once(ring, k)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_used_once_twice_or_have_no_length() {
        let found = sides_used_once(&[&[0, 1, 2, 3], &[1, 4, 5, 2], &[5, 5, 6]]);
        assert_eq!(found, [vec![0, 2, 3], vec![0, 1, 2], vec![]]);
    }

    #[test]
    fn distances_to_a_bent_side_are_those_of_dense_sampling() {
        let points = [[0.0, 0.0, 0.0], [5.0, 6.0, 1.0], [10.0, 0.0, 3.0]];
        let far = points.map(|[x, y, z]| [x, y + 20.0, z]);
        let points = points.iter().zip(far).flat_map(|(a, b)| [Vec3::from(*a), Vec3::from(b)]);
        let patch = Patch::Bezier { degrees: [2, 1], points: points.collect() };
        let side = SideCurve::new(&patch, 0);
        assert_eq!(side.point(0.0), Vec3::zeros());
        assert_eq!(side.point(1.0), Vec3::new(10.0, 0.0, 3.0));
        for p in [Vec3::new(3.0, 1.0, 2.0), Vec3::new(-4.0, 2.0, 0.0), Vec3::new(9.0, 7.0, -3.0)] {
            let dense = (0..=100_000).map(|k| (side.point(f64::from(k) * 1e-5) - p).norm());
            let dense = dense.fold(f64::INFINITY, f64::min);
            assert!((side.distance(&p) - dense).abs() < 1e-8, "{p:?}");
            assert!(side.bounds().distance_squared(&p).sqrt() <= dense);
        }
    }
}
