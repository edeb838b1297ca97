//! Tests of the STEP reader.

use std::path::{Path, PathBuf};

use super::read_bytes;
use crate::raw::{RawModel, RawSurface};

fn read(path: &Path) -> RawModel {
    let bytes = std::fs::read(path).unwrap();
    read_bytes(&bytes, &path.file_name().unwrap().to_string_lossy()).unwrap()
}

fn forming() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fixtures/forming")
}

fn step_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "stp"));
    paths.sort();
    paths
}

#[test]
fn forming_tools_have_all_their_faces_in_mm() {
    let truth = std::fs::read(forming().join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let files = step_files(&forming());
    assert!(files.len() >= 12);
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let model = read(&path);
        assert_eq!(model.faces.len() as u64, truth[&name]["faces"].as_u64().unwrap(), "{name}");
        assert_eq!(model.unit_mm, 1.0, "{name}");
        assert!(model.diagnostics.is_empty(), "{name}: {:?}", model.diagnostics);
        edges_join_end_to_end(&model, &name);
    }
}

/// Asserts that every edge starts at the end of its predecessor, in space and at its vertices.
fn edges_join_end_to_end(model: &RawModel, name: &str) {
    for face in &model.faces {
        for boundary in &face.loops {
            let ends: Vec<_> = boundary
                .edges
                .iter()
                .filter_map(|e| e.curve.as_ref())
                .map(|c| [c.point(c.domain()[0]), c.point(c.domain()[1])])
                .collect();
            for k in 0..ends.len() {
                let gap = (ends[k][1] - ends[(k + 1) % ends.len()][0]).norm();
                assert!(gap < 1e-2 * model.unit_mm.max(1.0), "{name} {}: gap {gap}", face.source);
            }
        }
    }
}

#[test]
fn corpus_has_as_many_faces_as_the_kernel_says() {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("../shared/cad");
    let folder = std::env::var_os("KANAGATA_CORPUS").map_or(beside, PathBuf::from);
    let Ok(truth) = std::fs::read(folder.join("truth.json")) else {
        println!("skipped: no corpus at {}", folder.display());
        return;
    };
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let mut wrong = vec![];
    for path in step_files(&folder) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let start = std::time::Instant::now();
        let model = read(&path);
        println!(
            "{name}: {} faces, {:.1} ms, {} diagnostics",
            model.faces.len(),
            start.elapsed().as_secs_f64() * 1e3,
            model.diagnostics.len()
        );
        for d in model.diagnostics.iter().take(3) {
            println!("    {} {} {}", d.code, d.place, d.text);
        }
        let faces = truth[&name]["truth"]["faces"].as_u64().unwrap();
        if model.faces.len() as u64 != faces {
            wrong.push(format!("{name}: {} for {faces}", model.faces.len()));
        }
        edges_join_end_to_end(&model, &name);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A file with these instances [mm].
pub(super) fn file(data: &str) -> Vec<u8> {
    format!(
        "ISO-10303-21;HEADER;FILE_NAME('','',(''),(''),'p','s','');ENDSEC;DATA;
#901=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#900=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#901))REPRESENTATION_CONTEXT('',''));
{data}
ENDSEC;END-ISO-10303-21;"
    )
    .into_bytes()
}

#[test]
fn mutated_files_never_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    let names = ["cone_AP214.stp", "sphere_AP214.stp", "torus_AP214.stp", "hemi_punch_AP214.stp"];
    let seeds: Vec<Vec<u8>> =
        names.iter().map(|n| std::fs::read(forming().join(n)).unwrap()).collect();
    let spare = b"()#,;'*$.=0123456789EFT-";
    let mut refused = 0;
    for round in 0..5000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        for _ in 0..=random(3) {
            let at = random(bytes.len());
            match random(4) {
                0 => bytes[at] = spare[random(spare.len())],
                1 => {
                    bytes.remove(at);
                }
                2 => bytes.insert(at, spare[random(spare.len())]),
                _ if random(20) == 0 => bytes.truncate(at),
                _ => {
                    // Replace one digit by another: pointers and numbers stay well-formed.
                    if let Some(d) = bytes[at..].iter().position(u8::is_ascii_digit) {
                        bytes[at + d] = b'0' + random(10) as u8;
                    }
                }
            }
        }
        refused += usize::from(read_bytes(&bytes, "mutated").is_err());
    }
    assert!((100..4900).contains(&refused), "{refused}");
}

