//! Tests of peculiarities of STEP writers.

use std::f64::consts::{PI, TAU};

use super::form::Form;
use super::read_bytes;
use super::tests::{UNIT_SPHERE, file};
use crate::Model;
use crate::build::build;
use crate::closest::ClosestPoint;
use kanagata_geometry::{Frame, Vec3};

fn model(data: &str) -> Model {
    let raw = read_bytes(&file(data), "habit").unwrap();
    let (model, said) = build(raw, "habit");
    assert!(said.is_empty(), "{said:?}");
    model
}

/// A face on `surface` (instance 3, about #2: origin and z) bounded by circles about the z axis: height, radius, angle
/// of the vertex [rad], same direction as the circle.
fn ringed(surface: &str, rings: &[(f64, f64, f64, bool)]) -> Model {
    let mut data =
        format!("#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3={surface};");
    let mut bounds = vec![];
    for (k, (z, r, angle, forwards)) in rings.iter().enumerate() {
        let n = 100 * (k + 1);
        let (x, y) = (r * angle.cos(), r * angle.sin());
        let flag = if *forwards { 'T' } else { 'F' };
        data += &format!(
            "#{a}=CARTESIAN_POINT('',(0.,0.,{z:?}));#{b}=AXIS2_PLACEMENT_3D('',#{a},$,$);#{c}=CIRCLE('',#{b},{r:?});\n\
             #{d}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));#{e}=VERTEX_POINT('',#{d});\n\
             #{f}=EDGE_CURVE('',#{e},#{e},#{c},.T.);#{g}=ORIENTED_EDGE('',*,*,#{f},.{flag}.);\n\
             #{h}=EDGE_LOOP('',(#{g}));#{n}=FACE_BOUND('',#{h},.T.);",
            a = n + 1,
            b = n + 2,
            c = n + 3,
            d = n + 4,
            e = n + 5,
            f = n + 6,
            g = n + 7,
            h = n + 8,
        );
        bounds.push(format!("#{n}"));
    }
    data += &format!(
        "#4=ADVANCED_FACE('',({}),#3,.T.);#5=OPEN_SHELL('',(#4));#6=SHELL_BASED_SURFACE_MODEL('',(#5));\n\
         #7=SHAPE_REPRESENTATION('',(#6),#900);",
        bounds.join(",")
    );
    model(&data)
}

fn near(found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-9, "{found} for {exact}");
}

#[test]
fn a_cylinder_between_circles_that_begin_anywhere_is_whole() {
    for turn in [0.0, 0.3, 0.5 * PI, 2.0, PI, 4.0] {
        let model = ringed(
            "CYLINDRICAL_SURFACE('',#2,2.)",
            &[(0.0, 2.0, 0.7, true), (5.0, 2.0, 0.7 + turn, false)],
        );
        near(model.area(), TAU * 2.0 * 5.0);
        // Two free circles; both sides of the seam are joined.
        let free = model.edges.iter().filter(|e| e.uses.len() == 1).map(|e| e.curve.length());
        near(free.sum(), 2.0 * TAU * 2.0);
        let search = ClosestPoint::new(&model);
        for k in 0..24 {
            let a = TAU * f64::from(k) / 24.0;
            let p = Vec3::new(3.0 * a.cos(), 3.0 * a.sin(), 0.2 * f64::from(k));
            assert!((search.closest(&p).unwrap().distance - 1.0).abs() < 1e-9, "{turn} {a}");
        }
    }
}

#[test]
fn a_band_of_a_torus_is_the_side_that_its_circles_have_on_their_left() {
    let (big, small, half) = (10.0_f64, 3.0_f64, 100_f64.to_radians());
    let (r, z) = (big + small * half.cos(), small * half.sin());
    for turn in [0.0, 1.0, PI] {
        let torus = "TOROIDAL_SURFACE('',#2,10.,3.)";
        let outer = ringed(torus, &[(-z, r, 0.2, true), (z, r, 0.2 + turn, false)]);
        near(outer.area(), TAU * small * (2.0 * half * big + 2.0 * small * half.sin()));
        let inner = ringed(torus, &[(-z, r, 0.2, false), (z, r, 0.2 + turn, true)]);
        near(inner.area(), 2.0 * TAU * PI * big * small - outer.area());
    }
}

#[test]
fn a_loop_on_a_sphere_says_by_its_direction_which_part_the_face_is() {
    // The circle x = 4 of the sphere of radius 5, about +x.
    let sphere = "SPHERICAL_SURFACE('',#2,5.)";
    the_circle_bounds(sphere);
}

/// Areas on both sides of the circle x = 4 of a sphere of radius 5.
fn the_circle_bounds(surface: &str) {
    let part = |flag: char| {
        let data = format!(
            "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3={surface};
             #10=CARTESIAN_POINT('',(4.,0.,0.));#11=DIRECTION('',(1.,0.,0.));#12=DIRECTION('',(0.,1.,0.));
             #13=AXIS2_PLACEMENT_3D('',#10,#11,#12);#14=CIRCLE('',#13,3.);#15=CARTESIAN_POINT('',(4.,3.,0.));
             #16=VERTEX_POINT('',#15);#17=EDGE_CURVE('',#16,#16,#14,.T.);#18=ORIENTED_EDGE('',*,*,#17,.{flag}.);
             #19=EDGE_LOOP('',(#18));#20=FACE_OUTER_BOUND('',#19,.T.);#4=ADVANCED_FACE('',(#20),#3,.T.);
             #5=OPEN_SHELL('',(#4));#6=SHELL_BASED_SURFACE_MODEL('',(#5));#7=SHAPE_REPRESENTATION('',(#6),#900);"
        );
        model(&data)
    };
    near(part('T').area(), TAU * 5.0);
    let rest = part('F');
    near(rest.area(), TAU * 5.0 * 9.0);
    let search = ClosestPoint::new(&rest);
    let distance = |x: f64, y: f64, z: f64| search.closest(&Vec3::new(x, y, z)).unwrap().distance;
    assert!((distance(-6.0, 0.0, 0.0) - 1.0).abs() < 1e-9);
    assert!((distance(0.0, 0.0, 7.0) - 2.0).abs() < 1e-9);
    assert!((distance(4.0, 0.0, 0.0) - 3.0).abs() < 1e-9, "in the opening");
}

