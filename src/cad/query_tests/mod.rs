//! Tests of areas, bounding boxes, trimmed regions and closest points on constructed models.

pub(crate) mod shapes;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use self::shapes::*;
use super::closest::ClosestPoint;
use super::model::{EdgeUse, Face, FootLocation, Model, TrimLoop};
use super::trim_region::TrimRegion;
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

#[test]
fn areas_are_those_of_closed_forms() {
    let (r, h, big) = (12.5, 31.0, 40.0);
    let torus = |r: f64| FRAC_PI_2 * ((big + r) * r * FRAC_PI_2 - r * r);
    let cases = [
        ("plane", holed_square(20.0).area(), 1e4 - PI * 400.0),
        ("cylinder", cylinder(r, h).area(), TAU * r * h),
        ("sphere", sphere(r).area(), 2.0 * TAU * r * r),
        ("cone", cone(r, h).area(), PI * r * r.hypot(h)),
        ("fillet", fillet(big, 7.0).area(), torus(7.0)),
    ];
    for (name, found, exact) in cases {
        assert!(relative(found, exact) < 1e-9, "{name}: {found} {exact}");
    }
}

#[test]
fn a_hole_and_what_was_cut_out_make_the_whole() {
    for mut whole in [fillet(40.0, 7.0), sphere(9.0), cone(5.0, 8.0), wavy(3)] {
        let full = whole.area();
        let [u, v] = whole.faces[0].surface.domain();
        let middle = Vec2::new(0.4 * u[0] + 0.6 * u[1], 0.5 * (v[0] + v[1]));
        let ring = circle(middle, 0.3 * (u[1] - u[0]), 0.4 * (v[1] - v[0]));
        let side = |pcurve| EdgeUse { pcurve, edge: None, reversed: false };
        let disc = face(whole.faces[0].surface.clone(), vec![vec![side(ring.clone())]]);
        whole.faces[0].loops.push(TrimLoop { uses: vec![side(ring.reversed())] });
        let (rest, cut) = (whole.area(), disc.area(1e-10));
        assert!(cut > 0.1 * full && rest > 0.1 * full);
        assert!(relative(rest + cut, full) < 1e-9, "{rest} + {cut} = {full}");
    }
}

#[test]
fn centroids_are_those_of_closed_forms() {
    let f = tilted();
    let off = |m: &Model, exact: Vec3| (m.area_centroid().unwrap() - exact).norm();
    assert!(off(&cylinder(12.5, 31.0), f.point(&Vec3::new(0.0, 0.0, 15.5))) < 1e-7);
    assert!(off(&sphere(9.0), f.origin) < 1e-7);
    assert!(off(&cone(6.0, 9.0), f.point(&Vec3::new(0.0, 0.0, 3.0))) < 1e-7);
    let hole = PI * 400.0;
    let exact = Vec3::new(10.0, 5.0, 0.0) * (-hole / (1e4 - hole));
    assert!(off(&holed_square(20.0), exact) < 1e-7);
    assert!(Model::default().area_centroid().is_none());
}

#[test]
fn boxes_touch_what_they_hold() {
    let f = tilted();
    let b = sphere(9.0).bbox();
    assert!((b.min - f.origin.add_scalar(-9.0)).norm() < 1e-9);
    assert!((b.max - f.origin.add_scalar(9.0)).norm() < 1e-9);
    // The extent of a cylinder beyond its end circle centres is r sqrt(1 - z_k^2).
    let b = cylinder(5.0, 20.0).bbox();
    let reach = f.z.map(|z| 5.0 * (1.0 - z * z).sqrt());
    let top = f.origin + f.z * 20.0;
    assert!((b.min - (f.origin.inf(&top) - reach)).norm() < 1e-9);
    assert!((b.max - (f.origin.sup(&top) + reach)).norm() < 1e-9);
    for seed in 0..4 {
        let m = wavy(seed);
        let b = m.bbox();
        let mut inner = kanagata_geometry::Aabb::EMPTY;
        for (_, p) in grid(&m.faces[0], 300) {
            inner.grow(&p);
        }
        assert!((0..3).all(|k| b.min[k] <= inner.min[k] && b.max[k] >= inner.max[k]));
        assert!((b.min - inner.min).norm() + (b.max - inner.max).norm() < 2e-2);
    }
}

