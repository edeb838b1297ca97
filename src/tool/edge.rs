//! The Nagata edge: the coefficient of Eq. 8, its guard, and the common curve of a crease.

use nalgebra::{DMatrix, DVector};

use kanagata_geometry::Vec3;

/// How edges are curved.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Default,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum EdgeRule {
    /// Eq. 8 where its curve runs forward, straight elsewhere.
    #[default]
    Guarded,
    /// Eq. 8 everywhere, also where it fails.
    Plain,
}

/// The reason why an edge is replaced by its chord.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeFault {
    /// `|q| > 0.99`: the parabola reverses its direction at an end, or nearly so (an inflected profile, a normal
    /// averaged over a crease, an inaccurate normal at one end).
    TurnsBack,
    /// `|c| >= 2 |d|`: large lateral deviation (nearly parallel normals on an oblique edge).
    SwingsOut,
    /// Both ends coincide, or the normals are opposite.
    Degenerate,
    /// An adjacent patch would fold: two borders meet there at a straight angle, or are tangent.
    Folds,
}

impl std::fmt::Display for EdgeFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TurnsBack => "the parabola would reverse its direction (an inflected profile, a normal averaged over a crease, or an apex)",
            Self::SwingsOut => "the parabola would have a large lateral deviation (nearly parallel normals on an oblique edge)",
            Self::Degenerate => "its ends coincide or their normals are opposite",
            Self::Folds => "an adjacent patch would fold (tangent borders, or a corner near 180 degrees)",
        })
    }
}

/// Coefficient of an edge and the result of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCurve {
    /// Quadratic coefficient c of Eq. 7 [mm].
    pub c: Vec3,
    /// Violated criterion of the guard; `c` is then zero (under [`EdgeRule::Guarded`]).
    pub fault: Option<EdgeFault>,
}

/// Half difference of unit normals below which it is noise of CAD files (1e-9 of their lengths, 1e-10 in their
/// normals). Along it the edge is straight. A tangential part `(nu . d)/|dl|^2 dl` due to noise alone could be as long
/// as the edge, and flat faces next to the fillets of a die would fold.
const NORMAL_NOISE: f64 = 1e-8;
/// Pairs (half difference of the normals, ratio): for half differences below the first value, the direction of the
/// difference is noise when the inclination of the mean normal along the edge exceeds the ratio times the half
/// difference. Eq. 8 would then bend the edge within the surface in an arbitrary direction.
///
/// On a smooth surface the inclination is of the order of the edge length. It is 0.1 where the curvature changes by 60
/// % along the edge. Above 1/3 the profile is inflected, which a parabola cannot represent. A quarter of a 3 : 1
/// ellipse has 0.45 at a half difference of 0.7.
const INCLINATION_LIMITS: [(f64, f64); 2] = [(0.01, 0.1), (0.1, 1.0 / 3.0)];
/// Length of the mean normal below which the normals are opposite.
const OPPOSITE_MEAN_MAX: f64 = 1e-12;
/// Largest admissible `|c| / |d|`; an arc of 90 degrees has 1, one of 120 degrees 1.73.
const LATERAL_RATIO_MAX: f64 = 2.0;

/// Largest admissible `|q| = |c . d| / d^2`. At 1 the tangent of the parabola vanishes at an end, and beyond it
/// reverses. Where one normal is perpendicular to the chord and the other is slightly inaccurate, rounding decides on
/// which side of 1 it is.
const REVERSAL_RATIO_MAX: f64 = 0.99;

