//! Tests of evaluation and construction.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;
use crate::{Frame, Vec2, Vec3};

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64
}

fn random_surface(seed: u64) -> Surface {
    let mut s = seed;
    let knots_u = vec![0.0, 0.0, 0.0, 0.0, 0.4, 0.4, 0.7, 1.0, 1.0, 1.0, 1.0];
    let knots_v = vec![-1.0, -1.0, -1.0, 0.5, 2.0, 2.0, 2.0];
    let points: Vec<Vec3> = (0..28)
        .map(|k| {
            Vec3::new(
                f64::from(k / 4) + random(&mut s),
                f64::from(k % 4) + random(&mut s),
                random(&mut s),
            )
        })
        .collect();
    let weights = (0..28).map(|_| 0.5 + random(&mut s)).collect();
    Surface::try_new([3, 2], [knots_u, knots_v], points, Some(weights)).unwrap()
}

#[test]
fn derivatives_agree_with_central_differences() {
    let h = 1e-5;
    for seed in 0..20 {
        let s = random_surface(seed);
        for uv in [Vec2::new(0.2, 0.1), Vec2::new(0.55, 1.3), Vec2::new(0.9, -0.7)] {
            let d = s.derivs(uv);
            let at = |du: f64, dv: f64| s.derivs(uv + Vec2::new(du * h, dv * h));
            let by_u =
                |f: fn(&SurfaceDerivs) -> Vec3| (f(&at(1.0, 0.0)) - f(&at(-1.0, 0.0))) / (2.0 * h);
            let by_v =
                |f: fn(&SurfaceDerivs) -> Vec3| (f(&at(0.0, 1.0)) - f(&at(0.0, -1.0))) / (2.0 * h);
            assert!((by_u(|d| d.s) - d.su).norm() < 1e-7);
            assert!((by_v(|d| d.s) - d.sv).norm() < 1e-7);
            assert!((by_u(|d| d.su) - d.suu).norm() < 1e-5);
            assert!((by_v(|d| d.su) - d.suv).norm() < 1e-5);
            assert!((by_v(|d| d.sv) - d.svv).norm() < 1e-5);
        }
    }
}

#[test]
fn points_are_those_of_the_derivatives_to_the_bit() {
    for seed in 0..20 {
        let s = random_surface(seed);
        let row: Vec<Vec3> = s.points()[..7].to_vec();
        let knots = vec![0.0, 0.0, 0.0, 0.3, 0.3, 0.5, 0.8, 1.0, 1.0, 1.0];
        let c = Curve3::try_new(2, knots, row, Some(s.weights()[..7].to_vec())).unwrap();
        for k in 0..=40 {
            let t = f64::from(k) / 40.0;
            let uv = Vec2::new(t, -1.0 + 3.0 * t);
            assert_eq!(s.point(uv), s.derivs(uv).s);
            assert_eq!(c.point(t), c.derivs(t).c);
        }
    }
}

#[test]
fn points_of_a_grid_are_the_single_points_to_the_bit() {
    for seed in 0..5 {
        let s = random_surface(seed);
        let (us, vs) = ([0.0, 0.1, 0.4, 0.65, 1.0], [-1.0, 0.5, 0.7, 2.0]);
        let pairs = us.iter().flat_map(|&u| vs.iter().map(move |&v| Vec2::new(u, v)));
        let single: Vec<Vec3> = pairs.map(|uv| s.point(uv)).collect();
        assert_eq!(s.grid(&us, &vs), single);
    }
}

#[test]
fn lines_of_one_parameter_are_exact() {
    let s = random_surface(7);
    for (a, b) in [([0.2, -0.5], [0.2, 1.7]), ([0.9, 0.3], [0.1, 0.3]), ([0.0, -1.0], [1.0, -1.0])]
    {
        let line = Curve2::line(Vec2::from(a), Vec2::from(b));
        let image = s.isoparametric_curve(&line).unwrap();
        let [from, to] = image.domain();
        for k in 0..=20 {
            let fraction = f64::from(k) / 20.0;
            let (p, q) =
                (image.point(from + (to - from) * fraction), s.point(line.point(fraction)));
            assert!((p - q).norm() < 1e-13, "{a:?} {b:?} at {fraction}");
        }
    }
    assert!(s.isoparametric_curve(&Curve2::line(Vec2::zeros(), Vec2::new(0.5, 0.5))).is_none());
}

#[test]
fn a_piece_is_the_same_surface() {
    let s = random_surface(3);
    let piece = s.trimmed([0.1, 0.65], [-0.3, 1.1]).unwrap();
    assert_eq!(piece.domain(), [[0.1, 0.65], [-0.3, 1.1]]);
    for (u, v) in [(0.1, -0.3), (0.4, 0.5), (0.65, 1.1), (0.2, 0.9)] {
        let uv = Vec2::new(u, v);
        assert!((piece.point(uv) - s.point(uv)).norm() < 1e-13);
    }
    assert!(s.trimmed([0.1, 1.5], [0.0, 1.0]).is_err());
}

