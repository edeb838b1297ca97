//! Tests of point projection: compared with dense sampling, exact solutions and degenerate surfaces.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;
use crate::{Frame, Vec2, Vec3};

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64
}

/// A wavy or folded net of degrees (p, q) with some repeated knots.
fn wild_surface(seed: u64, [p, q]: [usize; 2], fold: f64) -> Surface {
    let mut s = seed;
    let knots = |degree: usize, inner: &[f64]| {
        [&vec![0.0; degree + 1][..], inner, &vec![1.0; degree + 1]].concat()
    };
    let knots = [knots(p, &[0.3, 0.3, 0.6]), knots(q, &[0.5])];
    let (nu, nv) = (p + 4, q + 2);
    let points: Vec<Vec3> = (0..nu * nv)
        .map(|k| {
            let (i, j) = ((k / nv) as f64, (k % nv) as f64);
            let jitter = Vec3::new(random(&mut s), random(&mut s), random(&mut s)) * fold;
            Vec3::new(i, j, 0.0) + jitter
        })
        .collect();
    let weights = (0..nu * nv).map(|_| 0.4 + 1.6 * random(&mut s)).collect();
    Surface::try_new([p, q], knots, points, Some(weights)).unwrap()
}

fn dense(surface: &Surface, n: u32) -> Vec<Vec3> {
    let at = |k: u32| f64::from(k) / f64::from(n);
    (0..=n)
        .flat_map(|i| (0..=n).map(move |j| (i, j)))
        .map(|(i, j)| surface.point(Vec2::new(at(i), at(j))))
        .collect()
}

#[test]
fn no_sample_of_a_wild_surface_is_nearer_than_the_foot() {
    let mut s = 5;
    for (k, degrees) in [[3, 2], [2, 2], [1, 3], [4, 3], [5, 5]].into_iter().enumerate() {
        for fold in [1.0, 4.0] {
            let surface = wild_surface(k as u64 + 17, degrees, fold);
            let (projector, samples) = (SurfaceProjector::new(&surface), dense(&surface, 60));
            for _ in 0..25 {
                let p = Vec3::new(random(&mut s), random(&mut s), random(&mut s)) * 10.0
                    - Vec3::new(1.0, 2.0, 4.0);
                let (uv, d2) = projector.closest(&p);
                assert!(((surface.point(uv) - p).norm() - d2.sqrt()).abs() < 1e-12);
                let least = samples.iter().map(|x| (x - p).norm()).fold(f64::INFINITY, f64::min);
                assert!(d2.sqrt() <= least + 1e-12, "{degrees:?}: {} {least}", d2.sqrt());
                assert!(projector.proves(&p));
                assert_eq!(surface.closest(&p), (uv, d2), "the same without preparation");
            }
        }
    }
}

#[test]
fn a_point_of_the_surface_and_one_along_its_normal_come_back() {
    let mut s = 9;
    for seed in 0..6 {
        let surface = wild_surface(seed, [3, 3], 0.7);
        let projector = SurfaceProjector::new(&surface);
        for _ in 0..40 {
            let uv = Vec2::new(random(&mut s), random(&mut s));
            let (point, normal) = (surface.point(uv), surface.normal(uv).unwrap());
            let (_, d2) = projector.closest(&point);
            assert!(d2.sqrt() < 1e-13, "{}", d2.sqrt());
            let (foot, d2) = projector.closest(&(point + normal * 1e-3));
            assert!((d2.sqrt() - 1e-3).abs() < 1e-11, "{}", d2.sqrt() - 1e-3);
            let gap = (surface.point(foot) - point).norm();
            assert!(gap < 1e-10, "{uv:?} {foot:?}: {gap}");
        }
    }
}

fn torus(major: f64, minor: f64) -> Surface {
    let tube = Frame { origin: Vec3::x() * major, x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
    let arc = Curve3::ellipse_arc(&tube, minor, minor, 0.0, TAU);
    Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.0, TAU])
}

fn sphere(radius: f64) -> Surface {
    let frame = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: Vec3::z(), z: -Vec3::y() };
    let meridian = Curve3::ellipse_arc(&frame, radius, radius, -FRAC_PI_2, FRAC_PI_2);
    Surface::revolution(&meridian, Vec3::zeros(), Vec3::z(), [0.0, TAU])
}

#[test]
fn whole_circles_and_spheres_of_feet_are_proved() {
    let ring = SurfaceProjector::new(&torus(40.0, 7.0));
    for z in [0.0, 3.0, -60.0] {
        let p = Vec3::z() * z;
        let exact = (1600.0 + z * z).sqrt() - 7.0;
        assert!((ring.closest(&p).1.sqrt() - exact).abs() < 1e-10, "on the axis at {z}");
        assert!(ring.proves(&p), "on the axis at {z}");
    }
    let heart = Vec3::new(40.0 * 0.6, 40.0 * 0.8, 0.0);
    assert!((ring.closest(&heart).1.sqrt() - 7.0).abs() < 1e-10, "the centre of the tube");
    assert!(ring.proves(&heart));
    let ball = SurfaceProjector::new(&sphere(5.0));
    assert!((ball.closest(&Vec3::zeros()).1.sqrt() - 5.0).abs() < 1e-10);
    assert!(ball.proves(&Vec3::zeros()));
}

