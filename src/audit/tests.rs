use super::reference::ReferenceFoot;
use super::*;
use crate::shapes::whole;
use kanagata_cad::Model;
use kanagata_geometry::nurbs::{Curve3, Surface};
use kanagata_geometry::{Frame, Vec3};
use kanagata_tool::build::build;
use kanagata_tool::edge::EdgeRule;
use kanagata_tool::model::PatchCorners;
use kanagata_tool::{Patch, ToolKind};

/// A cylinder of radius r about the y axis.
struct Cylinder(f64);

impl ReferenceSurface for Cylinder {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let normal = Vec3::new(p.x, 0.0, p.z).try_normalize(0.0)?;
        let point = normal * self.0 + Vec3::y() * p.y;
        Some(ReferenceFoot { point, normal, own_normal: None, face, on_border: false })
    }
}

/// A quarter of a cylinder of radius 7 in `count` patches, all on face 3.
fn quarter(count: u32) -> ToolModel {
    let (mut vertices, mut normals, mut corners) = (vec![], vec![], vec![]);
    for k in 0..=count {
        let a = std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(count);
        let n = Vec3::new(a.cos(), 0.0, a.sin());
        vertices.extend([n * 7.0, n * 7.0 + Vec3::y() * 5.0]);
        normals.extend([n, n]);
        if k > 0 {
            let ids = vec![2 * k - 2, 2 * k, 2 * k + 1, 2 * k - 1];
            // eta up the arc, zeta along the axis: the normal points to the axis, reversed.
            let ids: Vec<u32> = ids.into_iter().rev().collect();
            corners.push(PatchCorners { vertices: ids.clone(), normals: ids, face: 3 });
        }
    }
    build("quarter".into(), ToolKind::Nagata, vertices, normals, corners, EdgeRule::Guarded)
        .unwrap()
        .0
}

fn run(tool: &ToolModel, options: &AuditOptions) -> Audit {
    audit(tool, &Cylinder(7.0), options).unwrap()
}

#[test]
fn arcs_have_the_closed_form_and_the_right_sign() {
    for (count, expected) in [(1, 0.4246), (2, 0.02195), (3, 0.00421), (4, 0.00132)] {
        let report = run(&quarter(count), &AuditOptions::default()).report;
        assert!((report.max_mm - expected).abs() < 6e-5 * expected.max(0.1), "{}", report.max_mm);
        assert!(report.min_mm > -1e-12 && !report.turned);
        assert_eq!(
            (report.patches, report.faces.len(), report.faces[0].face),
            (count as usize, 1, 3)
        );
        let w = &report.worst[0];
        assert!(
            (w.delta_mm - report.max_mm).abs() < 1e-15
                && (w.eta - 0.5).abs().min((w.zeta - 0.5).abs()) < 1e-9
        );
        assert_eq!(report.jumps.shared_edges, count as usize - 1);
        assert!(report.jumps.position_mm < 1e-14 && report.jumps.normal_deg < 1e-6);
        assert!((report.area_mm2 / (7.0 * std::f64::consts::FRAC_PI_2 * 5.0) - 1.0).abs() < 0.05);
    }
}

#[test]
fn extremes_between_the_grid_points_are_found() {
    // Three intervals miss the middle of the arc, where the error is largest.
    for count in [1, 2, 5] {
        let coarse = run(&quarter(count), &AuditOptions { samples: 3, ..Default::default() });
        let dense =
            run(&quarter(count), &AuditOptions { samples: 200, refine: 0, ..Default::default() });
        let (c, d) = (&coarse.report, &dense.report);
        assert!((c.max_mm / d.max_mm - 1.0).abs() < 1e-3, "{} {}", c.max_mm, d.max_mm);
        assert!((c.normal_max_deg / d.normal_max_deg - 1.0).abs() < 1e-3);
        let grid = coarse.samples.iter().flat_map(PatchSamples::valid).map(|s| s.delta);
        assert!(grid.fold(0.0, f64::max) < 0.95 * d.max_mm, "the search is what finds it");
        // Without the search one more point of a patch is evaluated: its error is no estimate.
        let vertex =
            run(&quarter(count), &AuditOptions { samples: 3, refine: 0, ..Default::default() });
        let found = vertex.report.max_mm;
        assert!(
            found > 0.98 * d.max_mm && found <= (1.0 + 1e-9) * c.max_mm,
            "{found} {}",
            c.max_mm
        );
    }
}

#[test]
fn a_side_between_two_smooth_corners_has_no_normal() {
    // A flat patch with a side tangent to the adjacent arcs at both ends: both derivatives are parallel to it along the
    // whole side. In its middle one of them is the rounding error of the vertices, here out of plane.
    let (x, y) = (Vec3::x(), Vec3::y());
    let [o, rounding] = [Vec3::zeros(), Vec3::z() * 5e-11];
    let flat = Patch::Quad([o, x * 50.0, rounding - x * 3.6, x * 7.2, o, y * 1.5 + x * 0.3, o, o]);
    let at = |eta, zeta| super::sample::patch_normal(&flat.derivs(eta, zeta));
    for eta in [0.0, 0.25, 0.5, 1.0] {
        assert_eq!(at(eta, 0.0), None, "{eta}");
        assert!((at(eta, 1e-6).unwrap() - Vec3::z()).norm() < 1e-4);
    }
}

