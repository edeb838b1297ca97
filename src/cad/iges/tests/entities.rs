//! Claims on single entities, by small files.

use std::f64::consts::{PI, TAU};

use super::build::{Item, file, item, moved};
use super::*;
use crate::cad::iges::curves::Piece;
use crate::cad::raw::{RawFace, RawSurface};
use crate::geometry::{Affine, Vec2, Vec3};

fn curve(items: &[Item], index: usize) -> Piece {
    let bytes = file(items);
    let file = File::open(&bytes);
    Reader::new(&file).joined(index, &Affine::identity()).unwrap()
}

fn faces(items: &[Item]) -> Vec<RawFace> {
    let model = read_bytes(&file(items), "test").unwrap();
    assert!(
        model.diagnostics.iter().all(|d| d.severity == Severity::Note),
        "{:?}",
        model.diagnostics
    );
    model.faces
}

fn near(a: Vec3, b: [f64; 3], tolerance: f64) {
    assert!((a - Vec3::from(b)).norm() < tolerance, "{a:?} {b:?}");
}

/// Point of a face's surface at file parameters, through the map the reader chose (checked by ends of curves).
fn at(face: &RawFace, u: f64, v: f64) -> Vec3 {
    point_on(&face.surface, Vec2::new(u, v)).unwrap()
}

#[test]
fn arcs_run_counter_clockwise_from_their_start_and_matrices_place_them() {
    let quarter = curve(&[item(100, 0, "5.,1.,2.,4.,2.,1.,5.")], 0).curve;
    assert_eq!(quarter.domain(), [0.0, PI / 2.0]);
    near(quarter.point(PI / 4.0), [1.0 + 3.0 / 2f64.sqrt(), 2.0 + 3.0 / 2f64.sqrt(), 5.0], 1e-12);
    let whole = curve(&[item(100, 0, "0.,0.,0.,0.,-2.,0.,-2.")], 0).curve;
    let [from, to] = whole.domain();
    assert!((from - 1.5 * PI).abs() < 1e-12 && (to - from - TAU).abs() < 1e-12);
    let items = [
        moved(100, 0, 3, "0.,0.,0.,1.,0.,0.,1."),
        moved(124, 0, 5, "1.,0.,0.,10.,0.,0.,-1.,0.,0.,1.,0.,0."),
        item(124, 0, "1.,0.,0.,0.,0.,1.,0.,7.,0.,0.,1.,0."),
    ];
    let placed = curve(&items, 0).curve;
    near(placed.point(0.0), [11.0, 7.0, 0.0], 1e-12);
    near(placed.point(PI / 2.0), [10.0, 7.0, 1.0], 1e-12);
}

#[test]
fn conics_lie_on_their_equation_and_join_their_points() {
    type Case<'a> = (&'a str, &'a dyn Fn(Vec3) -> f64, [f64; 3], [f64; 3]);
    let table: [Case<'_>; 4] = [
        (
            "0.25,0.,1.,0.,0.,-1.,3.,2.,0.,0.,1.",
            &|p| p.x * p.x / 4.0 + p.y * p.y - 1.0,
            [2.0, 0.0, 3.0],
            [0.0, 1.0, 3.0],
        ),
        (
            "1.,0.,0.,0.,-1.,0.,0.,-1.,1.,2.,4.",
            &|p| p.x * p.x - p.y,
            [-1.0, 1.0, 0.0],
            [2.0, 4.0, 0.0],
        ),
        (
            "1.,0.,-1.,0.,0.,-1.,0.,1.4142135623730951,1.,1.4142135623730951,-1.",
            &|p| p.x * p.x - p.y * p.y - 1.0,
            [2f64.sqrt(), 1.0, 0.0],
            [2f64.sqrt(), -1.0, 0.0],
        ),
        (
            "5.,-6.,5.,0.,0.,-8.,0.,1.4142135623730951,1.4142135623730951,-1.4142135623730951,-1.4142135623730951",
            &|p| 5.0 * p.x * p.x - 6.0 * p.x * p.y + 5.0 * p.y * p.y - 8.0,
            [2f64.sqrt(), 2f64.sqrt(), 0.0],
            [-(2f64.sqrt()), -(2f64.sqrt()), 0.0],
        ),
    ];
    for (text, equation, start, end) in table {
        let conic = curve(&[item(104, 1, text)], 0).curve;
        let [a, b] = conic.domain();
        near(conic.point(a), start, 1e-9);
        near(conic.point(b), end, 1e-9);
        for i in 0..=20 {
            let on = equation(conic.point(a + (b - a) * f64::from(i) / 20.0));
            assert!(on.abs() < 1e-9, "{text}: {on}");
        }
    }
}

