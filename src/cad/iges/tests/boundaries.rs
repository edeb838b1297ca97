//! Tests of faces by their boundaries, of shells and their placement, with small files.

use super::build::{Item, file, item, moved};
use super::entities::{faces, near};
use super::*;
use crate::raw::{RawFace, RawLoop, RawSurface};
use kanagata_geometry::{Vec2, Vec3};

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
        let ids = if flipped { [3, 2, 1, 0] } else { [0, 1, 2, 3] };
        assert_eq!(edges.iter().filter_map(|e| e.edge_id).collect::<Vec<_>>(), ids);
        for (edge, next) in edges.iter().zip(edges.iter().cycle().skip(1)) {
            let (here, there) = (edge.ends.unwrap()[1], next.ends.unwrap()[0]);
            assert_eq!(here, there);
            assert!((edge.curve.as_ref().unwrap().point(1.0) - here).norm() < 1e-15);
        }
        if count == 2 {
            assert!(found[1].flipped && found[1].shell == Some(1));
            assert_eq!(found[1].loops[0].edges[0].edge_id, Some(3));
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
            // A reflection reverses the loop about the outward normal.
            let mut b = b.clone();
            b.loops.iter_mut().for_each(RawLoop::reverse);
            if let (Some((p, n)), Some((q, m))) = (outward(a), outward(&b)) {
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
        item(304, 1, "0,0"),
    ];
    let model = read_bytes(&file(&items), "test").unwrap();
    assert_eq!((model.loose_curves, model.faces.len()), (2, 0));
    assert_eq!(model.entities["110:0"], 2);
    assert_eq!(model.diagnostics.len(), 1);
    assert_eq!(model.diagnostics[0].code, "entity-skipped");
    assert!(model.diagnostics[0].place.ends_with("(D9, entity 304)"), "{:?}", model.diagnostics);
}

/// Square surfaces of side 4, 10 mm apart, each an untrimmed surface, and the entities in `more`.
fn flat_squares(count: usize, more: Vec<Item>) -> Vec<Item> {
    let one = |k: usize| {
        let x = 10 * k;
        item(
            128,
            0,
            format!(
                "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,{x}.,0.,0.,{e}.,0.,0.,{x}.,4.,0.,{e}.,4.,0.,0.,1.,0.,1.",
                e = x + 4
            ),
        )
    };
    (0..count).map(one).chain(more).collect()
}

/// Reads items, entity `k` with the status `status`.
fn with_status(items: &[Item], statuses: &[(usize, &str)]) -> RawModel {
    let mut cards = super::build::cards(items);
    for (k, status) in statuses {
        let at = cards.iter().position(|c| c.ends_with(&format!("D{:7}", 2 * k + 1))).unwrap();
        cards[at].replace_range(64..72, status);
    }
    read_bytes(cards.join("\n").as_bytes(), "test").unwrap()
}

#[test]
fn what_is_blanked_dependent_or_construction_by_its_status_is_no_face() {
    let codes = |m: &RawModel| m.diagnostics.iter().map(|d| d.code).collect::<Vec<_>>();
    let plain = with_status(&flat_squares(2, vec![]), &[]);
    assert_eq!((plain.faces.len(), codes(&plain)), (2, vec![]));
    for (status, code) in [
        ("01000000", "entity-blanked"),
        ("00000100", "entity-not-geometry"),
        ("00000600", "entity-not-geometry"),
    ] {
        let model = with_status(&flat_squares(2, vec![]), &[(1, status)]);
        assert_eq!((model.faces.len(), codes(&model)), (1, vec![code]), "{status}");
        assert!(model.faces[0].source.starts_with("D1 "));
    }
    // A curve on the second surface does not make it a face; without the curve the flag contradicts the file.
    let curve = || vec![item(142, 0, "1,3,0,7,2"), item(110, 0, "10.,1.,0.,14.,1.,0.")];
    let carried = with_status(&flat_squares(2, curve()), &[(1, "00010000")]);
    assert_eq!((carried.faces.len(), codes(&carried)), (1, vec!["entity-dependent"]));
    assert_eq!(with_status(&flat_squares(2, vec![]), &[(1, "00010000")]).faces.len(), 2);
}

#[test]
fn a_blanked_group_hides_its_members_where_its_status_goes_down() {
    let items = || flat_squares(3, vec![item(402, 7, "2,3,5")]);
    let count = |status: &str| with_status(&items(), &[(3, status)]).faces.len();
    assert_eq!((count("00000000"), count("01000000"), count("01000001")), (3, 1, 3));
}

#[test]
fn a_file_of_nothing_but_blanked_faces_is_taken_with_a_warning() {
    let model = with_status(&flat_squares(2, vec![]), &[(0, "01000000"), (1, "01010000")]);
    assert_eq!((model.faces.len(), model.diagnostics[0].code), (2, "status-passed-over"));
}

#[test]
fn of_two_curves_that_contradict_each_other_the_preferred_one_bounds_the_face() {
    // The parameter curves enclose half of the square, the curves in space all of it.
    let flat = |a: &str, b: &str| item(110, 0, format!("{a},0.,{b},0."));
    let area = |preferred: u8| {
        let items = flat_squares(
            1,
            vec![
                item(144, 0, "1,1,0,5"),
                item(142, 0, format!("1,1,7,17,{preferred}")),
                item(102, 0, "4,9,11,13,15"),
                flat("0.,0.", "0.5,0."),
                flat("0.5,0.", "0.5,1."),
                flat("0.5,1.", "0.,1."),
                flat("0.,1.", "0.,0."),
                item(102, 0, "4,19,21,23,25"),
                flat("0.,0.", "4.,0."),
                flat("4.,0.", "4.,4."),
                flat("4.,4.", "0.,4."),
                flat("0.,4.", "0.,0."),
            ],
        );
        let (model, said) = crate::build::build(read_bytes(&file(&items), "test").unwrap(), "test");
        assert!(
            said.iter().any(|d| matches!(d.code, "curves-contradict" | "parameter-curve-off")),
            "{said:?}"
        );
        model.area()
    };
    assert!((area(1) - 8.0).abs() < 1e-9, "{}", area(1));
    assert!((area(2) - 16.0).abs() < 1e-9, "{}", area(2));
}

#[test]
fn a_half_cone_whose_profile_misses_its_axis_is_a_face() {
    // Radius 3, height 4; the apex is 0.02 mm off the axis, as coordinates of six digits leave it.
    let items = vec![
        item(144, 0, "3,1,0,9"),
        item(120, 0, "5,7,0.,6.283185307179586"),
        item(110, 0, "0.,0.,0.,0.,0.,1."),
        item(110, 0, "3.,0.,0.,0.02,0.,4."),
        item(142, 0, "0,3,0,11,2"),
        item(102, 0, "3,13,15,17"),
        item(100, 0, "0.,0.,0.,3.,0.,0.,-3."),
        item(110, 0, "0.,-3.,0.,0.02,0.,4."),
        item(110, 0, "0.02,0.,4.,3.,0.,0."),
    ];
    let (model, said) = crate::build::build(read_bytes(&file(&items), "t").unwrap(), "t");
    let exact = 0.75 * std::f64::consts::PI * 3.0 * 5.0;
    assert!(model.lost.is_empty() && model.faces.len() == 1, "{said:?}");
    assert!((model.area() / exact - 1.0).abs() < 1e-2, "{} for {exact}", model.area());
}