#[test]
fn a_torus_is_exact_and_so_is_its_normal() {
    let (major, minor) = (40.0, 7.0);
    let frame =
        Frame { origin: Vec3::new(major, 0.0, 0.0), x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
    let tube = Curve3::ellipse_arc(&frame, minor, minor, 0.0, 2.0 * PI);
    let s = Surface::revolution(&tube, Vec3::zeros(), Vec3::z(), [0.5, 0.5 + 2.0 * PI]);
    for k in 0..50 {
        let uv = Vec2::new(0.5 + 0.12 * f64::from(k), 0.11 * f64::from(k));
        let d = s.derivs(uv);
        let ring = Vec3::new(d.s.x, d.s.y, 0.0).normalize() * major;
        assert!(((d.s - ring).norm() - minor).abs() < 1e-12);
        let n = s.normal(uv).unwrap();
        assert!((n - (d.s - ring) / minor).norm() < 1e-12, "outwards");
    }
}

#[test]
fn a_sphere_has_normals_at_its_poles() {
    let frame = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
    let meridian = Curve3::ellipse_arc(&frame, 5.0, 5.0, -FRAC_PI_2, FRAC_PI_2);
    let s = Surface::revolution(&meridian, Vec3::zeros(), Vec3::z(), [0.0, 2.0 * PI]);
    for u in [0.0, 1.0, 4.0] {
        assert!((s.normal(Vec2::new(u, FRAC_PI_2)).unwrap() - Vec3::z()).norm() < 1e-12);
        assert!((s.normal(Vec2::new(u, -FRAC_PI_2)).unwrap() + Vec3::z()).norm() < 1e-12);
    }
}

#[test]
fn reversal_trimming_and_elevation_keep_the_curve() {
    let arc = Curve3::ellipse_arc(&Frame::world(), 3.0, 2.0, 0.2, 5.0);
    let (back, up) = (arc.reversed(), arc.elevated(5, &[1.0]));
    for k in 0..=20 {
        let t = 0.2 + 4.8 * f64::from(k) / 20.0;
        assert!((arc.point(t) - back.point(5.2 - t)).norm() < 1e-13);
        assert!((arc.point(t) - up.point(t)).norm() < 1e-13);
    }
    assert_eq!(up.degree(), 5);
    assert_eq!(back.domain(), arc.domain());
}

/// An arc that begins at a positive angle beside zero: the sum of both ends is the far one.
#[test]
fn reversal_keeps_all_knots_at_the_ends_of_the_domain() {
    for low in [4.57e-77, 1e-17, -1e-17, 0.1] {
        let arc = Curve3::ellipse_arc(&Frame::world(), 1.5, 1.5, low, 3.0);
        let back = arc.reversed();
        let knots = back.knots().to_vec();
        assert_eq!(knots[..3], [low; 3]);
        assert_eq!(knots[knots.len() - 3..], [3.0; 3]);
        let again = Curve3::try_new(2, knots, back.points().to_vec(), None);
        assert!(again.is_ok(), "{low}: {again:?}");
        assert!((back.point(low) - arc.point(3.0)).norm() < 1e-14);
    }
}

#[test]
fn unclamped_knots_have_the_inner_domain() {
    let points: Vec<Vec3> =
        (0..6).map(|k| Vec3::new(f64::from(k), f64::from(k * k % 5), 0.0)).collect();
    let c = Curve3::try_new(3, (0..10).map(f64::from).collect(), points, None).unwrap();
    assert_eq!(c.domain(), [3.0, 6.0]);
    let clamped = c.trimmed(3.0, 6.0).unwrap();
    for t in [3.0, 3.7, 5.0, 6.0] {
        assert!((c.point(t) - clamped.point(t)).norm() < 1e-13);
    }
}

#[test]
fn a_break_of_full_multiplicity_keeps_both_sides() {
    let points = vec![Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0), Vec3::new(2.0, 1.0, 0.0)];
    let c = Curve3::try_new(1, vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0], points, None).unwrap();
    assert!((c.point(1.0 - 1e-12) - Vec3::x()).norm() < 1e-9);
    assert_eq!(c.point(1.0), Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(c.trimmed(0.5, 1.0).unwrap().point(1.0), Vec3::x());
}

#[test]
fn a_ruled_surface_joins_curves_of_different_degree() {
    let arc = Curve3::ellipse_arc(&Frame::world(), 2.0, 2.0, 0.0, 1.0);
    let line = Curve3::line(Vec3::new(4.0, 0.0, 3.0), Vec3::new(0.0, 4.0, 3.0));
    let s = Surface::ruled(&arc, &line);
    for u in [0.0, 0.3, 1.0] {
        assert!((s.point(Vec2::new(u, 0.0)) - arc.point(u)).norm() < 1e-13);
        assert!((s.point(Vec2::new(u, 1.0)) - line.point(u)).norm() < 1e-13);
    }
}

#[test]
fn bad_control_data_is_refused() {
    let p = || vec![Vec3::zeros(), Vec3::x()];
    let fails = |degree, knots: Vec<f64>, points, weights| {
        Curve3::try_new(degree, knots, points, weights).unwrap_err()
    };
    assert!(matches!(fails(0, vec![0.0, 1.0, 2.0], p(), None), NurbsError::Degree { found: 0 }));
    assert!(matches!(fails(1, vec![0.0, 1.0], p(), None), NurbsError::KnotCount { .. }));
    assert!(matches!(
        fails(1, vec![0.0, 1.0, 0.5, 2.0], p(), None),
        NurbsError::Knots { index: 2, .. }
    ));
    assert!(matches!(fails(1, vec![0.0, 1.0, 1.0, 2.0], p(), None), NurbsError::Knots { .. }));
    let weights = Some(vec![1.0, 0.0]);
    assert!(matches!(
        fails(1, vec![0.0, 0.0, 1.0, 1.0], p(), weights),
        NurbsError::Weight { index: 1, .. }
    ));
    let nan = vec![Vec3::zeros(), Vec3::new(f64::NAN, 0.0, 0.0)];
    assert!(matches!(fails(1, vec![0.0, 0.0, 1.0, 1.0], nan, None), NurbsError::NotFinite));
}
