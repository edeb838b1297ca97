//! Tests of closest points.

use super::*;
use crate::query_tests::shapes::{fillet, sphere, wavy};
use std::path::Path;

fn model(name: &str) -> Model {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming")
        .join(name);
    crate::read(&path).unwrap().0
}

/// Points of all faces on a grid of the parameter plane, inside the trimming loops.
fn samples(model: &Model, n: usize) -> Vec<(usize, Vec2, Vec3)> {
    let mut out = Vec::new();
    for (f, face) in model.faces.iter().enumerate() {
        let region = TrimRegion::new(face);
        for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
            let fraction = Vec2::new(i as f64 / n as f64, j as f64 / n as f64);
            let uv = region.low + (region.high - region.low).component_mul(&fraction);
            if region.contains(uv) {
                out.push((f, uv, face.surface.point(uv)));
            }
        }
    }
    out
}

#[test]
fn no_sample_is_nearer_than_the_answer() {
    for name in
        ["cross_die_144.igs", "cross_punch_AP214.stp", "square_punch_186.igs", "torus_AP214.stp"]
    {
        let model = model(name);
        let index = ClosestPoint::new(&model);
        let dense = samples(&model, 60);
        let bounds = model.bbox();
        let mut seed = 5u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / (1u64 << 31) as f64
        };
        for _ in 0..200 {
            let fraction = Vec3::new(random(), random(), random()).map(|x| 1.4 * x - 0.2);
            let p = bounds.min + (bounds.max - bounds.min).component_mul(&fraction);
            let foot = index.closest(&p).unwrap();
            assert!(((foot.point - p).norm() - foot.distance).abs() < 1e-9);
            let best = dense.iter().map(|s| (s.2 - p).norm()).fold(f64::INFINITY, f64::min);
            assert!(foot.distance <= best + 1e-9, "{name} {p:?}: {} {best}", foot.distance);
            // The foot point lies on the model.
            assert!(best <= foot.distance + 6.0, "{name} {p:?}: {} {best}", foot.distance);
        }
    }
}

#[test]
fn points_off_a_face_along_its_normal_come_back() {
    let model = model("cross_die_144.igs");
    let index = ClosestPoint::new(&model);
    for (f, uv, x) in samples(&model, 9) {
        let n = model.faces[f].normal(uv).unwrap();
        for d in [0.02, -0.02] {
            let foot = index.closest(&(x + n * d)).unwrap();
            assert!((foot.distance - 0.02).abs() < 1e-9, "{f} {uv:?}: {}", foot.distance);
            assert!((foot.point - x).norm() < 1e-7);
        }
        let own = index.closest_on_face(f, &x).unwrap();
        assert!(own.distance < 1e-9 && own.face == f);
    }
}

#[test]
fn a_search_that_is_not_done_has_no_answer() {
    let model = model("hemi_punch_nurbs144.igs");
    let index = ClosestPoint::new(&model);
    let p = model.bbox().center();
    let with = |left: u32| index.nearest(Search { left, ..Search::new(&p) });
    assert_eq!(with(3), Err(WorkLimitReached));
    assert_eq!(with(VISITS_MAX), Ok(index.closest(&p)));
    assert!(index.closest(&p).is_some());
}

/// The edges of faces that are not in the model have no uses: they are no border of it.
#[test]
fn edges_without_faces_hide_no_border() {
    let mut model = model("cross_die_144.igs");
    let far: Vec<Vec3> = samples(&model, 3).into_iter().map(|s| s.2).collect();
    model.faces.truncate(1);
    model.edges.iter_mut().for_each(|e| e.uses.retain(|u| u[0] == 0));
    assert!(model.edges.iter().any(|e| e.uses.is_empty()));
    let search = ClosestPoint::new(&model);
    for p in far {
        let (any, own) = (search.closest(&p).unwrap(), search.closest_on_face(0, &p).unwrap());
        assert!(
            (any.distance - own.distance).abs() < 1e-9,
            "{p} {} {}",
            any.distance,
            own.distance
        );
    }
}

/// A search for points closer than a known foot point finds what a search without it finds, far off the face too.
#[test]
fn a_known_foot_point_hides_no_closer_one() {
    let mut closer = 0;
    for model in [wavy(3), wavy(8), fillet(40.0, 7.0), sphere(9.0)] {
        let index = ClosestPoint::new(&model);
        let size = model.bbox().diagonal();
        for (k, (_, uv, at)) in samples(&model, 24).into_iter().enumerate() {
            let Some(normal) = model.faces[0].normal(uv) else { continue };
            let p = at + normal * size * [0.001, -0.02, 0.2, -0.6][k % 4];
            let start = uv + Vec2::new(1e-3, -1e-3);
            let (known, d) = model.faces[0].surface.closest_locally(&p, start);
            let offset = d.s - p;
            let stationary =
                [d.su, d.sv].iter().all(|t| offset.dot(t).abs() <= 1e-6 * t.norm() * offset.norm());
            if !stationary || !TrimRegion::new(&model.faces[0]).contains(known) {
                continue;
            }
            let distance = (d.s - p).norm() - 1e-9;
            let with = index.closest_within(&p, distance, Some((0, known))).unwrap();
            let without = index.closest_within(&p, distance, None).unwrap();
            let [with, without] = [with, without].map(|foot| foot.map(|foot| foot.distance));
            let apart = (with.unwrap_or(distance) - without.unwrap_or(distance)).abs();
            assert!(apart <= 1e-8 * size, "{k} {p:?}: {with:?} {without:?}");
            closer += usize::from(without.is_some());
        }
    }
    assert!(closer > 100, "{closer}");
}