#[test]
fn a_components_solid_named_once_more_for_its_properties_counts_once() {
    let data = format!(
        "{UNIT_SPHERE}#10=SHAPE_REPRESENTATION('',(#6,#2),#900);#11=REPRESENTATION_MAP(#2,#10);
         #12=MAPPED_ITEM('',#11,#2);#13=SHAPE_REPRESENTATION('',(#12),#900);#14=SHAPE_REPRESENTATION('',(#6),#900);"
    );
    assert_eq!(model(&data).faces.len(), 1);
}

#[test]
fn a_hyperbola_is_cut_wherever_its_vertices_lie() {
    let frame = Frame { origin: Vec3::zeros(), x: Vec3::x(), y: Vec3::y(), z: Vec3::z() };
    let form = Form::Hyperbola(frame, 0.33, 0.19);
    for k in 1..200 {
        let (from, to) = (-0.0131 * f64::from(k), 0.0177 * f64::from(k));
        let curve = form.cut(from, to).unwrap_or_else(|| panic!("{from} to {to}"));
        assert_eq!(curve.domain(), [from, to]);
        assert!((curve.point(to) - form.point(to)).norm() < 1e-12);
    }
}

/// A product with one sphere, and another sphere in a representation that is the shape of `definition`.
fn product_beside(definition: &str) -> (Model, Vec<&'static str>) {
    let data = format!(
        "{UNIT_SPHERE}#7=SHAPE_REPRESENTATION('',(#6),#900);
         #10=PRODUCT_DEFINITION('','',$,$);#11=PRODUCT_DEFINITION_SHAPE('','',#10);#12=SHAPE_DEFINITION_REPRESENTATION(#11,#7);
         #20=SPHERICAL_SURFACE('',#2,2.);#21=ADVANCED_FACE('',(),#20,.T.);#22=CLOSED_SHELL('',(#21));
         #23=MANIFOLD_SOLID_BREP('',#22);#24=SHAPE_REPRESENTATION('',(#23),#900);{definition}"
    );
    let (model, said) = build(read_bytes(&file(&data), "product").unwrap(), "product");
    (model, said.iter().map(|d| d.code).collect())
}

#[test]
fn what_is_the_shape_of_an_aspect_a_feature_or_of_nothing_is_not_of_the_product() {
    let asides = [
        "#30=SHAPE_ASPECT('','',#11,.T.);#31=PROPERTY_DEFINITION('','',#30);#32=SHAPE_DEFINITION_REPRESENTATION(#31,#24);",
        "#30=DATUM('','',#11,.F.,'A');#31=PROPERTY_DEFINITION('','',#30);#32=SHAPE_DEFINITION_REPRESENTATION(#31,#24);",
        "#30=(CHARACTERIZED_OBJECT('','')FEATURE_DEFINITION()INSTANCED_FEATURE()ROUND_HOLE()SHAPE_ASPECT('','',#11,.T.));
         #31=PRODUCT_DEFINITION_SHAPE('','',#30);#32=SHAPE_DEFINITION_REPRESENTATION(#31,#24);",
        // A relationship does not make the shape of an aspect part of the product.
        "#30=SHAPE_ASPECT('','',#11,.T.);#31=PROPERTY_DEFINITION('','',#30);#32=SHAPE_DEFINITION_REPRESENTATION(#31,#24);
         #33=SHAPE_REPRESENTATION_RELATIONSHIP('','',#7,#24);",
        "",
    ];
    for aside in asides {
        let (model, codes) = product_beside(aside);
        assert_eq!((model.faces.len(), codes), (1, vec!["not-of-product"]), "{aside}");
        near(model.area(), 2.0 * TAU);
    }
    let counted = [
        "#30=SHAPE_REPRESENTATION_RELATIONSHIP('','',#7,#24);",
        "#31=PRODUCT_DEFINITION_SHAPE('','',#10);#32=SHAPE_DEFINITION_REPRESENTATION(#31,#24);",
    ];
    for more in counted {
        let (model, codes) = product_beside(more);
        assert_eq!((model.faces.len(), codes.len()), (2, 0), "{more}");
    }
}

#[test]
fn a_face_that_cannot_be_read_is_lost_and_the_model_is_not_sound() {
    let data = format!(
        "{UNIT_SPHERE}#7=SHAPE_REPRESENTATION('',(#6,#8),#900);#8=ADVANCED_FACE('',(),#1,.T.);"
    );
    let (model, _) = build(read_bytes(&file(&data), "lost").unwrap(), "lost");
    assert_eq!((model.faces.len(), model.lost.len()), (1, 1));
    let health = model.health();
    assert!(!health.is_sound());
    let said = health.to_text(&model);
    assert!(
        said.contains("not sound") && said.contains("lost        #8 (ADVANCED_FACE)"),
        "{said}"
    );
}
