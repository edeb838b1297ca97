//! Tests of faces on closed surfaces against closed-form areas.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::build::build;
use crate::model::Model;
use crate::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3};
use kanagata_geometry::{Frame, Vec2, Vec3};

const CYLINDER: f64 = 10.0;
pub(super) const MAJOR: f64 = 30.0;
pub(super) const MINOR: f64 = 8.0;
pub(super) const BALL: f64 = 25.0;

fn cylinder() -> RawSurface {
    RawSurface::Cylinder { frame: Frame::world(), radius: CYLINDER }
}

pub(super) fn torus() -> RawSurface {
    RawSurface::Torus { frame: Frame::world(), major: MAJOR, minor: MINOR, keep_outer: None }
}

pub(super) fn sphere() -> RawSurface {
    RawSurface::Sphere { frame: Frame::world(), radius: BALL }
}

/// Circular arc about a centre, between two angles in either direction.
fn arc(origin: Vec3, [x, y]: [Vec3; 2], radius: f64, [from, to]: [f64; 2]) -> Curve3 {
    let frame = Frame { origin, x, y, z: x.cross(&y) };
    let rising = Curve3::ellipse_arc(&frame, radius, radius, from.min(to), from.max(to));
    if from < to { rising } else { rising.reversed() }
}

/// Isoparametric curve on a surface.
pub(super) fn along(surface: &RawSurface, a: (f64, f64), b: (f64, f64)) -> Curve3 {
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let out = x * a.0.cos() + y * a.0.sin();
    let (centre, tube) = match surface {
        RawSurface::Torus { major, minor, .. } => (*major, *minor),
        RawSurface::Sphere { radius, .. } => (0.0, *radius),
        _ => (CYLINDER, 0.0),
    };
    let height = |v: f64| if tube > 0.0 { tube * v.sin() } else { v };
    if a.1 == b.1 {
        let radius = if tube > 0.0 { centre + tube * a.1.cos() } else { centre };
        arc(z * height(a.1), [x, y], radius, [a.0, b.0])
    } else if tube > 0.0 {
        arc(out * centre, [out, z], tube, [a.1, b.1])
    } else {
        Curve3::line(out * centre + z * a.1, out * centre + z * b.1)
    }
}

/// A loop of isoparametric sides with numbered edges.
fn ring(surface: &RawSurface, points: &[(f64, f64)]) -> RawLoop {
    let edges = points.windows(2).enumerate().map(|(k, w)| RawEdge {
        curve: Some(along(surface, w[0], w[1])),
        edge_id: Some(k),
        ..RawEdge::default()
    });
    RawLoop { outer: None, edges: edges.collect(), vertex: None }
}

fn rectangle(surface: &RawSurface, [u0, u1]: [f64; 2], [v0, v1]: [f64; 2]) -> RawLoop {
    ring(surface, &[(u0, v0), (u0, v1), (u1, v1), (u1, v0), (u0, v0)])
}

/// Area of the face, with both orientations.
fn areas(surface: &RawSurface, loops: &[RawLoop]) -> [f64; 2] {
    [false, true].map(|flipped| {
        let mut loops = loops.to_vec();
        for ring in loops.iter_mut().filter(|_| flipped) {
            ring.edges.reverse();
            for edge in &mut ring.edges {
                edge.curve = edge.curve.as_ref().map(Curve3::reversed);
            }
        }
        model_of(surface, loops, flipped).faces[0].area(1e-12)
    })
}

/// A model of one face.
fn model_of(surface: &RawSurface, mut loops: Vec<RawLoop>, flipped: bool) -> Model {
    for (k, edge) in loops.iter_mut().flat_map(|l| &mut l.edges).enumerate() {
        edge.edge_id = Some(k);
    }
    model_of_numbered(surface, loops, flipped)
}

/// As `model_of`, with the given edge numbers.
pub(super) fn model_of_numbered(surface: &RawSurface, loops: Vec<RawLoop>, flipped: bool) -> Model {
    let (surface, source) = (surface.clone(), "face".into());
    let face =
        RawFace { surface, loops, flipped, source, shell: None, attributes: Default::default() };
    let (model, said) = build(RawModel { faces: vec![face], ..RawModel::default() }, "face");
    assert_eq!(model.faces.len(), 1, "{said:?}");
    assert!(said.is_empty(), "{said:?}");
    model
}