#[test]
fn every_pointer_to_itself_or_its_neighbour_is_survived() {
    let text = std::fs::read_to_string(forming().join("hemi_punch_AP214.stp")).unwrap();
    let data = text.find("DATA;").unwrap();
    let hashes: Vec<usize> =
        text.match_indices('#').map(|(k, _)| k).filter(|k| *k > data).collect();
    let mut owner = String::new();
    for &at in &hashes {
        let id: String = text[at + 1..].chars().take_while(char::is_ascii_digit).collect();
        if text[at + 1 + id.len()..].starts_with(" =") {
            owner = id;
            continue;
        }
        let next = (owner.parse::<u64>().unwrap() + 1).to_string();
        for other in [&owner, &next] {
            let changed = format!("{}#{other}{}", &text[..at], &text[at + 1 + id.len()..]);
            let _ = read_bytes(changed.as_bytes(), "circle");
        }
    }
    assert!(hashes.len() > 200);
}

#[test]
fn a_million_brackets_are_refused() {
    let error = read_bytes(&file(&format!("#1=X{};", "(".repeat(1_000_000))), "deep").unwrap_err();
    assert!(error.to_string().contains("nested deeper"), "{error}");
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for number in ["1E400", "NaN", "1.#INF", "-1.E999"] {
        let text = file(&format!("#1=CARTESIAN_POINT('',({number},0.,0.));"));
        assert!(read_bytes(&text, "n").is_err(), "{number}");
    }
}

#[test]
fn doubling_mapped_items_are_refused_and_few_are_placed() {
    let doubled = |levels: usize| {
        let mut data = String::from(
            "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3=SPHERICAL_SURFACE('',#2,1.);\n\
             #4=ADVANCED_FACE('',(),#3,.T.);#5=CLOSED_SHELL('',(#4));#6=MANIFOLD_SOLID_BREP('',#5);\n\
             #10=SHAPE_REPRESENTATION('',(#6),#900);\n",
        );
        for k in 1..=levels {
            let (r, below) = (10 * (k + 1), 10 * k);
            data += &format!(
                "#{a}=REPRESENTATION_MAP(#2,#{below});#{b}=MAPPED_ITEM('',#{a},#2);#{c}=MAPPED_ITEM('',#{a},#2);\n\
                 #{r}=SHAPE_REPRESENTATION('',(#{b},#{c}),#900);\n",
                a = r + 1,
                b = r + 2,
                c = r + 3
            );
        }
        read_bytes(&file(&data), "doubling")
    };
    assert_eq!(doubled(3).unwrap().faces.len(), 8);
    // 8192 spheres of four sides; the size of the file adds some hundred sides.
    assert_eq!(doubled(13).unwrap().faces.len(), 8192);
    assert!(doubled(14).unwrap_err().to_string().contains("placed faces"));
    let error = doubled(40).unwrap_err().to_string();
    assert!(error.contains("placed faces"), "{error}");
}

pub(super) const UNIT_SPHERE: &str =
    "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3=SPHERICAL_SURFACE('',#2,1.);
     #4=ADVANCED_FACE('',(),#3,.T.);#5=CLOSED_SHELL('',(#4));#6=MANIFOLD_SOLID_BREP('',#5);";

fn curve_of(data: &str, id: u64) -> Result<super::form::Form, String> {
    let bytes = file(data);
    let table = super::parse(&bytes, "curve").unwrap();
    let resolver = super::Resolver::new(&table, bytes.len());
    let units = super::resolver::Units { length: 1.0, angle: 1f64.to_radians() };
    let entity = resolver.entity(table.find(id).unwrap());
    resolver.curve(entity, units, 0).map_err(|fault| fault.to_string())
}