/// Points of a face on a grid of its domain, inside the trimming loops.
fn grid(face: &Face, n: usize) -> Vec<(Vec2, Vec3)> {
    let [u, v] = face.surface.domain();
    let region = TrimRegion::new(face);
    let at = |r: [f64; 2], k: usize| r[0] + (r[1] - r[0]) * k as f64 / n as f64;
    let all = (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j)));
    all.map(|(i, j)| Vec2::new(at(u, i), at(v, j)))
        .filter(|&uv| region.contains(uv))
        .map(|uv| (uv, face.surface.point(uv)))
        .collect()
}

#[test]
fn inside_and_outside_are_those_of_the_circle_and_the_square() {
    let m = holed_square(20.0);
    let region = TrimRegion::new(&m.faces[0]);
    let center = Vec2::new(10.0, 5.0);
    let mut seed = 1;
    for _ in 0..20_000 {
        let q = Vec2::new(random(&mut seed), random(&mut seed)) * 120.0 - Vec2::repeat(60.0);
        let exact = q.amax() <= 50.0 && (q - center).norm() >= 20.0;
        assert_eq!(region.contains(q), exact, "{q:?}");
    }
    for k in 0..1000 {
        let a = 0.01 * f64::from(k);
        let ray = Vec2::new(a.cos(), a.sin());
        assert!(region.contains(center + ray * (20.0 - 1e-9)), "on the border");
        assert!(region.contains(center + ray * (20.0 + 1e-6)));
        assert!(!region.contains(center + ray * (20.0 - 1e-6)));
    }
    // Level with corners and with the top and bottom of the hole, where curve ends meet the ray.
    for y in [-50.0, 50.0, 25.0, -15.0, 5.0] {
        assert!(!region.contains(Vec2::new(-51.0, y)) && !region.contains(Vec2::new(51.0, y)));
        assert!(region.contains(Vec2::new(-49.0, y)));
    }
    assert!(!region.contains(Vec2::new(f64::NAN, 0.0)));
}

/// Points beside cubic curves that are run through unevenly, one bent and one nearly straight, down to four times the width of
/// the border.
#[test]
fn inside_and_outside_are_told_beside_uneven_curves() {
    let corners = [Vec2::new(-40.0, -40.0), Vec2::new(40.0, 40.0)];
    let bent = [Vec2::new(-39.0, 20.0), Vec2::new(-38.0, 35.0)];
    let straight = [Vec2::new(-39.76, -39.75), Vec2::new(-39.52, -39.50)];
    for inner in [bent, straight] {
        let mut m = holed_square(20.0);
        let control = vec![corners[0], inner[0], inner[1], corners[1]];
        let knots = [[0.0; 4], [1.0; 4]].concat();
        let curve = Curve2::try_new(3, knots, control, None).unwrap();
        let below = Vec2::new(40.0, -40.0);
        let side = |pcurve| EdgeUse { pcurve, edge: None, reversed: false };
        let lines = [Curve2::line(corners[0], below), Curve2::line(below, corners[1])];
        let uses = lines.into_iter().chain([curve.reversed()]).map(side).collect();
        m.faces[0].loops = vec![TrimLoop { uses }];
        let region = TrimRegion::new(&m.faces[0]);
        for k in 10..1000 {
            let d = curve.derivs(f64::from(k) / 1000.0);
            let outwards = Vec2::new(-d.d1.y, d.d1.x).normalize();
            for off in [5e-7, 1e-5, 1e-3, 0.01] {
                let [inside, outside] =
                    [-off, off].map(|off| region.contains(d.c + outwards * off));
                assert!(inside && !outside, "{k}, {off}: {inside} {outside}");
            }
            assert!(region.contains(d.c), "{k} on the border");
        }
    }
}

#[test]
fn a_gap_between_border_curves_does_not_leak() {
    let mut m = holed_square(20.0);
    let uses = &mut m.faces[0].loops[0].uses;
    uses[1].pcurve = Curve2::line(Vec2::new(50.0, -49.9), Vec2::new(50.0, 49.0));
    let region = TrimRegion::new(&m.faces[0]);
    for y in [-49.95, -49.0, 49.0, 49.5] {
        assert!(region.contains(Vec2::new(-20.0, y)));
        assert!(!region.contains(Vec2::new(-50.1, y)) && !region.contains(Vec2::new(51.0, y)));
    }
}