#[test]
fn polylines_and_splines_pass_through_their_points() {
    let open = curve(&[item(106, 11, "1,3,5.,0.,0.,1.,0.,1.,2.")], 0).curve;
    near(open.point(1.5), [1.0, 1.0, 5.0], 1e-12);
    let closed = curve(&[item(106, 63, "1,3,0.,0.,0.,1.,0.,1.,2.")], 0).curve;
    near(closed.point(3.0), [0.0, 0.0, 0.0], 1e-12);
    let vectors = curve(&[item(106, 13, "3,2,0.,0.,0.,9.,9.,9.,1.,2.,3.,9.,9.,9.")], 0).curve;
    near(vectors.point(1.0), [1.0, 2.0, 3.0], 1e-12);
    // x = 1 + 2 s + 3 s^2 + 4 s^3 on [2, 4], then linear on [4, 5]
    let text =
        "3,1,3,2,2.,4.,5.,1.,2.,3.,4.,0.,0.,0.,0.,7.,0.,0.,0.,49.,1.,0.,0.,0.,0.,0.,0.,7.,0.,0.,0.";
    let spline = curve(&[item(112, 0, text)], 0).curve;
    assert_eq!(spline.domain(), [2.0, 5.0]);
    near(spline.point(3.0), [10.0, 0.0, 7.0], 1e-12);
    near(spline.point(4.5), [49.5, 0.0, 7.0], 1e-12);
}

#[test]
fn rational_curves_are_cut_to_their_range() {
    let text =
        "2,2,0,0,0,0,0.,0.,0.,1.,1.,1.,1.,0.7071067811865476,1.,1.,0.,0.,1.,1.,0.,0.,1.,0.,0.,0.5;";
    let half = curve(&[item(126, 0, text)], 0).curve;
    assert_eq!(half.domain(), [0.0, 0.5]);
    assert!((half.point(0.3).norm() - 1.0).abs() < 1e-12);
    let short = curve(&[item(126, 0, "1,1,0,0,1,0,0.,0.,1.,1.,1.,1.,0.,0.,0.,2.,0.,0.;")], 0).curve;
    near(short.point(0.25), [0.5, 0.0, 0.0], 1e-12);
}

#[test]
fn composites_run_over_the_sum_of_their_ranges() {
    let items = [
        item(102, 0, "2,3,5"),
        item(110, 0, "1.,-2.,0.,1.,0.,0."),
        item(100, 0, "0.,0.,0.,1.,0.,0.,1."),
    ];
    let joined = curve(&items, 0).curve;
    let [from, to] = joined.domain();
    assert!(from == 0.0 && (to - 1.0 - PI / 2.0).abs() < 1e-12 && joined.degree() == 2);
    near(joined.point(0.5), [1.0, -1.0, 0.0], 1e-12);
    near(joined.point(1.0 + PI / 4.0), [0.5f64.sqrt(), 0.5f64.sqrt(), 0.0], 1e-12);
}

#[test]
fn offset_curves_keep_their_distance() {
    let items =
        [item(130, 0, "3,1,0,0,0,2.,0.,0.,0.,0.,0.,1.,0.,1."), item(110, 0, "0.,0.,0.,10.,0.,0.")];
    near(curve(&items, 0).curve.point(0.5), [5.0, 2.0, 0.0], 1e-9);
    let items = [
        item(130, 0, "3,1,0,0,0,-2.,0.,0.,0.,0.,0.,1.,0.,1.5707963267948966"),
        item(100, 0, "0.,0.,0.,5.,0.,0.,5."),
    ];
    let offset = curve(&items, 0).curve;
    for i in 0..=20 {
        let radius = offset.point(f64::from(i) / 20.0 * PI / 2.0).norm();
        assert!((radius - 7.0).abs() < 1e-6, "{radius}");
    }
}

