//! Transfinite interpolation: points inside a four- or three-sided region from the points on its sides.

use kanagata_geometry::Vec2;

/// A quantity that can be interpolated.
pub trait Blend:
    Copy
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<f64, Output = Self>
{
}

impl<T> Blend for T where
    T: Copy
        + std::ops::Add<Output = T>
        + std::ops::Sub<Output = T>
        + std::ops::Mul<f64, Output = T>
{
}

/// Four sides of a region as lists of points. Opposite sides have equal length and direction: `bottom` and `top` from
/// left to right, `left` and `right` from bottom to top.
#[derive(Debug, Clone)]
pub struct FourSides<T> {
    /// From the lower left corner to the lower right.
    pub bottom: Vec<T>,
    /// From the lower right corner to the upper right.
    pub right: Vec<T>,
    /// From the upper left corner to the upper right.
    pub top: Vec<T>,
    /// From the lower left corner to the upper left.
    pub left: Vec<T>,
}

/// Relative positions along each side, in the layout of [`FourSides`].
pub type RelativePositions = FourSides<f64>;

impl<T> FourSides<T> {
    /// Number of cells along and across.
    pub fn cells(&self) -> [usize; 2] {
        [self.bottom.len() - 1, self.left.len() - 1]
    }
}

impl<T: Blend> FourSides<T> {
    /// Coons patch at grid point (i, j): `(1-y) B + y T + (1-x) L + x R - bilinear(corners)`, where x and y are
    /// interpolated from the relative positions of the four boundary points.
    pub fn point(&self, positions: &RelativePositions, i: usize, j: usize) -> T {
        let [m, n] = self.cells();
        let (xb, xt, yl, yr) =
            (positions.bottom[i], positions.top[i], positions.left[j], positions.right[j]);
        // Intersection of the lines (xb, 0)-(xt, 1) and (0, yl)-(1, yr) in the unit square.
        let x = (xb + yl * (xt - xb)) / (1.0 - (xt - xb) * (yr - yl));
        let y = yl + x * (yr - yl);
        let (b, t, l, r) = (self.bottom[i], self.top[i], self.left[j], self.right[j]);
        let corners = (self.bottom[0] * (1.0 - x) + self.bottom[m] * x) * (1.0 - y)
            + (self.top[0] * (1.0 - x) + self.top[m] * x) * y;
        debug_assert!(self.right.len() == n + 1);
        b * (1.0 - y) + t * y + l * (1.0 - x) + r * x - corners
    }
}

/// Three sides of a region as lists of points of equal length: A to B, B to C, A to C.
#[derive(Debug, Clone)]
pub struct ThreeSides {
    /// From A to B.
    pub ab: Vec<Vec2>,
    /// From B to C.
    pub bc: Vec<Vec2>,
    /// From A to C.
    pub ac: Vec<Vec2>,
}

impl ThreeSides {
    /// Perronnet's map at the barycentric coordinates (1 - x - y, x, y), exact on the boundary.
    pub fn point(&self, x: f64, y: f64) -> Vec2 {
        let a = 1.0 - x - y;
        let at = |side: &[Vec2], s: f64| {
            let s = s.clamp(0.0, 1.0) * (side.len() - 1) as f64;
            let k = (s.floor() as usize).min(side.len() - 2);
            side[k] + (side[k + 1] - side[k]) * (s - k as f64)
        };
        let (pa, pb, pc) = (self.ab[0], self.bc[0], self.bc[self.bc.len() - 1]);
        (at(&self.ab, x) + at(&self.ac, y) - pa) * a
            + (at(&self.ab, 1.0 - a) + at(&self.bc, y) - pb) * x
            + (at(&self.ac, 1.0 - a) + at(&self.bc, 1.0 - x) - pc) * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(a: Vec2, b: Vec2, n: usize) -> Vec<Vec2> {
        (0..=n).map(|k| a + (b - a) * (k as f64 / n as f64)).collect()
    }

    #[test]
    fn coons_reproduces_a_bilinear_map_and_its_border() {
        let [a, b, c, d] =
            [[0.0, 0.0], [3.0, 1.0], [4.0, 3.0], [1.0, 2.0]].map(|[x, y]| Vec2::new(x, y));
        let sides = FourSides {
            bottom: line(a, b, 4),
            right: line(b, c, 2),
            top: line(d, c, 4),
            left: line(a, d, 2),
        };
        let uniform = |n: usize| (0..=n).map(|k| k as f64 / n as f64).collect::<Vec<_>>();
        let positions =
            FourSides { bottom: uniform(4), right: uniform(2), top: uniform(4), left: uniform(2) };
        for i in 0..=4 {
            assert!((sides.point(&positions, i, 0) - sides.bottom[i]).norm() < 1e-15);
            for j in 0..=2 {
                let (x, y) = (i as f64 / 4.0, j as f64 / 2.0);
                let expect = (a * (1.0 - x) + b * x) * (1.0 - y) + (d * (1.0 - x) + c * x) * y;
                assert!((sides.point(&positions, i, j) - expect).norm() < 1e-14);
            }
        }
    }

    #[test]
    fn three_sided_map_meets_bent_borders() {
        let bend = |p: Vec2| Vec2::new(p.x + 0.3 * p.y * p.y, p.y - 0.2 * p.x * p.x);
        let corner = [Vec2::zeros(), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)];
        let side = |a: usize, b: usize| -> Vec<Vec2> {
            line(corner[a], corner[b], 6).into_iter().map(bend).collect()
        };
        let sides = ThreeSides { ab: side(0, 1), bc: side(1, 2), ac: side(0, 2) };
        for k in 0..=6 {
            let s = k as f64 / 6.0;
            assert!((sides.point(s, 0.0) - sides.ab[k]).norm() < 1e-14);
            assert!((sides.point(0.0, s) - sides.ac[k]).norm() < 1e-14);
            assert!((sides.point(1.0 - s, s) - sides.bc[k]).norm() < 1e-14);
        }
    }
}
