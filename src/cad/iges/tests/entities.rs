//! Tests of single entities with small files.

use std::f64::consts::{PI, TAU};

use super::build::{Item, file, item, moved};
use super::*;
use crate::iges::curves::Piece;
use crate::raw::{RawFace, RawSurface};
use kanagata_geometry::{Affine, Vec2, Vec3};

fn curve(items: &[Item], index: usize) -> Piece {
    let bytes = file(items);
    let file = File::open(&bytes);
    Reader::new(&file).joined(index, &Affine::identity()).unwrap()
}

pub(super) fn faces(items: &[Item]) -> Vec<RawFace> {
    let model = read_bytes(&file(items), "test").unwrap();
    assert!(
        model.diagnostics.iter().all(|d| d.severity == Severity::Note),
        "{:?}",
        model.diagnostics
    );
    model.faces
}

pub(super) fn near(a: Vec3, b: [f64; 3], tolerance: f64) {
    assert!((a - Vec3::from(b)).norm() < tolerance, "{a:?} {b:?}");
}

/// Point of a face's surface at file parameters, through the chosen map (validated by the ends of curves).
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

/// A distance from 2 to 4 that is linear in the parameter (PTYPE 2, or none) is read; one that varies with the arc length of
/// the base (PTYPE 1) is refused.
#[test]
fn offset_curves_vary_with_the_parameter_alone() {
    let read = |ptype: &str, last: f64| {
        let items = [
            item(130, 0, format!("3,2,0,0,{ptype},2.,0.,{last},1.,0.,0.,1.,0.,1.")),
            item(110, 0, "0.,0.,0.,10.,0.,0."),
        ];
        let bytes = file(&items);
        let file = File::open(&bytes);
        Reader::new(&file).joined(0, &Affine::identity())
    };
    for ptype in ["2", "0", ""] {
        near(read(ptype, 4.0).unwrap().curve.point(0.5), [5.0, 3.0, 0.0], 1e-9);
    }
    let Err(fault) = read("1", 4.0) else { panic!("an offset by arc length") };
    assert!(
        fault.found.contains("PTYPE = 1") && fault.allowed.contains("parameter"),
        "{}",
        fault.found
    );
    // A constant distance varies with nothing.
    near(read("1", 2.0).unwrap().curve.point(0.5), [5.0, 2.0, 0.0], 1e-9);
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
fn an_offset_lies_where_the_curves_of_its_edges_do_whatever_its_indicator_says() {
    let plane = "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,4.,0.,0.,0.,2.,0.,4.,2.,0.,0.,1.,0.,1.";
    let unbounded = "0.,0.,1.,0.,0.";
    for (kind, base, z, noted) in [
        (128, plane, 3.0, 0),
        (128, plane, -3.0, 1),
        (108, unbounded, 3.0, 0),
        (108, unbounded, -3.0, 1),
    ] {
        let items = [
            item(144, 0, "3,1,0,7"),
            item(140, 0, "0.,0.,1.,3.,5"),
            item(kind, 0, base),
            item(142, 0, "0,3,0,9,2"),
            item(106, 63, format!("1,5,{z:.1},0.,0.,4.,0.,4.,2.,0.,2.,0.,0.")),
        ];
        let model = read_bytes(&file(&items), "test").unwrap();
        let RawSurface::Offset { distance, .. } = model.faces[0].surface else {
            panic!("{:?}", model.faces)
        };
        assert_eq!(distance, z);
        let told = model.diagnostics.iter().filter(|d| d.code == "offset-other-side").count();
        assert_eq!(told, noted, "{:?}", model.diagnostics);
    }
}

#[test]
fn the_indicator_of_an_offset_is_of_the_middle_of_its_base() {
    // A half cylinder about z, from +x over +y to -x. Its indicator is inclined by 60 degrees to -x: opposite to the
    // normal of its first boundary, along that of its middle.
    let items = [
        item(140, 0, "-0.866,0.5,0.,2.,3"),
        item(120, 0, "5,7,0.,3.141592653589793"),
        item(110, 0, "0.,0.,0.,0.,0.,1."),
        item(110, 0, "5.,0.,0.,5.,0.,9."),
    ];
    let model = faces(&items);
    let RawSurface::Offset { base, distance } = &model[0].surface else { panic!("{model:?}") };
    let middle = |v| point_on(base, Vec2::new(PI / 2.0, v)).unwrap();
    let beside = point_on(base, Vec2::new(PI / 2.0 + 0.01, 0.5)).unwrap();
    let normal = (beside - middle(0.5)).cross(&(middle(0.9) - middle(0.1))).normalize();
    assert!(normal.y * distance > 1.9, "{normal:?} {distance}");
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

#[test]
fn splines_whose_knots_go_beyond_their_range_begin_and_end_at_its_ends() {
    // Uniform knots of a closed periodic spline: the first control point is not on the curve.
    let knots = "-3.,-2.,-1.,0.,1.,2.,3.,4.,5.,6.,7.";
    let ones = "1.,1.,1.,1.,1.,1.,1.";
    let net = "6.,0.,0.,0.,6.,0.,-6.,0.,0.,0.,-6.,0.,6.,0.,0.,0.,6.,0.,-6.,0.,0.";
    let text = format!("6,3,1,1,1,1,{knots},{ones},{net},0.,4.,0.,0.,1.");
    let spline = curve(&[item(126, 0, text)], 0).curve;
    assert_eq!(spline.domain(), [0.0, 4.0]);
    let ends = [spline.points().first(), spline.points().last()];
    ends.into_iter().for_each(|p| near(*p.unwrap(), [0.0, 4.0, 0.0], 1e-12));
    near(spline.point(1.0), [-4.0, 0.0, 0.0], 1e-12);
    // A strip along y of three rows across it, by quadratic splines in u.
    let rows = ["0.,0.,0.", "2.,0.,2.", "4.,0.,0.", "0.,9.,0.", "2.,9.,2.", "4.,9.,0."].join(",");
    let knots = "-2.,-1.,0.,1.,2.,3.,0.,0.,1.,1.";
    let text = format!("2,1,2,1,0,0,1,0,0,{knots},1.,1.,1.,1.,1.,1.,{rows},0.,1.,0.,1.");
    let face = &faces(&[item(128, 0, text)])[0];
    let RawSurface::Nurbs(surface) = &face.surface else { panic!("{:?}", face.surface) };
    near(surface.points()[0], [1.0, 0.0, 1.0], 1e-12);
    near(surface.point(Vec2::zeros()), [1.0, 0.0, 1.0], 1e-12);
    near(*surface.points().last().unwrap(), [3.0, 9.0, 1.0], 1e-12);
}

#[test]
fn closed_surfaces_may_have_a_range_that_ends_beyond_their_knots() {
    // A square tube with a range from the middle of its knots to one period later.
    let corners = ["0.,0.,", "4.,0.,", "4.,4.,", "0.,4.,", "0.,0.,"];
    let net: Vec<String> =
        [0, 9].iter().flat_map(|z| corners.map(|c| format!("{c}{z}."))).collect();
    let knots = "0.,0.,1.,2.,3.,4.,4.,0.,0.,1.,1.";
    let ones = ["1."; 10].join(",");
    let text = format!("4,1,1,1,1,0,1,0,0,{knots},{ones},{},2.,6.,0.,1.", net.join(","));
    let face = &faces(&[item(128, 0, text)])[0];
    let RawSurface::Nurbs(surface) = &face.surface else { panic!("{:?}", face.surface) };
    assert_eq!(surface.domain(), [[2.0, 6.0], [0.0, 1.0]]);
    for (u, wanted) in [(2.0, [4.0, 4.0, 0.0]), (3.5, [0.0, 2.0, 0.0]), (5.5, [4.0, 2.0, 0.0])] {
        near(surface.point(Vec2::new(u, 0.0)), wanted, 1e-12);
    }
}