/// The coefficient c of `x0 + (d - c) e + c e^2` for the edge vector `d = x1 - x0` and unit normals `n0`, `n1`: the
/// smallest c with `n0 . (d - c) = 0` and `n1 . (d + c) = 0` (Eq. 8).
///
/// With the orthogonal vectors `nu = (n0 + n1)/2` and `dl = (n0 - n1)/2`,
/// `c = (dl . d)/|nu|^2 nu + (nu . d)/|dl|^2 dl`. The relative rounding error grows as 1e-16 / |dl|, so that the order
/// of accuracy is preserved down to normals 1e-7 rad apart. The reversed edge has the same c.
#[must_use]
pub fn coefficient(d: &Vec3, n0: &Vec3, n1: &Vec3) -> Vec3 {
    let nu = (n0 + n1) * 0.5;
    let dl = (n0 - n1) * 0.5;
    let (nu2, dl2) = (nu.norm_squared(), dl.norm_squared());
    let mut c = Vec3::zeros();
    if nu2 > OPPOSITE_MEAN_MAX * OPPOSITE_MEAN_MAX {
        c += nu * (dl.dot(d) / nu2);
    }
    if dl2 > NORMAL_NOISE * NORMAL_NOISE {
        c += dl * (nu.dot(d) / dl2);
    }
    c
}

/// True when the direction of the difference of the normals is noise.
fn is_noise(d: &Vec3, n0: &Vec3, n1: &Vec3) -> bool {
    let (nu, dl) = ((n0 + n1) * 0.5, (n0 - n1) * 0.5);
    let inclination = nu.dot(d).abs() / d.norm();
    INCLINATION_LIMITS.iter().any(|&(half_difference, ratio)| {
        dl.norm() < half_difference && inclination > ratio * dl.norm()
    })
}

/// The curve of an edge with the normals `ends` at its two ends, one pair per adjacent patch. One distinct pair: Eq. 8.
/// Several: a crease with one common curve and end tangents along `n_left x n_right` (least squares where they are
/// inconsistent).
#[must_use]
pub fn edge_curve(d: &Vec3, ends: &[[Vec3; 2]], rule: EdgeRule) -> EdgeCurve {
    let c = match ends {
        [] => Vec3::zeros(),
        [[n0, n1]] => coefficient(d, n0, n1),
        several => smallest_solution(&conditions(d, several, Kept::All, as_it_is), &Vec3::zeros()),
    };
    let fault = check(d, &c, ends);
    match (rule, fault) {
        (EdgeRule::Guarded, Some(_)) => EdgeCurve { c: Vec3::zeros(), fault },
        (EdgeRule::Guarded, None) if ends.iter().any(|[n0, n1]| is_noise(d, n0, n1)) => {
            let sound = conditions(d, ends, Kept::Sound, as_it_is);
            EdgeCurve { c: smallest_solution(&sound, &Vec3::zeros()), fault }
        }
        _ => EdgeCurve { c, fault },
    }
}

fn check(d: &Vec3, c: &Vec3, ends: &[[Vec3; 2]]) -> Option<EdgeFault> {
    let d2 = d.norm_squared();
    let opposed = ends.iter().any(|[n0, n1]| (n0 + n1).norm() < 1e-6);
    if d2 == 0.0 || opposed || c.iter().any(|x| !x.is_finite()) {
        Some(EdgeFault::Degenerate)
    } else if c.dot(d).abs() > REVERSAL_RATIO_MAX * d2 {
        Some(EdgeFault::TurnsBack)
    } else if c.norm_squared() >= LATERAL_RATIO_MAX * LATERAL_RATIO_MAX * d2 {
        Some(EdgeFault::SwingsOut)
    } else {
        None
    }
}

