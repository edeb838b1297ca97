//! Tests of the Nagata edge.

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
        assert_eq!(followed.fault, None);
        let (eq8, sideways) = (edge_curve(&d, &ends, EdgeRule::Plain).c, bend * h * h / 24.0);
        assert!((off(&eq8) / (sideways / twist) - 1.0).abs() < 0.1, "{h}: {}", off(&eq8));
    }
}

/// The same border beside its inflection, from -1.9 to 2.1: the change along the edge would be too large, and the end
/// tangents are 0.02 degrees off the tangent planes. A second call does not move the curve.
#[test]
fn the_curve_of_its_own_result_is_the_same() {
    let (twist, bend) = (0.02, 1e-3);
    let at = |x: f64| Vec3::new(x, 0.0, bend * x.powi(3) / 6.0);
    let normal = |x: f64| Vec3::new(-0.5 * bend * x * x, -twist * x, 1.0).normalize();
    let hardly_off = [(-1.9, 2.1), (1.0, 2.0), (10.0, 14.0)].map(|ends| (ends, None));
    // The end tangents of an edge over 16.5 mm are off by 1.3 degrees.
    let off = ((-8.0, 8.5), Some(EdgeFault::TurnsBack));
    for ((a, b), fault) in hardly_off.into_iter().chain([off]) {
        let (d, ends) = (at(b) - at(a), [[normal(a), normal(b)]]);
        let wanted = (at(0.5 * (a + b)) - 0.5 * (at(a) + at(b))) * -4.0;
        let found = nearest_coefficient(&d, &ends, &wanted);
        assert_eq!(found.fault, fault, "{a} {b}");
        let again = nearest_coefficient(&d, &ends, &found.c);
        assert!((again.c - found.c).norm() < 1e-12 * d.norm(), "{a} {b}: {again:?} {found:?}");
        assert!(on(&Vec3::zeros(), &d, &found.c, 0.5).y.abs() < 1e-4 * d.norm(), "{a} {b}");
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
