//! Tests of model defects.

use crate::model::Edge;
use crate::query_tests::shapes::whole;
use crate::{Model, read};
use kanagata_geometry::Affine;
use kanagata_geometry::nurbs::{Curve3, Surface};

use super::*;

fn fixture(name: &str) -> Model {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming");
    read(&folder.join(name)).unwrap().0
}

#[test]
fn a_closed_torus_is_sound_and_encloses_its_volume() {
    let model = fixture("torus_AP214.stp");
    let health = model.health();
    assert!(health.is_sound(), "{}", health.to_text(&model));
    let [part] = &health.parts[..] else { panic!("{} parts", health.parts.len()) };
    let exact = 2.0 * std::f64::consts::PI.powi(2) * 40.0 * 49.0;
    assert!(part.closed && (part.volume_mm3 / exact - 1.0).abs() < 1e-8, "{part:?}");
}

#[test]
fn a_solid_turned_inside_out_is_inverted() {
    let mut model = fixture("frustum_AP214.stp");
    assert!(model.health().is_sound());
    model.flip();
    assert!(model.health().parts[0].inverted);
}

#[test]
fn a_missing_face_leaves_its_neighbours_edges_free_and_one_face_turned_disagrees() {
    let whole = fixture("frustum_AP214.stp");
    let mut turned = whole.clone();
    turned.faces[0].flipped ^= true;
    assert!(turned.health().disagreeing_faces.contains(&0));
    let mut open = whole.clone();
    open.faces.remove(0);
    for edge in &mut open.edges {
        edge.uses.retain(|u| u[0] != 0);
        edge.uses.iter_mut().for_each(|u| u[0] -= 1);
    }
    let health = open.health();
    assert!(!health.free_edges.is_empty() && !health.parts[0].closed);
}

#[test]
fn a_face_twice_there_and_a_gap_are_found() {
    let whole = fixture("frustum_AP214.stp");
    let mut double = whole.clone();
    double.faces.push(whole.faces[0].clone());
    assert_eq!(double.health().duplicate_faces, [[0, whole.faces.len()]]);
    // The other side of every edge becomes an edge of its own, 0.01 mm higher.
    let mut open = whole.clone();
    let map = Affine { shift: Vec3::new(0.0, 0.0, 0.01), ..Affine::identity() };
    for edge in &whole.edges {
        let other = Edge { curve: edge.curve.transformed(&map), ..edge.clone() };
        open.edges.push(Edge { uses: vec![edge.uses[1]], ..other });
    }
    open.edges[..whole.edges.len()].iter_mut().for_each(|e| e.uses.truncate(1));
    let free = open.health().free_edges;
    let gaps: Vec<f64> = free.iter().filter_map(|e| e.gap_mm).collect();
    assert!(gaps.iter().any(|g| (g - 0.01).abs() < 1e-6), "{gaps:?}");
    let said = open.open_joints_text().unwrap();
    assert!(said.contains("up to 1.000e-2 mm away"), "{said}");
    assert_eq!(open.health().free_edges, free);
    assert!(open.health().verdict().contains(" beside other faces, up to 1.00e-2 mm away)"));
    assert!(whole.open_joints_text().is_none());
}

/// A strip between x = 0 and 100, 10 mm wide, folded `count` times.
fn pleated(count: u32) -> Model {
    let points = (0..=count).flat_map(|k| {
        [0.0, 10.0].map(|y| Vec3::new(if k % 2 == 0 { 0.0 } else { 100.0 }, y, 1e-3 * f64::from(k)))
    });
    let inner = (0..=count).map(f64::from);
    let knots = std::iter::once(0.0).chain(inner).chain([f64::from(count)]).collect();
    let knots = [knots, vec![0.0, 0.0, 1.0, 1.0]];
    let surface = Surface::try_new([1, 1], knots, points.collect(), None).unwrap();
    let mut model = whole(surface);
    model.faces[0].source = "D7 (510)".into();
    model
}

#[test]
fn more_area_than_its_box_may_hold_is_not_sound() {
    let model = pleated(9);
    assert!((model.area() / 9e3 - 1.0).abs() < 1e-3, "{}", model.area());
    assert!(model.health().impossible_faces.is_empty());
    let model = pleated(4000);
    let health = model.health();
    assert_eq!(health.impossible_faces, [0]);
    assert!(!health.is_sound());
    let told = health.to_text(&model);
    assert!(told.contains("D7 (510); check their boundary loops"), "{told}");
}