#[test]
fn lengths_follow_the_context_of_their_own_representation() {
    let data = format!(
        "{UNIT_SPHERE}
         /* ids out of order, of any width */ #00077 = SHAPE_REPRESENTATION('',(#6),#910);
         #910=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#911))REPRESENTATION_CONTEXT('',''));
         #911=(CONVERSION_BASED_UNIT('thumb',#912)LENGTH_UNIT()NAMED_UNIT(*));
         #912=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.54),#913);
         #913=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));
         #20=SPHERICAL_SURFACE('',#2,3.);#21=ADVANCED_FACE('',(),#20,.F.);#22=OPEN_SHELL('',(#21));
         #23=SHELL_BASED_SURFACE_MODEL('',(#22));#24=SHAPE_REPRESENTATION('',(#23),#900);"
    );
    let model = read_bytes(&file(&data), "units").unwrap();
    let mut radii: Vec<(f64, bool)> = model
        .faces
        .iter()
        .map(|f| match &f.surface {
            crate::raw::RawSurface::Sphere { radius, .. } => (*radius, f.flipped),
            other => panic!("{other:?}"),
        })
        .collect();
    radii.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(radii.len(), 2);
    assert!((radii[0].0 - 3.0).abs() < 1e-12 && radii[0].1, "{radii:?}");
    assert!((radii[1].0 - 25.4).abs() < 1e-12 && !radii[1].1, "{radii:?}");
    assert_eq!((model.unit.as_str(), model.unit_mm.round()), ("thumb", 25.0));
}

#[test]
fn trimmed_curves_run_from_their_first_trim_to_their_second() {
    let conic =
        "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3=CIRCLE('',#2,2.);
        #4=HYPERBOLA('',#2,2.,1.);#5=PARABOLA('',#2,0.5);";
    // (basis, trims, sense, start, middle, end)
    let at = |a: f64| [2.0 * a.to_radians().cos(), 2.0 * a.to_radians().sin()];
    let hyperbola = |t: f64| [2.0 * t.cosh(), t.sinh()];
    let parabola = |t: f64| [0.5 * t * t, t];
    let cases = [
        (3, [0.0, 90.0], "T", [at(0.0), at(45.0), at(90.0)]),
        (3, [0.0, 90.0], "F", [at(0.0), at(-135.0), at(90.0)]),
        (3, [350.0, 10.0], "T", [at(350.0), at(0.0), at(10.0)]),
        (4, [-1.0, 1.0], "T", [hyperbola(-1.0), hyperbola(0.0), hyperbola(1.0)]),
        (5, [2.0, -2.0], "F", [parabola(2.0), parabola(0.0), parabola(-2.0)]),
    ];
    for (basis, [from, to], sense, expected) in cases {
        let data = format!(
            "{conic}#9=TRIMMED_CURVE('',#{basis},(PARAMETER_VALUE({from:?})),(PARAMETER_VALUE({to:?})),.{sense}.,.PARAMETER.);"
        );
        let curve = curve_of(&data, 9).unwrap().whole().unwrap();
        let [low, high] = curve.domain();
        for (t, [x, y]) in [low, 0.5 * (low + high), high].into_iter().zip(expected) {
            let p = curve.point(t);
            assert!((p.x - x).hypot(p.y - y) < 1e-12, "{data}: {p} for {x} {y}");
        }
    }
}

