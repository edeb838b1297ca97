//! Tests of splitting faces along creases.

use std::f64::consts::FRAC_PI_4;

use crate::Model;
use crate::build::{Creases, build, build_with};
use crate::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
use kanagata_geometry::Vec2;
use kanagata_geometry::Vec3;
use kanagata_geometry::nurbs::{Curve2, Surface};

/// A roof of 60 by 60 mm over u in [0, 2] and v in [0, 1] with three equal knots at u = 1, where it bends by twice
/// `angles[j]` at the j-th control point along v.
fn roof(angles: [f64; 3]) -> Surface {
    let mut points = Vec::new();
    for i in 0..7 {
        for (j, angle) in angles.iter().enumerate() {
            let x = 10.0 * f64::from(i) - 30.0;
            points.push(Vec3::new(x, 30.0 * j as f64, -x.abs() * angle.tan()));
        }
    }
    let u = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0];
    let v = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    Surface::try_new([3, 2], [u, v], points, None).unwrap()
}

/// A face bounded by polygons in the parameter plane, or by its natural boundary.
fn model(surface: Surface, rings: &[&[[f64; 2]]]) -> (Model, Vec<String>) {
    let ring = |ends: &&[[f64; 2]]| {
        let at = |k: usize| Vec2::from(ends[k % ends.len()]);
        let line = |k: usize| RawEdge {
            pcurve: Some(Curve2::line(at(k), at(k + 1))),
            ..RawEdge::default()
        };
        RawLoop { outer: None, edges: (0..ends.len()).map(line).collect(), vertex: None }
    };
    let loops = rings.iter().map(ring).collect();
    let surface = RawSurface::Nurbs(surface);
    let face = RawFace {
        surface,
        loops,
        flipped: false,
        source: "roof".into(),
        shell: None,
        attributes: Default::default(),
    };
    let (model, said) =
        build_with(RawModel { faces: vec![face], ..RawModel::default() }, "roof", Creases::Cut);
    (model, said.into_iter().map(|d| format!("{}: {}", d.code, d.text)).collect())
}

fn area(model: &Model) -> f64 {
    model.area()
}

/// Number of sides of every loop of every face.
fn sides(model: &Model) -> Vec<Vec<usize>> {
    model.faces.iter().map(|f| f.loops.iter().map(|l| l.uses.len()).collect()).collect()
}

#[test]
fn a_ridge_cuts_its_face_in_two() {
    let (model, said) = model(roof([FRAC_PI_4; 3]), &[]);
    assert_eq!(sides(&model), [[4], [4]], "{said:?}");
    assert_eq!(model.edges.iter().filter(|e| e.uses.len() == 2).count(), 1);
    assert!((area(&model) - 3600.0 * 2f64.sqrt()).abs() < 1e-6);
    assert!(said[0].contains("u = 1 (90.0 degrees); split there into 2 faces"), "{said:?}");
    for face in &model.faces {
        let along = |f: &crate::model::Face| f.normal(Vec2::new(1.0, 0.5)).unwrap();
        assert!((along(face).x.abs() - 0.5f64.sqrt()).abs() < 1e-9);
    }
    assert!(model.faces[0].normal(Vec2::new(1.0, 0.5)).unwrap().x < 0.0);
    assert!(model.faces[1].normal(Vec2::new(1.0, 0.5)).unwrap().x > 0.0);
}

#[test]
fn a_face_stays_as_the_file_has_it_unless_asked() {
    let surface = RawSurface::Nurbs(roof([FRAC_PI_4; 3]));
    let face = RawFace {
        surface,
        loops: vec![],
        flipped: false,
        source: "roof".into(),
        shell: None,
        attributes: Default::default(),
    };
    let (model, said) = build(RawModel { faces: vec![face], ..RawModel::default() }, "roof");
    assert_eq!(sides(&model), [[4]], "{said:?}");
    assert!(said.iter().all(|d| d.code != "face-creased"));
}

#[test]
fn equal_knots_without_a_ridge_cut_nothing() {
    assert_eq!(sides(&model(roof([0.0; 3]), &[]).0), [[4]]);
    // A bend of four degrees is no crease.
    assert_eq!(sides(&model(roof([2f64.to_radians(); 3]), &[]).0), [[4]]);
}

#[test]
fn loops_are_closed_along_the_ridge() {
    let corners: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    let beside: &[[f64; 2]] = &[[0.2, 0.4], [0.2, 0.6], [0.6, 0.6], [0.6, 0.4]];
    let across: &[[f64; 2]] = &[[0.5, 0.4], [0.5, 0.6], [1.5, 0.6], [1.5, 0.4]];
    let angles = [FRAC_PI_4; 3];
    let (one, _) = model(roof(angles), &[corners, beside]);
    assert_eq!(sides(&one), [vec![4, 4], vec![4]]);
    let (two, _) = model(roof(angles), &[corners, across]);
    // The hole intersects the ridge: each part has two sides on it.
    assert_eq!(sides(&two), [[8], [8]]);
    assert_eq!(two.edges.iter().filter(|e| e.uses.len() == 2).count(), 2);
    for (m, hole) in [(&one, beside), (&two, across)] {
        let [a, b] = [0, 2].map(|k| roof(angles).point(Vec2::from(hole[k])));
        let flat = 3600.0 - (b.x - a.x).abs() * (b.y - a.y).abs();
        assert!((area(m) - flat * 2f64.sqrt()).abs() < 1e-6, "{}", area(m));
    }
    // A cross: two faces on either side of a ridge that enters the face twice.
    let comb: &[[f64; 2]] = &[
        [0.5, 0.0],
        [1.5, 0.0],
        [1.5, 0.3],
        [0.7, 0.3],
        [0.7, 0.7],
        [1.5, 0.7],
        [1.5, 1.0],
        [0.5, 1.0],
    ];
    let (comb, _) = model(roof(angles), &[comb]);
    assert_eq!(sides(&comb), [[8], [4], [4]]);
}
