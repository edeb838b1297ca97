use std::f64::consts::{FRAC_PI_2, PI};

use super::*;
use crate::oracle::Oracle;
use crate::projection::Outcome;
use crate::test_tools::{arc, line, plane, revolved};
use kanagata_geometry::Mat3;

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64
}

/// Half of a die: flat, shoulder r = 7, wall, corner fillet and floor over a full turn, with concave and convex parts
/// and points beyond every centre of curvature.
fn cup_die() -> ToolModel {
    let profile = [
        line(1, [60.0, 0.0], [37.0, 0.0], [0.0, 1.0]),
        arc(3, [37.0, -7.0], 7.0, [FRAC_PI_2, PI], 1.0),
        line(1, [30.0, -7.0], [30.0, -20.0], [-1.0, 0.0]),
        arc(2, [22.0, -20.0], 8.0, [0.0, -FRAC_PI_2], -1.0),
        line(1, [22.0, -28.0], [0.0, -28.0], [0.0, 1.0]),
    ];
    revolved("die", 8, FRAC_PI_2, &profile)
}

#[test]
fn never_farther_than_dense_sampling() {
    let model = cup_die();
    let surface = ToolSurface::new(model.clone());
    let oracle = Oracle::new(&model);
    let mut seed = 3;
    for _ in 0..3000 {
        let p = Vec3::new(
            -10.0 + 80.0 * random(&mut seed),
            -10.0 + 80.0 * random(&mut seed),
            -40.0 + 60.0 * random(&mut seed),
        );
        let foot = surface.closest(&p, None);
        let found = (p - foot.point).norm();
        assert!(found <= oracle.distance(&p) + 1e-9, "{p:?}: {foot:?}");
        let on_patch = model.patches[foot.patch as usize].derivs(foot.eta, foot.zeta).s;
        assert_eq!(on_patch, foot.point);
        let d = model.patches[foot.patch as usize].derivs(foot.eta, foot.zeta);
        let n = d.d1.cross(&d.d2).normalize();
        assert!((n - foot.normal).norm() <= 1e-12, "{foot:?}");
        let warm = surface.closest(&p, Some(foot.patch));
        assert!(((p - warm.point).norm() - found).abs() < 1e-11);
    }
}

#[test]
fn gap_is_signed_by_the_patch_normal_and_curvature_is_that_of_the_sphere() {
    let sphere = [arc(8, [0.0, 0.0], 10.0, [-FRAC_PI_2, 0.0], 1.0)];
    let surface = ToolSurface::new(revolved("ball", 8, FRAC_PI_2, &sphere));
    let direction = Vec3::new(0.5, 0.4, -0.8).normalize();
    for (distance, sign) in [(12.0, 1.0), (9.5, -1.0)] {
        let foot = surface.closest(&(direction * distance), None);
        assert!((foot.gap - (distance - 10.0)).abs() < 2e-3 && foot.gap * sign > 0.0);
        assert!((foot.normal - direction).norm() < 3e-3);
        // dn = dx / R for an outward normal: the tensor is -1/R in the tangent plane.
        let tangent = foot.normal.cross(&Vec3::z()).normalize();
        assert!((tangent.dot(&(foot.curvature * tangent)) * 10.0 + 1.0).abs() < 0.02);
        assert!((foot.curvature * foot.normal).norm() < 1e-12);
    }
}