#[test]
fn the_box_of_a_surface_reaches_its_corners_inside() {
    // A pyramid of four bilinear patches; its apex is on no uniform grid.
    let at = [0.0, 0.37, 1.0];
    let top = |i: usize, j: usize| if i == 1 && j == 1 { 1.0 } else { 0.0 };
    let points = (0..9).map(|k| Vec3::new(at[k / 3], at[k % 3], top(k / 3, k % 3))).collect();
    let knots = || vec![0.0, 0.0, 0.37, 1.0, 1.0];
    let model = whole(Surface::try_new([1, 1], [knots(), knots()], points, None).unwrap());
    assert!((model.bbox().max.z - 1.0).abs() < 1e-14, "{:?}", model.bbox());
}

/// Parallel lines with mutually overlapping bounding boxes.
#[test]
fn gaps_of_crowded_edges_stop_at_the_projection_budget_and_are_counted() {
    let unmeasured = |count: u32| {
        let mut model = fixture("frustum_AP214.stp");
        let edge = model.edges[0].clone();
        let line = |k: u32| {
            let shift = 1e-4 * f64::from(k);
            let at = |x: f64| Vec3::new(x + shift, x - shift, x);
            Edge { curve: Curve3::line(at(0.0), at(100.0)), uses: vec![[0, 0, 0]], ..edge.clone() }
        };
        model.edges = (0..count).map(line).collect();
        let health = model.health();
        let count = health.free_edges.iter().filter(|e| !e.gap_measured).count();
        (count, health.to_text(&model))
    };
    assert_eq!(unmeasured(20).0, 0);
    let (count, told) = unmeasured(2000);
    assert_eq!(count, 2000);
    assert!(told.contains("gaps of 2000 free edges"), "{told}");
}

#[test]
fn equal_faces_are_compared_with_so_many_others_only() {
    let fact = |k: usize| FaceMeasures {
        measured: Measured {
            area_mm2: 3.0,
            centroid: Vec3::new(10.0 * k as f64, 0.0, 0.0),
            is_within: true,
        },
        bounds: Aabb {
            min: Vec3::new(10.0 * k as f64, 0.0, 0.0),
            max: Vec3::new(10.0 * k as f64 + 1.0, 1.0, 0.0),
        },
    };
    // A row of equal holes with a duplicate of the middle one, found although not all pairs are compared.
    let mut row: Vec<FaceMeasures> = (0..COMPARISONS_MAX + 10).map(fact).collect();
    row.push(fact(4_000));
    let twice = vec![[4_000, row.len() - 1]];
    assert_eq!(duplicate_faces(&row, 0.1), (twice, false));
    row.truncate(100);
    row.push(fact(4));
    assert_eq!(duplicate_faces(&row, 0.1), (vec![[4, 100]], true));
}

/// Two plates of 100 by 10 mm, the second with this place of its first corner.
fn plates(x: f64, z: f64) -> Model {
    let plate = |from: f64, z: f64| {
        let points = [[from, 0.0], [from, 10.0], [from + 100.0, 0.0], [from + 100.0, 10.0]];
        let points = points.map(|[x, y]| Vec3::new(x, y, z)).to_vec();
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        whole(Surface::try_new([1, 1], [knots(), knots()], points, None).unwrap())
    };
    let (mut both, other) = (plate(0.0, 0.0), plate(x, z));
    let shift = both.edges.len();
    for mut edge in other.edges {
        edge.uses.iter_mut().for_each(|used| used[0] += 1);
        both.edges.push(edge);
    }
    for mut face in other.faces {
        let uses = face.loops.iter_mut().flat_map(|l| &mut l.uses);
        uses.for_each(|used| used.edge = used.edge.map(|edge| edge + shift));
        both.faces.push(face);
    }
    both
}

/// The sides of 10 mm between the plates are open joints. The other six free edges are not, nor are sides 0.8 mm apart, which
/// is a gap below 1 % of the size, nor two plates one above the other.
#[test]
fn faces_that_end_beside_each_other_are_open_joints() {
    let near = plates(100.3, 0.0).health();
    let open: Vec<f64> = near.free_edges.iter().filter_map(|e| e.open_joint_mm).collect();
    assert!(near.free_edges.len() == 8 && open.len() == 2, "{near:?}");
    assert!(open.iter().all(|gap| (gap - 0.3).abs() < 1e-9), "{open:?}");
    let far = plates(100.8, 0.0).health();
    assert_eq!(far.free_edges.iter().filter(|e| e.gap_mm.is_some()).count(), 2);
    assert!(far.free_edges.iter().all(|e| e.open_joint_mm.is_none()), "{far:?}");
    // A strip 0.4 mm wide of two faces: its sides are beside each other, with the strip between them.
    let strip = plates(-99.6, 0.0).health();
    assert!(strip.free_edges.iter().all(|e| e.open_joint_mm.is_none()), "{strip:?}");
    let above = plates(0.0, 0.3);
    assert!(above.health().free_edges.iter().all(|e| e.gap_mm.is_some()));
    assert!(above.open_joints_text().is_none());
}
