//! Tests of faces on closed surfaces with holes, whose boundary traverses a seam in both directions.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::tests::{BALL, MAJOR, MINOR, along, model_of_numbered, sphere, torus};
use crate::model::Model;
use crate::raw::{RawEdge, RawLoop, RawSurface};

/// Edge number, and its ends in the parameter plane.
type Leg = (Option<usize>, [(f64, f64); 2]);

/// A loop of isoparametric sides between points of the parameter plane.
fn ring(on: &RawSurface, sides: &[Leg]) -> RawLoop {
    let edge = |&(edge_id, [a, b]): &Leg| RawEdge {
        curve: Some(along(on, a, b)),
        edge_id,
        ..RawEdge::default()
    };
    RawLoop { outer: None, edges: sides.iter().map(edge).collect(), vertex: None }
}

fn assert_area(model: &Model, exact: f64) {
    let area = model.faces[0].area(1e-12);
    assert!((area / exact - 1.0).abs() < 1e-9, "{area} instead of {exact}");
}

/// Number of edges traversed in both directions, including the seam of a closed surface.
fn slits(model: &Model) -> usize {
    model.edges.iter().filter(|e| e.uses.len() == 2).count()
}

/// From the hole to one pole and back, half around the hole, to the other pole and back, and around the rest.
#[test]
fn a_ball_with_a_hole_on_its_seam() {
    let on = sphere();
    let (a, b, w) = (-0.2, 0.3, 0.25);
    for numbered in [true, false] {
        for turned in [false, true] {
            let mut sides = vec![
                (0, [(0.0, b), (0.0, FRAC_PI_2)]),
                (0, [(0.0, FRAC_PI_2), (0.0, b)]),
                (1, [(0.0, b), (w, b)]),
                (2, [(w, b), (w, a)]),
                (3, [(w, a), (0.0, a)]),
                (4, [(0.0, a), (0.0, -FRAC_PI_2)]),
                (4, [(0.0, -FRAC_PI_2), (0.0, a)]),
                (5, [(0.0, a), (-w, a)]),
                (6, [(-w, a), (-w, b)]),
                (7, [(-w, b), (0.0, b)]),
            ];
            if turned {
                sides.reverse();
                sides.iter_mut().for_each(|(_, ends)| ends.reverse());
            }
            let sides: Vec<_> =
                sides.into_iter().map(|(id, ends)| (numbered.then_some(id), ends)).collect();
            for begin in 0..sides.len() {
                let mut sides = sides.clone();
                sides.rotate_left(begin);
                let model = model_of_numbered(&on, vec![ring(&on, &sides)], turned);
                let hole = 2.0 * w * (b.sin() - f64::sin(a));
                assert_area(&model, BALL * BALL * (2.0 * TAU - hole));
                assert_eq!(
                    (slits(&model), model.faces[0].loops.len()),
                    (1, 2),
                    "{numbered} {turned} {begin}"
                );
            }
        }
    }
}

/// Two holes joined by a slit.
#[test]
fn a_ball_with_two_holes_on_its_seam() {
    let on = sphere();
    let w = 0.25;
    let half = |low: f64, high: f64, w: f64, id: usize| {
        [
            (Some(id), [(0.0, high), (w, high)]),
            (Some(id + 1), [(w, high), (w, low)]),
            (Some(id + 2), [(w, low), (0.0, low)]),
        ]
    };
    let back = |of: [Leg; 3]| {
        let mut of = of.to_vec();
        of.reverse();
        of.iter_mut().for_each(|(_, ends)| ends.reverse());
        of
    };
    let mut sides =
        vec![(Some(0), [(0.0, 0.7), (0.0, FRAC_PI_2)]), (Some(0), [(0.0, FRAC_PI_2), (0.0, 0.7)])];
    sides.extend(half(0.3, 0.7, w, 10));
    sides.push((Some(1), [(0.0, 0.3), (0.0, -0.1)]));
    sides.extend(half(-0.6, -0.1, w, 20));
    sides.push((Some(2), [(0.0, -0.6), (0.0, -FRAC_PI_2)]));
    sides.push((Some(2), [(0.0, -FRAC_PI_2), (0.0, -0.6)]));
    sides.extend(back(half(-0.6, -0.1, -w, 30)));
    sides.push((Some(1), [(0.0, -0.1), (0.0, 0.3)]));
    sides.extend(back(half(0.3, 0.7, -w, 40)));
    let model = model_of_numbered(&on, vec![ring(&on, &sides)], false);
    let sines = 0.7_f64.sin() - 0.3_f64.sin() + 0.6_f64.sin() - 0.1_f64.sin();
    assert_area(&model, BALL * BALL * (2.0 * TAU - 2.0 * w * sines));
    assert_eq!((slits(&model), model.faces[0].loops.len()), (1, 3));
}

