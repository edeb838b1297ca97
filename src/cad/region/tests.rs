//! Tests of the region of a closed curve: areas of cut planes, cylinders, spheres, tori and solids.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use super::{PlanCurve, RegionError, split};
use crate::build::{Creases, build};
use crate::model::Model;
use crate::raw::{RawFace, RawModel, RawSurface};
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Frame, Vec2, Vec3};

fn fixture(name: &str) -> Model {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures").join(name);
    crate::read_with(&path, Creases::Cut).unwrap().0
}

fn circle(x: f64, y: f64, radius: f64) -> PlanCurve {
    let frame = Frame { origin: Vec3::new(x, y, 0.0), ..Frame::world() };
    PlanCurve::of_curves(&[Curve3::ellipse_arc(&frame, radius, radius, 0.0, TAU)], 1e-6).unwrap()
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> PlanCurve {
    PlanCurve::polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]]).unwrap()
}

/// Areas inside and outside, after checks that both models together have the area, the closed edges and the numbers of
/// the whole.
fn areas(model: &Model, curve: &PlanCurve) -> [f64; 2] {
    let whole = model.area();
    let found = split(model, curve, true).unwrap_or_else(|e| panic!("{e}"));
    let open = |m: &Model| m.edges.iter().filter(|e| e.uses.len() == 1).count();
    let bad = found.model.edges.iter().filter(|e| e.uses.is_empty() || e.uses.len() > 2).count();
    let length = |m: &Model| {
        let free = m.edges.iter().filter(|e| e.uses.len() == 1);
        free.map(|e| e.curve.length()).sum::<f64>()
    };
    assert_eq!(bad, 0, "edges of no or more than two uses");
    assert!(
        (length(&found.model) - length(model)).abs() < 1e-3 * (1.0 + length(model)),
        "free edges {} of {}",
        open(&found.model),
        open(model)
    );
    let area = |inside: bool| {
        let own = (0..found.inside.len()).filter(|&f| found.inside[f] == inside);
        own.map(|f| found.model.faces[f].area(1e-9)).sum::<f64>()
    };
    let both = [area(true), area(false)];
    assert!((both[0] + both[1] - whole).abs() < 1e-6 * whole, "{both:?} of {whole}");
    // The borders of both halves lie above the curve.
    for edge in &found.model.edges {
        let [a, b] = edge.uses[..] else { continue };
        if found.inside[a[0]] != found.inside[b[0]] {
            let [s, t] = edge.curve.domain();
            for k in 0..=20 {
                let p = edge.curve.point(s + (t - s) * f64::from(k) / 20.0);
                let off = curve.near(Vec2::new(p.x, p.y)).signed.abs();
                assert!(off < 2.0 * model.join_tolerance, "{off} off at {p:?}");
            }
        }
    }
    both
}

fn near(found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-6, "{found} for {exact}");
}

#[test]
fn a_block_cut_by_a_rectangle_inside_it_has_two_discs_within() {
    let model = fixture("bodies/press.stp");
    let [inside, _] = areas(&model, &rectangle([30.0, 30.0], [50.0, 45.0]));
    // Top and bottom of die and punch.
    near(inside, 4.0 * 20.0 * 15.0);
}

#[test]
fn walls_and_corners_of_blocks_are_cut_along_vertical_lines() {
    let model = fixture("bodies/press.igs");
    let [inside, _] = areas(&model, &rectangle([-5.0, -7.0], [10.0, 33.0]));
    // The die and the binder: both flat faces, the walls x = 0 and y = 0.
    near(inside, 4.0 * 10.0 * 33.0 + 20.0 * (10.0 + 33.0) + 10.0 * (10.0 + 33.0));
    // An edge of the polygon with a corner on a face, and one outside.
    let triangle = PlanCurve::polygon(&[[50.0, 40.0], [200.0, 40.0], [50.0, 300.0]]).unwrap();
    areas(&model, &triangle);
}

#[test]
fn everything_or_nothing_is_inside_a_curve_around_or_beside_it() {
    let model = fixture("bodies/press.stp");
    let found = split(&model, &circle(50.0, 40.0, 200.0), true).unwrap();
    assert!(found.inside.iter().all(|x| *x) && found.model.faces.len() == 22);
    let found = split(&model, &circle(500.0, 40.0, 200.0), true).unwrap();
    assert!(!found.inside.iter().any(|x| *x) && found.model.faces.len() == 22);
}