/// The coefficient closest to `wanted` with end tangents perpendicular to the normals. The part of `c` not determined
/// by Eq. 8, along `n0 x n1` (the whole tangent plane for equal normals), is that of `wanted`. Where the normals cannot
/// be satisfied (an inflected edge, rejected by the guard of [`edge_curve`]) only their mean is, and the fault is
/// reported; the curve then follows `wanted`.
///
/// The difference of the normals changes `c` along the edge only. Near an inflection it points across the edge (twist),
/// and Eq. 8 would shift the curve sideways by the ratio of two small numbers, which decreases only as the square of
/// the length: as slowly as the sagitta of a chord.
#[must_use]
pub fn nearest_coefficient(d: &Vec3, ends: &[[Vec3; 2]], wanted: &Vec3) -> EdgeCurve {
    let length = d.norm();
    if length == 0.0 {
        return EdgeCurve { c: Vec3::zeros(), fault: Some(EdgeFault::Degenerate) };
    }
    let along = d / length;
    let sideways = wanted - along * wanted.dot(&along);
    let by_length = |a: Vec3, b: f64| (along * a.dot(&along), b - a.dot(&sideways));
    let bent =
        |kept: Kept| wanted + smallest_solution(&conditions(d, ends, kept, by_length), wanted);
    let full = bent(Kept::All);
    // Normals that vary along the edge as those of a parabola need a correction of higher order only.
    let kept = (full - wanted).norm() <= CORRECTION_MAX_REL * length;
    match check(d, &full, ends) {
        None if kept => EdgeCurve { c: bent(Kept::Sound), fault: None },
        fault => {
            let c = bent(Kept::Means);
            let fault = fault.or(Some(EdgeFault::TurnsBack));
            match check(d, &c, ends) {
                None => EdgeCurve { c, fault },
                fault => EdgeCurve { c: Vec3::zeros(), fault },
            }
        }
    }
}

/// Largest correction of a wanted coefficient relative to the edge length; inflected edges need more.
const CORRECTION_MAX_REL: f64 = 0.2;

/// Selection of the conditions on an edge.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    All,
    /// All except differences of normals that are noise.
    Sound,
    /// Those on the means of normals.
    Means,
}

/// A row `a . c = b` unchanged.
fn as_it_is(a: Vec3, b: f64) -> (Vec3, f64) {
    (a, b)
}

/// Rows `nu . c = dl . d` and, if selected, `dl . c = nu . d` of every side, with a length of about one. `difference`
/// changes the rows of the second kind.
fn conditions(
    d: &Vec3,
    ends: &[[Vec3; 2]],
    kept: Kept,
    difference: impl Fn(Vec3, f64) -> (Vec3, f64),
) -> Vec<(Vec3, f64)> {
    let mut rows: Vec<(Vec3, f64)> = Vec::with_capacity(2 * ends.len());
    for [n0, n1] in ends {
        let (nu, dl) = ((n0 + n1) * 0.5, (n0 - n1) * 0.5);
        rows.push((nu, dl.dot(d)));
        let size = dl.norm();
        let wanted = match kept {
            Kept::All => true,
            Kept::Sound => !is_noise(d, n0, n1),
            Kept::Means => false,
        };
        // Below this the condition is rounding; the side is flat along the crease.
        if size > NORMAL_NOISE && wanted {
            rows.push(difference(dl / size, nu.dot(d) / size));
        }
    }
    rows
}

/// Singular value over the largest one below which a direction is not determined by the normals: no deviation along it.
const SINGULAR_VALUE_MIN_REL: f64 = 1e-6;
/// Cosine of the angle between two rows below which they are orthogonal.
const ORTHOGONAL_COSINE_MAX: f64 = 1e-12;