#[test]
fn spline_surfaces_are_their_polynomials() {
    // x = u, y = t, z = s^3 t^2 over [0,2] x [0,3], one patch and the unused row and column
    let mut block = [0.0; 48];
    (block[1], block[16 + 4], block[32 + 11]) = (1.0, 1.0, 1.0);
    let patch: Vec<String> = block.iter().map(|v| format!("{v}")).collect();
    let patch = patch.join(",");
    let zeros = vec!["0."; 48].join(",");
    for text in [
        format!("3,1,1,1,0.,2.,0.,3.,{patch},{zeros},{zeros},{zeros}"),
        format!("3,1,1,1,0.,2.,0.,3.,{patch}"),
    ] {
        let face = &faces(&[item(114, 0, text)])[0];
        near(at(face, 1.5, 2.0), [1.5, 2.0, 1.5f64.powi(3) * 4.0], 1e-12);
    }
}

#[test]
fn rational_surfaces_have_u_fastest_and_may_be_narrower_than_their_knots() {
    let text =
        "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,4.,0.,0.,0.,2.,0.,4.,2.,1.";
    let face = &faces(&[item(128, 0, format!("{text},0.,1.,0.,1."))])[0];
    near(at(face, 0.5, 0.0), [2.0, 0.0, 0.0], 1e-12);
    near(at(face, 0.0, 0.5), [0.0, 1.0, 0.0], 1e-12);
    assert!(face.loops.is_empty() && !face.flipped);
    let face = &faces(&[item(128, 0, format!("{text},0.,0.5,0.,1."))])[0];
    assert_eq!(face.loops[0].edges.len(), 4);
    let first = face.loops[0].edges[0].pcurve.as_ref().unwrap();
    assert_eq!(first.point(1.0), Vec2::new(0.5, 0.0));
}

#[test]
fn swept_surfaces_have_the_parameters_of_the_standard() {
    let rails = [item(110, 0, "0.,0.,0.,4.,0.,0."), item(110, 0, "0.,2.,1.,4.,2.,1.")];
    for (crossed, x) in [(0, 1.0), (1, 2.0)] {
        let [a, b] = &rails;
        let items = [
            item(118, 1, format!("3,5,{crossed},0")),
            item(110, 0, a.text.clone()),
            item(110, 0, b.text.clone()),
        ];
        near(at(&faces(&items)[0], 0.25, 0.5), [x, 1.0, 0.5], 1e-12);
    }
    let items = [
        item(120, 0, "3,5,0.,1.5707963267948966"),
        item(110, 0, "0.,0.,0.,0.,0.,1."),
        item(110, 0, "3.,0.,0.,3.,0.,8."),
    ];
    let face = &faces(&items)[0];
    assert!(matches!(
        &face.surface,
        RawSurface::Revolution { angles: Some([0.0, _]), curve_first: false, .. }
    ));
    near(at(face, PI / 2.0, 0.5), [0.0, 3.0, 4.0], 1e-12);
    assert!(face.flipped, "the file's normal is curve x angle");
    let items = [item(122, 0, "3,1.,0.,5."), item(100, 0, "0.,0.,0.,1.,0.,0.,1.")];
    near(at(&faces(&items)[0], PI / 2.0, 0.5), [0.0, 1.0, 2.5], 1e-12);
}

#[test]
fn offset_surfaces_lie_on_the_side_they_say() {
    let plane = "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,4.,0.,0.,0.,2.,0.,4.,2.,0.,0.,1.,0.,1.";
    for (z, wanted) in [(1.0, 3.0), (-1.0, -3.0)] {
        let items = [item(140, 0, format!("0.,0.,{z},3.,3")), item(128, 0, plane)];
        let faces = faces(&items);
        let [RawFace { surface: RawSurface::Offset { distance, .. }, .. }] = faces.as_slice()
        else {
            panic!("{faces:?}")
        };
        assert_eq!(*distance, wanted);
    }
}

#[test]
fn analytic_surfaces_take_their_axes_and_reflections() {
    let items = |kind: u32, form: i32, text: &str, matrix: u32| {
        [
            moved(kind, form, matrix, text),
            item(116, 0, "1.,2.,3.,0"),
            item(123, 0, "0.,0.,2."),
            item(123, 0, "0.,5.,0."),
            item(124, 1, "-1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0."),
        ]
    };
    let torus = &faces(&items(198, 1, "3,5,10.,2.,7", 0))[0];
    near(at(torus, 0.0, 0.0), [1.0, 14.0, 3.0], 1e-12);
    near(at(torus, PI / 2.0, 0.0), [-11.0, 2.0, 3.0], 1e-12);
    let mirrored = &faces(&items(198, 1, "3,5,10.,2.,7", 9))[0];
    near(at(mirrored, -PI / 2.0, 0.0), [11.0, 2.0, 3.0], 1e-12);
    assert!(!torus.flipped && mirrored.flipped);
    let sphere = &faces(&items(196, 1, "3,4.,5,7", 0))[0];
    near(at(sphere, 0.0, PI / 2.0), [1.0, 2.0, 7.0], 1e-12);
}