#[test]
fn a_sphere_is_projected_on_next_to_its_poles() {
    let surface = sphere(5.0);
    let ball = SurfaceProjector::new(&surface);
    for off in [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1] {
        for r in [1e-3, 3.0, 4.999, 5.0, 5.001, 80.0] {
            for a in [0.0, 0.7, 2.4, 5.0] {
                let direction = Vec3::new(off * f64::cos(a), off * f64::sin(a), -1.0).normalize();
                let (uv, d2) = ball.closest(&(direction * r));
                assert!((d2.sqrt() - (r - 5.0).abs()).abs() < 1e-10, "{off} {r} {a}");
                let gap = (surface.point(uv) - direction * 5.0).norm();
                // Near the centre all distances are equal; foot points are distinguishable to sqrt(eps R^3 / r).
                let allowed = 1e-9 + 2.0 * (f64::EPSILON * 125.0 / r).sqrt();
                assert!(gap < allowed, "{off} {r} {a}: {gap}");
                assert!(ball.proves(&(direction * r)), "{off} {r} {a}");
            }
        }
    }
}

#[test]
fn a_plane_a_degenerate_patch_and_a_bad_point_do_no_harm() {
    let flat = Surface::plane(&Frame::world(), [0.0, 4.0], [-1.0, 2.0]);
    let (uv, d2) = flat.closest(&Vec3::new(1.25, 7.0, 3.0));
    assert!((uv - Vec2::new(1.25, 2.0)).norm() < 1e-14 && (d2 - 34.0).abs() < 1e-12);
    assert_eq!(flat.closest(&Vec3::repeat(f64::NAN)).1, f64::INFINITY);
    let knots = vec![0.0, 0.0, 1.0, 1.0];
    let dot = Surface::try_new([1, 1], [knots.clone(), knots], vec![Vec3::x(); 4], None).unwrap();
    assert!((dot.closest(&Vec3::zeros()).1 - 1.0).abs() < 1e-15);
}

#[test]
fn no_sample_of_a_curve_is_nearer_than_its_foot() {
    let mut s = 3;
    for degree in [1, 2, 3, 5, 11] {
        let inner = [0.2, 0.2, 0.5, 0.9];
        let knots = [&vec![0.0; degree + 1][..], &inner[..], &vec![1.0; degree + 1]].concat();
        let knots = if degree == 1 { vec![0.0, 0.0, 0.2, 0.2, 0.5, 0.9, 1.0, 1.0] } else { knots };
        let n = knots.len() - degree - 1;
        let points: Vec<Vec3> =
            (0..n).map(|_| Vec3::new(random(&mut s), random(&mut s), random(&mut s))).collect();
        let weights = (0..n).map(|_| 0.3 + random(&mut s)).collect();
        let curve = Curve3::try_new(degree, knots, points, Some(weights)).unwrap();
        let samples: Vec<Vec3> = (0..=4000).map(|k| curve.point(f64::from(k) / 4000.0)).collect();
        for _ in 0..60 {
            let p = Vec3::new(random(&mut s), random(&mut s), random(&mut s)) * 1.5;
            let (t, d2) = curve.closest(&p);
            assert!(((curve.point(t) - p).norm() - d2.sqrt()).abs() < 1e-13);
            let least = samples.iter().map(|x| (x - p).norm()).fold(f64::INFINITY, f64::min);
            assert!(d2.sqrt() <= least + 1e-13, "degree {degree}: {} {least}", d2.sqrt());
        }
    }
    let circle = Curve3::ellipse_arc(&Frame::world(), 3.0, 3.0, 0.0, TAU);
    assert!((circle.closest(&(Vec3::z() * 4.0)).1.sqrt() - 5.0).abs() < 1e-11);
    let flat = Curve2::line(Vec2::zeros(), Vec2::new(2.0, 0.0));
    assert!((flat.closest(&Vec2::new(0.5, 1.0)).0 - 0.25).abs() < 1e-15);
}

#[test]
fn bezier_pieces_are_the_surface_span_by_span() {
    let points: Vec<Vec3> = (0..30)
        .map(|k| Vec3::new(f64::from(k / 5), f64::from(k % 5), f64::from(k * k % 7)))
        .collect();
    let unclamped = vec![0.0, 0.5, 1.0, 2.0, 2.5, 3.5, 4.0, 5.0, 5.5, 6.0];
    let knots = [unclamped, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0]];
    let weights = (0..30).map(|k| 1.0 + 0.1 * f64::from(k % 4)).collect();
    let surface = Surface::try_new([3, 2], knots, points, Some(weights)).unwrap();
    let pieces = surface.bezier_pieces();
    assert_eq!(pieces.len(), 3 * 2);
    for piece in &pieces {
        let [u, v] = piece.domain();
        for (a, b) in [(0.0, 0.0), (0.2, 0.9), (1.0, 0.5), (0.7, 0.3)] {
            let uv = Vec2::new(u[0] + (u[1] - u[0]) * a, v[0] + (v[1] - v[0]) * b);
            assert!((piece.point(uv) - surface.point(uv)).norm() < 1e-13);
        }
    }
}

#[test]
fn a_point_is_within_its_distance_of_a_curve_and_not_within_less() {
    let mut s = 11;
    for degree in [1, 2, 4] {
        let points: Vec<Vec3> = (0..degree + 3)
            .map(|k| Vec3::new(k as f64, 3.0 * random(&mut s), 3.0 * random(&mut s)))
            .collect();
        let ends = |end: f64| vec![end; degree + 1];
        let knots = [ends(0.0), vec![0.4, 0.7], ends(1.0)].concat();
        let curve = Curve3::try_new(degree, knots, points, None).unwrap();
        let projector = CurveProjector::new(&curve);
        for _ in 0..50 {
            let p = Vec3::new(random(&mut s), random(&mut s), random(&mut s)) * 6.0;
            let (t, d2) = projector.closest(&p);
            assert!(projector.is_within(&p, d2 * (1.0 + 1e-6)), "{degree}: {d2}");
            assert!(!projector.is_within(&p, d2 * (1.0 - 1e-6)), "{degree}: {d2}");
            assert!(projector.is_within(&curve.point(t), 0.0));
        }
    }
}