#[test]
fn a_circle_about_the_axis_of_a_sphere_cuts_two_caps() {
    let ball = fixture("forming/sphere_AP214.stp");
    let (low, high) = (ball.bbox().min, ball.bbox().max);
    let (r, c) = (0.5 * (high.x - low.x), 0.5 * (low + high));
    let [inside, _] = areas(&ball, &circle(c.x, c.y, 0.6 * r));
    // Caps of height r (1 - 0.8).
    near(inside, ball.area() * 0.2);
    let off = areas(&ball, &circle(c.x + 0.3 * r, c.y - 0.2 * r, 0.45 * r));
    assert!(off[0] > 0.1 * off[1] && off[0] < 0.5 * off[1], "{off:?}");
}

#[test]
fn dies_are_cut_across_their_radii() {
    for name in [
        "forming/cross_die_AP214.stp",
        "forming/round_die_144.igs",
        "forming/square_punch_AP214.stp",
        "turned/dome_360.stp",
    ] {
        let model = fixture(name);
        let b = model.bbox();
        let (c, size) = (0.5 * (b.min + b.max), b.max - b.min);
        let [inside, outside] =
            areas(&model, &circle(c.x + 0.11 * size.x, c.y - 0.07 * size.y, 0.23 * size.x));
        assert!(inside > 0.0 && outside > 0.0, "{name}");
        let (low, high) = (
            [c.x - 0.31 * size.x, c.y - 0.27 * size.y],
            [c.x + 0.21 * size.x, c.y + 0.36 * size.y],
        );
        let [inside, outside] = areas(&model, &rectangle(low, high));
        assert!(inside > 0.0 && outside > 0.0, "{name}");
    }
}

#[test]
fn closed_cuts_beside_the_axis_of_a_cone_are_found_once() {
    let model = fixture("forming/frustum_144.igs");
    let small = PlanCurve::polygon(&[[-20.0, 12.0], [-22.0, 14.0], [-24.0, 10.0]]).unwrap();
    // A wall of radius 30 to 15 over 20 mm, and the floor.
    near(areas(&model, &small)[0], 6.0 + 6.0 * 25.0 / 15.0);
    let large =
        PlanCurve::polygon(&[[-16.0, 21.0], [-24.0, 16.0], [-24.0, 9.0], [-15.0, 3.0]]).unwrap();
    areas(&model, &large);
}