fn assert_areas(found: [f64; 2], exact: f64) {
    for area in found {
        assert!((area / exact - 1.0).abs() < 1e-9, "{area} instead of {exact}");
    }
}

#[test]
fn a_window_where_both_circles_of_a_cylinder_begin() {
    let on = cylinder();
    let whole = TAU * CYLINDER * 20.0;
    let circles = [ring(&on, &[(0.0, 0.0), (TAU, 0.0)]), ring(&on, &[(TAU, 20.0), (0.0, 20.0)])];
    for begin in [-0.9, -0.4, 0.0, 1.0] {
        let window = rectangle(&on, [begin, begin + 0.9], [5.0, 12.0]);
        let loops = [circles.as_slice(), &[window]].concat();
        assert_areas(areas(&on, &loops), whole - CYLINDER * 0.9 * 7.0);
    }
}

#[test]
fn windows_that_leave_a_cylinder_one_gap() {
    let on = cylinder();
    let begins = [0.0, 1.5, 3.0, 4.5];
    let mut loops =
        vec![ring(&on, &[(0.3, 0.0), (TAU + 0.3, 0.0)]), ring(&on, &[(TAU, 20.0), (0.0, 20.0)])];
    loops.extend(begins.map(|u| rectangle(&on, [u, u + 1.6], [2.0 + 2.0 * u, 4.0 + 2.0 * u])));
    assert_areas(areas(&on, &loops), CYLINDER * (TAU * 20.0 - 4.0 * 1.6 * 2.0));
}

#[test]
fn a_band_of_a_torus_whose_border_hangs_over_its_beginning() {
    let on = torus();
    // A hook: back over its start, up, nearly around, down, and to the start from below.
    let hook =
        [(0.0, 1.0), (-0.4, 1.0), (-0.4, 1.5), (5.0, 1.5), (5.0, 0.5), (TAU, 0.5), (TAU, 1.0)];
    let upper: Vec<(f64, f64)> = hook.iter().rev().copied().collect();
    let loops = [ring(&on, &[(0.0, 0.0), (TAU, 0.0)]), ring(&on, &upper)];
    let below = |v: f64| MINOR * (MAJOR * v + MINOR * v.sin());
    let exact = 5.0 * below(1.5) + 0.4 * (below(1.5) - below(1.0)) + (TAU - 5.0) * below(0.5);
    assert_areas(areas(&on, &loops), exact);
}

#[test]
fn a_cap_with_a_window_where_its_border_begins() {
    let on = sphere();
    let loops = [ring(&on, &[(0.0, 0.0), (TAU, 0.0)]), rectangle(&on, [-0.5, 0.7], [0.4, 1.1])];
    let exact = BALL * BALL * (TAU - 1.2 * (1.1_f64.sin() - 0.4_f64.sin()));
    assert_areas(areas(&on, &loops), exact);
}

#[test]
fn a_ball_with_windows_on_opposite_sides() {
    let on = sphere();
    let windows = [0.0, PI, FRAC_PI_2].map(|u| rectangle(&on, [u - 0.3, u + 0.4], [-0.2, 0.5]));
    let one = 0.7 * (0.5_f64.sin() + 0.2_f64.sin());
    assert_areas(areas(&on, &windows), BALL * BALL * (2.0 * TAU - 3.0 * one));
}

#[test]
fn the_part_between_two_meridians_or_all_the_rest() {
    let on = sphere();
    let lune = [(0.3, FRAC_PI_2), (0.3, -FRAC_PI_2)];
    let back = [(1.6, -FRAC_PI_2), (1.6, FRAC_PI_2)];
    let half = |ends: [(f64, f64); 2], k: usize| RawEdge {
        curve: Some(along(&on, ends[0], ends[1])),
        edge_id: Some(k),
        ..RawEdge::default()
    };
    let inside = RawLoop { outer: None, edges: vec![half(lune, 0), half(back, 1)], vertex: None };
    assert_areas(areas(&on, &[inside]), BALL * BALL * 2.0 * 1.3);
    let [up, down] = [[back[1], back[0]], [lune[1], lune[0]]];
    let outside = RawLoop { outer: None, edges: vec![half(up, 0), half(down, 1)], vertex: None };
    assert_areas(areas(&on, &[outside]), BALL * BALL * (2.0 * TAU - 2.0 * 1.3));
}