/// A square face of side 4 in the plane z = 0, by each kind of boundary.
fn square(trim: Vec<Item>) -> Vec<Item> {
    let mut items = trim;
    items.push(item(110, 0, "0.,0.,0.,4.,0.,0."));
    items.push(item(110, 0, "4.,0.,0.,4.,4.,0."));
    items.push(item(110, 0, "4.,4.,0.,0.,4.,0."));
    items.push(item(110, 0, "0.,4.,0.,0.,0.,0."));
    items.push(item(108, 0, "0.,0.,1.,0.,0,0.,0.,0.,1."));
    items
}

#[test]
fn every_kind_of_boundary_gives_the_square() {
    // lines are D(2 n + 1) .. D(2 n + 7), the plane D(2 n + 9), with n items before
    let kinds: [Vec<Item>; 4] = [
        vec![item(144, 0, "15,1,0,3"), item(142, 0, "1,15,0,5,2"), item(102, 0, "4,7,9,11,13")],
        vec![item(144, 0, "13,1,0,3"), item(102, 0, "4,5,7,9,11")],
        vec![item(143, 0, "0,13,1,3"), item(141, 0, "0,2,13,4,5,1,0,7,1,0,9,1,0,11,1,0")],
        vec![item(108, 1, "0.,0.,1.,0.,3,0.,0.,0.,1."), item(102, 0, "4,5,7,9,11")],
    ];
    for (k, kind) in kinds.into_iter().enumerate() {
        let found = faces(&square(kind));
        assert_eq!(found.len(), 1, "kind {k}");
        assert_eq!(found[0].loops[0].edges.len(), 4, "kind {k}");
        let corners: f64 = found[0].loops[0]
            .edges
            .iter()
            .map(|e| e.curve.as_ref().unwrap().point(1.0).sum())
            .sum();
        assert!((corners - 16.0).abs() < 1e-12, "kind {k}");
    }
}

#[test]
fn senses_of_141_and_members_in_any_direction_close_the_loop() {
    let backwards = |lines: [&str; 4]| lines.map(|l| item(110, 0, l));
    let turned =
        ["0.,0.,0.,4.,0.,0.", "4.,4.,0.,4.,0.,0.", "4.,4.,0.,0.,4.,0.", "0.,0.,0.,0.,4.,0."];
    let mut by_141 =
        vec![item(143, 0, "0,13,1,3"), item(141, 0, "0,2,13,4,5,1,0,7,2,0,9,1,0,11,2,0")];
    by_141.extend(backwards(turned));
    by_141.push(item(108, 0, "0.,0.,1.,0.,0"));
    let mut by_102 = vec![item(144, 0, "13,1,0,3"), item(102, 0, "4,5,7,9,11")];
    by_102.extend(backwards(turned));
    by_102.push(item(108, 0, "0.,0.,1.,0.,0"));
    for items in [by_141, by_102] {
        let model = read_bytes(&file(&items), "test").unwrap();
        let (_, along, _) = gaps(&model);
        assert!(along < 1e-12, "{along}");
    }
}

#[test]
fn a_boundary_that_is_the_domain_is_kept_beside_holes() {
    let plane = "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,4.,0.,0.,0.,4.,0.,4.,4.,0.,0.,1.,0.,1.";
    let items = [
        item(144, 0, "3,0,1,0,5"),
        item(128, 0, plane),
        item(142, 0, "1,3,0,7,2"),
        item(100, 0, "0.,2.,2.,3.,2.,3.,2."),
    ];
    let found = faces(&items);
    assert_eq!(found.len(), 1, "the base surface is not a face of its own");
    assert_eq!(
        found[0].loops.iter().map(|l| (l.outer, l.edges.len())).collect::<Vec<_>>(),
        [(Some(true), 4), (Some(false), 1)]
    );
}