#[test]
fn cuts_pass_creases_of_a_surface() {
    // A roof: bilinear on both sides of its ridge x = 0.
    let points = [[-10.0, 0.0], [0.0, 6.0], [10.0, 0.0]]
        .map(|[x, z]| [-8.0, 8.0].map(|y| Vec3::new(x, y, z)));
    let knots = [vec![0.0, 0.0, 0.5, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    let surface =
        kanagata_geometry::nurbs::Surface::try_new([1, 1], knots, points.concat(), None).unwrap();
    let surface = RawSurface::Nurbs(surface);
    let face = RawFace {
        surface,
        loops: vec![],
        flipped: false,
        source: "roof".into(),
        shell: None,
        attributes: Default::default(),
    };
    let (model, _) = build(RawModel { faces: vec![face], ..RawModel::default() }, "roof");
    let slope = (1.0f64 + 0.36).sqrt();
    near(areas(&model, &rectangle([-3.0, -2.0], [5.0, 4.0]))[0], 48.0 * slope);
    let triangle = PlanCurve::polygon(&[[-6.0, -20.0], [7.0, 0.0], [-6.0, 5.0]]).unwrap();
    let [inside, _] = areas(&model, &triangle);
    assert!(inside > 30.0 * slope, "{inside}");
}

#[test]
fn a_torus_and_a_cylinder_are_cut_off_their_axes() {
    let ring =
        RawSurface::Torus { frame: Frame::world(), major: 10.0, minor: 3.0, keep_outer: None };
    let face = RawFace {
        surface: ring,
        loops: vec![],
        flipped: false,
        source: "ring".into(),
        shell: None,
        attributes: Default::default(),
    };
    let (model, said) = build(RawModel { faces: vec![face], ..RawModel::default() }, "ring");
    assert!(said.is_empty(), "{said:?}");
    near(model.area(), 4.0 * PI * PI * 30.0);
    let [half, _] = areas(&model, &rectangle([0.5, -20.0], [20.0, 20.0]));
    assert!(half < 0.5 * model.area() && half > 0.45 * model.area());
    areas(&model, &circle(9.0, 1.0, 4.5));
    areas(&model, &circle(0.0, 0.0, 10.0));
}

#[test]
fn curves_that_are_no_region_are_refused_in_words() {
    let text = |corners: &[[f64; 2]]| PlanCurve::polygon(corners).unwrap_err().to_string();
    assert!(text(&[[0.0, 0.0], [1.0, 0.0]]).contains("2 different points"));
    assert!(text(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).contains("without area"));
    assert!(text(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]).contains("crosses itself"));
    assert!(text(&[[0.0, 0.0], [f64::NAN, 0.0], [0.0, 1.0]]).contains("not finite"));
    let line = |a: [f64; 3], b: [f64; 3]| Curve3::line(Vec3::from(a), Vec3::from(b));
    let open = [line([0.0; 3], [1.0, 0.0, 0.0]), line([1.0, 0.0, 0.0], [1.0, 1.0, 5.0])];
    let error = PlanCurve::of_curves(&open, 1e-6).unwrap_err();
    assert!(
        matches!(&error, RegionError::Curve { .. }) && error.to_string().contains("open curve"),
        "{error}"
    );
    let apart = [open[0].clone(), line([5.0, 0.0, 0.0], [6.0, 0.0, 0.0])];
    assert!(
        PlanCurve::of_curves(&apart, 1e-6)
            .unwrap_err()
            .to_string()
            .contains("2 curves, of which 1")
    );
    // Any order and direction, at any height.
    let closed = [
        line([0.0; 3], [4.0, 0.0, 0.0]),
        line([0.0, 3.0, 9.0], [4.0, 0.0, 0.0]),
        line([0.0, 3.0, 2.0], [0.0; 3]),
    ];
    assert_eq!(PlanCurve::of_curves(&closed, 1e-6).unwrap().pieces().len(), 3);
}

#[test]
fn signed_distances_are_positive_inside_also_at_corners() {
    let l = PlanCurve::polygon(&[
        [0.0, 0.0],
        [0.0, 4.0],
        [2.0, 4.0],
        [2.0, 2.0],
        [4.0, 2.0],
        [4.0, 0.0],
    ])
    .unwrap();
    let signed = |x: f64, y: f64| l.near(Vec2::new(x, y)).signed;
    let table = [
        (1.0, 1.0, 1.0),
        (3.0, 3.0, -1.0),
        (5.0, 3.0, -2f64.sqrt()),
        (-1.0, -1.0, -2f64.sqrt()),
        (1.9, 1.9, 0.02f64.sqrt()),
        (3.0, 0.5, 0.5),
    ];
    for (x, y, exact) in table {
        assert!((signed(x, y) - exact).abs() < 1e-12, "{x} {y}: {}", signed(x, y));
    }
    let round = circle(1.0, 2.0, 3.0);
    assert!((round.near(Vec2::new(1.5, 2.0)).signed - 2.5).abs() < 1e-9);
    assert!((round.near(Vec2::new(1.0, 7.0)).signed + 2.0).abs() < 1e-9);
}

/// Area inside a polygon, or `None` for a face that is refused.
fn area_within(model: &Model, corners: &[[f64; 2]]) -> Option<f64> {
    let found = split(model, &PlanCurve::polygon(corners).unwrap(), true).ok()?;
    let own = (0..found.inside.len()).filter(|&f| found.inside[f]);
    Some(own.map(|f| found.model.faces[f].area(1e-10)).sum())
}

/// Cuts that lose a corner, a second sheet or a part are not seen by the sum of both halves, which share the cut: a
/// quadrilateral has the area of its two triangles.
#[test]
fn a_quadrilateral_has_the_area_of_its_triangles() {
    let (mut compared, mut refused) = (0, 0);
    for name in ["bodies/press.stp", "forming/torus_AP214.stp", "forming/cross_die_AP214.stp"] {
        let model = fixture(name);
        let b = model.bbox();
        let size = b.max - b.min;
        for k in 0..14 {
            let turn = 0.7 * f64::from(k);
            let place = |a: f64| 0.5 + 0.37 * (f64::from(k) * a).sin();
            let c = [b.min.x + size.x * place(1.3), b.min.y + size.y * place(2.1)];
            let radius = size.x * [0.013, 0.04, 0.11][k as usize % 3];
            let corner = |j: u32| {
                let angle = turn + TAU * (f64::from(j) + 0.2 * f64::from(k + j).sin()) / 4.0;
                [c[0] + radius * angle.cos(), c[1] + radius * angle.sin()]
            };
            let q = [0, 1, 2, 3].map(corner);
            let parts = [&q[..], &[q[0], q[1], q[2]], &[q[0], q[2], q[3]]];
            let [Some(whole), Some(one), Some(other)] = parts.map(|p| area_within(&model, p))
            else {
                refused += 1;
                continue;
            };
            compared += 1;
            let slack = 1e-6 * whole + 8.0 * radius * model.join_tolerance;
            assert!((whole - one - other).abs() < slack, "{name} {k}: {whole} {one} {other}");
        }
    }
    assert!(compared >= 36 && refused <= 6, "{compared} compared, {refused} refused");
}

/// Walls that run along the curve are on neither side.
#[test]
fn walls_along_the_curve_are_refused() {
    let model = fixture("bodies/press.stp");
    let b = model.bbox();
    let error = split(&model, &rectangle([b.min.x, b.min.y], [b.max.x, b.max.y]), true);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("runs along the curve"), "{error}");
}
