//! Area of a patch by adaptive Gauss quadrature, independent of the sample grid.

use kanagata_tool::Patch;

/// Abscissae and weights of the six-point Gauss rule on [0, 1].
const RULE: [[f64; 2]; 6] = [
    [0.033_765_242_898_423_99, 0.085_662_246_189_585_17],
    [0.169_395_306_766_867_74, 0.180_380_786_524_069_3],
    [0.380_690_406_958_401_56, 0.233_956_967_286_345_53],
    [0.619_309_593_041_598_4, 0.233_956_967_286_345_53],
    [0.830_604_693_233_132_3, 0.180_380_786_524_069_3],
    [0.966_234_757_101_576, 0.085_662_246_189_585_17],
];
/// Tolerance on the difference between a rectangle and its quarters, relative to the area of the patch.
const QUADRATURE_TOLERANCE_REL: f64 = 1e-9;
/// Maximum depth of subdivision; at degenerate corners the remaining area is negligible.
const SUBDIVISION_DEPTH_MAX: u32 = 8;
/// Maximum number of subdivided rectangles per patch. A collapsed corner needs about ten, a fold along a patch about
/// five hundred. The area of patches with more folds is less accurate. Doubled: twice the time for such patches.
const SUBDIVISIONS_PER_PATCH_MAX: usize = 1000;
/// Maximum number over all patches of a tool, if that leaves each patch [`SUBDIVISIONS_MIN`], which suffices for a
/// collapsed corner.
const SUBDIVISIONS_TOTAL_MAX: usize = 5_000;
const SUBDIVISIONS_MIN: usize = 50;

/// Maximum number of subdivided rectangles for each of `patches` patches.
pub(super) fn max_subdivisions(patches: usize) -> usize {
    (SUBDIVISIONS_TOTAL_MAX / patches.max(1)).clamp(SUBDIVISIONS_MIN, SUBDIVISIONS_PER_PATCH_MAX)
}

/// Area of a patch [mm^2], with a relative error of about 1e-7 and at most `max_subdivisions` subdivided rectangles.
pub(super) fn area(patch: &Patch, max_subdivisions: usize) -> f64 {
    let whole = gauss(patch, [0.0, 0.0], 1.0);
    let mut sum = 0.0;
    let mut stack = vec![([0.0, 0.0], 1.0, whole, 0)];
    let mut left = max_subdivisions;
    while let Some(([x, y], side, rough, depth)) = stack.pop() {
        let half = 0.5 * side;
        let quarters = [[x, y], [x + half, y], [x, y + half], [x + half, y + half]]
            .map(|at| (at, gauss(patch, at, half)));
        let fine: f64 = quarters.iter().map(|q| q.1).sum();
        let done = depth >= SUBDIVISION_DEPTH_MAX || left == 0;
        if done || (fine - rough).abs() <= QUADRATURE_TOLERANCE_REL * whole || !fine.is_finite() {
            sum += fine;
        } else {
            left -= 1;
            stack.extend(quarters.map(|(at, area)| (at, half, area, depth + 1)));
        }
    }
    sum
}

/// Area over the square with this corner and side in the unit square [mm^2]; triangles are mapped from it by
/// `(eta, zeta) = (s, s t)`.
fn gauss(patch: &Patch, [x, y]: [f64; 2], side: f64) -> f64 {
    let mut sum = 0.0;
    for [a, first] in RULE {
        for [b, second] in RULE {
            let (s, t) = (x + side * a, y + side * b);
            let triangle = patch.sides() == 3;
            let d = patch.derivs(s, if triangle { s * t } else { t });
            let fraction = if triangle { s } else { 1.0 };
            sum += first * second * fraction * d.d1.cross(&d.d2).norm();
        }
    }
    sum * side * side
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Vec3;

    /// A flat bilinear patch.
    fn flat(points: [[f64; 2]; 4]) -> Patch {
        let points = points.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        Patch::Bezier { degrees: [1, 1], points }
    }

    #[test]
    fn areas_of_known_patches() {
        let (x, y, z, o) = (Vec3::x(), Vec3::y(), Vec3::z(), Vec3::zeros());
        let square = flat([[0.0, 0.0], [0.0, 2.0], [3.0, 0.0], [3.0, 2.0]]);
        let collapsed = flat([[0.0, 0.0], [0.0, 0.0], [3.0, 0.0], [3.0, 2.0]]);
        let triangle = Patch::Triangle([o, x * 3.0, y * 2.0, o, o, o]);
        // z = a x^2 over the unit square, as both types of Nagata patch.
        let a: f64 = 0.7;
        let strip = 0.5 * (1.0 + 4.0 * a * a).sqrt() + (2.0 * a).asinh() / (4.0 * a);
        let bowed = Patch::Quad([o, x, y, o, z * a, o, o, o]);
        // Over x >= y, the integral of x sqrt(1 + 4 a^2 x^2).
        let wedge = ((1.0 + 4.0 * a * a).powf(1.5) - 1.0) / (12.0 * a * a);
        let bent = Patch::Triangle([o, x, y, o, z * a, o]);
        let all = [(square, 6.0), (collapsed, 3.0), (triangle, 3.0), (bowed, strip), (bent, wedge)];
        for (k, (patch, exact)) in all.into_iter().enumerate() {
            let found = area(&patch, SUBDIVISIONS_PER_PATCH_MAX);
            assert!((found / exact - 1.0).abs() < 1e-8, "{k}: {found} {exact}");
        }
        assert_eq!(area(&Patch::Quad([o; 8]), SUBDIVISIONS_PER_PATCH_MAX), 0.0);
    }

    /// A cubic that runs back over itself: |S_eta x S_zeta| has kinks along two lines.
    #[test]
    fn the_area_of_a_patch_that_folds_is_bounded_work() {
        let along = [0.0, 8.0, -7.0, 1.0];
        let point = |k: usize| Vec3::new(along[k / 2], (k % 2) as f64, 0.0);
        let points = (0..8).map(point).collect();
        let folded = Patch::Bezier { degrees: [3, 1], points };
        // x(t) forward, back and forward again.
        let x = |t: f64| {
            let s = 1.0 - t;
            3.0 * s * s * t * 8.0 - 3.0 * s * t * t * 7.0 + t * t * t
        };
        let steps = 1_000_000;
        let at = |k: i32| x(f64::from(k) / f64::from(steps));
        let length: f64 = (0..steps).map(|k| (at(k + 1) - at(k)).abs()).sum();
        assert!((area(&folded, SUBDIVISIONS_PER_PATCH_MAX) / length - 1.0).abs() < 1e-4);
    }
}