#[test]
fn a_tool_turned_round_changes_sides() {
    let mut tool = quarter(2);
    let turned = {
        for c in &mut tool.corners {
            c.vertices.reverse();
            c.normals.reverse();
        }
        tool.normals.iter_mut().for_each(|n| *n = -*n);
        build(tool.name, tool.kind, tool.vertices, tool.normals, tool.corners, EdgeRule::Guarded)
            .unwrap()
            .0
    };
    let (a, b) =
        (run(&quarter(2), &AuditOptions::default()), run(&turned, &AuditOptions::default()));
    assert!(b.report.turned);
    assert!((a.report.max_mm + b.report.min_mm).abs() < 1e-12);
    assert!((a.report.normal_max_deg - b.report.normal_max_deg).abs() < 1e-9);
}

#[test]
fn tolerances_decide() {
    let with = |tolerance_mm, normal_tolerance_deg| {
        let options =
            AuditOptions { tolerance_mm, normal_tolerance_deg, ..AuditOptions::default() };
        run(&quarter(2), &options).report.within_tolerance
    };
    assert_eq!(with(None, None), None);
    assert_eq!(with(Some(0.023), None), Some(true));
    assert_eq!(with(Some(0.021), None), Some(false));
    assert_eq!(with(Some(0.023), Some(0.6)), Some(false));
    assert_eq!(with(Some(0.023), Some(0.8)), Some(true));
}

#[test]
fn what_cannot_be_compared_is_an_error_or_counted() {
    let mut tool = quarter(2);
    tool.patches[1] = Patch::Quad([Vec3::repeat(f64::NAN); 8]);
    let failed = audit(&tool, &Cylinder(7.0), &AuditOptions::default());
    assert_eq!(failed.unwrap_err(), AuditError::Incomparable { patch: 1 });
    tool.patches.clear();
    assert!(matches!(
        audit(&tool, &Cylinder(7.0), &AuditOptions::default()),
        Err(AuditError::NoPatches)
    ));
    let options = AuditOptions { samples: 0, ..AuditOptions::default() };
    assert!(matches!(
        audit(&quarter(1), &Cylinder(7.0), &options),
        Err(AuditError::Samples { .. })
    ));
    // A patch with a corner on the axis: no closest point there, and no tolerance is met.
    let options = AuditOptions { tolerance_mm: Some(1e9), ..AuditOptions::default() };
    let mut tool = quarter(1);
    let Patch::Quad(c) = &mut tool.patches[0] else { unreachable!() };
    let [y, x] = [Vec3::y(), Vec3::x()];
    *c = [
        Vec3::zeros(),
        x * 7.0,
        y,
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
    ];
    let report = run(&tool, &options).report;
    assert_eq!((report.points_lost, report.within_tolerance), (9, Some(false)));
    serde_json::from_str::<AuditReport>(&serde_json::to_string(&report).unwrap()).unwrap();
}

#[test]
fn bezier_patches_find_their_neighbours() {
    let nagata = quarter(3);
    let bezier = ToolModel {
        kind: ToolKind::Bezier,
        vertices: vec![],
        normals: vec![],
        corners: vec![],
        patches: nagata
            .corners
            .iter()
            .map(|c| {
                let x = |k: usize| nagata.vertices[c.vertices[k] as usize];
                Patch::Bezier { degrees: [1, 1], points: vec![x(0), x(3), x(1), x(2)] }
            })
            .collect(),
        ..nagata
    };
    let jumps = run(&bezier, &AuditOptions::default()).report.jumps;
    assert_eq!((jumps.shared_edges, jumps.free_edges, jumps.creases), (2, 8, 0));
    // The control points of the border are identical; its points differ by the rounding of their evaluation.
    let rounding = 4.0 * f64::EPSILON;
    assert!((jumps.normal_deg - 30.0).abs() < 1e-9 && jumps.position_mm <= rounding, "{jumps:?}");
}

