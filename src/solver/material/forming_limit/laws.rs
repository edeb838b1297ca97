//! Forming limit curves of steels from tensile data.

use super::curve::LimitCurve;

/// Largest thickness of Keeler and Brazier's correlation [mm]; a thicker sheet has the limit of this thickness.
pub const KEELER_THICKNESS_MAX: f64 = 3.1;
/// Largest strain-hardening exponent of the correlation; a larger one has the limit of this one. Without the bound a
/// steel with n = 0.25 would have a limit higher by a fifth than the steels of the correlation.
const KEELER_EXPONENT_MAX: f64 = 0.21;
/// Engineering minor strain up to which the right branch rises; beyond it the curve is horizontal. Measured curves of
/// steels have been compared up to there.
const KEELER_MINOR_MAX: f64 = 0.2;

/// Keeler and Brazier (1977), "Relationship between laboratory material characterization and press-shop formability",
/// Microalloying 75.
///
/// Engineering limit in plane strain `FLD0 = (23.3 + 14.13 t) n / 0.21` per cent, with t [mm] up to 3.1 and n up to
/// 0.21. In logarithmic strains the left branch has slope -1 (constant thickness strain) and the right one ½: `1 + e1 =
/// (1 + FLD0) (1 + e2)^½`. Up to 20 % minor strain that is within 0.02 of `e1 = FLD0 + 0.6 e2` in engineering strains, the
/// slope of the AHSS Application Guidelines of WorldAutoSteel.
pub(super) fn keeler_brazier(thickness: f64, exponent: f64) -> LimitCurve {
    let (t, n) = (thickness.min(KEELER_THICKNESS_MAX), exponent.min(KEELER_EXPONENT_MAX));
    let plane = (0.01 * (23.3 + 14.13 * t) * n / 0.21).ln_1p();
    let end = KEELER_MINOR_MAX.ln_1p();
    LimitCurve::new(vec![[0.0, plane], [end, plane + 0.5 * end]])
}

/// Abspoel, Scholting and Droog (2013), "A new method for predicting forming limit curves from mechanical properties",
/// J. Mater. Process. Technol. 213, 759-769, Eqs. 14-32.
///
/// Points of uniaxial tension, plane strain, intermediate biaxial and equibiaxial stretching from A80 [%], its smallest
/// value of all directions, the mean r value and the thickness t [mm]. The two biaxial points rise with the thickness up
/// to the transition thickness and are constant beyond.
pub(super) fn abspoel_scholting(t: f64, [a80, smallest]: [f64; 2], r: f64) -> LimitCurve {
    let length = 0.0626 * a80.powf(0.567) + (t - 1.0) * (0.12 - 0.0024 * a80);
    // Minor over thickness strain of the local neck in tension.
    let ratio = 0.797 * r.powf(0.701);
    let thinning = length.max(0.0) / ratio.hypot(1.0);
    let tension = [-ratio * thinning, (1.0 + ratio) * thinning];
    let plane = 0.0084 * a80 + 0.0017 * a80 * (t - 1.0);
    let transition = (1.5 - 0.00215 * smallest) / (0.6 + 0.00285 * smallest);
    let t = t.min(transition);
    let intermediate = 0.0062 * a80 + 0.18 + 0.0027 * a80 * (t - 1.0);
    let equibiaxial = 0.00215 * smallest + 0.25 + 0.00285 * smallest * t;
    let mut points = vec![tension, [0.0, plane], [0.75 * intermediate, intermediate]];
    // A low smallest elongation can put the equibiaxial point to the left of the intermediate one.
    if equibiaxial > 0.75 * intermediate {
        points.push([equibiaxial, equibiaxial]);
    }
    points.retain(|point| point[1] > 0.0);
    points.dedup_by(|b, a| b[0] <= a[0]);
    LimitCurve::new(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeler_brazier_follows_its_formula_within_its_range() {
        for (t, n) in [(0.8, 0.2), (1.0, 0.21), (2.5, 0.12)] {
            let percent = (23.3 + 14.13 * t) * n / 0.21;
            let plane = f64::ln(1.0 + percent / 100.0);
            let curve = keeler_brazier(t, n);
            let near = |minor: f64, major: f64| {
                let found = curve.major_at(minor);
                assert!((found - major).abs() < 1e-14, "{t} {n} {minor}: {found} {major}");
            };
            near(0.0, plane);
            near(-0.25, plane + 0.25);
            near(0.1, plane + 0.05);
            near(f64::ln(1.2), plane + 0.5 * f64::ln(1.2));
            near(0.4, plane + 0.5 * f64::ln(1.2));
            // In engineering strains the right branch has a mean slope of 0.6.
            for e in [0.05, 0.1, 0.2_f64] {
                let found = curve.major_at(e.ln_1p()).exp_m1();
                assert!((found - percent / 100.0 - 0.6 * e).abs() < 0.02, "{found}");
            }
        }
        assert_eq!(keeler_brazier(1.0, 0.21), keeler_brazier(1.0, 0.3));
        assert_eq!(keeler_brazier(3.1, 0.2), keeler_brazier(4.0, 0.2));
        // 1 mm, n = 0.21: 37.43 %.
        assert!((keeler_brazier(1.0, 0.21).major_at(0.0).exp_m1() - 0.3743).abs() < 1e-12);
    }

    /// A80 = 40.8 %, r = 1.829, 1.2 mm: a deep-drawing steel, computed by hand.
    #[test]
    fn abspoel_scholting_gives_its_four_points() {
        let curve = abspoel_scholting(1.2, [40.8, 40.8], 1.829);
        let expected = [[-0.3996, 0.7279], [0.0, 0.3566], [0.3410, 0.4550], [0.4772, 0.4772]];
        for (found, expected) in curve.points().iter().zip(expected) {
            for k in 0..2 {
                assert!((found[k] - expected[k]).abs() < 1.5e-3, "{found:?} {expected:?}");
            }
        }
        assert_eq!(curve.points().len(), 4);
        // Beyond the transition thickness of 1.97 mm the biaxial points are constant, the others are not.
        let [thick, thicker] = [2.2, 2.4].map(|t| abspoel_scholting(t, [40.8, 40.8], 1.829));
        assert_eq!(thick.points()[2..], thicker.points()[2..]);
        assert!(thicker.major_at(0.0) > thick.major_at(0.0));
    }

    #[test]
    fn curves_are_ordered_for_all_inputs() {
        for t in [0.01, 0.5, 2.0, 50.0] {
            for a80 in [0.1, 10.0, 40.0, 100.0] {
                for (part, r) in [(0.01, 0.001), (1.0, 1.0), (0.7, 5.0)] {
                    let curve = abspoel_scholting(t, [a80, part * a80], r);
                    let points = curve.points();
                    assert!(!points.is_empty() && points.iter().all(|p| p[1] > 0.0), "{points:?}");
                    assert!(points.windows(2).all(|p| p[0][0] < p[1][0]), "{t} {a80} {points:?}");
                }
            }
        }
    }
}
