//! Area of a patch by Gauss's rule, whatever the grid of its samples is.

use crate::tool::Patch;

/// Abscissae and weights of the six-point Gauss rule on [0, 1].
const RULE: [[f64; 2]; 6] = [
    [0.033_765_242_898_423_99, 0.085_662_246_189_585_17],
    [0.169_395_306_766_867_74, 0.180_380_786_524_069_3],
    [0.380_690_406_958_401_56, 0.233_956_967_286_345_53],
    [0.619_309_593_041_598_4, 0.233_956_967_286_345_53],
    [0.830_604_693_233_132_3, 0.180_380_786_524_069_3],
    [0.966_234_757_101_576, 0.085_662_246_189_585_17],
];
/// Differences between a rectangle and its quarters that are let pass, as a share of the patch's area.
const TOLERANCE: f64 = 1e-9;
/// Halvings of a rectangle at most: at corners without area what is left is nothing by then.
const DEEPEST: u32 = 8;
/// Rectangles that are quartered in one patch at most: a collapsed corner takes some ten, a fold all along a patch some five hundred. Of
/// what folds more the area is known to fewer digits. Doubled: as much longer for such patches.
const QUARTERED: usize = 1000;
/// The same over all patches of a tool, as long as that leaves each `QUARTERED_LEAST`: more than a collapsed corner takes.
const QUARTERED_IN_ALL: usize = 5_000;
const QUARTERED_LEAST: usize = 50;

/// Rectangles that may be quartered in each of so many patches.
pub(super) fn quartered_most(patches: usize) -> usize {
    (QUARTERED_IN_ALL / patches.max(1)).clamp(QUARTERED_LEAST, QUARTERED)
}

/// Area of a patch [mm^2], to 1e-7 of it or so, with so many rectangles quartered at most.
pub(super) fn area(patch: &Patch, quartered_most: usize) -> f64 {
    let whole = gauss(patch, [0.0, 0.0], 1.0);
    let mut sum = 0.0;
    let mut stack = vec![([0.0, 0.0], 1.0, whole, 0)];
    let mut left = quartered_most;
    while let Some(([x, y], side, rough, depth)) = stack.pop() {
        let half = 0.5 * side;
        let quarters = [[x, y], [x + half, y], [x, y + half], [x + half, y + half]]
            .map(|at| (at, gauss(patch, at, half)));
        let fine: f64 = quarters.iter().map(|q| q.1).sum();
        let done = depth >= DEEPEST || left == 0;
        if done || (fine - rough).abs() <= TOLERANCE * whole || !fine.is_finite() {
            sum += fine;
        } else {
            left -= 1;
            stack.extend(quarters.map(|(at, area)| (at, half, area, depth + 1)));
        }
    }
    sum
}

/// Area over the square of this corner and side in the unit square [mm^2]; triangles are drawn from it by
/// `(eta, zeta) = (s, s t)`.
fn gauss(patch: &Patch, [x, y]: [f64; 2], side: f64) -> f64 {
    let mut sum = 0.0;
    for [a, first] in RULE {
        for [b, second] in RULE {
            let (s, t) = (x + side * a, y + side * b);
            let triangle = patch.sides() == 3;
            let d = patch.derivs(s, if triangle { s * t } else { t });
            let share = if triangle { s } else { 1.0 };
            sum += first * second * share * d.d1.cross(&d.d2).norm();
        }
    }
    sum * side * side
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

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
        // z = a x^2 over the unit square, as both kinds of Nagata patch.
        let a: f64 = 0.7;
        let strip = 0.5 * (1.0 + 4.0 * a * a).sqrt() + (2.0 * a).asinh() / (4.0 * a);
        let bowed = Patch::Quad([o, x, y, o, z * a, o, o, o]);
        // Over x >= y, the integral of x sqrt(1 + 4 a^2 x^2).
        let wedge = ((1.0 + 4.0 * a * a).powf(1.5) - 1.0) / (12.0 * a * a);
        let bent = Patch::Triangle([o, x, y, o, z * a, o]);
        let all = [(square, 6.0), (collapsed, 3.0), (triangle, 3.0), (bowed, strip), (bent, wedge)];
        for (k, (patch, exact)) in all.into_iter().enumerate() {
            let found = area(&patch, QUARTERED);
            assert!((found / exact - 1.0).abs() < 1e-8, "{k}: {found} {exact}");
        }
        assert_eq!(area(&Patch::Quad([o; 8]), QUARTERED), 0.0);
    }

    /// A cubic that runs back over itself: |cross| has a kink along two lines.
    #[test]
    fn the_area_of_a_patch_that_folds_is_bounded_work() {
        let along = [0.0, 8.0, -7.0, 1.0];
        let point = |k: usize| Vec3::new(along[k / 2], (k % 2) as f64, 0.0);
        let points = (0..8).map(point).collect();
        let folded = Patch::Bezier { degrees: [3, 1], points };
        // x(t) there, back and there again.
        let x = |t: f64| {
            let s = 1.0 - t;
            3.0 * s * s * t * 8.0 - 3.0 * s * t * t * 7.0 + t * t * t
        };
        let steps = 1_000_000;
        let at = |k: i32| x(f64::from(k) / f64::from(steps));
        let length: f64 = (0..steps).map(|k| (at(k + 1) - at(k)).abs()).sum();
        assert!((area(&folded, QUARTERED) / length - 1.0).abs() < 1e-4);
    }
}