#[test]
fn a_rectangle_that_no_loop_enters_is_told() {
    let m = holed_square(20.0);
    let region = TrimRegion::new(&m.faces[0]);
    let around =
        |x: f64, y: f64, r: f64| region.touches(Vec2::new(x - r, y - r), Vec2::new(x + r, y + r));
    assert!(!around(10.0, 5.0, 14.0) && around(10.0, 5.0, 14.2));
    assert!(!around(-30.0, -30.0, 10.0) && around(-30.0, -30.0, 20.0) && around(30.0, 5.0, 1.0));
}

#[test]
fn feet_on_quadrics_are_those_of_closed_forms() {
    let f = tilted();
    let models = [cylinder(12.0, 30.0), sphere(9.0), cone(6.0, 9.0), holed_square(20.0)];
    let index: Vec<ClosestPoint<'_>> = models.iter().map(ClosestPoint::new).collect();
    let mut seed = 9;
    for k in 0..3000 {
        let q = Vec3::new(random(&mut seed), random(&mut seed), random(&mut seed)) * 60.0
            - Vec3::repeat(30.0);
        // Every tenth on the axis, every hundredth at the centre.
        let q = if k % 10 == 0 { Vec3::z() * q.z } else { q };
        let q = if k % 100 == 0 { Vec3::zeros() } else { q };
        let ring = q.x.hypot(q.y);
        let p = f.point(&q);
        let to_side = (Vec2::new(ring, q.z) - {
            let (a, d) = (Vec2::new(6.0, 0.0), Vec2::new(-6.0, 9.0));
            let t = (Vec2::new(ring, q.z) - a).dot(&d) / d.norm_squared();
            a + d * t.clamp(0.0, 1.0)
        })
        .norm();
        let exact =
            [(ring - 12.0).hypot(q.z - q.z.clamp(0.0, 30.0)), (q.norm() - 9.0).abs(), to_side];
        for (i, (index, exact)) in index.iter().zip(exact).enumerate() {
            let foot = index.closest(&p).unwrap();
            assert!((foot.distance - exact).abs() < 1e-9, "{i} {q:?}: {} {exact}", foot.distance);
            let on_face = index.model().faces[0].surface.point(foot.uv);
            assert!((on_face - foot.point).norm() < 1e-8, "{i} {q:?}");
            let own = index.closest_on_face(0, &p).unwrap();
            assert!((own.distance - exact).abs() < 1e-9);
        }
        let (flat, center) = (Vec3::new(q.x, q.y, 0.0), Vec3::new(10.0, 5.0, 0.0));
        let in_hole = (20.0 - (flat - center).norm()).max(0.0);
        let foot = index[3].closest(&q).unwrap();
        assert!((foot.distance - in_hole.hypot(q.z)).abs() < 1e-9, "{q:?}");
        assert_eq!(matches!(foot.location, FootLocation::Inside), in_hole == 0.0, "{q:?}");
    }
}

#[test]
fn no_point_of_a_wavy_surface_is_nearer_than_the_foot() {
    for seed in 0..6 {
        let m = wavy(seed);
        let index = ClosestPoint::new(&m);
        let dense = grid(&m.faces[0], 160);
        let b = m.bbox().widened(8.0);
        let mut s = seed + 100;
        let points: Vec<Vec3> = (0..400)
            .map(|_| {
                let fraction = Vec3::new(random(&mut s), random(&mut s), random(&mut s));
                b.min + (b.max - b.min).component_mul(&fraction)
            })
            .collect();
        let feet = index.closest_many(&points);
        for (p, foot) in points.iter().zip(feet) {
            let foot = foot.unwrap();
            let near = dense.iter().min_by(|a, b| (a.1 - p).norm().total_cmp(&(b.1 - p).norm()));
            // Refined from the nearest sample.
            let refined = m.faces[0].surface.closest_near(p, near.unwrap().0, 0.0).1.sqrt();
            assert!(foot.distance <= refined + 1e-10, "{p:?}: {} {refined}", foot.distance);
            assert!((foot.distance - (foot.point - p).norm()).abs() < 1e-12);
            assert!((m.faces[0].surface.point(foot.uv) - foot.point).norm() < 1e-8);
            if foot.location == FootLocation::Inside {
                let d = m.faces[0].surface.derivs(foot.uv);
                let r = (p - foot.point).normalize();
                let slant = r.dot(&d.su.normalize()).abs().max(r.dot(&d.sv.normalize()).abs());
                assert!(slant < 1e-6, "{p:?} {foot:?}: {slant:e} {r:?}");
            }
            assert_eq!(index.closest(p), Some(foot), "the same on any thread");
        }
    }
}