#[test]
fn a_quarter_of_a_ball_whose_border_runs_over_the_pole_or_all_the_rest() {
    let on = sphere();
    let over = arc(Vec3::zeros(), [Vec3::y(), Vec3::z()], BALL, [0.0, PI]);
    let front = arc(Vec3::zeros(), [Vec3::x(), Vec3::y()], BALL, [-FRAC_PI_2, FRAC_PI_2]);
    let ring_of = |curves: [Curve3; 2]| {
        let edges = curves.into_iter().map(|c| RawEdge { curve: Some(c), ..RawEdge::default() });
        RawLoop { outer: None, edges: edges.collect(), vertex: None }
    };
    let quarter = ring_of([front.clone(), over.clone()]);
    assert_areas(areas(&on, &[quarter]), PI * BALL * BALL);
    let rest = ring_of([over.reversed(), front.reversed()]);
    assert_areas(areas(&on, &[rest]), 3.0 * PI * BALL * BALL);
}

#[test]
fn a_seam_stays_where_a_winding_begins_unless_something_is_in_its_way() {
    let on = cylinder();
    let circles =
        [ring(&on, &[(0.7, 0.0), (TAU + 0.7, 0.0)]), ring(&on, &[(TAU + 0.7, 20.0), (0.7, 20.0)])];
    for (window, kept) in [([1.0, 1.5], true), ([0.5, 1.0], false)] {
        let mut loops = circles.to_vec();
        loops.push(rectangle(&on, window, [5.0, 12.0]));
        let found = model_of(&on, loops, false);
        let corner = Vec3::new(CYLINDER * 0.7_f64.cos(), CYLINDER * 0.7_f64.sin(), 0.0);
        let seam = found.edges.iter().find(|e| e.uses.len() == 2).expect("a seam has two sides");
        let nearest = seam.curve.closest(&corner).1.sqrt();
        assert_eq!(nearest < 1e-9, kept, "{nearest}");
    }
}

