//! Offsets of models: closed forms, splines, and places where there is no offset.

use std::path::Path;

use super::curvature::principal_curvatures;
use super::tests::{area_by_definition, panel};
use super::{OffsetError, offset_model, offset_model_again};
use crate::Model;
use crate::build::build;
use crate::closest::ClosestPoint;
use crate::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
use crate::trim_region::TrimRegion;
use kanagata_geometry::nurbs::{Curve2, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

const SMOOTH_DEG: f64 = 0.5;

fn fixture(name: &str) -> Model {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming")
        .join(name);
    crate::read(&path).unwrap().0
}

/// A face over a rectangle of parameters; the whole surface without one.
fn raw_face(surface: RawSurface, rectangle: Option<[[f64; 2]; 2]>, flipped: bool) -> RawFace {
    let ring = |[u, v]: [[f64; 2]; 2]| {
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Vec2::new(u[i], v[j]));
        let edge = |k: usize| RawEdge {
            pcurve: Some(Curve2::line(corners[k], corners[(k + 1) % 4])),
            ..RawEdge::default()
        };
        let mut ring = RawLoop { outer: None, edges: (0..4).map(edge).collect(), vertex: None };
        if flipped {
            ring.reverse();
        }
        ring
    };
    RawFace {
        surface,
        loops: rectangle.map(ring).into_iter().collect(),
        flipped,
        source: "#7".into(),
        shell: None,
        attributes: Default::default(),
    }
}

fn model_of(faces: Vec<RawFace>) -> Model {
    let (model, diagnostics) = build(RawModel { faces, ..RawModel::default() }, "faces");
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    model
}

/// Points of the faces of a model within their loops.
fn points(model: &Model) -> Vec<(usize, Vec2)> {
    let mut out = Vec::new();
    for (f, face) in model.faces.iter().enumerate() {
        let region = TrimRegion::new(face);
        let size = region.high - region.low;
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            let step = |k: u32| (f64::from(k) + 0.37) / 9.0;
            let uv = region.low + Vec2::new(size.x * step(i), size.y * step(j));
            if region.contains(uv) {
                out.push((f, uv));
            }
        }
    }
    out
}

#[test]
fn planes_quadrics_and_tori_stay_exact_with_their_parameters() {
    let frame =
        Frame::from_z_x(Vec3::new(3.0, -2.0, 1.0), Vec3::new(0.2, 0.5, 1.0), Vec3::x()).unwrap();
    let surfaces = [
        (RawSurface::Plane(frame), Some([[-4.0, 6.0], [1.0, 9.0]])),
        (RawSurface::Cylinder { frame, radius: 7.0 }, Some([[0.3, 2.4], [-5.0, 8.0]])),
        (RawSurface::Cone { frame, radius: 9.0, semi_angle: 0.4 }, Some([[0.3, 2.4], [-3.0, 8.0]])),
        (RawSurface::Sphere { frame, radius: 6.0 }, Some([[0.3, 2.4], [-0.7, 1.1]])),
        (RawSurface::Sphere { frame, radius: 6.0 }, None),
        (
            RawSurface::Torus { frame, major: 12.0, minor: 5.0, keep_outer: None },
            Some([[0.3, 2.4], [-0.7, 2.1]]),
        ),
        (RawSurface::Torus { frame, major: 12.0, minor: 5.0, keep_outer: None }, None),
    ];
    for (surface, rectangle) in surfaces {
        for (distance, flipped) in [(1.5, false), (1.5, true), (-1.5, false)] {
            let model = model_of(vec![raw_face(surface.clone(), rectangle, flipped)]);
            let made = offset_model(&model, distance, SMOOTH_DEG).unwrap();
            let offset = &made.model;
            assert_eq!(made.report.fitted, 0, "{surface:?}");
            let search = ClosestPoint::new(offset);
            for (f, uv) in points(&model) {
                let n = model.faces[f].normal(uv).unwrap();
                let expected = model.faces[f].surface.point(uv) + n * distance;
                let found = offset.faces[f].surface.point(uv);
                assert!((found - expected).norm() < 1e-12 * 30.0, "{surface:?} {uv}");
                let m = offset.faces[f].normal(uv).unwrap();
                assert!((m - n).norm() < 1e-12, "{surface:?} {uv}");
                // The closed form behind the closest point has moved with the surface.
                let foot = search.closest(&(expected + n * 0.1)).unwrap();
                assert!((foot.point - expected).norm() < 1e-9, "{surface:?} {uv}");
            }
            let [least, most] = made.report.distances_mm;
            assert!((least - 1.5).abs() < 1e-9 && (most - 1.5).abs() < 1e-9, "{least} {most}");
        }
    }
}