#[test]
fn gap_and_normal_change_as_their_derivatives_say() {
    let surface = ToolSurface::new(cup_die());
    let mut seed = 11;
    let mut tested = 0;
    while tested < 60 {
        let p = Vec3::new(
            20.0 + 20.0 * random(&mut seed),
            20.0 * random(&mut seed) + 3.0,
            -9.0 + 10.0 * random(&mut seed),
        );
        let foot = surface.closest(&p, None);
        if foot.location != Location::Inside || foot.gap.abs() > 3.0 {
            continue;
        }
        tested += 1;
        let bent = foot.curvature
            * (Mat3::identity() - foot.curvature * foot.gap).try_inverse().expect("regular");
        let h = 1e-5;
        for axis in 0..3 {
            let e = Vec3::ith(axis, h);
            let (plus, minus) = (surface.closest(&(p + e), None), surface.closest(&(p - e), None));
            if plus.patch != foot.patch || minus.patch != foot.patch {
                continue;
            }
            assert!(((plus.gap - minus.gap) / (2.0 * h) - foot.normal[axis]).abs() < 1e-7);
            let dn = (plus.normal - minus.normal) / (2.0 * h);
            let along = Vec3::ith(axis, 1.0) - foot.normal * foot.normal[axis];
            assert!((dn + bent * along).norm() < 1e-7, "{:?} {:?}", dn, bent * along);
        }
    }
}

#[test]
fn past_the_border_there_is_no_contact_and_on_it_there_is() {
    let square = plane("flat", Vec3::zeros(), Vec3::x() * 10.0, Vec3::y() * 10.0, Vec3::z());
    let surface = ToolSurface::new(square);
    let at = |x: f64, y: f64, z: f64| surface.closest(&Vec3::new(x, y, z), None);
    assert!(at(11.0, 5.0, -0.1).past_border && at(-0.5, -0.5, 0.0).past_border);
    assert!(!at(10.0, 5.0, -0.1).past_border && !at(0.0, 0.0, 1.0).past_border);
    assert_eq!(at(5.0, 5.0, -0.25).gap, -0.25);
    assert_eq!(at(5.0, 5.0, -0.25).location, Location::Inside);
    assert_eq!(at(10.0, 5.0, 1.0).location, Location::Edge(1));
}

#[test]
fn the_medial_axis_and_coincident_feet_end_in_finite_work() {
    let surface = ToolSurface::new(cup_die());
    for p in [Vec3::new(0.0, 0.0, -10.0), Vec3::new(22.0, 0.0, -20.0), Vec3::new(0.0, 0.0, 1e6)] {
        let foot = surface.closest(&p, None);
        assert!(foot.gap.is_finite() && foot.patch != u32::MAX);
    }
    let axis = surface.closest(&Vec3::new(0.0, 0.0, -5.0), None);
    assert!((axis.point - Vec3::new(0.0, 0.0, -28.0)).norm() < 1e-6, "{axis:?}");
}

/// On sides and corners, and on their normals: the distance is zero, or several patches share the foot point.
#[test]
fn points_on_the_tool_and_over_its_vertices_are_found() {
    for model in [cup_die(), kanagata_tool::exchange::to_bezier(&cup_die())] {
        let surface = ToolSurface::new(model.clone());
        for patch in &model.patches {
            for (eta, zeta) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.3), (0.6, 0.0)] {
                let on = patch.derivs(eta, zeta).s;
                let normal = patch.normal(eta, zeta).unwrap();
                for gap in [0.0, 1e-9, -1e-3, 0.4] {
                    let p = on + normal * gap;
                    let foot = surface.closest(&p, None);
                    let found = (p - foot.point).norm();
                    assert!(found <= gap.abs() + 1e-11, "{p:?} {gap} {foot:?}");
                    assert_eq!(
                        foot.outcome,
                        Outcome::Certified,
                        "{gap} at {eta} {zeta} of {patch:?}"
                    );
                }
            }
        }
    }
}

/// Differences hidden by rounding cannot be bounded: subdivision must still end before the work limit.
#[test]
fn a_search_from_very_far_away_ends() {
    let surface = ToolSurface::new(cup_die());
    for far in [1e4, 1e6, 1e9, 1e12, 1e16] {
        for along in [Vec3::z(), -Vec3::z(), Vec3::new(1.0, 0.4, 0.3)] {
            let p = along.normalize() * far;
            let foot = surface.closest(&p, None);
            assert_eq!(foot.outcome, Outcome::Certified, "{p:?}");
        }
    }
}