/// Sides of a boundary across both seams of a torus, connected by position only and listed in another order.
#[test]
fn a_torus_with_a_hole_whose_sides_come_in_another_order() {
    let on = torus();
    let (v, w, h) = (1.3, 0.2, 0.3);
    let sides = [
        [(0.0, v - h), (0.0, 0.0)],
        [(0.0, 0.0), (TAU, 0.0)],
        [(0.0, 0.0), (0.0, v + h - TAU)],
        [(0.0, v + h), (w, v + h)],
        [(w, v + h), (w, v - h)],
        [(w, v - h), (-w, v - h)],
        [(-w, v - h), (-w, v + h)],
        [(-w, v + h), (0.0, v + h)],
        [(0.0, v + h - TAU), (0.0, 0.0)],
        [(TAU, 0.0), (0.0, 0.0)],
        [(0.0, 0.0), (0.0, v - h)],
    ];
    for turned in [false, true] {
        let model =
            model_of_numbered(&on, vec![ring(&on, &sides.map(|ends| (None, ends)))], turned);
        let hole = 2.0 * w * MINOR * (MAJOR * 2.0 * h + MINOR * ((v + h).sin() - (v - h).sin()));
        assert_area(&model, TAU * TAU * MAJOR * MINOR - hole);
        assert_eq!(model.faces[0].loops.len(), 2);
    }
}

/// A window on a sphere or torus with a hole, whose single loop leads to the hole and back.
#[test]
fn a_window_with_a_slit_to_a_hole_in_it_is_no_hole_itself() {
    let legs = [
        (0, [(0.3, -0.6), (1.7, -0.6)]),
        (1, [(1.7, -0.6), (1.7, 0.8)]),
        (2, [(1.7, 0.8), (0.3, 0.8)]),
        (3, [(0.3, 0.8), (0.3, 0.2)]),
        (4, [(0.3, 0.2), (0.7, 0.2)]),
        (5, [(0.7, 0.2), (0.7, 0.5)]),
        (6, [(0.7, 0.5), (1.2, 0.5)]),
        (7, [(1.2, 0.5), (1.2, -0.1)]),
        (8, [(1.2, -0.1), (0.7, -0.1)]),
        (9, [(0.7, -0.1), (0.7, 0.2)]),
        (4, [(0.7, 0.2), (0.3, 0.2)]),
        (10, [(0.3, 0.2), (0.3, -0.6)]),
    ];
    let on_ball = |v: f64| BALL * BALL * v.sin();
    let on_torus = |v: f64| MINOR * (MAJOR * v + MINOR * v.sin());
    let band = |f: &dyn Fn(f64) -> f64| 1.4 * (f(0.8) - f(-0.6)) - 0.5 * (f(0.5) - f(-0.1));
    for (on, exact) in [(sphere(), band(&on_ball)), (torus(), band(&on_torus))] {
        for numbered in [true, false] {
            for begin in 0..legs.len() {
                let mut sides = legs.map(|(id, ends)| (numbered.then_some(id), ends));
                sides.rotate_left(begin);
                let model = model_of_numbered(&on, vec![ring(&on, &sides)], false);
                assert_area(&model, exact);
                assert_eq!((slits(&model), model.faces[0].loops.len()), (0, 2), "{begin}");
            }
        }
    }
}