#[test]
fn the_offset_of_a_die_is_joined_and_at_its_distance_with_exact_and_fitted_faces() {
    for distance in [0.8, -1.1] {
        let exact = offset_model(&fixture("cross_die_144.igs"), distance, SMOOTH_DEG).unwrap();
        let fitted =
            offset_model(&fixture("cross_die_nurbs144.igs"), distance, SMOOTH_DEG).unwrap();
        assert_eq!(exact.report.fitted, 0);
        assert!(fitted.report.fitted > 0 && fitted.report.tolerance_mm < 1e-5);
        let areas = [exact.model.area(), fitted.model.area()];
        assert!((areas[0] - areas[1]).abs() < 1e-7 * areas[0], "{areas:?}");
        for made in [&exact, &fitted] {
            let report = &made.report;
            let off = report.distances_mm.map(|d| (d - distance.abs()).abs());
            assert!(off.iter().all(|o| *o <= 1e-9 + report.tolerance_mm), "{report:?}");
            assert!(report.gap.distance < 1e-6 && report.complete, "{report:?}");
        }
        for (name, made) in [("cross_die_144.igs", &exact), ("cross_die_nurbs144.igs", &fitted)] {
            let model = fixture(name);
            let search = ClosestPoint::new(&model);
            for (edge, before) in made.model.edges.iter().zip(&model.edges) {
                assert_eq!((&edge.uses, edge.vertices), (&before.uses, before.vertices));
                let [a, b] = edge.curve.domain();
                for k in 0..=10 {
                    let p = edge.curve.point(a + (b - a) * f64::from(k) / 10.0);
                    let off = (search.closest(&p).unwrap().distance - distance.abs()).abs();
                    assert!(off < 1e-5, "{off:e}");
                }
                for (v, t) in edge.vertices.into_iter().zip([a, b]) {
                    assert!((made.model.vertices[v] - edge.curve.point(t)).norm() < 1e-5);
                }
            }
        }
    }
}

#[test]
fn a_spline_is_fitted_within_its_loops_and_has_the_curvatures_of_the_offset() {
    let base = panel([12, 9]);
    let rectangle = [[1.3, 9.6], [2.2, 8.1]];
    for (distance, flipped) in [(0.8, false), (-2.0, false), (1.2, true)] {
        let model =
            model_of(vec![raw_face(RawSurface::Nurbs(base.clone()), Some(rectangle), flipped)]);
        let made = offset_model(&model, distance, SMOOTH_DEG).unwrap();
        let (face, before) = (&made.model.faces[0], &model.faces[0]);
        assert_eq!((made.report.fitted, face.surface.domain()), (1, rectangle));
        let signed = if flipped { -distance } else { distance };
        let expected = area_by_definition(&base, signed, rectangle, 2);
        let off = (face.area(1e-10) - expected).abs() / expected;
        assert!(off < 1e-7, "{off:e}");
        for (_, uv) in points(&model) {
            let expected = before.surface.point(uv) + before.normal(uv).unwrap() * distance;
            let off = (face.surface.point(uv) - expected).norm();
            assert!(off <= made.report.tolerance_mm, "{off:e}");
            let of =
                |f: &crate::model::Face| principal_curvatures(f, &f.surface.derivs(uv)).unwrap();
            let expected = of(before).map(|k| k / (1.0 + distance * k));
            for (found, expected) in of(face).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4 * (0.1 + expected.abs()), "{uv}");
            }
        }
        assert_eq!(offset_model_again(&model, distance).unwrap().faces[0].surface, face.surface);
    }
}

#[test]
fn an_offset_beyond_a_radius_is_refused_with_the_radius_and_its_place() {
    for name in ["square_die_144.igs", "square_die_nurbs144.igs"] {
        let model = fixture(name);
        for sign in [1.0, -1.0] {
            let radius = offset_model(&model, sign * 0.5, SMOOTH_DEG).unwrap().report.radius_mm;
            // The smallest radius on the side does not depend on the distance.
            let again = offset_model(&model, sign * 0.9, SMOOTH_DEG).unwrap().report.radius_mm;
            assert!((radius - again).abs() < 1e-3 * radius, "{radius} {again}");
            let distance = sign * 1.01 * radius;
            let error = offset_model(&model, distance, SMOOTH_DEG).unwrap_err();
            let said = error.to_string();
            let OffsetError::Folds { places, .. } = error else { panic!("{said}") };
            println!("{said}");
            assert!(said.contains(&format!("radius {:.1}", places[0].radius)), "{said}");
            for place in &places {
                assert!(place.radius < distance.abs() && place.radius > 0.999 * radius, "{said}");
                let foot = ClosestPoint::new(&model).closest(&place.at).unwrap();
                assert!(foot.distance < 1e-6, "the place is on the die");
            }
        }
    }
}

/// The tightest place of a wavy panel lies between all samples of a coarse grid: compared with a search over 600 x 600
/// points.
#[test]
fn the_smallest_radius_of_a_spline_is_found_between_the_knots() {
    let base = panel([12, 9]);
    let rectangle = [[1.3, 9.6], [2.2, 8.1]];
    let model = model_of(vec![raw_face(RawSurface::Nurbs(base), Some(rectangle), false)]);
    for distance in [1.0, -1.0] {
        let found = offset_model(&model, distance, SMOOTH_DEG).unwrap().report.radius_mm;
        let face = &model.faces[0];
        let [[u0, u1], [v0, v1]] = rectangle;
        let mut bent = 0.0_f64;
        for (i, j) in (0..=600).flat_map(|i| (0..=600).map(move |j| (f64::from(i), f64::from(j)))) {
            let uv = Vec2::new(u0 + (u1 - u0) * i / 600.0, v0 + (v1 - v0) * j / 600.0);
            let curvatures = principal_curvatures(face, &face.surface.derivs(uv)).unwrap();
            bent = curvatures.into_iter().fold(bent, |m, k| m.max(-k * distance));
        }
        // Within the accuracy of the search, and below it by no more than samples 0.14 mm apart can miss.
        assert!(1.0 / found >= bent - 2e-6, "{found} {}", 1.0 / bent);
        assert!(1.0 / found < 1.01 * bent, "{found} {}", 1.0 / bent);
    }
}