#[test]
fn feet_on_edges_and_vertices_choose_the_face_that_looks_at_the_point() {
    // Two squares at a right angle along x: z = 0 for y < 0, y = 0 for z < 0.
    let flat = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: -Vec3::y(), z: -Vec3::z() };
    let wall = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: -Vec3::z(), z: Vec3::y() };
    let mut faces = Vec::new();
    let mut curves = vec![Curve3::line(Vec3::zeros(), Vec3::x() * 10.0)];
    for frame in [flat, wall] {
        let corner = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
        let mut uses = Vec::new();
        for k in 0..4 {
            let [a, b] = [k, (k + 1) % 4].map(|k| Vec2::new(corner[k].0, corner[k].1));
            let edge = if k == 0 { 0 } else { curves.len() };
            if k > 0 {
                let [a, b] = [a, b].map(|q| frame.point(&Vec3::new(q.x, q.y, 0.0)));
                curves.push(Curve3::line(a, b));
            }
            uses.push(EdgeUse { pcurve: Curve2::line(a, b), edge: Some(edge), reversed: false });
        }
        faces.push(face(Surface::plane(&frame, [0.0, 10.0], [0.0, 10.0]), vec![uses]));
    }
    let m = model(faces, curves);
    let index = ClosestPoint::new(&m);
    for (y, z, expected) in [(0.1, 0.3, 0), (0.3, 0.1, 1), (0.2, 0.2, 0)] {
        let foot = index.closest(&Vec3::new(4.0, y, z)).unwrap();
        assert_eq!((foot.face, foot.location), (expected, FootLocation::Edge(0)));
        assert!((foot.uv - Vec2::new(4.0, 0.0)).norm() < 1e-9);
        assert!((foot.distance - f64::hypot(y, z)).abs() < 1e-12);
    }
    // On the edge, and straight above it: located on the edge, lowest face index.
    let foot = index.closest(&Vec3::new(4.0, 0.0, 0.0)).unwrap();
    assert_eq!((foot.face, foot.location, foot.distance), (0, FootLocation::Edge(0), 0.0));
    let foot = index.closest(&Vec3::new(11.0, 0.5, 0.2)).unwrap();
    let FootLocation::Vertex(v) = foot.location else { panic!("{:?}", foot.location) };
    assert_eq!(m.vertices[v], Vec3::x() * 10.0);
    assert_eq!(index.closest_on_face(0, &Vec3::new(4.0, 0.3, 0.1)).unwrap().face, 0);
    assert!(index.closest_on_face(2, &Vec3::zeros()).is_none());
    assert!(index.closest(&Vec3::repeat(f64::NAN)).is_none());
    assert!(ClosestPoint::new(&Model::default()).closest(&Vec3::zeros()).is_none());
}

/// Two squares on both sides of the line from (0, 0) to (10, 0) in one plane, with separate edges. The first side of
/// each follows `borders` in the plane, mirrored for the second square, and `curves` in space.
fn two_squares(borders: [Curve2; 2], curves: [Curve3; 2]) -> Model {
    let above = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: Vec3::y(), z: Vec3::z() };
    let below = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: -Vec3::y(), z: -Vec3::z() };
    let (mut faces, mut all) = (Vec::new(), Vec::new());
    for ((frame, border), curve) in [above, below].into_iter().zip(borders).zip(curves) {
        let [low, high] = border.domain().map(|t| border.point(t));
        let far = [Vec2::new(10.0, 10.0), Vec2::new(0.0, 10.0)];
        let lines = [(high, far[0]), (far[0], far[1]), (far[1], low)];
        let mut uses = vec![EdgeUse { pcurve: border, edge: Some(all.len()), reversed: false }];
        all.push(curve);
        for (a, b) in lines {
            uses.push(EdgeUse {
                pcurve: Curve2::line(a, b),
                edge: Some(all.len()),
                reversed: false,
            });
            let [a, b] = [a, b].map(|q| frame.point(&Vec3::new(q.x, q.y, 0.0)));
            all.push(Curve3::line(a, b));
        }
        faces.push(face(Surface::plane(&frame, [-1.0, 11.0], [-1.0, 11.0]), vec![uses]));
    }
    model(faces, all)
}