/// A unit square face as 510 with its loop, edges and vertices; 514 and 186 are put in front.
fn sheet(front: Vec<Item>) -> Vec<Item> {
    let n = front.len();
    let p = |i: usize| 2 * (n + i) + 1;
    let mut items = front;
    items.push(item(510, 1, format!("{},1,1,{}", p(3), p(1))));
    let list = p(2);
    items.push(item(
        508,
        1,
        format!("4,0,{list},1,1,0,0,{list},2,1,0,0,{list},3,0,0,0,{list},4,1,0"),
    ));
    let vertices = p(6);
    let line = |k: usize, a: usize, b: usize| format!("{},{vertices},{a},{vertices},{b}", p(6 + k));
    items.push(item(
        504,
        1,
        format!("4,{},{},{},{}", line(1, 1, 2), line(2, 2, 3), line(3, 4, 3), line(4, 4, 1)),
    ));
    items.push(item(190, 1, format!("{},{},{}", p(4), p(5), p(11))));
    items.push(item(116, 0, "0.,0.,0.,0"));
    items.push(item(123, 0, "0.,0.,1."));
    items.push(item(502, 1, "4,0.,0.,0.,1.,0.,0.,1.,1.,0.,0.,1.,0."));
    items.push(item(110, 0, "0.,0.,0.,1.,0.,0."));
    items.push(item(110, 0, "1.,0.,0.,1.,1.,0."));
    items.push(item(110, 0, "0.,1.,0.,1.,1.,0."));
    items.push(item(110, 0, "0.,1.,0.,0.,0.,0."));
    items.push(item(123, 0, "1.,0.,0."));
    items
}

#[test]
fn brep_faces_are_oriented_by_shell_and_solid_and_share_edges() {
    let cases: [(Vec<Item>, bool, Option<usize>, usize); 6] = [
        (vec![], false, None, 1),
        (vec![item(514, 1, "1,3,1")], false, Some(0), 1),
        (vec![item(514, 1, "1,3,0")], true, Some(0), 1),
        (vec![item(186, 0, "3,1,0"), item(514, 1, "1,5,1")], false, Some(0), 1),
        (vec![item(186, 0, "3,0,0"), item(514, 1, "1,5,1")], true, Some(0), 1),
        (
            vec![item(186, 0, "3,1,1,5,0"), item(514, 1, "1,7,1"), item(514, 1, "1,7,1")],
            false,
            Some(0),
            2,
        ),
    ];
    for (front, flipped, shell, count) in cases {
        let found = faces(&sheet(front));
        assert_eq!(found.len(), count);
        assert_eq!((found[0].flipped, found[0].shell), (flipped, shell));
        let edges = &found[0].loops[0].edges;
        assert_eq!(edges.iter().filter_map(|e| e.edge_id).collect::<Vec<_>>(), [0, 1, 2, 3]);
        for (edge, next) in edges.iter().zip(edges.iter().cycle().skip(1)) {
            let (here, there) = (edge.ends.unwrap()[1], next.ends.unwrap()[0]);
            assert_eq!(here, there);
            assert!((edge.curve.as_ref().unwrap().point(1.0) - here).norm() < 1e-15);
        }
        if count == 2 {
            assert!(found[1].flipped && found[1].shell == Some(1));
            assert_eq!(found[1].loops[0].edges[0].edge_id, Some(0));
        }
    }
}

#[test]
fn listed_edges_are_cut_to_their_vertices() {
    let mut items = sheet(vec![]);
    items[7] = item(110, 0, "-3.,0.,0.,5.,0.,0.");
    items[8] = item(110, 0, "1.,1.,0.,1.,0.,0.");
    let edges = &faces(&items)[0].loops[0].edges;
    for (edge, ends) in edges.iter().zip([[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]]) {
        let curve = edge.curve.as_ref().unwrap();
        for (t, [x, y]) in curve.domain().into_iter().zip(ends) {
            near(curve.point(t), [x, y, 0.0], 1e-6);
        }
    }
}