/// Least-squares solution of the rows `a . (start + x) = b` with the smallest norm of `x`.
fn smallest_solution(rows: &[(Vec3, f64)], start: &Vec3) -> Vec3 {
    let crossed = |a: &Vec3, b: &Vec3| a.dot(b).abs() > ORTHOGONAL_COSINE_MAX * a.norm() * b.norm();
    if rows.len() <= 2 && !rows.windows(2).any(|w| crossed(&w[0].0, &w[1].0)) {
        // Mean and half difference of the unit normals of one side: their lengths are the singular values.
        let largest = rows.iter().map(|row| row.0.norm_squared()).fold(0.0, f64::max);
        let sound =
            |a: &Vec3| a.norm_squared() > SINGULAR_VALUE_MIN_REL * SINGULAR_VALUE_MIN_REL * largest;
        let part = |(a, b): &(Vec3, f64)| a * ((b - a.dot(start)) / a.norm_squared());
        return rows.iter().filter(|row| sound(&row.0)).map(part).sum();
    }
    let matrix = DMatrix::from_fn(rows.len(), 3, |r, k| rows[r].0[k]);
    let right = DVector::from_fn(rows.len(), |r, _| rows[r].1 - rows[r].0.dot(start));
    let svd = matrix.svd(true, true);
    let smallest = SINGULAR_VALUE_MIN_REL * svd.singular_values.max();
    svd.solve(&right, smallest).map_or_else(|_| Vec3::zeros(), |c| Vec3::new(c[0], c[1], c[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends and normals of a circular arc with half angle `h` and radius `r` in the xy plane.
    fn arc(r: f64, h: f64) -> (Vec3, Vec3, Vec3, Vec3) {
        let at = |a: f64| Vec3::new(a.sin(), a.cos(), 0.0);
        (at(-h) * r, at(h) * r, at(-h), at(h))
    }

    fn on(x0: &Vec3, d: &Vec3, c: &Vec3, e: f64) -> Vec3 {
        x0 + (d - c) * e + c * (e * e)
    }

    #[test]
    fn arc_error_is_the_closed_form_and_of_fourth_order() {
        let r = 7.0;
        for h in [0.8, 0.4, 0.2, 0.1, 0.05, 1e-2] {
            let (x0, x1, n0, n1) = arc(r, h);
            let d = x1 - x0;
            let c = coefficient(&d, &n0, &n1);
            let middle = on(&x0, &d, &c, 0.5).norm() - r;
            let exact = r * (1.0 - h.cos()).powi(2) / (2.0 * h.cos());
            assert!((middle - exact).abs() < 1e-9 * r, "h {h}: {middle} against {exact}");
        }
    }

    #[test]
    fn tangents_stay_across_the_normals_down_to_parallel_ones() {
        for h in [1e-3, 1e-5, 5e-6, 1e-7] {
            let (x0, x1, n0, n1) = arc(7.0, h);
            let d = x1 - x0;
            let c = coefficient(&d, &n0, &n1);
            assert!((d - c).dot(&n0).abs() < 1e-12 * d.norm() + 1e-8 * c.norm(), "{h}");
            assert!((c.norm() / d.norm() - h.tan()).abs() < 1e-6 * h, "h {h}: {}", c.norm());
        }
    }

    #[test]
    fn noise_in_the_normals_of_a_flat_does_not_bend_it() {
        let d = Vec3::new(30.0, 35.0, 0.0);
        let noisy = Vec3::new(-7.25e-11, 3.9e-11, 1.0);
        assert!(coefficient(&d, &noisy, &Vec3::z()).norm() < 1e-10 * d.norm());
    }

    /// As on the chamfers of NIST's MBE PMI 1: normals of one plane that differ by 1e-5.
    #[test]
    fn normals_that_differ_by_noise_do_not_bend_an_edge_within_the_surface() {
        let d = Vec3::new(58.0, 0.0, 0.0);
        let noisy = |x: f64, y: f64| Vec3::new(x, y, 1.0).normalize();
        let (n0, n1) = (noisy(4e-6, 1e-5), noisy(3e-6, -1e-5));
        assert!(coefficient(&d, &n0, &n1).norm() > 0.3 * d.norm());
        for ends in [vec![[n0, n1]], vec![[n0, n1], [noisy(4e-6, 1.1e-5), n1]]] {
            let found = edge_curve(&d, &ends, EdgeRule::Guarded);
            assert!(found.c.norm() < 1e-5 * d.norm(), "{:?}", found.c);
        }
        assert!(edge_curve(&d, &[[n0, n1]], EdgeRule::Plain).c.norm() > 0.3 * d.norm());
    }

    #[test]
    fn reversed_rotated_and_scaled_edges_have_the_same_curve() {
        let (d, n0, n1) = (
            Vec3::new(1.0, 0.2, -0.1),
            Vec3::new(0.1, 1.0, 0.3).normalize(),
            Vec3::new(-0.3, 1.0, 0.1).normalize(),
        );
        let c = coefficient(&d, &n0, &n1);
        assert!((coefficient(&-d, &n1, &n0) - c).norm() < 1e-15);
        assert!((coefficient(&(d * 1000.0), &n0, &n1) - c * 1000.0).norm() < 1e-11);
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.7);
        assert!((coefficient(&(turn * d), &(turn * n0), &(turn * n1)) - turn * c).norm() < 1e-14);
        assert_eq!(coefficient(&Vec3::x(), &Vec3::z(), &Vec3::z()), Vec3::zeros());
    }

    #[test]
    fn near_parallel_normals_on_a_tilted_edge_swing_out_as_predicted_and_are_caught() {
        let (tilt, theta) = (5f64.to_radians(), 0.1f64.to_radians());
        let d = Vec3::new(tilt.cos(), tilt.sin(), 0.0);
        let n = |a: f64| Vec3::new(a.sin(), a.cos(), 0.0);
        let (n0, n1) = (n(-theta / 2.0), n(theta / 2.0));
        let ratio = coefficient(&d, &n0, &n1).norm();
        assert!((ratio - tilt.sin() / (theta / 2.0).sin()).abs() < 0.02 * ratio, "{ratio}");
        let guarded = edge_curve(&d, &[[n0, n1]], EdgeRule::Guarded);
        assert!(guarded.fault.is_some() && guarded.c == Vec3::zeros());
        let plain = edge_curve(&d, &[[n0, n1]], EdgeRule::Plain);
        assert!(plain.fault.is_some() && plain.c.norm() > 90.0);
    }

    /// On the border between a flat face and a fillet all normals are equal: Eq. 8 gives a chord for any radius of the
    /// border. A wanted coefficient in the plane is kept, and projected onto the tangent plane otherwise.
    #[test]
    fn what_the_normals_leave_open_is_taken_from_the_wanted_coefficient() {
        let (x0, x1, _, _) = arc(27.0, 0.2);
        let d = x1 - x0;
        let wanted = coefficient(&d, &x0.normalize(), &x1.normalize());
        let flat = [[Vec3::z(), Vec3::z()]];
        assert_eq!(edge_curve(&d, &flat, EdgeRule::Guarded).c, Vec3::zeros());
        let found = nearest_coefficient(&d, &flat, &(wanted + Vec3::z() * 0.3));
        assert!(found.fault.is_none() && (found.c - wanted).norm() < 1e-14);
        // On a cone the normals determine two of the three components.
        let inclination = |x: &Vec3| (x.normalize() + Vec3::z() * 2.0).normalize();
        let cone = [[inclination(&x0), inclination(&x1)]];
        let found = nearest_coefficient(&d, &cone, &wanted);
        let middle = on(&x0, &d, &found.c, 0.5);
        let eq8 = on(&x0, &d, &coefficient(&d, &cone[0][0], &cone[0][1]), 0.5);
        assert!((found.c - wanted).norm() < 1e-12 && middle.norm() - 27.0 < 0.01);
        assert!((eq8 - middle).norm() > 0.2, "Eq. 8 leaves the circle along the cone");
    }

    /// Border `y = 0` of the surface `z = twist x y + bend x³ / 6` about its inflection: the difference of the normals points
    /// along y. Eq. 8 leaves the border by `bend h² / (24 twist)`, of second order as the sagitta of a chord; the
    /// profile alone needs `sqrt(3) bend h³ / 216`.
    #[test]
    fn a_twisted_border_with_an_inflection_is_followed_to_third_order() {
        let (twist, bend) = (0.02, 1e-3);
        for h in [2.0, 4.0, 8.0] {
            let at = |x: f64| Vec3::new(x, 0.0, bend * x.powi(3) / 6.0);
            let normal = |x: f64| Vec3::new(-0.5 * bend * x * x, -twist * x, 1.0).normalize();
            let (x0, x1) = (at(-0.5 * h), at(0.5 * h));
            let (d, ends) = (x1 - x0, [[normal(-0.5 * h), normal(0.5 * h)]]);
            let off = |c: &Vec3| {
                let away = |k: u32| {
                    let p = on(&x0, &d, c, f64::from(k) / 64.0);
                    (p - at(p.x)).norm()
                };
                (0..=64).map(away).fold(0.0, f64::max)
            };
            let followed = nearest_coefficient(&d, &ends, &Vec3::zeros());
            let profile = 3f64.sqrt() * bend * h.powi(3) / 216.0;
            assert!(off(&followed.c) < 1.01 * profile, "{h}: {} {profile}", off(&followed.c));
            let (eq8, sideways) = (edge_curve(&d, &ends, EdgeRule::Plain).c, bend * h * h / 24.0);
            assert!((off(&eq8) / (sideways / twist) - 1.0).abs() < 0.1, "{h}: {}", off(&eq8));
        }
    }

    #[test]
    fn an_inflected_edge_keeps_the_wanted_curve_and_is_named() {
        let n = |a: f64| Vec3::new(a.sin(), a.cos(), 0.0);
        let ends = [[n(0.1), n(0.1 + 1e-3)]];
        let d = Vec3::new(1.0, 0.2, 0.0);
        let wanted = Vec3::new(0.0, 0.05, 0.0);
        let found = nearest_coefficient(&d, &ends, &wanted);
        assert!(found.fault.is_some() && (found.c - wanted).norm() < 0.1);
        assert!(coefficient(&d, &ends[0][0], &ends[0][1]).norm() > 100.0);
    }

    #[test]
    fn a_normal_off_at_one_end_only_leaves_the_edge_straight_and_is_named() {
        let d = Vec3::new(1911.0, 0.0, 0.0);
        for off in [1e-6, 1e-4, 3e-3, 0.05, 0.3] {
            for inclination in [-off, off] {
                let n1 = Vec3::new(inclination, 0.01 * off, 1.0).normalize();
                let c = coefficient(&d, &Vec3::z(), &n1);
                assert!((c.norm() / d.norm() - 1.0).abs() < 0.03, "{inclination}: {c:?}");
                let guarded = edge_curve(&d, &[[Vec3::z(), n1]], EdgeRule::Guarded);
                assert_eq!((guarded.c, guarded.fault), (Vec3::zeros(), Some(EdgeFault::TurnsBack)));
            }
        }
    }

    #[test]
    fn an_averaged_normal_at_a_crease_turns_back_and_is_caught() {
        let (n0, n1) = (Vec3::z(), Vec3::new(1.0, 0.0, 1.0).normalize());
        let guarded = edge_curve(&Vec3::x(), &[[n1, n0]], EdgeRule::Guarded);
        let plain = edge_curve(&Vec3::x(), &[[n1, n0]], EdgeRule::Plain);
        assert_eq!(guarded.fault, Some(EdgeFault::TurnsBack));
        assert!((plain.c.norm() - 1.0).abs() < 1e-12, "c = -d or d: no tangent at one end");
    }

    #[test]
    fn a_crease_between_a_flat_and_a_wall_follows_the_circle() {
        let (x0, x1, n0, n1) = arc(14.0, 0.2);
        let d = x1 - x0;
        let curve = edge_curve(&d, &[[Vec3::z(), Vec3::z()], [n0, n1]], EdgeRule::Guarded);
        assert!((curve.c - coefficient(&d, &n0, &n1)).norm() < 1e-12);
        let straight = edge_curve(
            &Vec3::x(),
            &[[Vec3::z(), Vec3::z()], [Vec3::y(), Vec3::y()]],
            EdgeRule::Guarded,
        );
        assert!(straight.c.norm() < 1e-15 && straight.fault.is_none());
    }
}