#[test]
fn sharp_edges_and_apexes_are_refused_by_place() {
    let cylinder = fixture("cylinder_144.igs");
    for (distance, opens) in [(0.8, true), (-0.8, false)] {
        let error = offset_model(&cylinder, distance, SMOOTH_DEG).unwrap_err();
        let said = error.to_string();
        let OffsetError::Sharp { places, .. } = error else { panic!("{said}") };
        assert_eq!(places.len(), 2, "{said}");
        for place in places {
            assert!((place.angle_deg - 90.0).abs() < 1e-6 && place.opens == opens, "{said}");
            assert!((place.at.xy().norm() - 20.0).abs() < 1e-6, "{said}");
        }
        assert!(said.contains("90.0 degrees") && said.contains("choose faces"), "{said}");
    }
    let error = offset_model(&fixture("cone_144.igs"), 0.8, SMOOTH_DEG).unwrap_err();
    let said = error.to_string();
    let OffsetError::Sharp { places, .. } = error else { panic!("{said}") };
    let apex = places.iter().find(|p| p.faces[0] == p.faces[1]).unwrap();
    assert!(apex.opens && said.contains("in face"), "{said}");
    // Numbers of the complete file.
    let renumbered = OffsetError::Sharp { distance: 0.8, smooth_deg: 0.5, places }
        .renumbered(|f| f + 100)
        .to_string();
    assert!(renumbered.contains("in face 10"), "{renumbered}");
}

/// A plate of 400 x 400 mm with its normal up, and a ball of radius 0.5 mm that hovers over it by `gap` [mm].
fn plate_and_ball(gap: f64) -> Model {
    let frame = Frame { origin: Vec3::new(37.3, -81.9, gap + 0.5), ..Frame::world() };
    model_of(vec![
        raw_face(RawSurface::Plane(Frame::world()), Some([[-200.0, 200.0]; 2]), false),
        raw_face(RawSurface::Sphere { frame, radius: 0.5 }, None, false),
    ])
}

#[test]
fn parts_that_are_closer_than_the_offset_are_refused_by_place() {
    let error = offset_model(&plate_and_ball(1.0), 0.8, SMOOTH_DEG).unwrap_err();
    let said = error.to_string();
    let OffsetError::Overlaps { places, .. } = error else { panic!("{said}") };
    // The point of the plate below the ball is 0.2 mm from it, within the cells of 0.2 mm.
    assert!(places[0].distance > 0.2 - 1e-9 && places[0].distance < 0.25, "{said}");
    for place in places.iter().filter(|p| p.faces == [0, 1]) {
        assert!((place.at.xy() - Vec3::new(37.3, -81.9, 0.0).xy()).norm() < 1.1, "{said}");
    }
    assert!(said.contains("intersects itself"), "{said}");
    assert!(places.iter().any(|p| p.faces == [0, 1]) && places.iter().any(|p| p.faces == [1, 0]));
    // Balls of the radius 0.8 that touch the plate reach up to 1.6: a gap above that, or the other side.
    assert!(offset_model(&plate_and_ball(1.61), 0.8, SMOOTH_DEG).is_ok());
    assert!(offset_model(&plate_and_ball(1.0), -0.4, SMOOTH_DEG).is_ok());
}

#[test]
fn distances_that_are_none_are_refused() {
    let model = plate_and_ball(5.0);
    for bad in [0.0, f64::NAN, f64::INFINITY] {
        let error = offset_model(&model, bad, SMOOTH_DEG).unwrap_err();
        assert!(error.to_string().contains("allowed: a finite distance"), "{error}");
    }
    // A flat spline is moved as it is.
    let mut flat = model.clone();
    flat.faces[0].analytic = None;
    let made = offset_model(&flat, -0.4, SMOOTH_DEG).unwrap();
    let points = made.model.faces[0].surface.points();
    assert!(points.len() == 4 && points.iter().all(|p| p.z == -0.4), "{points:?}");
    assert_eq!(made.report.fitted, 0);
    // Without an area, and with a normal only on one side of a fold.
    let flat = Surface::try_new(
        [1, 1],
        [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        [0.0, 1.0, 2.0, 3.0].map(|x| Vec3::new(x, 0.0, 0.0)).to_vec(),
        None,
    );
    let mut line = model;
    line.faces[0].surface = flat.unwrap();
    line.faces[0].analytic = None;
    let error = offset_model_again(&line, 1.0).unwrap_err();
    assert!(matches!(error, OffsetError::Face { face: 0, .. }), "{error}");
}