#[cfg(feature = "pages")]
#[test]
fn picture_and_page_hold_the_figures() {
    let tool = quarter(2);
    let found = run(&tool, &AuditOptions::default());
    let grid = view::grid(&tool, &found.samples);
    let mut bytes = Vec::new();
    grid.write_to(&mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    for name in ["shape_error_mm", "normal_error_deg", "\"face\"", "\"patch\""] {
        assert!(text.contains(name), "{name}");
    }
    assert!(text.contains(&format!("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", 2 * 81, 2 * 64)));
    let html = page::page(&tool, &found).html();
    assert!(html.contains("0.0219") && html.contains("Worst patches"));
    // The verdict, the answers, the view and at last what was compared.
    let place = kanagata_report::doubt::place_mm(&found.report.worst[0].point);
    let verdict = format!(
        "<p class=\"outcome good\">The tool was compared without a tolerance, and there is no doubt. The shape error is {:+.4} mm at {place}, patch",
        found.report.max_mm
    );
    let parts = [&verdict, "within 95 %", "Where the error is", "Set-up", "points compared, lost"];
    let places: Vec<Option<usize>> = parts.iter().map(|text| html.find(*text)).collect();
    assert!(places.is_sorted() && places[0].is_some(), "{places:?}");
    let strict = AuditOptions { tolerance_mm: Some(0.01), ..AuditOptions::default() };
    let html = page::page(&tool, &run(&tool, &strict)).html();
    assert!(html.contains("outcome failed\">The tool exceeds its tolerance of 0.0100 mm."));
}

#[test]
fn triangles_share_their_area_out() {
    let plate = Patch::Triangle([
        Vec3::zeros(),
        Vec3::x() * 3.0,
        Vec3::y() * 2.0,
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
    ]);
    let probe = Probe { patch: &plate, face: 0, reference: &Cylinder(1.0), sign: 1.0, start: None };
    for n in [1, 2, 7] {
        let mut samples = PatchSamples::new(&probe, n);
        let point = samples.points.iter().flatten().next().copied();
        samples.points.iter_mut().for_each(|p| *p = p.or(point));
        assert!((samples.areas().iter().sum::<f64>() - 3.0).abs() < 1e-12);
        assert_eq!(samples.cells().len(), n * n);
    }
}

#[test]
fn the_schema_is_that_of_the_type() {
    let path = concat!(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."), "/schemas/audit.schema.json");
    let schema = schemars::schema_for!(AuditReport);
    let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
    if std::env::var_os("KANAGATA_WRITE_SCHEMAS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let kept = std::fs::read_to_string(path).unwrap_or_default();
    assert_eq!(kept, text, "run the test with KANAGATA_WRITE_SCHEMAS=1 to write the schema anew");
    let found = run(&quarter(2), &AuditOptions::default()).report;
    let schema: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(jsonschema::is_valid(&schema, &serde_json::to_value(&found).unwrap()));
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let tool = quarter(7);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            serde_json::to_string(&run(&tool, &AuditOptions::default()).report).unwrap()
        })
    };
    assert_eq!(with(1), with(2));
}

/// Full revolution of a line or an arc about z.
fn turned(generatrix: &Curve3) -> Model {
    let surface =
        Surface::revolution(generatrix, Vec3::zeros(), Vec3::z(), [0.0, std::f64::consts::TAU]);
    whole(surface)
}

#[test]
fn a_pole_has_the_normal_of_its_surroundings_and_an_apex_none() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let frame = Frame { x: Vec3::x(), y: Vec3::z(), z: -Vec3::y(), ..Frame::world() };
    let sphere = turned(&Curve3::ellipse_arc(&frame, 20.0, 20.0, 0.0, quarter));
    let cone = turned(&Curve3::line(Vec3::x() * 20.0, Vec3::z() * 20.0));
    let at_top =
        |model: &Model, z: f64| CadReference::new(model).closest(&(Vec3::z() * z), 0).unwrap();
    let foot = at_top(&sphere, 20.1);
    assert!((foot.point - Vec3::z() * 20.0).norm() < 1e-9);
    assert!((foot.normal.z.abs() - 1.0).abs() < 1e-9, "{:?}", foot.normal);
    assert_eq!(at_top(&cone, 20.1).normal, Vec3::zeros());
}

/// A plane next to a crease, closer to every point than their own face, which has no normal.
struct Beside;

impl ReferenceSurface for Beside {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        Some(ReferenceFoot {
            point: *p,
            normal: Vec3::y(),
            own_normal: Some(Vec3::zeros()),
            face: face + 1,
            on_border: false,
        })
    }
}

#[test]
fn the_face_beside_says_nothing_where_the_own_one_has_no_normal() {
    let plate = Patch::Quad([
        Vec3::zeros(),
        Vec3::x(),
        Vec3::y(),
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
        Vec3::zeros(),
    ]);
    let probe = Probe { patch: &plate, face: 0, reference: &Beside, sign: 1.0, start: None };
    assert_eq!(probe.at(0.5, 0.5, None).unwrap().normal_deg, None);
}

#[test]
fn areas_do_not_hang_on_the_samples() {
    let of = |samples| {
        let report = run(&quarter(1), &AuditOptions { samples, ..Default::default() }).report;
        assert_eq!(report.area_mm2, report.faces[0].area_mm2);
        report.area_mm2
    };
    // The patch is an extruded parabola: 5 times its length.
    let patch = &quarter(1).patches[0];
    let length = |n: usize| -> f64 {
        let at = |k: usize| patch.derivs(k as f64 / n as f64, 0.0).s;
        let other = |k: usize| patch.derivs(0.0, k as f64 / n as f64).s;
        let along: f64 = (0..n).map(|k| (at(k + 1) - at(k)).norm()).sum();
        let across: f64 = (0..n).map(|k| (other(k + 1) - other(k)).norm()).sum();
        along * across
    };
    let exact = length(20_000);
    for samples in [1, 8, 40] {
        assert!((of(samples) / exact - 1.0).abs() < 1e-8, "{samples}: {} {exact}", of(samples));
    }
}