#[test]
fn subfigures_are_placed_scaled_and_nested_and_groups_own_nothing() {
    let sphere = [item(196, 0, ""), item(116, 0, "1.,0.,0.,0")];
    let items = [
        item(408, 0, "5,10.,0.,0.,2."),
        moved(408, 0, 15, "5,0.,0.,0.,1."),
        item(308, 0, "0,3Hone,1,7"),
        item(408, 0, "9,0.,5.,0.,1."),
        item(308, 0, "0,3Htwo,1,11"),
        item(196, 0, "13,1.5"),
        item(116, 0, sphere[1].text.clone()),
        item(124, 0, "0.,-1.,0.,0.,1.,0.,0.,0.,0.,0.,1.,0."),
        item(402, 7, "2,1,3"),
    ];
    let found = faces(&items);
    let spheres: Vec<(Vec3, f64)> = found
        .iter()
        .map(|f| match &f.surface {
            RawSurface::Sphere { frame, radius } => (frame.origin, *radius),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(spheres.len(), 2);
    near(spheres[0].0, [12.0, 10.0, 0.0], 1e-12);
    near(spheres[1].0, [-5.0, 1.0, 0.0], 1e-12);
    assert_eq!((spheres[0].1, spheres[1].1), (3.0, 1.5));
}

/// Outward normal of a face beside the middle of its first parameter curve, by differences.
fn outward(face: &RawFace) -> Option<(Vec3, Vec3)> {
    let out = if face.flipped { -1.0 } else { 1.0 };
    if let RawSurface::Plane(frame) = &face.surface {
        return Some((Vec3::zeros(), frame.z * out));
    }
    let flat = face.loops.iter().flat_map(|l| &l.edges).find_map(|e| e.pcurve.as_ref())?;
    let [a, b] = flat.domain();
    let uv = flat.point(a + 0.4 * (b - a));
    let on = |du: f64, dv: f64| point_on(&face.surface, uv + Vec2::new(du, dv)).unwrap();
    let h = 1e-5;
    let normal = (on(h, 0.0) - on(-h, 0.0)).cross(&(on(0.0, h) - on(0.0, -h)));
    (normal.norm() > 1e-14).then(|| (on(0.0, 0.0), normal.normalize() * out))
}

#[test]
fn reflected_models_are_reflected_with_their_normals() {
    let mut compared = 0;
    for name in [
        "round_die_144",
        "cone_144",
        "hemi_punch_186",
        "torus_144",
        "cross_die_nurbs144",
        "cone_186",
    ] {
        let bytes = std::fs::read(forming().join(format!("{name}.igs"))).unwrap();
        let file = File::open(&bytes);
        let plain = Reader::new(&file).walk(1.0).unwrap().faces;
        let mirrored = Reader::new(&file).walk(-1.0).unwrap().faces;
        for (a, b) in plain.iter().zip(&mirrored) {
            if let (Some((p, n)), Some((q, m))) = (outward(a), outward(b)) {
                assert!(
                    (p + q).norm() < 1e-6 && (n + m).norm() < 1e-4,
                    "{name} {}: {n:?} {m:?}",
                    a.source
                );
                compared += 1;
            }
        }
        let model = RawModel { faces: mirrored, ..RawModel::default() };
        let (between, along, place) = gaps(&model);
        assert!(between < 1e-6 && along < 1e-6, "{name}: {between} {along} at {place}");
    }
    assert!(compared > 20, "{compared}");
}

#[test]
fn a_curve_on_a_surface_does_not_make_it_part_of_a_face() {
    let plane = "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,4.,0.,0.,0.,4.,0.,4.,4.,0.,0.,1.,0.,1.";
    let items = [item(142, 0, "1,3,0,5,2"), item(128, 0, plane), item(110, 0, "0.,0.,0.,1.,0.,0.")];
    let model = read_bytes(&file(&items), "test").unwrap();
    assert_eq!((model.faces.len(), model.loose_curves), (1, 1));
}

#[test]
fn curves_nothing_uses_are_counted() {
    let items = [
        item(102, 0, "1,3"),
        item(110, 0, "0.,0.,0.,1.,0.,0."),
        item(110, 0, "0.,0.,0.,1.,0.,0."),
        item(106, 1, "2,1,0.,0.,0."),
        item(314, 0, "1.,2.,3."),
    ];
    let model = read_bytes(&file(&items), "test").unwrap();
    assert_eq!((model.loose_curves, model.faces.len()), (2, 0));
    assert_eq!(model.entities["110:0"], 2);
    assert_eq!(model.diagnostics.len(), 1);
    assert_eq!(model.diagnostics[0].code, "entity-skipped");
    assert!(model.diagnostics[0].place.ends_with("(D9, entity 314)"), "{:?}", model.diagnostics);
}