#[test]
fn implied_knots_are_those_of_their_kind() {
    let points: String =
        (0..7).map(|k| format!("#{}=CARTESIAN_POINT('',({k}.,{}.,0.));", k + 1, k % 2)).collect();
    let cases = [
        ("UNIFORM_CURVE", [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]),
        ("QUASI_UNIFORM_CURVE", [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0]),
        ("BEZIER_CURVE", [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]),
    ];
    for (kind, knots) in cases {
        let simple =
            format!("{points}#9={kind}('',3,(#1,#2,#3,#4,#5,#6,#7),.UNSPECIFIED.,.F.,.F.);");
        // As a rational complex instance with its parts in another order.
        let complex = format!(
            "{points}#9=(RATIONAL_B_SPLINE_CURVE((1.,1.,2.,1.,1.,1.,1.)){kind}()REPRESENTATION_ITEM('')CURVE()
             B_SPLINE_CURVE(3,(#1,#2,#3,#4,#5,#6,#7),.UNSPECIFIED.,.F.,.F.)BOUNDED_CURVE());"
        );
        for (data, third) in [(simple, 1.0), (complex, 2.0)] {
            let super::form::Form::Free(curve) = curve_of(&data, 9).unwrap() else { panic!() };
            assert_eq!(curve.knots(), knots, "{kind}");
            assert_eq!(curve.weights()[2], third, "{kind}");
        }
    }
}

#[test]
fn doubling_composites_and_circles_of_curves_are_refused() {
    let mut data = String::from(
        "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=CARTESIAN_POINT('',(1.,0.,0.));#10=POLYLINE('',(#1,#2));",
    );
    for k in 1..=40 {
        let (below, c) = (10 * k, 10 * (k + 1));
        data += &format!(
            "#{s}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{below});#{c}=COMPOSITE_CURVE('',(#{s},#{s}),.F.);",
            s = c + 1
        );
    }
    let error = curve_of(&data, 410).unwrap_err();
    assert!(error.contains("self-multiplying"), "{error}");
    let error = curve_of("#5=SURFACE_CURVE('',#5,(),.CURVE_3D.);", 5).unwrap_err();
    assert!(error.contains("#5 (SURFACE_CURVE)") && error.contains("cyclic"), "{error}");
}

/// Two hundred levels of a set that contains itself twice: each path ends with a message.
#[test]
fn messages_on_a_set_that_holds_itself_are_counted() {
    let data = "#10=GEOMETRIC_SET('',(#10,#10));#11=SHAPE_REPRESENTATION('',(#10),#12);";
    let bytes = file(data);
    let table = super::parse(&bytes, "set").unwrap();
    let resolver = super::Resolver::new(&table, bytes.len());
    let units = super::resolver::Units { length: 1.0, angle: 1.0 };
    let set = resolver.entities().find(|e| e.kind() == "GEOMETRIC_SET").unwrap();
    let fault = resolver.item(set, units).unwrap_err();
    assert!(fault.fatal && fault.found.contains("self-multiplying"), "{fault:?}");
    assert!(resolver.diagnostics.borrow().len() < 20_000);
}

#[test]
fn a_mirrored_instance_keeps_its_outward_side() {
    let data = format!(
        "{UNIT_SPHERE}#7=SHAPE_REPRESENTATION('',(#6,#30),#900);
         #30=MANIFOLD_SOLID_BREP('',#31);#31=CLOSED_SHELL('',(#32));#32=ADVANCED_FACE('',(#34),#33,.T.);
         #33=PLANE('',#2);#34=FACE_OUTER_BOUND('',#35,.T.);#35=POLY_LOOP('',(#1,#36,#37));
         #36=CARTESIAN_POINT('',(1.,0.,0.));#37=CARTESIAN_POINT('',(0.,1.,0.));
         #8=REPRESENTATION_MAP(#2,#7);#40=DIRECTION('',(1.,0.,0.));#41=DIRECTION('',(0.,-1.,0.));
         #9=CARTESIAN_TRANSFORMATION_OPERATOR_3D('','',$,#40,#41,#1,2.,$);#10=MAPPED_ITEM('',#8,#9);
         #11=SHAPE_REPRESENTATION('',(#10),#900);"
    );
    let model = read_bytes(&file(&data), "mirror").unwrap();
    assert_eq!(model.faces.len(), 2, "{:?}", model.diagnostics);
    for face in &model.faces {
        match &face.surface {
            crate::raw::RawSurface::Sphere { radius, .. } => {
                assert!((radius - 2.0).abs() < 1e-12 && !face.flipped);
            }
            crate::raw::RawSurface::Plane(f) => {
                // The image of the outward normal +z is +z, and the loop remains counter-clockwise about it.
                let outward = if face.flipped { -f.z } else { f.z };
                assert!((outward.z - 1.0).abs() < 1e-12);
                let ends: Vec<_> = face.loops[0].edges.iter().map(|e| e.ends.unwrap()[0]).collect();
                let turn = (ends[1] - ends[0]).cross(&(ends[2] - ends[1]));
                assert!(turn.z > 0.0, "{ends:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Planes swept by endless lines, as replicas of a tenth at another place: the sweep reaches as far as the face.
#[test]
fn replicas_of_swept_surfaces_reach_as_far_as_their_faces() {
    // (x, y, z) becomes (30 + z / 10, -y / 10, 5 + x / 10): faces of 20 x 10 mm in the plane x = 30 or across it.
    const COMMON: &str = "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=DIRECTION('',(1.,0.,0.));#3=DIRECTION('',(0.,1.,0.));
         #4=DIRECTION('',(0.,0.,1.));#5=VECTOR('',#2,1.);#6=VECTOR('',#3,1.);#7=LINE('',#1,#5);
         #8=CARTESIAN_POINT('',(30.,0.,5.));#9=CARTESIAN_TRANSFORMATION_OPERATOR_3D('','',$,#4,$,#8,0.1,#2);
         #20=CARTESIAN_POINT('',(30.,0.,5.));#21=CARTESIAN_POINT('',(30.,0.,25.));
         #22=CARTESIAN_POINT('',(30.,-10.,25.));#23=CARTESIAN_POINT('',(30.,-10.,5.));
         #24=POLY_LOOP('',(#20,#21,#22,#23));#25=FACE_OUTER_BOUND('',#24,.T.);#26=ADVANCED_FACE('',(#25),#30,.T.);
         #27=OPEN_SHELL('',(#26));#28=SHELL_BASED_SURFACE_MODEL('',(#27));#29=SHAPE_REPRESENTATION('',(#28),#900);";
    let surfaces = [
        "#31=SURFACE_OF_LINEAR_EXTRUSION('',#7,#6);#30=SURFACE_REPLICA('',#31,#9);",
        "#31=CURVE_REPLICA('',#7,#9);#32=VECTOR('',#3,1.);#30=SURFACE_OF_LINEAR_EXTRUSION('',#31,#32);",
        "#31=AXIS1_PLACEMENT('',#1,#4);#32=SURFACE_OF_REVOLUTION('',#7,#31);#30=SURFACE_REPLICA('',#32,#9);",
    ];
    for surface in surfaces {
        let model = read_bytes(&file(&format!("{COMMON}{surface}")), "replica").unwrap();
        assert_eq!(model.faces.len(), 1, "{surface}: {:?}", model.diagnostics);
        let swept = match &model.faces[0].surface {
            RawSurface::Extrusion { directrix, direction, .. } => {
                assert!((direction / direction.norm()).y.abs() > 1.0 - 1e-12, "{surface}");
                directrix
            }
            RawSurface::Revolution { generatrix, origin, axis, .. } => {
                assert!((axis.x.abs() - 1.0).abs() < 1e-12, "{surface}: {axis}");
                assert!((origin.y, origin.z) == (0.0, 5.0), "{surface}: {origin}");
                generatrix
            }
            other => panic!("{surface}: {other:?}"),
        };
        let ends = swept.domain().map(|t| swept.point(t));
        assert!(ends.iter().all(|p| (p.x - 30.0).abs() < 1e-9), "{surface}: {ends:?}");
        let [low, high] = [ends[0].z.min(ends[1].z), ends[0].z.max(ends[1].z)];
        assert!(low <= 5.0 && (25.0..100.0).contains(&high), "{surface}: {low} to {high}");
    }
}
