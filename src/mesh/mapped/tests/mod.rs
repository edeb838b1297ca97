mod builder;

use std::f64::consts::{FRAC_PI_2, PI};

use self::builder::{Builder, at, border_curve, flat_side, line};
use super::*;
use crate::{Element, MeshError, SurfaceMesh};
use kanagata_cad::Model;
use kanagata_cad::model::{EdgeUse, SurfaceKind};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

/// A quarter of a drawing ring: plate outside radius 17, fillet of 7 mm, wall of radius 10, 20 mm deep.
fn ring() -> Model {
    let up = Frame::world();
    let tube = Frame::from_z_x(at(17.0, 0.0, -7.0), -Vec3::y(), Vec3::x()).unwrap();
    let fillet = Curve3::ellipse_arc(&tube, 7.0, 7.0, FRAC_PI_2, PI);
    let fillet = Surface::revolution(&fillet, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let wall = Curve3::line(at(10.0, 0.0, -7.0), at(10.0, 0.0, -27.0));
    let wall = Surface::revolution(&wall, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let plate = Surface::plane(&up, [0.0, 40.0], [0.0, 40.0]);
    let arc = Curve3::ellipse_arc(&up, 17.0, 17.0, 0.0, FRAC_PI_2).reversed();
    let p = |x, y| at(x, y, 0.0);
    let border = vec![
        line(p(17.0, 0.0), p(40.0, 0.0)),
        line(p(40.0, 0.0), p(40.0, 40.0)),
        line(p(40.0, 40.0), p(0.0, 40.0)),
        line(p(0.0, 40.0), p(0.0, 17.0)),
        flat_side(arc),
    ];
    Builder::default()
        .face(plate, SurfaceKind::Plane, vec![border])
        .patch(fillet, SurfaceKind::Torus)
        .patch(wall, SurfaceKind::Cylinder)
        .model
}

/// Area of [`ring`]: plate, fillet by Pappus, wall.
fn ring_area() -> f64 {
    let fillet = FRAC_PI_2 * 7.0 * (17.0 * FRAC_PI_2 - 7.0);
    1600.0 - PI * 17.0 * 17.0 / 4.0 + fillet + FRAC_PI_2 * 10.0 * 20.0
}

fn options(arc_divisions: usize, style: MeshStyle) -> MappedOptions {
    MappedOptions { arc_divisions, style, ..MappedOptions::default() }
}

/// Asserts that every interior side is used once in each direction, and that the number of free sides is that of the
/// model's free edges.
fn assert_conforming(mesh: &SurfaceMesh) {
    let uses = mesh.conformity();
    assert_eq!(uses.irregular, 0, "{uses:?}");
}

#[test]
fn fillets_get_a_regular_grid_on_the_exact_surface() {
    let model = ring();
    for n in [1, 2, 4] {
        let mesh = mesh(&model, &options(n, MeshStyle::Structured)).unwrap();
        assert_conforming(&mesh);
        let fillet: Vec<_> = mesh.elements.iter().filter(|e| e.face == 1).collect();
        assert_eq!(fillet.len(), n * n);
        // All nodes at integer steps of both angles, to rounding.
        for p in fillet.iter().flat_map(|e| mesh.corners(e)) {
            let across = p.xy().norm() - 17.0;
            let steps = [
                p.y.atan2(p.x) / FRAC_PI_2 * n as f64,
                (across.atan2(p.z + 7.0) / -FRAC_PI_2) * n as f64,
            ];
            assert!((across.hypot(p.z + 7.0) - 7.0).abs() < 1e-12);
            assert!(steps.iter().all(|s| (s - s.round()).abs() < 1e-9), "{steps:?}");
        }
        assert_eq!(mesh.elements.iter().filter(|e| e.face == 2).count(), n);
    }
}

#[test]
fn area_converges_with_second_order() {
    let model = ring();
    let error = |n| {
        let mesh = mesh(&model, &options(n, MeshStyle::Structured)).unwrap();
        (mesh.area() / ring_area() - 1.0).abs()
    };
    let (coarse, fine) = (error(8), error(16));
    assert!(fine < 1e-3 && coarse / fine > 3.8, "{coarse} {fine}");
}

#[test]
fn flats_get_no_inner_nodes_and_few_elements() {
    let mesh = mesh(&ring(), &options(4, MeshStyle::Structured)).unwrap();
    // Boundary: 4 straight sides and 4 chords: 8 nodes, equivalent to 6 triangles.
    let worth = |e: &&Element| e.nodes().len() - 2;
    assert_eq!(mesh.elements.iter().filter(|e| e.face == 0).map(|e| worth(&e)).sum::<usize>(), 6);
}

#[test]
fn every_style_is_conforming_and_of_its_kind() {
    let model = ring();
    for style in [MeshStyle::Structured, MeshStyle::Mixed, MeshStyle::Triangles, MeshStyle::Quads] {
        for n in [1, 3, 4] {
            let mesh = mesh(&model, &options(n, style)).unwrap();
            assert_conforming(&mesh);
            let triangles = mesh.elements.iter().filter(|e| e.nodes().len() == 3).count();
            match style {
                MeshStyle::Triangles => assert_eq!(triangles, mesh.elements.len()),
                MeshStyle::Quads => assert_eq!(triangles, 0),
                _ => {}
            }
        }
    }
}

#[test]
fn a_hemisphere_has_triangles_at_its_pole() {
    let tube = Frame::from_z_x(Vec3::zeros(), -Vec3::y(), Vec3::x()).unwrap();
    let meridian = Curve3::ellipse_arc(&tube, 30.0, 30.0, 0.0, FRAC_PI_2);
    for turn in [FRAC_PI_2, 2.0 * PI] {
        let dome = Surface::revolution(&meridian, Vec3::zeros(), Vec3::z(), [0.0, turn]);
        let model = Builder::default().patch(dome, SurfaceKind::Sphere).model;
        for style in [MeshStyle::Structured, MeshStyle::Quads] {
            let mesh = mesh(&model, &options(8, style)).unwrap();
            assert_conforming(&mesh);
            let triangles = mesh.elements.iter().filter(|e| e.nodes().len() == 3).count();
            let around = (turn / FRAC_PI_2 * 8.0).round() as usize;
            assert_eq!(triangles, if style == MeshStyle::Quads { 0 } else { around });
            let error = mesh.area() / (turn * 900.0) - 1.0;
            assert!(error < 0.0 && error > -0.01, "{error}");
        }
    }
}

#[test]
fn a_wall_with_a_window_is_refined_where_it_curves() {
    let wall = Curve3::line(at(10.0, 0.0, 0.0), at(10.0, 0.0, 20.0));
    let wall = Surface::revolution(&wall, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let [[u0, u1], [v0, v1]] = wall.domain();
    let mut sides = Vec::new();
    // A diamond in the parameter plane, with space curves interpolated finely enough to have common ends.
    let at_uv = |x: f64, y: f64| Vec2::new(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
    let c = [at_uv(0.5, 0.3), at_uv(0.3, 0.5), at_uv(0.5, 0.7), at_uv(0.7, 0.5)];
    for k in 0..4 {
        let (a, b) = (c[k], c[(k + 1) % 4]);
        let n = 40;
        let points = (0..=n).map(|i| wall.point(a + (b - a) * (f64::from(i) / f64::from(n))));
        let knots = [0, 0].into_iter().chain(1..n).chain([n, n]).map(f64::from).collect();
        let curve = Curve3::try_new(1, knots, points.collect(), None).unwrap();
        sides.push((Curve2::line(a, b), curve));
    }
    let mut model = Builder::default().patch(wall, SurfaceKind::Cylinder).model;
    let face = model.faces.pop().unwrap();
    let outer = face.loops[0].uses.iter().zip(0..4);
    let outer = outer.map(|(u, k)| (u.pcurve.clone(), border_curve(&face.surface, k))).collect();
    let model = Builder::default().face(face.surface.clone(), face.kind, vec![outer, sides]).model;
    for style in [MeshStyle::Structured, MeshStyle::Triangles, MeshStyle::Quads] {
        let mesh = mesh(&model, &options(8, style)).unwrap();
        assert_conforming(&mesh);
        // The normals of all elements are close to those of the cylinder.
        for e in &mesh.elements {
            let p = mesh.corners(e);
            let flat = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
            let middle = p.iter().sum::<Vec3>() / p.len() as f64;
            let radial = Vec3::new(middle.x, middle.y, 0.0).normalize();
            assert!(flat.dot(&radial) > 0.97, "{:?}", e.nodes());
        }
        // A diamond covers half of its enclosing rectangle of 0.4 x 0.4, except for the non-uniform arc parameter.
        let fraction = mesh.area() / (FRAC_PI_2 * 10.0 * 20.0);
        assert!((0.88..0.94).contains(&fraction), "{fraction}");
    }
}

#[test]
fn options_out_of_range_say_so() {
    let bad = mesh(&ring(), &options(0, MeshStyle::Structured)).unwrap_err().to_string();
    assert!(bad.contains("arc_divisions is 0; allowed: 1 to 1000"), "{bad}");
    let size = MappedOptions { max_size: Some(f64::NAN), ..MappedOptions::default() };
    assert!(matches!(mesh(&ring(), &size), Err(MeshError::Option { .. })));
    assert!(matches!(
        mesh(&Model::default(), &MappedOptions::default()),
        Err(MeshError::NoFaces { .. })
    ));
}

#[test]
fn largest_size_and_chord_error_are_kept() {
    let size = MappedOptions { max_size: Some(3.0), ..MappedOptions::default() };
    let mesh_a = mesh(&ring(), &size).unwrap();
    assert_conforming(&mesh_a);
    let longest = |m: &SurfaceMesh| {
        let sides = m.elements.iter().flat_map(Element::sides);
        let length = |[a, b]: [u32; 2]| (m.vertices[a as usize] - m.vertices[b as usize]).norm();
        sides.map(length).fold(0.0, f64::max)
    };
    assert!(longest(&mesh_a) < 3.0 * 1.00001, "{}", longest(&mesh_a));
    let sag = MappedOptions { arc_divisions: 1, chord_error: Some(0.01), ..size };
    let mesh_b = mesh(&ring(), &MappedOptions { max_size: None, ..sag }).unwrap();
    for e in mesh_b.elements.iter().filter(|e| e.face == 2) {
        let p = mesh_b.corners(e);
        for k in 0..4 {
            let middle = (p[k] + p[(k + 1) % 4]) * 0.5;
            assert!(10.0 - middle.xy().norm() < 0.0105);
        }
    }
}

/// The whole surface of revolution of a circle arc in the x-z plane.
fn turned(centre: f64, radius: f64, from: f64, to: f64) -> Surface {
    let tube = Frame::from_z_x(at(centre, 0.0, 0.0), -Vec3::y(), Vec3::x()).unwrap();
    let arc = Curve3::ellipse_arc(&tube, radius, radius, from, to);
    Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.0, 2.0 * PI])
}

#[test]
fn closed_surfaces_close() {
    let sphere = turned(0.0, 10.0, -FRAC_PI_2, FRAC_PI_2);
    let torus = turned(30.0, 10.0, 0.0, 2.0 * PI);
    let shapes = [
        (sphere, SurfaceKind::Sphere, 400.0 * PI),
        (torus, SurfaceKind::Torus, 4.0 * PI * PI * 300.0),
    ];
    for (surface, kind, area) in shapes {
        let model = Builder::default().patch(surface, kind).model;
        for style in [MeshStyle::Structured, MeshStyle::Triangles, MeshStyle::Quads] {
            for n in [1, 2, 8] {
                let mesh = mesh(&model, &options(n, style)).unwrap();
                let uses = mesh.conformity();
                assert_eq!((uses.free, uses.irregular), (0, 0), "{kind:?} {style:?} {n}: {uses:?}");
                let error = mesh.area() / area - 1.0;
                assert!(error < 0.0 && (n < 8 || error > -0.02), "{kind:?} {style:?} {n}: {error}");
            }
        }
    }
}

/// A spindle torus corner, as under a punch with a nose radius larger than its corner radius: the fillet ends in a
/// point where the tube crosses the axis.
#[test]
fn a_spindle_torus_corner_ends_in_a_pole() {
    let (centre, radius): (f64, f64) = (-3.0, 10.0);
    let apex = (3.0f64 / 10.0).acos();
    let tube = Frame::from_z_x(at(centre, 0.0, 0.0), -Vec3::y(), Vec3::x()).unwrap();
    let arc = Curve3::ellipse_arc(&tube, radius, radius, 0.0, apex);
    let corner = Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let model = Builder::default().patch(corner, SurfaceKind::Torus).model;
    // Pappus: area = angle * r * integral of (centre + r cos v) over v.
    let area = FRAC_PI_2 * radius * (centre * apex + radius * apex.sin());
    for style in [MeshStyle::Structured, MeshStyle::Quads] {
        let mesh = mesh(&model, &options(8, style)).unwrap();
        assert_conforming(&mesh);
        assert!((mesh.area() / area - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_dome_with_a_window_keeps_its_pole_and_seam_closed() {
    let dome = turned(0.0, 30.0, 0.0, FRAC_PI_2);
    let [[u0, u1], [v0, v1]] = dome.domain();
    let at_uv = |x: f64, y: f64| Vec2::new(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
    let c = [at_uv(0.5, 0.3), at_uv(0.4, 0.5), at_uv(0.5, 0.7), at_uv(0.6, 0.5)];
    let window = (0..4).map(|k| {
        let (a, b) = (c[k], c[(k + 1) % 4]);
        let n = 40;
        let points = (0..=n).map(|i| dome.point(a + (b - a) * (f64::from(i) / f64::from(n))));
        let knots = [0, 0].into_iter().chain(1..n).chain([n, n]).map(f64::from).collect();
        (Curve2::line(a, b), Curve3::try_new(1, knots, points.collect(), None).unwrap())
    });
    let whole = Builder::default().patch(dome.clone(), SurfaceKind::Sphere).model;
    let outer = whole.faces[0].loops[0].uses.iter().zip(0..4);
    let outer = outer.map(|(u, k)| (u.pcurve.clone(), border_curve(&dome, k))).collect();
    let loops = vec![outer, window.collect()];
    let model = Builder::default().face(dome, SurfaceKind::Sphere, loops).model;
    for style in [MeshStyle::Structured, MeshStyle::Triangles, MeshStyle::Quads] {
        let mesh = mesh(&model, &options(6, style)).unwrap();
        assert_conforming(&mesh);
        // Free sides are those of the rim and the window only: none at the seam or the pole.
        let on_window = |p: &Vec3| p.z > 1e-9;
        let mut free = std::collections::BTreeMap::new();
        for [a, b] in mesh.elements.iter().flat_map(Element::sides) {
            *free.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
        }
        for ([a, b], n) in free {
            let (a, b) = (mesh.vertices[a as usize], mesh.vertices[b as usize]);
            if n == 1 && (on_window(&a) || on_window(&b)) {
                assert!(a.x < 0.0 && b.x < 0.0 && a.z < 29.0, "a hole from {a:?} to {b:?}");
            }
        }
        for e in &mesh.elements {
            let p = mesh.corners(e);
            let flat = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
            assert!(flat.dot(&p.iter().sum::<Vec3>().normalize()) > 0.9, "{style:?} {p:?}");
        }
    }
}

#[test]
fn three_sided_faces_get_triangles_or_three_blocks() {
    let wall = Curve3::line(at(10.0, 0.0, 0.0), at(10.0, 0.0, 12.0));
    let wall = Surface::revolution(&wall, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let [[u0, u1], [v0, v1]] = wall.domain();
    let c = [Vec2::new(u0, v0), Vec2::new(u1, v0), Vec2::new(u0, v1)];
    let sides = (0..3).map(|k| {
        let (a, b) = (c[k], c[(k + 1) % 3]);
        let n = 64;
        let points = (0..=n).map(|i| wall.point(a + (b - a) * (f64::from(i) / f64::from(n))));
        let knots = [0, 0].into_iter().chain(1..n).chain([n, n]).map(f64::from).collect();
        (Curve2::line(a, b), Curve3::try_new(1, knots, points.collect(), None).unwrap())
    });
    let loops = vec![sides.collect()];
    let model = Builder::default().face(wall, SurfaceKind::Cylinder, loops).model;
    let count = |style| {
        let mesh = mesh(&model, &options(3, style)).unwrap();
        assert_conforming(&mesh);
        assert!((mesh.area() / (FRAC_PI_2 * 60.0) - 1.0).abs() < 0.03);
        let quads = mesh.elements.iter().filter(|e| e.nodes().len() == 4).count();
        (quads, mesh.elements.len() - quads)
    };
    assert_eq!(count(MeshStyle::Mixed), (0, 9));
    // Three divisions become four: three blocks of two by two.
    assert_eq!(count(MeshStyle::Structured), (12, 0));
    assert_eq!(count(MeshStyle::Quads), (12, 0));
}

#[test]
fn a_gap_bridged_back_over_the_side_before_it_is_no_side() {
    // The first side overshoots by 2e-6 of its length; the closing segment runs back over it.
    let p = |x, y| at(x, y, 0.0);
    let plate = Surface::plane(&Frame::world(), [0.0, 11.0], [0.0, 10.0]);
    let border = vec![
        line(p(0.0, 0.0), p(10.0, 0.0)),
        line(p(10.0, 0.0), p(10.0, 10.0)),
        line(p(10.0, 10.0), p(0.0, 10.0)),
        line(p(0.0, 10.0), p(0.0, 0.0)),
    ];
    let mut model = Builder::default().face(plate, SurfaceKind::Plane, vec![border]).model;
    let (over, corner) = (Vec2::new(10.000_02, 0.0), Vec2::new(10.0, 0.0));
    let uses = &mut model.faces[0].loops[0].uses;
    uses[0].pcurve = Curve2::line(Vec2::zeros(), over);
    uses.insert(1, EdgeUse { pcurve: Curve2::line(over, corner), edge: None, reversed: false });
    for style in [MeshStyle::Structured, MeshStyle::Triangles] {
        let mesh = mesh(&model, &options(2, style)).unwrap();
        assert_conforming(&mesh);
        assert!((mesh.area() - 100.0).abs() < 1e-9, "{}", mesh.area());
    }
    // On a surface that degenerates to a point there the same segment is a pole: a side of its own.
    let cone = Curve3::line(at(0.0, 0.0, 0.0), at(10.0, 0.0, -10.0));
    let cone = Surface::revolution(&cone, Vec3::zeros(), Vec3::z(), [0.0, FRAC_PI_2]);
    let model = Builder::default().patch(cone, SurfaceKind::Cone).model;
    let mesh = mesh(&model, &options(4, MeshStyle::Structured)).unwrap();
    assert!(
        (mesh.area() / (FRAC_PI_2 * 50.0 * 2.0f64.sqrt()) - 1.0).abs() < 0.02,
        "{}",
        mesh.area()
    );
}

#[test]
fn a_hole_may_touch_the_border_at_a_vertex() {
    let p = |x, y| at(x, y, 0.0);
    let plate = Surface::plane(&Frame::world(), [-10.0, 10.0], [0.0, 20.0]);
    let border = vec![
        line(p(0.0, 0.0), p(10.0, 0.0)),
        line(p(10.0, 0.0), p(10.0, 20.0)),
        line(p(10.0, 20.0), p(-10.0, 20.0)),
        line(p(-10.0, 20.0), p(-10.0, 0.0)),
        line(p(-10.0, 0.0), p(0.0, 0.0)),
    ];
    let centre = Frame { origin: p(0.0, 4.0), x: -Vec3::y(), y: Vec3::x(), z: Vec3::z() };
    let circle = Curve3::ellipse_arc(&centre, 4.0, 4.0, 0.0, 2.0 * PI).reversed();
    let mut model = Builder::default()
        .face(plate, SurfaceKind::Plane, vec![border, vec![flat_side(circle)]])
        .model;
    // Where the loops meet their parameters are equal to rounding.
    let hole = &mut model.faces[0].loops[1].uses[0].pcurve;
    *hole = hole.with_start(Vec2::new(3e-16, -4e-15)).with_end(Vec2::new(-2e-16, -4e-15));
    let mesh = mesh(&model, &options(16, MeshStyle::Triangles)).unwrap();
    assert!((mesh.area() / (400.0 - 16.0 * PI) - 1.0).abs() < 1e-3, "{}", mesh.area());
}

#[test]
fn a_face_of_no_area_gets_no_elements_and_one_with_an_area_is_not_left_out() {
    let p = |x, y| at(x, y, 0.0);
    let round =
        |corners: [Vec3; 4]| (0..4).map(|k| line(corners[k], corners[(k + 1) % 4])).collect();
    let beside =
        |border: Vec<builder::Side>| {
            let plate = Surface::plane(&Frame::world(), [0.0, 10.0], [-1.0, 1.0]);
            let square = round([p(0.0, 0.0), p(0.0, -1.0), p(10.0, -1.0), p(10.0, 0.0)]);
            let faces = Builder::default()
                .face(plate.clone(), SurfaceKind::Plane, vec![square])
                .face(plate, SurfaceKind::Plane, vec![border]);
            let model = Model { join_tolerance: 1e-5, ..faces.model };
            mesh(&model, &options(2, MeshStyle::Structured))
        };
    let (start, end) = (p(0.0, 0.0), p(10.0, 1e-6));
    let mesh = beside(vec![line(start, end), line(end, start)]).unwrap();
    assert!(mesh.elements.iter().all(|e| e.face == 0) && (mesh.area() - 10.0).abs() < 1e-9);
    // A boundary that intersects itself with enclosed area is an error of the file and reported.
    let tie = round([p(0.0, 0.0), p(10.0, 1.0), p(10.0, 0.0), p(0.0, 0.2)]);
    let Err(MeshError::Faces { count, face, .. }) = beside(tie) else { panic!("no error") };
    assert_eq!((count, face), (1, 1));
}