#[test]
fn sides_join_up_to_the_tolerance_and_no_farther() {
    let line = Curve2::line(Vec2::zeros(), Vec2::new(10.0, 0.0));
    let straight = Curve3::line(Vec3::zeros(), Vec3::x() * 10.0);
    for (gap, joined) in [(0.009, 1), (0.011, 0), (0.019, 0)] {
        // The ends coincide; the middle of the second curve deviates by the gap.
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let y = [0.0, 2.0 * gap, 0.0];
        let flat = (0..3).map(|k| Vec2::new(5.0 * k as f64, y[k])).collect();
        let space = (0..3).map(|k| Vec3::new(5.0 * k as f64, -y[k], 0.0)).collect();
        let bent = Curve2::try_new(2, knots.clone(), flat, None).unwrap();
        let curve = Curve3::try_new(2, knots, space, None).unwrap();
        let sheets = two_squares([line.clone(), bent], [straight.clone(), curve]);
        // A previous joining with a larger tolerance has no effect.
        for sheets in [sheets.joined_within(0.05), sheets] {
            let found = sheets.joined_within(0.01);
            assert_eq!(found.edges.iter().filter(|e| e.uses.len() == 2).count(), joined, "{gap}");
        }
    }
}

#[test]
fn a_side_may_swing_out_at_one_place() {
    let line = Curve2::line(Vec2::zeros(), Vec2::new(10.0, 0.0));
    let straight = Curve3::line(Vec3::zeros(), Vec3::x() * 10.0);
    let at = [0.0, 0.4, 0.7, 1.0, 2.0, 2.3, 2.6, 10.0];
    let knots = [&at[..1], &at, &at[7..]].concat();
    // Deviation at 0.7 and at 2.3.
    for (swing, joined) in [([0.016, 0.0], 1), ([0.024, 0.0], 0), ([0.016, 0.016], 0)] {
        let y = [0.0, 0.0, swing[0], 0.0, 0.0, swing[1], 0.0, 0.0];
        let flat = at.iter().zip(y).map(|(&x, y)| Vec2::new(x, y)).collect();
        let space = at.iter().zip(y).map(|(&x, y)| Vec3::new(x, -y, 0.0)).collect();
        let bent = Curve2::try_new(1, knots.clone(), flat, None).unwrap();
        let curve = Curve3::try_new(1, knots.clone(), space, None).unwrap();
        let sheets = two_squares([line.clone(), bent], [straight.clone(), curve]);
        let found = sheets.joined_within(0.01);
        assert_eq!(found.edges.iter().filter(|e| e.uses.len() == 2).count(), joined, "{swing:?}");
    }
}

#[test]
fn sides_whose_curves_meet_join_though_their_surfaces_end_apart() {
    let straight = Curve3::line(Vec3::zeros(), Vec3::x() * 10.0);
    let joined = |shift: Vec2| {
        let border = |d: Vec2| Curve2::line(d, Vec2::new(10.0, d.y));
        // The second square is mirrored: an equal shift across the line has the opposite direction there.
        let borders = [border(shift), border(Vec2::new(-shift.x, shift.y))];
        let sheets = two_squares(borders, [straight.clone(), straight.clone()]);
        let found = sheets.joined_within(0.01);
        let shared = found.edges.iter().filter(|e| e.uses.len() == 2).count();
        (shared, found.edges.len())
    };
    // Across the line: both sides deviate from it.
    assert_eq!(joined(Vec2::new(0.0, 0.007)), (1, 7));
    assert_eq!(joined(Vec2::new(0.0, 0.011)), (0, 8));
    // Along the line: what exceeds the end of the curve becomes a separate side.
    assert_eq!(joined(Vec2::new(0.007, 0.0)), (1, 7));
    assert_eq!(joined(Vec2::new(0.011, 0.0)), (1, 8));
}