#[test]
fn half_a_turn_between_two_sides_of_a_pole_is_no_winding() {
    let on = sphere();
    for (sign, begin) in [(1.0, 0.0), (-1.0, 0.0), (1.0, 2.5)] {
        let end = begin + sign * PI;
        let half = [(begin, -FRAC_PI_2), (begin, 0.0), (end, 0.0), (end, -FRAC_PI_2)];
        let model = model_of(&on, vec![ring(&on, &half)], sign > 0.0);
        let uses = &model.faces[0].loops[0].uses;
        assert_eq!(uses.iter().filter(|u| u.edge.is_none()).count(), 1, "{uses:?}");
        assert!((model.faces[0].area(1e-12) / (PI * BALL * BALL) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_thread_runs_round_its_cylinder_several_times() {
    let (on, turns, pitch, width) = (cylinder(), 5.25, 1.0, 0.5);
    let end = turns * TAU;
    let at =
        |u: f64, v: f64| Vec3::new(CYLINDER * u.cos(), CYLINDER * u.sin(), v + pitch * u / TAU);
    let helix = |v: f64, from: f64, to: f64| {
        let breaks: Vec<f64> = (0..=22).map(|k| f64::from(k) / 22.0).collect();
        Curve3::fitted(|t| at(from + (to - from) * t, v), &breaks, 1e-10)
    };
    let curves = [
        helix(0.0, 0.0, end),
        Curve3::line(at(end, 0.0), at(end, width)),
        helix(width, end, 0.0),
        Curve3::line(at(0.0, width), at(0.0, 0.0)),
    ];
    let edges = curves.map(|c| RawEdge { curve: Some(c), ..RawEdge::default() }).to_vec();
    let model = model_of(&on, vec![RawLoop { outer: None, edges, vertex: None }], false);
    let exact = CYLINDER * end * width;
    assert!(
        (model.faces[0].area(1e-10) / exact - 1.0).abs() < 1e-7,
        "{}",
        model.faces[0].area(1e-10)
    );
    let height = model.bbox().max.z - model.bbox().min.z;
    assert!((height - (turns * pitch + width)).abs() < 1e-6, "{height}");
}

#[test]
fn loops_that_wind_without_end_are_refused_before_their_surface_is_made() {
    let turns = 1e8;
    let corners = [(0.0, 0.0), (turns * TAU, 0.0), (turns * TAU, 1.0), (0.0, 1.0)];
    let at = |k: usize| Vec2::new(corners[k % 4].0, corners[k % 4].1);
    let edge = |k| RawEdge { pcurve: Some(Curve2::line(at(k), at(k + 1))), ..RawEdge::default() };
    let loops = vec![RawLoop { outer: None, edges: (0..4).map(edge).collect(), vertex: None }];
    let face = RawFace {
        surface: cylinder(),
        loops,
        flipped: false,
        source: "face".into(),
        shell: None,
        attributes: Default::default(),
    };
    let (model, said) = build(RawModel { faces: vec![face], ..RawModel::default() }, "face");
    assert!(model.faces.is_empty());
    assert!(said.iter().any(|d| d.text.contains("turns of the surface")), "{said:?}");
}

/// A sphere as the revolution of a profile about an axis that it crosses; a full circle covers itself.
fn turned_circle(angles: [f64; 2]) -> RawSurface {
    let frame = Frame { y: Vec3::z(), z: -Vec3::y(), ..Frame::world() };
    RawSurface::Revolution {
        generatrix: Curve3::ellipse_arc(&frame, BALL, BALL, angles[0], angles[1]),
        origin: Vec3::zeros(),
        axis: Vec3::z(),
        angles: None,
        curve_first: false,
    }
}

#[test]
fn a_profile_across_its_axis_is_taken_on_one_sheet() {
    let cap = turned_circle([-FRAC_PI_2 - 1.2, -FRAC_PI_2 + 1.2]);
    for k in 0..8 {
        let (u, rim, width) = (0.3 + 0.7 * f64::from(k), -FRAC_PI_2 + 1.0, 0.9);
        let sides = [((u, rim), (u, -FRAC_PI_2)), ((u + width, -FRAC_PI_2), (u + width, rim))];
        let round = ((u + width, rim), (u, rim));
        let curves = [sides[0], sides[1], round].map(|(a, b)| along(&sphere(), a, b));
        let edges = curves.map(|c| RawEdge { curve: Some(c), ..RawEdge::default() }).to_vec();
        let model = model_of(&cap, vec![RawLoop { outer: None, edges, vertex: None }], true);
        let uses = &model.faces[0].loops[0].uses;
        assert_eq!((uses.len(), uses.iter().filter(|u| u.edge.is_none()).count()), (4, 1), "{k}");
        let exact = width * BALL * BALL * (1.0 - 1.0f64.cos());
        assert!((model.faces[0].area(1e-12) / exact - 1.0).abs() < 1e-9, "{k}");
    }
}

/// A full band of a torus whose boundary traverses the seam in both directions; kernels write it with either
/// orientation.
#[test]
fn a_band_of_a_torus_has_its_seam_in_it_whatever_the_sense_of_its_border() {
    for [v0, v1] in [[PI, 1.5 * PI], [-0.3, 0.9], [0.5, 0.5 + 1.5 * PI]] {
        let band = rectangle(&torus(), [0.0, TAU], [v0, v1]);
        let mut turned = band.clone();
        turned.edges.reverse();
        for edge in &mut turned.edges {
            edge.curve = edge.curve.as_ref().map(Curve3::reversed);
        }
        let exact = TAU * MINOR * (MAJOR * (v1 - v0) + MINOR * (v1.sin() - v0.sin()));
        for mut ring in [band, turned] {
            // The seam is one edge with two uses.
            for (edge, id) in ring.edges.iter_mut().zip([0, 1, 0, 2]) {
                edge.edge_id = Some(id);
            }
            let source = "face".to_owned();
            let face = RawFace {
                surface: torus(),
                loops: vec![ring],
                flipped: false,
                source,
                shell: None,
                attributes: Default::default(),
            };
            let (model, said) =
                build(RawModel { faces: vec![face], ..RawModel::default() }, "face");
            let area = model.faces[0].area(1e-12);
            assert!((area / exact - 1.0).abs() < 1e-9, "{area} instead of {exact}: {said:?}");
        }
    }
}

#[test]
fn the_side_of_a_loop_tells_a_slice_from_the_rest() {
    let ball = turned_circle([-FRAC_PI_2, FRAC_PI_2]);
    let slice = |from: f64, to: f64| {
        let up = along(&sphere(), (from, -FRAC_PI_2), (from, FRAC_PI_2));
        let down = along(&sphere(), (to, FRAC_PI_2), (to, -FRAC_PI_2));
        let edges = [up, down].map(|c| RawEdge { curve: Some(c), ..RawEdge::default() }).to_vec();
        let model = model_of(&ball, vec![RawLoop { outer: None, edges, vertex: None }], false);
        model.faces[0].area(1e-12) / (2.0 * BALL * BALL)
    };
    for from in [0.0, 0.4, 3.0] {
        let (one, rest) = (slice(from + 1.0, from), slice(from, from + 1.0));
        assert!((one - 1.0).abs() < 1e-9 && (rest - (TAU - 1.0)).abs() < 1e-9, "{one} {rest}");
    }
}

/// Vertex loops at both poles of a surface of revolution mark it as closed: its other loops are holes.
#[test]
fn a_ball_of_revolution_with_vertices_at_its_poles_has_holes() {
    let ball = turned_circle([-FRAC_PI_2, FRAC_PI_2]);
    let pole = |z: f64| RawLoop { vertex: Some(Vec3::z() * z), ..RawLoop::default() };
    // Clockwise about x, seen from outside, 24 mm from the centre.
    let rim = arc(Vec3::x() * 24.0, [Vec3::y(), Vec3::z()], 7.0, [TAU, 0.0]);
    let edges = vec![RawEdge { curve: Some(rim), ..RawEdge::default() }];
    let hole = RawLoop { edges, ..RawLoop::default() };
    let model = model_of(&ball, vec![pole(-BALL), hole, pole(BALL)], false);
    let exact = 2.0 * TAU * BALL * BALL - TAU * BALL * (BALL - 24.0);
    let area = model.faces[0].area(1e-12);
    assert!((area / exact - 1.0).abs() < 1e-9, "{area} instead of {exact}");
}

#[test]
fn lines_that_end_a_hair_off_the_tip_of_a_cone_stay_straight() {
    let on = RawSurface::Cone { frame: Frame::world(), radius: 0.0, semi_angle: PI / 4.0 };
    let rim = |u: f64| Vec3::new(u.cos(), u.sin(), 1.0) * 5.0;
    // The apex as given by two edges: inaccurate by rounding, at unrelated azimuths.
    let tip = |angle: f64| Vec3::new(angle.cos(), angle.sin(), 1.0) * 1e-11;
    let curves = [
        Curve3::line(tip(2.0), rim(0.0)),
        arc(Vec3::z() * 5.0, [Vec3::x(), Vec3::y()], 5.0, [0.0, 1.0]),
        Curve3::line(rim(1.0), tip(-1.5)),
    ];
    let edges = curves.map(|c| RawEdge { curve: Some(c), ..RawEdge::default() }).to_vec();
    let model = model_of(&on, vec![RawLoop { outer: None, edges, vertex: None }], false);
    for side in &model.faces[0].loops[0].uses {
        let [a, b] = side.pcurve.domain();
        let [start, middle, end] = [a, 0.5 * (a + b), b].map(|t| side.pcurve.point(t));
        assert!((0.5 * (start + end) - middle).norm() < 1e-6, "{start} {middle} {end}");
    }
}
